"""Arguments, checked: each error names the argument, the value and what would do."""

from __future__ import annotations

import enum
import itertools
import operator
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Set
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

#: Those of ``gymnasium.vector.AutoresetMode``, which there is from gymnasium 1.1 on.
MODES = ("next_step", "same_step", "disabled")
#: Most names of routes that a batch takes: more than any benchmark has routes.
MOST_NAMES = 10_000_000
#: Most names of values that a policy reads: more than there are.
MOST_VALUES = 1000


def mode_name(name: str, mode: str | enum.Enum) -> str:
    """``"next_step"`` for ``AutoresetMode.NEXT_STEP`` or its name, and so on."""
    given = mode.name if isinstance(mode, enum.Enum) else text(name, mode)
    if given.lower() not in MODES:
        raise ValueError(f'{name}: "{given}"; must be one of {", ".join(MODES)}')
    return given.lower()


def checked_seed(seed: int) -> int:
    """The seed, if it lies in ``0..2**32``."""
    return within("seed", seed, 0, 2**32)


def file_name(file: str | os.PathLike[str], name: str = "file") -> str:
    """The path of a file or folder as text."""
    try:
        return text(name, os.fspath(file))
    except TypeError:
        raise TypeError(f"{name}: {file!r}; the path of a {name} is needed") from None


def checked_integer(name: str, value: int) -> int:
    """The value as an integer, if it is one: True and False are none, of which a list would be a mask."""
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: {value!r}; an integer is needed") from None


def within(name: str, value: int, low: int, high: int) -> int:
    """The value as an integer, if it lies in ``low..high``, the last not included."""
    index = checked_integer(name, value)
    if not low <= index < high:
        raise ValueError(f"{name}: {index}; must lie in {low}..{high - 1}")
    return index


def check_commands(name: str, commands: npt.NDArray[Any]) -> None:
    """An error for the first of some numbers that lies outside -1..1, as they were given: none is rounded before."""
    outside = np.argwhere(~(abs(commands) <= 1))
    if len(outside):
        index = tuple(int(i) for i in outside[0])
        raise ValueError(f"{name}[{', '.join(map(str, index))}]: {commands[index]}; must lie in -1..1")


def check_order(name: str, given: object, needed: str) -> None:
    """An error for what has no order of its own, such as a set, and for bytes, which are no list of numbers."""
    if isinstance(given, Set | Mapping | bytes | bytearray | memoryview):
        raise TypeError(f"{name}: {type(given).__name__}; {needed}")


def begun(name: str, given: Iterable[Any], most: int, needed: str) -> list[Any]:
    """The first ``most`` things of what is given, however long it is."""
    try:
        return list(itertools.islice(given, most))
    except TypeError:
        raise TypeError(f"{name}: {given!r}; {needed}") from None


def names_of(routes: Iterable[str]) -> list[str]:
    """Names of routes as a list."""
    if isinstance(routes, str):
        return [text("routes", routes)]
    check_order("routes", routes, "a sequence is needed: random roads and roads of files stand in its order")
    needed = "names of routes or roundabouts are needed"
    names = begun("routes", routes, MOST_NAMES + 1, needed)
    if len(names) > MOST_NAMES:
        raise ValueError(f"routes: more than {MOST_NAMES} names")
    wrong = next((name for name in names if not isinstance(name, str)), None)
    if wrong is not None:
        raise TypeError(f"routes: {wrong!r}; {needed}")
    return [text("routes", name) for name in names]


def names_of_values(values: Iterable[str]) -> list[str]:
    """Names of values as a list."""
    check_order("values", values, "a sequence is needed: a network reads them in its order")
    given = [values] if isinstance(values, str) else values
    names = begun("values", given, MOST_VALUES + 1, "names of values are needed")
    if len(names) > MOST_VALUES:
        raise ValueError(f"values: more than {MOST_VALUES} names")
    return [text("values", name) for name in names]


def text(name: str, value: object) -> str:
    """The value, if it is a text that can be written."""
    if not isinstance(value, str):
        raise TypeError(f"{name}: {value!r}; a text is needed")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{name}: {value!r} is no UTF-8") from None
    return value


def trucks_of(envs: Iterable[int], num_envs: int) -> list[int]:
    """Trucks that begin, each once: no more than there are, however long what was given is."""
    needed = "a sequence of indices of trucks is needed, or None for all"
    check_order("envs", envs, needed)
    given = begun("envs", envs, num_envs + 1, needed)
    if len(given) > num_envs:
        raise ValueError(f"envs: more than {num_envs} of them; the batch has as many trucks")
    indices = [checked_integer(f"envs[{index}]", env) for index, env in enumerate(given)]
    outside = next((env for env in indices if not 0 <= env < num_envs), None)
    if outside is not None:
        raise ValueError(f"envs: {outside}; the batch has trucks 0..{num_envs - 1}")
    if len(set(indices)) < len(indices):
        twice, _ = Counter(indices).most_common(1)[0]
        raise ValueError(f"envs: {twice} stands twice; a truck begins one episode at a time")
    return indices


def device_name(device: object) -> str:
    """A device as the native part takes it."""
    if text("device", device):
        return str(device)
    raise ValueError('device: \'\'; "cpu", "gpu" or part of an adapter\'s name is needed')


def numbers(name: str, value: npt.ArrayLike, needed: str) -> npt.NDArray[Any]:
    """The value as an array, if it is one of integers or real numbers."""
    try:
        found = np.asarray(value)
    except (TypeError, ValueError):
        found = np.array([""])
    if found.dtype.kind not in "fiu":
        raise TypeError(f"{name}: {type(value).__name__}; {needed}")
    if np.ma.is_masked(value):
        raise ValueError(f"{name}: some are masked; {needed}, and none of them masked")
    return found


def real(name: str, value: object, bounds: str) -> float:
    """A number as a float; texts and booleans, which ``float`` takes, are none."""
    if not isinstance(value, int | float | np.integer | np.floating) or isinstance(value, bool):
        raise TypeError(f"{name}: {value!r}; a number is needed")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{name}: too large for a float; must {bounds}") from None


def single(found: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    """Numbers as float32; those beyond it are infinite, without a warning."""
    with np.errstate(over="ignore"):
        return found.astype(np.float32, copy=False)


def is_sequence(given: object) -> TypeGuard[Sequence[Any]]:
    """Whether things stand in an order, one for each truck: not a text, bytes, a set or a dict."""
    is_text = isinstance(given, str | bytes | bytearray | memoryview)
    return isinstance(given, Sequence | np.ndarray) and not is_text and getattr(given, "ndim", 1) > 0


def check_length(name: str, given: Sequence[Any] | npt.NDArray[Any] | None, n: int) -> None:
    """An error unless there is one for each truck; before any of them is looked at."""
    if given is None:
        return
    if not is_sequence(given):
        raise TypeError(f"{name}: {given!r}; a sequence is needed, one a truck")
    if len(given) != n:
        raise ValueError(f"{name}: {len(given)} of them; {n} are needed, one a truck")


def stream_of(name: str, given: tuple[int, int] | None) -> tuple[int, int] | None:
    """A stream, if it is a pair of seed and index."""
    if given is None:
        return None
    needed = "a pair of seed and index is needed"
    check_order(name, given, needed)
    try:
        seed, env = given
    except (TypeError, ValueError):
        raise TypeError(f"{name}: {given!r}; {needed}") from None
    return within(f"{name}[0]", seed, 0, 2**32), within(f"{name}[1]", env, 0, 2**32)


def weights_of(weights: Mapping[str, float]) -> list[tuple[str, float]]:
    """Weights as the native part takes them."""
    if not isinstance(weights, Mapping):
        raise TypeError(f"weights: {weights!r}; a dict of numbers by name of route or roundabout is needed")
    pairs = []
    for name, weight in weights.items():
        if isinstance(weight, bool) or not isinstance(weight, int | float | np.integer | np.floating):
            raise TypeError(f"weights[{name!r}]: {weight!r}; a number is needed")
        try:
            pairs.append((text("weights", name), float(weight)))
        except OverflowError:
            raise ValueError(f"weights[{name!r}]: too large for a float; must lie in 0..1e6") from None
    return pairs
