"""Trucks that something else drives, and what a policy observes of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _offtrack
from .arguments import check_order, checked_integer, is_sequence, names_of, numbers, single, text, within
from .scenarios import Scenario, given, kept, kept_routes
from .state import check_world

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
#: One number for all trucks, or one for each.
Numbers = npt.ArrayLike
#: Indices of trucks, waypoints or vehicles.
Indices = Sequence[int] | npt.NDArray[np.integer[Any]]


class Seen(NamedTuple):
    """What is observed of k trucks."""

    values: Floats
    """What a policy observes, ``[k, n_values]``: the simulator's values, to the last bit."""
    lane_distance: Floats
    """Distance of the middle of the tractor's wheelbase from the lane's centre [m], ``[k]``."""
    waypoint: Ints
    """Index of the next waypoint to pass; their number once all are passed, ``[k]``."""
    clearance: Floats
    """Distance of tractor and trailer from the nearest kerb, at most 0 where they touch [m], ``[k, 2]``.

    It exceeds the distance by at most 2 cm near a kerb; far from one, where fewer points are sampled, it is up to twice
    the distance."""
    ended: Ints
    """Whether and why the episode has ended, as :class:`Ended`: 0 while it goes on, ``[k]``."""


class Frame(NamedTuple):
    """Where the frame that a road is driven in lies in the map that the road is from."""

    origin: tuple[float, float]
    """The road's centre in the map's frame [m]."""
    mirrored: bool
    """Whether traffic keeps to the left: the road is then driven as its mirror image in the x axis."""


class Observer(_offtrack.Observer):
    """Trucks that another simulator or a real one drives: what a policy observes of them.

    Poses are in the frame of the map that a road is from (an outline file's ``origin``): x east, y north, metres,
    radians, counter-clockwise, signs as on the map on left-hand roads too. There are no dynamics, and none of a
    benchmark's ``[disturbances]``: poses from elsewhere have errors of their own.

    Args:
        scenario: Benchmark, as for :class:`offtrack_sim.Batch`.
        routes: Name of each truck's route, n of them or one for all trucks.
        vehicles: What each truck is, n or one for all: names of vehicle and load, as their files have them; or an index
            in ``Batch.vehicle_classes``, the vehicle that episodes draw. None for the first vehicle, the one vehicle of
            a benchmark that names one.
        num_threads: Threads that observe the trucks; None for one a core. No result depends on it.

    Attributes:
        num_trucks: Number of trucks n.
        scenario: Name of the benchmark.
        routes: Name of each truck's route, n of them.
        vehicles: What each truck is, as it was given, n of them.
        step_seconds: Time between two observations [s].
        action_table: Steer angle [rad] and target speed [m/s] of each action, float32 ``[n_actions, 2]``, as the policy
            learned it: :meth:`command` gives them as they are on the map.
        n_commands: Numbers of a command where actions are continuous; 0 where an action is an index.
        extras: Names of the extras that stand behind an observation's 69 values.
        n_values: Number of an observation's values, extras included.
        classes: Names of vehicle and load of each class of the benchmark.

    It observes no other vehicles: a policy that reads what they do cannot drive by it.

    Copies and pickles go on from where the original is, independent of it. One thread at a time may use it.

    Raises:
        ValueError: For an unknown scenario, route or vehicle; the message names the choices. :class:`ScenarioError` for
            a file that is refused.
    """

    def __new__(
        cls,
        scenario: Scenario,
        routes: Iterable[str],
        vehicles: Sequence[tuple[str, str]] | Indices | None = None,
        *,
        num_threads: int | None = None,
    ) -> Observer:
        check_order("routes", routes, "a sequence is needed, one a truck or one for all")
        names = names_of(routes)
        if not names:
            raise ValueError("routes: empty; the name of each truck's route is needed, or of one for all")
        threads = 0 if num_threads is None else within("num_threads", num_threads, 1, 1025)
        pairs, rows = _vehicles(vehicles)
        stated: list[Any] | None = pairs if pairs is not None else rows
        n = max(len(names), 0 if stated is None else len(stated))
        for name, values in (("routes", names), ("vehicles", stated)):
            if values is not None and len(values) not in (1, n):
                raise ValueError(f"{name}: {len(values)} of them; {n} or 1 are needed")
        names = names * n if len(names) == 1 else names
        if stated is not None:
            stated *= n if len(stated) == 1 else 1
        observer = super().__new__(cls, given(scenario), names, vehicles=pairs, rows=rows, num_threads=threads)
        observer.routes = names
        observer.vehicles = [observer.classes[0]] * n if stated is None else list(stated)
        observer._arguments = {
            "scenario": kept(scenario),
            "routes": kept_routes(names),
            "vehicles": stated,
            "num_threads": num_threads,
        }
        return observer

    routes: list[str]
    vehicles: list[Any]
    _arguments: dict[str, Any]
    """What makes an observer of the same trucks."""

    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]:
        return (), self._arguments

    def __getstate__(self) -> tuple[int, list[tuple[int, int | None, int, float]]]:
        return self.fingerprint(), self.states()

    def __setstate__(self, kept: tuple[int, list[tuple[int, int | None, int, float]]]) -> None:
        world, states = kept
        check_world(self.scenario, world, self.fingerprint(), "benchmark file and routes")
        self.restore_states(states)

    def begin(
        self,
        position: npt.ArrayLike,
        heading: Numbers,
        trailer_heading: Numbers,
        speed: Numbers,
        *,
        waypoint: int | Indices | None = None,
        trucks: Indices | None = None,
    ) -> Seen:
        """Begins an episode of each truck at any place along its route: what lies behind counts as passed.

        Wheels are straight and the target speed is the truck's, as where the simulator begins a route; in a bend
        ``observe`` may come first, which takes what the truck's electronics know. The start is not judged.
        Of a route that passes a place twice the nearer lane is taken, unless ``waypoint`` says which is meant.

        Args:
            position: Middle of the drive axle in the map's frame [m], ``[k, 2]``.
            heading: Heading of the tractor [rad], one number or ``[k]``, as all that follows.
            trailer_heading: Heading of the trailer [rad].
            speed: Speed of the drive axle along the tractor's heading [m/s].
            waypoint: Index of a waypoint near which the trucks are, such as ``Seen.waypoint`` of an episode that goes
                on, one or k of them: the next is looked for from 16 waypoints before it to 16 behind it. None if it
                is not known.
            trucks: Indices of the k trucks that begin; None for all of them.

        Raises:
            TypeError: For what are no numbers.
            ValueError: For another shape, for a number that no truck has, such as NaN, and for a waypoint that a route
                does not have; no truck has begun then.
        """
        rows = self._rows(trucks)
        poses = self._poses(rows, position, heading, trailer_heading, speed)
        near: list[Any] = []
        if waypoint is not None:
            near = list(waypoint) if is_sequence(waypoint) else [waypoint] * len(poses)
            if len(near) != len(poses):
                raise ValueError(f"waypoint: {len(near)} of them; {len(poses)} or 1 are needed")
            near = [within(f"waypoint[{row}]", index, 0, 2**32) for row, index in enumerate(near)]
        return Seen(*self.begin_at(rows, poses, near))

    def observe(
        self,
        position: npt.ArrayLike,
        heading: Numbers,
        trailer_heading: Numbers,
        speed: Numbers,
        *,
        steering: Numbers = 0.0,
        target_speed: Numbers = 0.0,
        acceleration: Numbers = 0.0,
        lateral_acceleration: Numbers = 0.0,
        trailer_roll: Numbers = 0.0,
        trailer_roll_rate: Numbers = 0.0,
        tractor_load_transfer_ratio: Numbers = 0.0,
        trailer_load_transfer_ratio: Numbers = 0.0,
        trucks: Indices | None = None,
    ) -> Seen:
        """The trucks a step later, at poses as :meth:`begin` has them. A truck's first pose begins its episode.

        Of the rest extras and rollover alone are computed.

        Args:
            position: As for :meth:`begin`, and so are the next three and ``trucks``.
            heading: Heading of the tractor [rad].
            trailer_heading: Heading of the trailer [rad].
            speed: Speed [m/s].
            steering: Steer angle of the front axle, left positive [rad].
            target_speed: Target speed [m/s].
            acceleration: Acceleration along the tractor's heading [m/s^2].
            lateral_acceleration: That of the trailer's axles, to the left [m/s^2].
            trailer_roll: Roll of the trailer, to the right [rad].
            trailer_roll_rate: Its rate [rad/s].
            tractor_load_transfer_ratio: The largest of the step, to the right.
            trailer_load_transfer_ratio: The same of the trailer.
            trucks: Indices of the k trucks; None for all of them.

        Raises:
            TypeError: For what are no numbers.
            ValueError: As for :meth:`begin`; no truck has gone on then.
        """
        rows = self._rows(trucks)
        poses = self._poses(rows, position, heading, trailer_heading, speed)
        telemetry = np.empty((len(poses), 8), np.float32)
        for column, (name, value) in enumerate(
            {
                "steering": steering,
                "target_speed": target_speed,
                "acceleration": acceleration,
                "lateral_acceleration": lateral_acceleration,
                "trailer_roll": trailer_roll,
                "trailer_roll_rate": trailer_roll_rate,
                "tractor_load_transfer_ratio": tractor_load_transfer_ratio,
                "trailer_load_transfer_ratio": trailer_load_transfer_ratio,
            }.items()
        ):
            telemetry[:, column] = single(_numbers(name, value, (len(poses),)))
        return Seen(*self.observe_at(rows, poses, telemetry))

    def command(self, actions: npt.NDArray[Any], target_speed: Numbers = 0.0) -> tuple[Floats, Floats]:
        """What actions ask for: steer angle on the map, left positive [rad], and target speed [m/s], ``[n]`` each.

        Args:
            actions: Index of each truck's action in ``action_table``, integers ``[n]``; where actions are continuous
                each truck's command, float32 ``[n, n_commands]`` in -1..1, see :class:`offtrack_sim.Batch`.
            target_speed: The last target speed [m/s], which counts where actions change it.

        Raises:
            TypeError: For anything but an array of integers, or of numbers.
            ValueError: For another shape, for an action outside the table, a number outside -1..1, and a speed that is
                not finite.
        """
        speeds = single(_numbers("target_speed", target_speed, (self.num_trucks,)))
        if not np.isfinite(speeds).all():
            truck = int(np.flatnonzero(~np.isfinite(speeds))[0])
            raise ValueError(f"target_speed[{truck}]: {speeds[truck]}; a finite number is needed")
        return self.commands(actions, speeds)

    def frame(self, route: str) -> Frame:
        """Where the road of a route lies in its map."""
        return Frame(*self.frame_of(text("route", route)))

    def waypoints(self, route: str) -> Doubles:
        """Position [m] and heading [rad] of a route's waypoints in the map's frame, ``[n_waypoints, 3]``."""
        return self.waypoints_of(text("route", route))

    def kerbs(self, route: str) -> list[Doubles]:
        """The kerbs of a route's road in the map's frame: lines ``[n, 2]`` [m], drivable on their left.

        The last point of each is joined to its first.
        """
        return self.kerbs_of(text("route", route))

    def dimensions(self, vehicle: tuple[str, str] | int | None = None) -> dict[str, float]:
        """Lengths [m], masses [kg], and limits (SI, rad) of one of ``vehicles``; of the first without a name.

        Ends of the tractor are ahead of its drive axle, those of the trailer ahead of its axle group.
        """
        if vehicle is not None and vehicle not in self.vehicles:
            raise ValueError(f"vehicle: {vehicle!r}; must be one of {sorted(set(self.vehicles))}")
        return self.dimensions_of(0 if vehicle is None else self.vehicles.index(vehicle))

    def _rows(self, trucks: Indices | None) -> list[int] | None:
        """Indices of trucks, none for all."""
        if trucks is None:
            return None
        if not is_sequence(trucks):
            raise TypeError(f"trucks: {trucks!r}; indices of trucks are needed, or None for all")
        rows = [within(f"trucks[{row}]", truck, 0, self.num_trucks) for row, truck in enumerate(trucks)]
        if len(set(rows)) != len(rows):
            raise ValueError("trucks: one of them stands twice")
        return rows

    def _poses(
        self,
        rows: list[int] | None,
        position: npt.ArrayLike,
        heading: Numbers,
        trailer_heading: Numbers,
        speed: Numbers,
    ) -> Doubles:
        """Poses as rows."""
        k = self.num_trucks if rows is None else len(rows)
        poses = np.empty((k, 5))
        poses[:, :2] = _numbers("position", position, (k, 2))
        for column, (name, value) in enumerate(
            {"heading": heading, "trailer_heading": trailer_heading, "speed": speed}.items(), start=2
        ):
            poses[:, column] = _numbers(name, value, (k,))
        return poses


def speed_control(observer: Observer, speed: Numbers, target: Numbers) -> Floats:
    """Acceleration by which the simulator's own controller approaches a target speed: for trucks with pedals.

    A PI controller with the limits of vehicle and load, asked once a step. It keeps an integral of each truck's error
    until the truck's next episode begins.

    Args:
        observer: The trucks.
        speed: Present speed [m/s], one number or ``[n]``.
        target: Target speed [m/s], as :meth:`Observer.command` gives it.

    Returns:
        Acceleration of each truck [m/s^2], ``[n]``.

    Raises:
        ValueError: For a speed that no truck can have; no controller has gone on then.
    """
    if not isinstance(observer, Observer):
        raise TypeError(f"observer: {observer!r}; an Observer is needed")
    n = (observer.num_trucks,)
    speeds = [single(_numbers(name, value, n)) for name, value in (("speed", speed), ("target", target))]
    return observer.accelerations(*speeds)


def _vehicles(given: Sequence[tuple[str, str]] | Indices | None) -> tuple[list[Any] | None, list[Any] | None]:
    """Vehicles as pairs of names, or as indices; the other is None."""
    if given is None:
        return None, None
    if not is_sequence(given):
        raise TypeError(f"vehicles: {given!r}; a sequence is needed, one a truck or one for all")
    if len(given) == 0:
        raise ValueError("vehicles: empty; give None for the first vehicle")
    if all(isinstance(vehicle, tuple | list) for vehicle in given):
        pairs: list[Any] = [tuple(vehicle) for vehicle in given]
        for index, pair in enumerate(pairs):
            if len(pair) != 2 or not all(isinstance(name, str) for name in pair):
                raise TypeError(f"vehicles[{index}]: {pair!r}; names of vehicle and load are needed")
        return pairs, None
    for index, vehicle in enumerate(given):
        if isinstance(vehicle, str):
            needed = "a pair of names of vehicle and load, or an index, is needed"
            raise TypeError(f"vehicles[{index}]: {vehicle!r}; {needed}")
    rows = [checked_integer(f"vehicles[{index}]", vehicle) for index, vehicle in enumerate(given)]
    return None, [within(f"vehicles[{index}]", row, 0, 2**32) for index, row in enumerate(rows)]


def _numbers(name: str, value: npt.ArrayLike, shape: tuple[int, ...]) -> npt.NDArray[Any]:
    """Numbers of this shape: as many as are needed, or one for all."""
    found = numbers(name, value, f"numbers of shape {shape} are needed")
    if found.shape == shape or found.shape == shape[1:]:
        return np.broadcast_to(found, shape)
    raise ValueError(f"{name}: shape {found.shape}; {shape} is needed")
