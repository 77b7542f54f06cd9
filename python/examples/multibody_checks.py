"""Checks of the multibody truck against what is known: published geometry, closed forms, and its vehicle file.

Each check gives rows of a table: what was done, what the multibody truck does, what is expected of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from multibody import HITCH_STIFFNESS, TIMESTEP, Array, SpeedControl, Trucks
from multibody_parts import GRAVITY, Parts, read, threshold, written

CRAWL = 2.5 / 3.6
"""Speed at which tyres slip by next to nothing [m/s]."""
FOOT = 0.3048


class Row(NamedTuple):
    """A row of the table."""

    what: str
    found: float
    expected: float
    unit: str
    source: str


def steered(trucks: Trucks, error: Array, course: Array, speed: Array) -> Array:
    """Steer angle that keeps the front axle on a path, which lies ``error`` to its right [m] and leads to ``course``
    [rad] (Stanley's controller)."""
    turn = course - trucks.heading
    return np.arctan2(np.sin(turn), np.cos(turn)) - np.arctan(error / np.maximum(speed, 1.0))


def circled(parts: Parts, radii: Array, speeds: Array, seconds: float = 40.0, **options: float | bool) -> Trucks:
    """Trucks that have driven circles to the left about (0, 0) for a while, the front axle on each radius."""
    n = len(radii)
    trucks = Trucks(parts, n, **options)  # type: ignore[arg-type]
    # Where geometry puts them, so that little is left to settle.
    drive = np.sqrt(radii**2 - parts.wheelbase**2)
    hitch = np.hypot(drive, parts.fifth_wheel)
    articulation = np.arcsin(parts.trailer_wheelbase / hitch) - np.arctan(parts.fifth_wheel / drive)
    straight = np.zeros(n)
    begun = np.minimum(speeds, 10 / 3.6)
    trucks.place(np.arange(n), np.stack([straight, -drive], axis=1), straight, -articulation, begun)
    trucks.steering[:] = np.arctan(parts.wheelbase / drive)
    control = SpeedControl(parts, n)
    steps = round(SpeedControl.PERIOD / 5 / trucks.model.opt.timestep)
    for _ in range(round(seconds / SpeedControl.PERIOD)):
        acceleration = control(trucks.speed, speeds)
        for _ in range(5):
            x, y = trucks.front.T
            error = radii - np.hypot(x, y)
            trucks.advance(steered(trucks, error, np.arctan2(y, x) + math.pi / 2, speeds), acceleration, steps)
    return trucks


def off_tracking(trucks: Trucks) -> tuple[Array, Array]:
    """Radius of the front axles about (0, 0), and what the trailer's axle groups are inside of it [m]."""
    front, trailer = (np.hypot(*points.T) for points in (trucks.front, trucks.trailer_position))
    return front, front - trailer


def sum_of_squares(parts: Parts, radius: float, trailer_wheelbase: float) -> float:
    """Off-tracking of the front axle's radius without slip [m] (SAE J695)."""
    return radius - math.sqrt(radius**2 - parts.wheelbase**2 + parts.fifth_wheel**2 - trailer_wheelbase**2)


def single_track(parts: Parts, radius: float, speed: float) -> float:
    """Off-tracking of the simulator's equations in a steady turn at a speed of the drive axle [m/s], see
    src/engine/cpu/drive.rs."""

    def turn(curvature: float) -> tuple[float, float]:
        yaw = speed * curvature
        side = -parts.slip * speed**2 * yaw
        hitch = side + parts.fifth_wheel * yaw
        low, high = 0.0, 1.5
        for _ in range(60):
            articulation = 0.5 * (low + high)
            sin, cos = math.sin(articulation), math.cos(articulation)
            ahead, left = speed * cos - hitch * sin, speed * sin + hitch * cos
            slower = left < yaw * (parts.trailer_wheelbase - parts.slip * ahead**2)
            low, high = (articulation, high) if slower else (low, articulation)
        trailer = math.hypot(ahead, left - parts.trailer_wheelbase * yaw) / yaw
        return math.hypot(speed, side + parts.wheelbase * yaw) / yaw, trailer

    low, high = 0.2 / radius, 3 / radius
    for _ in range(60):
        curvature = 0.5 * (low + high)
        low, high = (curvature, high) if turn(curvature)[0] > radius else (low, curvature)
    front, trailer = turn(curvature)
    return front - trailer


def crawling(vehicles: Path) -> Iterator[Row]:
    """Circles at walking pace."""
    radii = np.array([12.5, 20.0])
    for name, one_axle in [("eu_4x2_13m6", True), ("eu_4x2_13m6", False), ("daf_xf", False)]:
        parts = read(vehicles / f"{name}.toml", "empty", one_axle)
        _, found = off_tracking(circled(parts, radii, np.full(2, CRAWL)))
        lengths = [-axle.ahead for axle in parts.group]
        wheelbase = sum(length**2 for length in lengths) / sum(lengths)
        for radius, inside in zip(radii, found):
            expected = sum_of_squares(parts, radius, wheelbase)
            source = "SAE J695" if one_axle else f"SAE J695 with the equivalent wheelbase of {wheelbase:.3f} m"
            axles = f"{len(lengths)} axle{'s' if len(lengths) > 1 else ''}"
            yield Row(f"off-tracking on {radius} m, {name}, {axles}", inside, expected, "m", source)


def design_vehicle(vehicles: Path) -> Iterator[Row]:
    """AASHTO's minimum turn of its design vehicle WB-62: half a turn, the front axle on 41 ft."""
    # Its lock is just that of the turn, which would leave nothing to correct with.
    parts, radius = replace(read(vehicles / "us_wb62.toml", "empty"), steer_max=1.0), 41 * FOOT
    trucks, one = Trucks(parts), np.ones(1)
    trucks.place(np.zeros(1, np.int64), np.array([[-parts.wheelbase - 1, -radius]]), 0 * one, 0 * one, CRAWL * one)
    control, least, turned = SpeedControl(parts, 1), math.inf, 0.0
    while turned < math.pi + 1.0:
        acceleration = control(trucks.speed, CRAWL * one)
        for _ in range(5):
            x, y = trucks.front[0]
            turned = math.atan2(x, -y) % math.tau if x > 0 or y > 0 else 0.0
            course, error = (0.0, radius + y) if x < 0 and y < 0 else (turned, radius - math.hypot(x, y))
            if y > 0 and x < 0:
                course, error = math.pi, radius - y
                turned = math.pi - x / radius
            trucks.advance(steered(trucks, one * error, one * course, CRAWL * one), acceleration, 10)
        heading = trucks.trailer_heading
        inner = trucks.trailer_position + 0.5 * parts.trailer_width * np.stack([-np.sin(heading), np.cos(heading)], 1)
        least = min(least, float(np.hypot(*inner[0])))
    yield Row("least inside radius of half a turn on 41 ft, us_wb62", least / FOOT, 7.4, "ft", "AASHTO, WB-62")


def linear(vehicles: Path) -> Iterator[Row]:
    """Under the simulator's assumptions (one trailer axle, tyres of the file's slip) the simulator's off-tracking."""
    radii, speeds = np.array([13.9, 20.0, 27.6]), np.array([20.0, 30.0, 35.0]) / 3.6
    for load in ("empty", "laden"):
        parts = read(vehicles / "eu_4x2_13m6.toml", load, one_axle=True)
        trucks = circled(parts, radii, speeds, linear=True)
        for front, inside, speed in zip(*off_tracking(trucks), trucks.speed):
            what = f"off-tracking on {front:.1f} m at {speed * 3.6:.0f} km/h, eu_4x2_13m6 {load}, linear tyres, 1 axle"
            yield Row(what, inside, single_track(parts, front, speed), "m", "the simulator's equations")


def lifted(parts: Parts, start: float, hitch_stiffness: float) -> float:
    """Lateral acceleration at which all inner wheels of a standing truck's trailer have lifted [g], from ``start``."""
    trucks = Trucks(parts, mu=10.0, hitch_stiffness=hitch_stiffness)
    lateral = 0.0
    # Half of it at once would throw it over.
    for step in range(10_000):
        lateral = start * min(step * 0.02 / 4, 1) + 0.02 * max(step * 0.02 - 8, 0)
        trucks.model.opt.gravity[1] = -GRAVITY * lateral
        trucks.advance(np.zeros(1), np.zeros(1), 10)
        if not trucks.loads[0, 2:, 0].any():
            break
    return lateral


def tilt_table(vehicles: Path) -> Iterator[Row]:
    """The lateral acceleration at which the trailer's wheels lift, as a tilt table finds it."""
    file = vehicles / "daf_xf.toml"
    for load in ("empty", "half", "laden", "laden_high"):
        expected = threshold(written(file)["loads"][load]["suspension"])
        for name, stiffness in [("stiff", HITCH_STIFFNESS), ("free", 0.0)]:
            found = lifted(read(file, load), 0.7 * expected, stiffness)
            what = f"trailer's wheels lift, daf_xf {load}, fifth wheel {name} in roll"
            yield Row(what, found, expected, "g", "the file's threshold")


def swung(parts: Parts) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio of the standing trailer's roll once a steady side force ends."""
    trucks, zero, roll = Trucks(parts), np.zeros(1), []
    for step in range(900):
        trucks.model.opt.gravity[1] = -0.1 * GRAVITY if step < 400 else 0.0
        trucks.advance(zero, zero, 5)
        if step >= 400:
            roll.append(float(trucks.trailer_roll[0]))
    turns = [k for k in range(1, len(roll) - 1) if (roll[k] - roll[k - 1]) * (roll[k + 1] - roll[k]) < 0]
    first, third, heights = turns[0], turns[2], [roll[k] for k in turns[:3]]
    # From one turning point to the next is half a period; the swing between them shrinks by the same factor.
    decrement = math.log((heights[0] - heights[1]) / (heights[2] - heights[1]))
    ratio = decrement / math.hypot(math.pi, decrement)
    return 1 / ((third - first) * 0.01) / math.sqrt(1 - ratio**2), ratio


def roll_decay(vehicles: Path) -> Iterator[Row]:
    """Free roll of the trailer."""
    file = vehicles / "eu_4x2_13m6.toml"
    for load in ("empty", "half", "laden", "laden_high"):
        suspension = written(file)["loads"][load]["suspension"]
        frequency, ratio = swung(read(file, load))
        yield Row(f"roll, eu_4x2_13m6 {load}", frequency, suspension["roll_frequency"], "Hz", "the file")
        yield Row(f"roll, eu_4x2_13m6 {load}", ratio, suspension["roll_damping"], "damping ratio", "the file")


def time_step(vehicles: Path) -> Iterator[Row]:
    """The trailer's load transfer ratio with the time step that is driven and with a quarter of it."""
    parts = read(vehicles / "eu_4x2_13m6.toml", "laden")
    found, expected = (
        float(circled(parts, np.array([16.0]), np.array([20 / 3.6]), 10.0, timestep=step).load_transfer_ratio[0])
        for step in (TIMESTEP, TIMESTEP / 4)
    )
    yield Row(
        "load transfer ratio on 16 m at 20 km/h, eu_4x2_13m6 laden", found, expected, "1", "a quarter of the step"
    )


CHECKS: list[Callable[[Path], Iterator[Row]]] = [crawling, design_vehicle, linear, tilt_table, roll_decay, time_step]
