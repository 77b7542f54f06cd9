"""The state of a batch, checked before the native part takes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from .layout import COLUMNS


def check_world(scenario: str, found: npt.ArrayLike, fingerprint: int, alike: str) -> None:
    """An error where a state is of another world than this one of a benchmark; ``alike`` is what makes a world."""
    if np.asarray(found).reshape(-1).tolist() != [fingerprint]:
        raise ValueError(
            f"scenario: {scenario} has changed since this state was kept, or is another one here; {alike} must be alike"
        )


def checked_state(
    state: Mapping[str, npt.NDArray[Any]], num_envs: int, scenario: str, fingerprint: int
) -> tuple[list[tuple[str, npt.NDArray[np.uint8]]], list[tuple[int, int]]]:
    """The bytes of each column and the stream of each truck, if they are what ``Batch.state()`` gives of so many
    trucks in this world of a benchmark."""
    if not isinstance(state, Mapping):
        raise TypeError(f"state: {type(state).__name__}; what Batch.state() gives is needed")
    names = [*COLUMNS, "stream", "world"]
    missing = [name for name in names if name not in state]
    if missing:
        raise ValueError(f"state: {missing[0]} is missing; Batch.state() gives all of {', '.join(names)}")
    check_world(scenario, state["world"], fingerprint, "benchmark file, routes or split, and max_episode_steps")
    columns = []
    for name, dtype in COLUMNS.items():
        column = np.asarray(state[name])
        # Which columns have no rows is known where they are stored.
        n = num_envs if column.size else 0
        if column.dtype != dtype.base or column.shape != (n, *dtype.shape):
            needed = f"{dtype.base} of shape {(num_envs, *dtype.shape)}"
            raise ValueError(f"{name}: {column.dtype} of shape {column.shape}; {needed} is needed")
        columns.append((name, np.ascontiguousarray(column).reshape(-1).view(np.uint8)))
    stream = np.asarray(state["stream"])
    if stream.shape != (num_envs, 2) or stream.dtype.kind not in "iu":
        needed = f"integers of shape {(num_envs, 2)}"
        raise ValueError(f"stream: {stream.dtype} of shape {stream.shape}; {needed} are needed")
    outside = stream[(stream < 0) | (stream >= 2**32)] if stream.dtype != np.uint32 else stream[:0]
    if outside.size:
        raise ValueError(f"stream: {outside.flat[0]}; must lie in 0..{2**32 - 1}")
    return columns, [(seed, env) for seed, env in stream.tolist()]
