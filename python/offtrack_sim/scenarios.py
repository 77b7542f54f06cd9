"""The benchmarks that come with the package, as files to change."""

from __future__ import annotations

import os
from pathlib import Path

from . import _offtrack
from .arguments import file_name


def write_scenarios(folder: str | os.PathLike[str]) -> list[Path]:
    """Writes every scenario file that comes with the package below a folder, and returns their paths.

    A copy is a benchmark of its own once it is changed and has another name: ``Batch("folder/mine.toml", ...)``. Its
    roundabouts, vehicles and distributions are the files beside it. ``scenarios/README.md`` of the project explains
    every key. Files that are there already with the same text are left alone.

    Raises:
        FileExistsError: Where a file is there with another text. Nothing is written then.
        OSError: Where a file cannot be read or written.
    """
    below = Path(file_name(folder))
    files = [(below / path, text) for path, text in _offtrack.scenario_files()]
    for file, text in files:
        if file.exists() and file.read_text(encoding="utf-8") != text:
            raise FileExistsError(f"folder: {file} is there with another text; another folder is needed")
    for file, text in files:
        if not file.exists():
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8", newline="\n")
    return [file for file, _ in files]
