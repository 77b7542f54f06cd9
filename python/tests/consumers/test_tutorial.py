"""The whole tutorial, with the training: run by run.py."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

TUTORIAL = Path(__file__).parents[2] / "TUTORIAL.md"


def test_the_tutorial_runs_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", TUTORIAL.read_text(), flags=re.MULTILINE | re.DOTALL)
    assert len(blocks) == 7
    names: dict[str, Any] = {"__name__": "snippet"}
    for block in blocks:
        exec(compile(block, "TUTORIAL.md", "exec"), names)
    printed = capsys.readouterr().out
    # The trained policy's evaluation comes after the shipped one's.
    assert printed.count("own test: ") == 2
    assert (tmp_path / "own.safetensors").is_file() and list(tmp_path.glob("films/*.mp4"))
