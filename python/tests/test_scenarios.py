"""The benchmarks of the package as files."""

from pathlib import Path

import numpy as np
import pytest

import offtrack_sim


def stepped(scenario: str | Path) -> np.ndarray:
    batch = offtrack_sim.Batch(scenario, 32, seed=3)
    for _ in range(20):
        batch.step(np.arange(32) % len(batch.action_table))
    return np.array(batch.observation())


def test_written_scenarios_are_the_packages_own_and_can_be_changed_without_the_repository(tmp_path: Path) -> None:
    files = offtrack_sim.write_scenarios(tmp_path)
    names = {file.stem for file in files if file.parent == tmp_path}
    assert names == set(offtrack_sim.scenario_names())
    assert (stepped(tmp_path / "attard2023.toml") == stepped("attard2023")).all()
    text = (tmp_path / "attard2023.toml").read_text()
    slow = tmp_path / "slow.toml"
    slow.write_text(text.replace("speeds_kmh = [30.0]", "speeds_kmh = [15.0]"))
    assert not (stepped(slow) == stepped("attard2023")).all()


def test_files_that_are_there_are_left_alone_or_refused_before_anything_is_written(tmp_path: Path) -> None:
    assert offtrack_sim.write_scenarios(tmp_path) == offtrack_sim.write_scenarios(str(tmp_path))
    changed, gone = tmp_path / "attard2023.toml", tmp_path / "laden2026.toml"
    changed.write_text("mine")
    gone.unlink()
    with pytest.raises(FileExistsError, match=r"attard2023\.toml is there with another text; another folder"):
        offtrack_sim.write_scenarios(tmp_path)
    assert changed.read_text() == "mine" and not gone.exists()
    with pytest.raises(TypeError, match="file: 3; the path of a file is needed"):
        offtrack_sim.write_scenarios(3)  # type: ignore[arg-type]
