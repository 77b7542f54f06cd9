"""The whole tutorial, with the training: run by run.py."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

TUTORIAL = Path(__file__).parents[2] / "TUTORIAL.ipynb"


def test_the_tutorial_runs_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    cells = json.loads(TUTORIAL.read_text())["cells"]
    blocks = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert len(blocks) == 7
    names: dict[str, Any] = {"__name__": "snippet"}
    for block in blocks:
        exec(compile(block, TUTORIAL.name, "exec"), names)
    printed = capsys.readouterr().out
    # The trained policy's evaluation comes after the shipped one's.
    assert printed.count("own test: ") == 2
    assert (tmp_path / "own.safetensors").is_file() and list(tmp_path.glob("films/*.mp4"))
