"""What codes, observations and columns are made of, as the simulator declares it."""

from __future__ import annotations

import enum
from typing import Any, NamedTuple

import numpy as np

from . import _offtrack


class Ended(enum.IntEnum):
    """Why an episode ended. Failure wins over arrival, everything wins over the time limit."""

    RUNNING = 0
    ARRIVED = 1
    TRACTOR_COLLIDED = 2
    TRAILER_COLLIDED = 3
    ROLLED_OVER = 4
    JACKKNIFED = 5
    STRAYED = 6
    TIMED_OUT = 7
    MET_VEHICLE = 8
    """The truck is at fault of a contact with another vehicle."""
    WAS_MET = 9
    """The other vehicle is at fault: no failure of the truck."""


assert [ended.name.lower() for ended in Ended] == _offtrack.end_codes()


class Values(NamedTuple):
    """Neighbouring values of an observation that measure the same thing."""

    name: str
    """Name of the group."""
    first: int
    """Index of its first value."""
    n: int
    """Number of its values."""
    low: float
    """The least that they can be: 0, of angles -1. The largest is 1."""
    doc: str
    """What each value is, what it is divided by, and where it is limited."""


OBSERVATION: tuple[Values, ...] = tuple(Values(*values) for values in _offtrack.observation_groups())
"""What each of the 69 values of an observation is, group by group."""

EXTRAS: tuple[Values, ...] = tuple(Values(*values) for values in _offtrack.extra_groups())
"""What may stand behind these values, a value each: a benchmark with extras has the first so many, ``Batch.extras``."""

VEHICLES: tuple[Values, ...] = tuple(Values(*values) for values in _offtrack.vehicle_groups())
"""What is observed of other vehicles, group by group, where ``Batch.observes_vehicles``: the last 42 values of an
observation. ``first`` counts from the first of them."""


def _dtype(fields: list[tuple[str, str, int, str]], n: int) -> np.dtype[Any]:
    def typed(kind: str, length: int) -> np.dtype[Any]:
        return np.dtype((kind, (length,))) if length else np.dtype(kind)

    if len(fields) == 1 and not fields[0][0]:
        return typed(fields[0][1], n)
    record = np.dtype([(name, typed(kind, length)) for name, kind, length, _ in fields])
    return np.dtype((record, (n,))) if n else record


COLUMNS: dict[str, np.dtype[Any]] = {name: _dtype(fields, n) for name, fields, n, _ in _offtrack.column_layouts()}
"""Every column of a batch and the type of a row: a number, an array of numbers, or a record with named fields."""

COLUMN_DOCS: dict[str, str] = {
    place: doc
    for column, fields, _, about in _offtrack.column_layouts()
    for place, doc in [(column, about), *((f"{column}.{field}", doc) for field, _, _, doc in fields if field)]
}
"""What each column and each field of a record is, with its unit: ``COLUMN_DOCS["truck.speed"]``."""
