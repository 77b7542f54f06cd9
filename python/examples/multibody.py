"""Multibody tractor-semitrailers in MuJoCo, many at once: bodies and springs are MuJoCo's, tyres are forces.

All trucks are one model without contacts, so that a step is one call of MuJoCo and a few dozen operations on arrays
``[n, wheels]``. It shares no equation with the simulator: mass, load transfer, grip and lag follow from the bodies.
Needs ``mujoco`` and ``numpy``.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from multibody_parts import GRAVITY, TYRE_DAMPING, Parts, mjcf

Array = npt.NDArray[np.float64]

RELAXATION = 0.5
"""Distance over which a tyre builds up its lateral force [m]."""
ROLLING_RESISTANCE = 0.006
CREEP = 0.1
"""Speed below which rolling resistance and brakes fade, so that a truck can stand [m/s]."""
DRIVE_LAG, BRAKE_LAG = 0.45, 0.35
"""Time constants of drive and brakes [s]."""
POWER = 330e3
"""Engine power [W]."""
HITCH_STIFFNESS = 3e6
"""Roll stiffness of a fifth wheel in line [N m/rad]."""
TIMESTEP = 0.002

TRACTOR, FRONT, DRIVE, TRAILER = range(4)
"""Bodies of a truck in MuJoCo's order; the trailer's axles follow."""
N_HITCH = 3
"""Joints of the fifth wheel: pitch, roll, yaw."""


class Trucks:
    """``n`` alike trucks on a flat road.

    Args:
        parts: What :func:`multibody_parts.read` gives.
        n: Number of trucks.
        mu: Peak friction of the tyres.
        timestep: Of the integration [s].
        hitch_stiffness: Roll stiffness of the fifth wheel [N m/rad].
        linear: Tyres that never saturate, as stiff as the file's slip says at their load at rest.
    """

    def __init__(
        self,
        parts: Parts,
        n: int = 1,
        *,
        mu: float = 0.75,
        timestep: float = TIMESTEP,
        hitch_stiffness: float = HITCH_STIFFNESS,
        linear: bool = False,
    ) -> None:
        self.parts, self.n, self.mu = parts, n, mu
        self.model = mujoco.MjModel.from_xml_string(mjcf(parts, n, timestep, hitch_stiffness))
        self.data = data = mujoco.MjData(self.model)
        axles, n_bodies = parts.axles, 4 + len(parts.group)
        slots = [FRONT, DRIVE, *range(TRAILER + 1, n_bodies)]
        self._slots = np.array(slots)
        # Views of MuJoCo's own arrays: body 0 is the world.
        self.qpos: Array = data.qpos.reshape(n, -1)
        self.qvel: Array = data.qvel.reshape(n, -1)
        self._xpos: Array = data.xpos[1:].reshape(n, n_bodies, 3)
        self._xmat: Array = data.xmat[1:].reshape(n, n_bodies, 9)
        self._cvel: Array = data.cvel[1:].reshape(n, n_bodies, 6)
        self._com: Array = data.subtree_com[1:].reshape(n, n_bodies, 3)[:, TRACTOR]
        self._force: Array = data.xfrc_applied[1:].reshape(n, n_bodies, 6)
        # Free joint, two axles of two joints, fifth wheel, the trailer's axles.
        self._hitch = 6 + 2 * 2
        # Wheels: left and right of each axle, from the front; arrays [axles, 2, n].
        self._out = _column([0.5 * axle.track for axle in axles]) * np.array([[1.0], [-1.0]])
        self._radius = _column([axle.radius for axle in axles])
        self._stiffness = _column([axle.n_tyres * axle.tyre_stiffness for axle in axles])
        self._peak_load = _column([axle.n_tyres * axle.peak_load for axle in axles])
        self._linear = _column([axle.load / 2 / (GRAVITY * parts.slip) for axle in axles]) if linear else None
        self._brake_share = _column([axle.load / (2 * GRAVITY * parts.mass) for axle in axles])
        self._slip = np.zeros((len(axles), 2, n))
        self._load = np.zeros((len(axles), 2, n))
        self.steering = np.zeros(n)
        """Steer angle of the front axle, left positive [rad]."""
        self.acceleration = np.zeros(n)
        """What drive and brakes give, per mass [m/s^2]."""
        self.place(np.arange(n), np.zeros((n, 2)), np.zeros(n), np.zeros(n), np.zeros(n))

    def place(
        self, trucks: npt.NDArray[np.int64], position: Array, heading: Array, trailer_heading: Array, speed: Array
    ) -> None:
        """Puts trucks on the road at rest in their springs: middle of the drive axle [m], headings [rad], speed along
        the heading [m/s]. They roll without slip, wheels straight."""
        qpos, qvel = np.zeros((len(trucks), self.qpos.shape[1])), np.zeros((len(trucks), self.qvel.shape[1]))
        qpos[:, :2] = position
        qpos[:, 3], qpos[:, 6] = np.cos(0.5 * heading), np.sin(0.5 * heading)
        qpos[:, self._hitch + N_HITCH] = trailer_heading - heading
        qvel[:, 0], qvel[:, 1] = speed * np.cos(heading), speed * np.sin(heading)
        qvel[:, self._hitch + 2] = speed * np.sin(heading - trailer_heading) / self.parts.trailer_wheelbase
        self.qpos[trucks], self.qvel[trucks] = qpos, qvel
        for state in (self._slip, self._load, self.steering, self.acceleration):
            state[..., trucks] = 0.0
        self._measure()

    def advance(self, steering: Array, acceleration: Array, steps: int = 1) -> None:
        """Integrates some steps towards a steer angle [rad] with an acceleration asked for [m/s^2], ``[n]`` each."""
        parts, dt = self.parts, float(self.model.opt.timestep)
        target = np.clip(steering, -parts.steer_max, parts.steer_max)
        lag, turn = dt / np.where(acceleration < 0, BRAKE_LAG, DRIVE_LAG), parts.steer_rate * dt
        power = POWER / parts.mass / np.maximum(self.speed, 1.0)
        asked = np.clip(acceleration, parts.acceleration_min, np.minimum(parts.acceleration_max, power))
        for _ in range(steps):
            self.steering += np.clip(target - self.steering, -turn, turn)
            self.acceleration += (asked - self.acceleration) * lag
            mujoco.mj_step1(self.model, self.data)
            self._apply_tyres(dt)
            mujoco.mj_step2(self.model, self.data)
        self._measure()

    def _measure(self) -> None:
        """Poses and velocities after the last integration, which a step leaves as they were before it."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_comVel(self.model, self.data)

    def _apply_tyres(self, dt: float) -> None:
        """Forces of all wheels on their axles, from the state as MuJoCo has it."""
        axle = np.ascontiguousarray(self._xpos[:, self._slots].transpose(2, 1, 0))[:, :, None]
        turned = np.ascontiguousarray(self._xmat[:, self._slots].transpose(2, 1, 0))[:, :, None]
        velocity = np.ascontiguousarray(self._cvel[:, self._slots].transpose(2, 1, 0))[:, :, None]
        com_x, com_y, com_z = self._com.T.copy()
        # Contact of a wheel: on the road below its centre.
        arm_x, arm_y = self._out * turned[1], self._out * turned[4]
        x, y, z = axle[0] + arm_x - com_x, axle[1] + arm_y - com_y, -com_z
        spin_x, spin_y, spin_z = velocity[:3]
        v_x = velocity[3] + spin_y * z - spin_z * y
        v_y = velocity[4] + spin_z * x - spin_x * z
        v_z = velocity[5] + spin_x * y - spin_y * x
        sunk = self._radius - axle[2] - self._out * turned[7]
        load = np.maximum(self._stiffness * sunk - TYRE_DAMPING * v_z, 0.0) * (sunk > 0)
        # Where the wheels point: along the axle's heading, the front ones turned about one centre (Ackermann).
        norm = 1 / np.hypot(turned[0], turned[3])
        ahead_x, ahead_y = np.broadcast_to(turned[0] * norm, load.shape), np.broadcast_to(turned[3] * norm, load.shape)
        tangent = np.tan(self.steering)
        turn = np.arctan(tangent / (1 - self._out[0] / self.parts.wheelbase * tangent))
        cos, sin = np.ones_like(load), np.zeros_like(load)
        cos[0], sin[0] = np.cos(turn), np.sin(turn)
        along_x, along_y = ahead_x * cos - ahead_y * sin, ahead_y * cos + ahead_x * sin
        rolling = v_x * along_x + v_y * along_y
        sliding = v_y * along_x - v_x * along_y
        self._slip -= sliding * (dt / RELAXATION)
        self._slip /= 1 + np.abs(rolling) * (dt / RELAXATION)
        np.clip(self._slip, -2.0, 2.0, out=self._slip)
        force = self.acceleration * self.parts.mass
        fade = np.clip(rolling / CREEP, -1.0, 1.0)
        drive = np.minimum(force, 0.0) * self._brake_share * fade - ROLLING_RESISTANCE * load * fade
        drive[1] += np.maximum(force, 0.0) / 2
        lateral = self._lateral(load, drive)
        f_x, f_y = drive * along_x - lateral * along_y, drive * along_y + lateral * along_x
        # About the axle's centre, which is above the road by axle[2].
        self._load = load
        total = self._force[:, self._slots]
        down = axle[2]
        for place, part in enumerate(
            (f_x, f_y, load, arm_y * load + down * f_y, -down * f_x - arm_x * load, arm_x * f_y - arm_y * f_x)
        ):
            total[..., place] = (part[:, 0] + part[:, 1]).T
        self._force[:, self._slots] = total

    def _lateral(self, load: Array, drive: Array) -> Array:
        """Lateral force of each wheel [N] within the circle of friction, which bounds the longitudinal force ``drive``
        first."""
        if self._linear is not None:
            stiff: Array = self._linear * self._slip
            return stiff
        grip = self.mu * load
        np.clip(drive, -0.95 * grip, 0.95 * grip, out=drive)
        most = np.sqrt(grip * grip - drive * drive) + 1e-9
        stiffness = self.parts.cornering * load / (1 + (load / self._peak_load) ** 2)
        return brush(self._slip, stiffness, most)

    def _heading(self, body: int) -> Array:
        heading: Array = np.arctan2(self._xmat[:, body, 3], self._xmat[:, body, 0])
        return heading

    @property
    def position(self) -> Array:
        """Middle of the drive axle [m], ``[n, 2]``."""
        return self._xpos[:, DRIVE, :2].copy()

    @property
    def front(self) -> Array:
        """Middle of the front axle [m], ``[n, 2]``."""
        return self._xpos[:, FRONT, :2].copy()

    @property
    def trailer_position(self) -> Array:
        """Middle of the trailer's axle group [m], ``[n, 2]``."""
        middle: Array = self._xpos[:, TRAILER + 1 :, :2].mean(axis=1)
        return middle

    @property
    def heading(self) -> Array:
        """Heading of the tractor [rad]."""
        return self._heading(TRACTOR)

    @property
    def trailer_heading(self) -> Array:
        """Heading of the trailer [rad]."""
        return self._heading(TRAILER)

    @property
    def speed(self) -> Array:
        """Speed of the drive axle along its heading [m/s]."""
        x, y, z = (self._xpos[:, DRIVE] - self._com).T
        spin_x, spin_y, spin_z, v_x, v_y, _ = self._cvel[:, DRIVE].T
        heading = self._heading(DRIVE)
        along = (v_x + spin_y * z - spin_z * y) * np.cos(heading)
        speed: Array = along + (v_y + spin_z * x - spin_x * z) * np.sin(heading)
        return speed

    @property
    def yaw_rate(self) -> Array:
        """Yaw rate of the tractor [rad/s]."""
        return self._cvel[:, TRACTOR, 2].copy()

    @property
    def trailer_lateral_acceleration(self) -> Array:
        """Lateral acceleration of the trailer, speed times yaw rate, to the left [m/s^2]."""
        return self.speed * np.cos(self.heading - self.trailer_heading) * self._cvel[:, TRAILER, 2]

    @property
    def trailer_roll(self) -> Array:
        """Roll angle of the trailer, to the right [rad]."""
        roll: Array = np.arcsin(np.clip(self._xmat[:, TRAILER, 7], -1.0, 1.0))
        return roll

    @property
    def trailer_roll_rate(self) -> Array:
        """Roll rate of the trailer, to the right [rad/s]."""
        heading = self.trailer_heading
        spin = self._cvel[:, TRAILER]
        rate: Array = spin[:, 0] * np.cos(heading) + spin[:, 1] * np.sin(heading)
        return rate

    @property
    def loads(self) -> Array:
        """Vertical force on each wheel [N], ``[n, axles, 2]``, left first."""
        return self._load.transpose(2, 0, 1)

    @property
    def load_transfer_ratio(self) -> Array:
        """Fraction of the weight on the trailer's axles that has moved to their right wheels."""
        left, right = self._load[2:].sum(axis=0)
        ratio: Array = (right - left) / np.maximum(left + right, 1.0)
        return ratio


class SpeedControl:
    """The simulator's PI controller with anti-windup, for ``n`` trucks: asks for an acceleration each 0.1 s."""

    PERIOD = 0.1

    def __init__(self, parts: Parts, n: int) -> None:
        self._keys, self._most = parts.speed_control, parts.acceleration_max
        self._integral = np.zeros(n)

    def __call__(self, speed: Array, target: Array) -> Array:
        """The acceleration from the present speed towards a target [m/s] that holds until the next call [m/s^2]."""
        keys, error = self._keys, target - speed
        near = np.abs(error) <= keys["integral_band_kmh"] / 3.6
        held = np.where(near, self._integral, 0.0)
        integrated = np.where(near, held + error * self.PERIOD, 0.0)
        asked = keys["gain"] * error + keys["integral_gain"] * integrated
        self._integral = np.where((keys["braking"] <= asked) & (asked <= self._most), integrated, held)
        found: Array = np.clip(
            keys["gain"] * error + keys["integral_gain"] * self._integral, keys["braking"], self._most
        )
        return found


def brush(slip: Array, stiffness: Array, most: Array) -> Array:
    """Lateral force of a brush model (Fiala) [N]: of a tyre with a cornering stiffness [N/rad] and a largest force
    [N], which it reaches where all of its contact slides."""
    adhering = 1 - np.minimum(stiffness * np.abs(slip) / (3 * most), 1.0)
    force: Array = np.copysign(most * (1 - adhering**3), slip)
    return force


def _column(values: list[float]) -> Any:
    """Values of axles beside arrays ``[axles, 2, n]``."""
    return np.array(values)[:, None, None]
