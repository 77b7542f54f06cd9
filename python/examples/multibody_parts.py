"""The bodies, springs and tyres of a tractor-semitrailer from one of the project's vehicle files, as a MuJoCo model.

A vehicle file says how a unit rolls as a whole; here that becomes suspensions and tyres in series. What a file does not
say (axle masses, tyre stiffness, the load's place) stands in the constants below. Needs Python 3.11 and nothing else.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomllib

GRAVITY = 9.81
WHEEL_RADIUS = 0.5
"""Height of an axle at rest [m]."""
HITCH_HEIGHT = 1.15
"""Height of the fifth wheel [m]."""
FRONT_AXLE_MASS, DRIVE_AXLE_MASS, TRAILER_AXLE_MASS = 700.0, 1100.0, 750.0
"""Unsprung masses [kg]."""
FRONT_SHARE = 0.65
"""Fraction of the tractor's own weight on its front axle."""
LOAD_AHEAD = {"empty": 2.3, "half": 2.15}
"""Centre of gravity of the trailer ahead of the middle of its axles by load [m]; 2 m with every full load."""
HEAVE_FREQUENCY, HEAVE_DAMPING = 1.8, 0.2
"""Bounce of the sprung mass above an axle [Hz], and its damping ratio."""
DUAL_STIFFNESS, WIDE_STIFFNESS, TYRE_DAMPING = 0.9e6, 1.1e6, 500.0
"""Vertical stiffness of a tyre [N/m], and its damping [N s/m]."""
TRACTOR_TYRE_LOAD = 47e3
"""Load at which the cornering stiffness of a tyre of the tractor peaks [N]: that of the tyres of daf_xf's trailer."""


@dataclass(frozen=True)
class Axles:
    """The axle group of a trailer."""

    spacing: float
    """Distance between two axles [m]."""
    number: int
    n_tyres: int
    """Tyres on each side of an axle."""


GROUPS = {"daf_xf": Axles(2.478, 2, 2), "eu_4x2_13m6": Axles(1.31, 3, 1), "us_wb62": Axles(1.22, 2, 2)}
"""Axle groups of the vehicle files, which know only the middle."""


@dataclass(frozen=True)
class Axle:
    """An axle: a rigid body that heaves and rolls about its unit's roll centre."""

    ahead: float
    """Ahead of the drive axle, or of the kingpin for an axle of the trailer [m]."""
    mass: float
    track: float
    roll_centre: float
    load: float
    """Weight that it bears at rest [N]."""
    n_tyres: int
    tyre_stiffness: float
    roll_stiffness: float
    roll_damping: float
    peak_load: float
    """Load at which a tyre's cornering stiffness peaks [N]."""

    @property
    def sprung(self) -> float:
        """Mass that its springs bear [kg]."""
        return self.load / GRAVITY - self.mass

    @property
    def radius(self) -> float:
        """Radius of the unloaded tyre [m]."""
        return WHEEL_RADIUS + self.load / (2 * self.n_tyres * self.tyre_stiffness)


@dataclass(frozen=True)
class Body:
    """The sprung part of a unit."""

    mass: float
    ahead: float
    """Centre of gravity ahead of the drive axle or the kingpin [m]."""
    height: float
    roll_inertia: float
    yaw_inertia: float


@dataclass(frozen=True)
class Parts:
    """A tractor and its semitrailer with a load."""

    tractor: Body
    trailer: Body
    front: Axle
    drive: Axle
    group: tuple[Axle, ...]
    wheelbase: float
    fifth_wheel: float
    trailer_wheelbase: float
    trailer_width: float
    steer_max: float
    steer_rate: float
    slip: float
    """Slip angle per lateral acceleration of the file [rad/(m/s^2)]."""
    cornering: float
    """Cornering coefficient of an unloaded tyre [1/rad]."""
    acceleration_min: float
    acceleration_max: float
    speed_control: dict[str, float]

    @property
    def axles(self) -> tuple[Axle, ...]:
        """All axles, from the front."""
        return (self.front, self.drive, *self.group)

    @property
    def mass(self) -> float:
        """Gross mass [kg]."""
        return self.tractor.mass + self.trailer.mass + sum(axle.mass for axle in self.axles)


def written(vehicle: Path) -> dict[str, Any]:
    """A vehicle file as it is written."""
    return tomllib.loads(vehicle.read_text())


def threshold(suspension: dict[str, float]) -> float:
    """Lateral acceleration at which the file says that a unit's wheels lift [g]."""
    lever = suspension["centre_of_gravity"] - suspension["roll_centre"]
    return 0.5 * suspension["track"] / (suspension["centre_of_gravity"] + suspension["roll_gain"] * lever)


def tyre(file: dict[str, Any], group: Axles) -> tuple[float, float]:
    """Cornering coefficient of an unloaded tyre [1/rad], and the load at which its cornering stiffness peaks [N].

    The stiffness of Pacejka's Magic Formula, ``c F / (1 + (F / F0)^2)``, through the slips that the file gives for the
    empty and the full trailer.
    """
    points = []
    for load in ("empty", "laden"):
        data = file["loads"][load]
        borne = 1 - _ahead(load) / file["trailer"]["wheelbase"]
        force = data["mass"] * GRAVITY * borne / (2 * group.number * group.n_tyres)
        points.append((force, 1 / (GRAVITY * data["slip"])))
    (light, stiff), (heavy, soft) = points
    square = (soft * heavy**2 - stiff * light**2) / (stiff - soft)
    return stiff * (1 + light**2 / square), math.sqrt(square)


def read(vehicle: Path, load: str, one_axle: bool = False) -> Parts:
    """The parts of a vehicle file with one of its loads; ``one_axle`` puts one axle in place of the trailer's group.

    Raises:
        ValueError: For a vehicle whose axles are not known here, and for a load that it does not have.
    """
    if vehicle.stem not in GROUPS:
        raise ValueError(f"vehicle: {vehicle.stem!r}; the axles of {', '.join(GROUPS)} are known")
    file = written(vehicle)
    if load not in file["loads"]:
        raise ValueError(f"load: {load!r}; {vehicle.stem} has {', '.join(file['loads'])}")
    tractor, trailer, data = file["tractor"], file["trailer"], file["loads"][load]
    group = GROUPS[vehicle.stem]
    cornering, peak_load = tyre(file, group)
    if one_axle:
        group = Axles(0.0, 1, group.number * group.n_tyres)
    wheelbase, fifth_wheel, length = tractor["wheelbase"], tractor["fifth_wheel"], trailer["wheelbase"]
    own, weight = tractor["mass"] * GRAVITY, data["mass"] * GRAVITY
    hitch_load = weight * _ahead(load) / length
    on_front = hitch_load * fifth_wheel / wheelbase
    group_load = weight - hitch_load
    stiffness = DUAL_STIFFNESS if GROUPS[vehicle.stem].n_tyres == 2 else WIDE_STIFFNESS
    group_mass = TRAILER_AXLE_MASS * GROUPS[vehicle.stem].number
    of_tractor = _roll(
        tractor["mass"],
        FRONT_AXLE_MASS + DRIVE_AXLE_MASS,
        tractor["suspension"],
        own / (3 * DUAL_STIFFNESS * tractor["suspension"]["track"]),
    )
    per_side = stiffness * group.number * group.n_tyres
    of_trailer = _roll(
        data["mass"], group_mass, data["suspension"], group_load / (per_side * data["suspension"]["track"])
    )

    def axle(ahead: float, mass: float, loads: tuple[float, float], of_group: bool, n_tyres: int) -> Axle:
        suspension = data["suspension"] if of_group else tractor["suspension"]
        shares = loads[0] / own, loads[1] / weight
        return Axle(
            ahead=ahead,
            mass=mass,
            track=suspension["track"],
            roll_centre=suspension["roll_centre"],
            load=sum(loads),
            n_tyres=n_tyres,
            tyre_stiffness=stiffness if of_group else DUAL_STIFFNESS,
            roll_stiffness=shares[0] * of_tractor[0] + shares[1] * of_trailer[0],
            roll_damping=shares[0] * of_tractor[1] + shares[1] * of_trailer[1],
            peak_load=peak_load if of_group else TRACTOR_TYRE_LOAD,
        )

    places = [-length + (0.5 * (group.number - 1) - n) * group.spacing for n in range(group.number)]
    return Parts(
        tractor=_body(
            tractor["mass"],
            FRONT_SHARE * wheelbase,
            [(FRONT_AXLE_MASS, wheelbase), (DRIVE_AXLE_MASS, 0.0)],
            tractor["suspension"],
            FRONT_SHARE * (1 - FRONT_SHARE) * wheelbase**2,
        ),
        trailer=_body(
            data["mass"],
            _ahead(load) - length,
            [(group_mass, -length)],
            data["suspension"],
            (trailer["kingpin_to_front"] + trailer["kingpin_to_rear"]) ** 2 / 12,
        ),
        front=axle(wheelbase, FRONT_AXLE_MASS, (FRONT_SHARE * own, on_front), False, 1),
        drive=axle(0.0, DRIVE_AXLE_MASS, ((1 - FRONT_SHARE) * own, hitch_load - on_front), False, 2),
        group=tuple(
            axle(place, group_mass / group.number, (0.0, group_load / group.number), True, group.n_tyres)
            for place in places
        ),
        wheelbase=wheelbase,
        fifth_wheel=fifth_wheel,
        trailer_wheelbase=length,
        trailer_width=trailer["width"],
        steer_max=math.radians(tractor["steer_max_deg"]),
        steer_rate=math.radians(tractor["steer_rate_deg"]),
        slip=data["slip"],
        cornering=cornering,
        acceleration_min=data["acceleration_min"],
        acceleration_max=data["acceleration_max"],
        speed_control={"gain": 0.8, "integral_gain": 0.05, "integral_band_kmh": 0.5, "braking": -2.5}
        | file.get("speed_control", {}),
    )


def _ahead(load: str) -> float:
    return LOAD_AHEAD.get(load, 2.0)


def _roll(mass: float, unsprung: float, suspension: dict[str, float], on_tyres: float) -> tuple[float, float]:
    """Roll stiffness [N m/rad] and damping [N m s/rad] of a unit's springs.

    In series with its tyres, on which it leans by ``on_tyres`` where its wheels lift [rad], its centre of gravity is
    then moved as far as the file's roll gain says.
    """
    height, centre = suspension["centre_of_gravity"], suspension["roll_centre"]
    lever, limit = height - centre, threshold(suspension)
    shift = lever * suspension["roll_gain"] * limit
    # What hangs above the roll centre [kg m].
    moment = mass * height - unsprung * WHEEL_RADIUS - (mass - unsprung) * centre
    on_springs = (shift - height * on_tyres) * mass / moment
    stiffness = GRAVITY * moment * (limit + on_tyres + on_springs) / on_springs
    natural = math.tau * suspension["roll_frequency"]
    damping = 2 * suspension["roll_damping"] * natural * _roll_inertia(mass, suspension)
    # Dampers work on the springs' part of the roll alone, so they are as much harder.
    return stiffness, damping * (suspension["roll_gain"] * limit / on_springs) ** 2


def _roll_inertia(mass: float, suspension: dict[str, float]) -> float:
    """Moment of inertia about the roll centre that gives the file's natural frequency [kg m^2]."""
    lever = suspension["centre_of_gravity"] - suspension["roll_centre"]
    natural = math.tau * suspension["roll_frequency"]
    return mass * GRAVITY * lever / (suspension["roll_gain"] * natural**2)


def _body(
    mass: float, ahead: float, axles: list[tuple[float, float]], suspension: dict[str, float], gyration: float
) -> Body:
    """What is left of a unit without its axles, (mass, place) each; ``gyration`` is the square of its yaw radius."""
    sprung = mass - sum(axle for axle, _ in axles)
    place = (mass * ahead - sum(axle * x for axle, x in axles)) / sprung
    height = (mass * suspension["centre_of_gravity"] - (mass - sprung) * WHEEL_RADIUS) / sprung
    lever = height - suspension["roll_centre"]
    return Body(sprung, place, height, _roll_inertia(mass, suspension) - sprung * lever**2, sprung * gyration)


def mjcf(parts: Parts, n: int, timestep: float, hitch_stiffness: float) -> str:
    """A MuJoCo model of ``n`` such trucks that do not touch each other; ``hitch_stiffness`` of the fifth wheel in roll
    [N m/rad]. The tyres' forces are not in it."""
    return f"""<mujoco>
<compiler angle="radian" autolimits="false"/>
<option timestep="{timestep}" gravity="0 0 {-GRAVITY}" integrator="implicitfast">
  <flag constraint="disable" contact="disable" autoreset="disable"/>
</option>
<worldbody>
{"".join(_truck_mjcf(parts, hitch_stiffness) for _ in range(n))}</worldbody>
</mujoco>
"""


def _truck_mjcf(parts: Parts, hitch_stiffness: float) -> str:
    tractor = "".join(_axle_mjcf(axle, 0.0) for axle in (parts.front, parts.drive))
    trailer = "".join(_axle_mjcf(axle, HITCH_HEIGHT) for axle in parts.group)
    # The plate pitches on the tractor and twists; the kingpin turns on the plate.
    return f"""<body><freejoint/>{_inertial(parts.tractor, 0.0)}{tractor}
<body pos="{parts.fifth_wheel} 0 {HITCH_HEIGHT}">
<joint axis="0 1 0" damping="500"/>
<joint axis="1 0 0" stiffness="{hitch_stiffness}" damping="2000"/>
<joint axis="0 0 1"/>
{_inertial(parts.trailer, HITCH_HEIGHT)}{trailer}</body></body>
"""


def _inertial(body: Body, origin: float) -> str:
    """Mass and inertia of a body whose frame lies ``origin`` above the road."""
    inertia = f"{body.roll_inertia} {body.yaw_inertia} {body.yaw_inertia}"
    return f'<inertial pos="{body.ahead} 0 {body.height - origin}" mass="{body.mass}" diaginertia="{inertia}"/>'


def _axle_mjcf(axle: Axle, origin: float) -> str:
    stiffness = axle.sprung * (math.tau * HEAVE_FREQUENCY) ** 2
    damping = 2 * HEAVE_DAMPING * axle.sprung * math.tau * HEAVE_FREQUENCY
    sag = -axle.sprung * GRAVITY / stiffness
    inertia = axle.mass * (axle.track / 2) ** 2 * 0.6
    return f"""<body pos="{axle.ahead} 0 {WHEEL_RADIUS - origin}">
<joint type="slide" axis="0 0 1" stiffness="{stiffness}" damping="{damping}" springref="{sag}"/>
<joint axis="1 0 0" pos="0 0 {axle.roll_centre - WHEEL_RADIUS}" stiffness="{axle.roll_stiffness}"
 damping="{axle.roll_damping}"/>
<inertial pos="0 0 0" mass="{axle.mass}" diaginertia="{inertia} {0.2 * inertia} {inertia}"/></body>
"""
