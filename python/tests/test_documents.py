"""The snippets of the documents run, in their order."""

from __future__ import annotations

import json
import re
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import offtrack_sim

DOCUMENTS = Path(__file__).parents[1]
# Run by tests/consumers, where the library is installed.
ELSEWHERE = "<!-- needs "


def snippets(document: str) -> list[str]:
    """The Python blocks of a document, or the cells of a notebook, that need no other library."""
    text = (DOCUMENTS / document).read_text()
    if document.endswith(".ipynb"):
        cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
        return ["".join(cell["source"]) for cell in cells if not cell["metadata"].get("tags")]
    parts = re.split(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    before, blocks = parts[0::2], parts[1::2]
    return [block for text, block in zip(before, blocks) if not text.rstrip().split("\n")[-1].startswith(ELSEWHERE)]


@pytest.mark.parametrize(("document", "n"), [("README.md", 10), ("TUTORIAL.ipynb", 5)])
def test_the_snippets_run(
    document: str, n: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    found = snippets(document)
    assert len(found) == n
    names: dict[str, Any] = {"__name__": "snippet"}
    for block in found:
        exec(compile(block, document, "exec"), names)
    printed = capsys.readouterr().out
    if document == "TUTORIAL.ipynb":
        assert "15 routes, the first is village/E-left-1" in printed
        assert "own test: 100.0% (60/60); arrived 60" in printed and "'is_success': True" in printed
        assert list(tmp_path.glob("films/*.mp4"))
    else:
        assert "attard2023 test: 100.0% (46/46); arrived 46" in printed


def test_the_tutorials_reward_is_that_of_the_step_that_was_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    roundabout, benchmark, _, own_reward, _ = snippets("TUTORIAL.ipynb")
    names: dict[str, Any] = {"__name__": "snippet"}
    for block in (roundabout, benchmark, own_reward):
        exec(compile(block, "TUTORIAL.ipynb", "exec"), names)
    envs = names["envs"]
    # The same trucks, of which none is replaced.
    batch = offtrack_sim.Batch("own.toml", 8, autoreset="disabled")
    leaned = 0.0
    for seed in range(4):
        envs.reset(seed=seed)
        batch.begin(streams=[(seed, env) for env in range(8)])
        while not batch.waiting().any():
            rewards = envs.step(np.full(8, 5))[1]
            batch.step(np.full(8, 5))
            columns = batch.columns("terms", "truck")
            terms, leaning = columns["terms"], abs(columns["truck"]["trailer_load_transfer_ratio"])
            expected = terms["waypoints"] - 0.1 * terms["lane_distance"] - 0.1 * leaning - 10.0 * terms["failure"]
            np.testing.assert_allclose(rewards, expected, atol=1e-6)
        leaned += float(leaning[batch.waiting()].sum())
        assert (envs.step(np.full(8, 5))[1][batch.waiting()] == 0).all()
    assert leaned > 0.1


def test_the_notebook_is_one_that_jupyter_opens_without_what_a_run_left() -> None:
    notebook = json.loads((DOCUMENTS / "TUTORIAL.ipynb").read_text())
    assert (notebook["nbformat"], notebook["metadata"]["kernelspec"]["name"]) == (4, "python3")
    names = [cell["id"] for cell in notebook["cells"]]
    assert len(set(names)) == len(names) and {cell["cell_type"] for cell in notebook["cells"]} == {"markdown", "code"}
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
    assert {tag for cell in code for tag in cell["metadata"].get("tags", [])} == {"needs-stable-baselines3"}


def test_the_wheel_has_the_licence_of_everything_in_it() -> None:
    whole = DOCUMENTS.parent / "LICENSES"
    found = {file.name: file for file in metadata.files("offtrack-sim") or [] if "licenses" in file.parts}
    names = {"MIT.txt", "Apache-2.0.txt", "Ubuntu-font-1.0.txt", "MIT-carla.txt", "MIT-zalazone.txt"}
    assert found.keys() == names
    for name, file in found.items():
        assert file.read_text() == (whole / name).read_text(), name
