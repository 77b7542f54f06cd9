"""How episodes begin and end."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .arguments import check_order, real

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int64]
#: A start as the native part takes it: offset, heading, speed, index of the vehicle, along.
GivenStart = tuple[float, float, float, int, float]


class Ends(NamedTuple):
    """The episodes that the last step ended, k of them."""

    envs: Ints
    """Index of each truck, ``[k]``."""
    codes: Ints
    """Why, as :class:`Ended`, ``[k]``."""
    routes: Ints
    """Index of its route in ``Batch.route_names``, ``[k]``."""
    observations: Floats
    """The observation after the last action, ``[k, n_values]``."""
    vehicles: Ints
    """Index of its vehicle in ``Batch.vehicle_classes``, ``[k]``."""


class Start(NamedTuple):
    """How a truck begins its route; the zeros are the first vehicle on the lane's centre at the first waypoint."""

    offset: float = 0.0
    """Lateral offset as a fraction of the benchmark's largest, in ``-1..1``, left positive."""
    heading: float = 0.0
    """Heading error as a fraction of the benchmark's largest, in ``-1..1``, counter-clockwise positive."""
    speed: float = 0.0
    """Where in the benchmark's range of speeds at the start: -1 the lowest, 0 the middle, 1 the highest."""
    vehicle: int | tuple[str, str] = 0
    """Index of the vehicle in ``Batch.vehicle_classes``, or its class, one of ``Batch.classes``: that class's first."""
    along: float = 0.0
    """Fraction of the route that lies behind, in ``0..1``: the truck begins at the nearest waypoint, the last but one
    at most; ``k / (n - 1)`` is waypoint ``k`` of ``n``, see :meth:`Batch.road`. Both units stand there as if the truck
    had followed the lane, with the wheels and the lean that a bend asks for, and the clock begins: the time limit is
    that of the whole route. The start is not judged: a truck that touches a kerb there ends with its first step."""


def start_of(name: str, given: Iterable[Any]) -> Start:
    """A start, or a tuple of its first values, with floats for its numbers."""
    needed = "a tuple of offset, heading error, speed, vehicle and along is needed, see offtrack_sim.Start"
    try:
        check_order(name, given, needed)
        start = Start(*given)
        return start._replace(
            offset=real(f"{name}.offset", start.offset, "lie in -1..1"),
            heading=real(f"{name}.heading", start.heading, "lie in -1..1"),
            speed=real(f"{name}.speed", start.speed, "lie in -1..1"),
            along=real(f"{name}.along", start.along, "lie in 0..1"),
        )
    except TypeError:
        raise TypeError(f"{name}: {given!r}; {needed}") from None
