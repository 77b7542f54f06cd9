"""Benchmarks: those that come with the package, as texts, keys and files to change; and ones of your own."""

from __future__ import annotations

import copy
import itertools
import json
import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _offtrack
from .arguments import file_name, text

#: A step of a key: a name, or an index in brackets.
STEP = re.compile(r"([A-Za-z0-9_-]+)|\[(\d+)\]")
#: Name of a benchmark that was given as a dict.
OWN = "own"


class Benchmark:
    """A benchmark in memory. What takes a benchmark's name or file takes one of these too, and a dict of its keys.

    Args:
        keys: Its keys as ``scenarios/README.md`` of the project lists them, a dict of tables, or the text of a
            benchmark file (TOML). Files that it names come with the package (``"vehicles/daf_xf.toml"``,
            ``"roundabouts/16m.toml"``) or lie relative to ``folder``.
        name: Its name, for results and policies.
        folder: Folder that paths in it are relative to, in place of the package's files; None for these, and for others
            the process's folder.

    A text is read when trucks are made: errors name the key, its value and what would do, as :class:`ScenarioError`.

    Raises:
        TypeError: For keys that are no text or dict, and for a value that TOML has no type for.
        ValueError: For a value that is None or not finite; the message names its key.
    """

    def __init__(
        self, keys: str | Mapping[str, Any], name: str = OWN, *, folder: str | os.PathLike[str] | None = None
    ) -> None:
        self.name = text("name", name)
        if isinstance(keys, str):
            self.text = text("keys", keys)
        elif isinstance(keys, Mapping):
            self.text = _offtrack.scenario_of_keys(json.dumps(_plain("", keys)))
        else:
            raise TypeError(f"keys: {keys!r}; a dict of keys or the text of a benchmark file is needed")
        self.folder = None if folder is None else os.path.abspath(file_name(folder, "folder"))

    name: str
    """Its name."""
    text: str
    """Its text, TOML."""
    folder: str | None
    """The folder that its paths are relative to; None for the package's files."""

    @property
    def keys(self) -> dict[str, Any]:
        """Its keys as they are written: a dict of tables, numbers, texts and lists.

        Raises:
            ScenarioError: For a text that is no TOML.
        """
        return json.loads(_offtrack.scenario_keys(self.name, self.text))  # type: ignore[no-any-return]

    def changed(self, changes: Mapping[str, Any], *, name: str = OWN) -> Benchmark:
        """Another benchmark with some keys changed: ``{"actions.speeds_kmh": [20.0], "reward.clearance": -2.0}``.

        Args:
            changes: A value for each key. A key is written with dots, and with an index where it is one of several
                tables: ``"roundabout[0].train"``, counted before any is removed. A table that is not there is made;
                None removes a key.
            name: Name of the other benchmark.

        Raises:
            KeyError: For an index that there is not, and a key of what is no table.
            TypeError, ValueError: For values as above.
        """
        if not isinstance(changes, Mapping):
            raise TypeError(f"changes: {changes!r}; a dict of a value for each key is needed")
        keys = self.keys
        for key, value in changes.items():
            _change(keys, text("key", key), value)
        return Benchmark(_without_removed(keys), name, folder=self.folder)

    def write(self, file: str | os.PathLike[str]) -> None:
        """Writes its text, for the command line; the files that it names are looked for beside it."""
        Path(file_name(file)).write_text(self.text, encoding="utf-8", newline="\n")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Benchmark):
            return NotImplemented
        return (self.name, self.text, self.folder) == (other.name, other.text, other.folder)

    def __hash__(self) -> int:
        return hash((self.name, self.text, self.folder))

    def __repr__(self) -> str:
        return f"Benchmark({self.name!r})"


#: Stands where an entry of a list was.
_REMOVED = object()

#: A benchmark's name, the path of its file, a benchmark in memory, or its keys.
Scenario = str | os.PathLike[str] | Benchmark | Mapping[str, Any]
#: The same as the native part takes it: a name or path, or a name, a text and a folder.
Given = str | tuple[str, str, str | None]


def benchmark(scenario: str | os.PathLike[str]) -> Benchmark:
    """A benchmark to read and to change: one that comes with the package by its name, or one of a file.

    >>> slow = benchmark("attard2023").changed({"actions.speeds_kmh": [20.0]}, name="slow")
    >>> batch = offtrack_sim.Batch(slow, num_envs=64)

    Raises:
        ValueError: For an unknown name; the message lists those there are.
        ScenarioError: For a file that cannot be read.
    """
    source = _source(scenario)
    is_file = _is_file(source)
    folder = os.path.dirname(os.path.abspath(source)) if is_file else None
    return Benchmark(_offtrack.scenario_text(source), Path(source).stem if is_file else source, folder=folder)


def given(scenario: Scenario) -> Given:
    """A benchmark as the native part takes it."""
    if isinstance(scenario, Mapping):
        scenario = Benchmark(scenario)
    if isinstance(scenario, Benchmark):
        return scenario.name, scenario.text, scenario.folder
    return _source(scenario)


def kept(scenario: Scenario) -> str | Benchmark:
    """The same for a pickle: a relative path is found from another folder too."""
    if isinstance(scenario, Benchmark):
        return scenario
    if isinstance(scenario, Mapping):
        return Benchmark(scenario)
    source = _source(scenario)
    return os.path.abspath(source) if _is_file(source) else source


def kept_routes(names: list[str] | None) -> list[str] | None:
    """Names of routes for a pickle: roads of files by paths that are found from another folder too."""
    return None if names is None else [os.path.abspath(name) if ".toml" in name else name for name in names]


def whole(scenario: Scenario) -> Benchmark:
    """The same as a benchmark in memory."""
    if isinstance(scenario, Benchmark):
        return scenario
    return Benchmark(scenario) if isinstance(scenario, Mapping) else benchmark(scenario)


def _source(scenario: str | os.PathLike[str]) -> str:
    needed = "the name of a benchmark, the path of its file, a Benchmark or a dict of its keys is needed"
    try:
        return text("scenario", os.fspath(scenario))
    except TypeError:
        raise TypeError(f"scenario: {scenario!r}; {needed}") from None


def _is_file(source: str) -> bool:
    is_named = source in _offtrack.scenario_names()
    return not is_named and (source.endswith(".toml") or os.path.isfile(source))


def _plain(key: str, value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, Mapping):
        below = f"{key}." if key else ""
        return {text("key", name): _plain(f"{below}{name}", inner) for name, inner in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(f"{key}[{index}]", inner) for index, inner in enumerate(value)]
    if value is None:
        raise ValueError(f"{key}: None; leave the key out")
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if not isinstance(value, str | bool | int | float):
        raise TypeError(f"{key}: {value!r}; a number, a text, a list or a table is needed")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{key}: {value}; must be finite")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError(f"{key}: an integer of {value.bit_length()} bits; at most 63 and a sign are read")
    return text(key, value) if isinstance(value, str) else value


def _without_removed(value: Any) -> Any:
    """A value without the entries of lists that were removed."""
    if isinstance(value, dict):
        return {name: _without_removed(inner) for name, inner in value.items()}
    if isinstance(value, list):
        return [_without_removed(inner) for inner in value if inner is not _REMOVED]
    return value


def _change(keys: dict[str, Any], key: str, value: Any) -> None:
    """Sets a key, which is written with dots and brackets, or removes it."""
    steps: list[str | int] = [name or int(index) for name, index in STEP.findall(key)]
    written = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps)
    if not steps or written.removeprefix(".") != key:
        raise KeyError(f"{key}: must be names with dots, and indices in brackets: roundabout[0].train")
    place: Any = keys
    for step, following in itertools.pairwise(steps):
        if isinstance(step, str) and isinstance(place, dict):
            if value is None and step not in place:
                return
            place = place.setdefault(step, [] if isinstance(following, int) else {})
        elif isinstance(step, int) and isinstance(place, list) and step < len(place):
            place = place[step]
        else:
            raise KeyError(f"{key}: there is no such table")
    last = steps[-1]
    if isinstance(last, str) and isinstance(place, dict):
        if value is None:
            place.pop(last, None)
        else:
            place[last] = copy.deepcopy(value)
    elif isinstance(last, int) and isinstance(place, list) and last < len(place) and value is not None:
        place[last] = copy.deepcopy(value)
    elif isinstance(last, int) and isinstance(place, list) and last < len(place):
        # Indices of the changes that follow are those of the tables as they were.
        place[last] = _REMOVED
    else:
        raise KeyError(f"{key}: there is no such table")


def write_scenarios(folder: str | os.PathLike[str]) -> list[Path]:
    """Writes every scenario file that comes with the package below a folder, and returns their paths.

    A copy is a benchmark of its own once it is changed and has another name: ``Batch("folder/mine.toml", ...)``. Its
    roundabouts, vehicles and distributions are the files beside it. ``scenarios/README.md`` of the project explains
    every key. Files that are there already with the same text are left alone.

    Raises:
        FileExistsError: Where a file is there with another text. Nothing is written then.
        OSError: Where a file cannot be read or written.
    """
    below = Path(file_name(folder, "folder"))
    files = [(below / path, contents) for path, contents in _offtrack.scenario_files()]
    for file, contents in files:
        if file.exists() and file.read_text(encoding="utf-8") != contents:
            raise FileExistsError(f"folder: {file} is there with another text; another folder is needed")
    for file, contents in files:
        if not file.exists():
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(contents, encoding="utf-8", newline="\n")
    return [file for file, _ in files]
