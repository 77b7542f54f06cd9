"""Episodes as a data set of Minari: run by run.py."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[2] / "examples"))


# Minari warns where a data set has no address of its code.
@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", ["attard2023", "laden2026"])
def test_episodes_are_written_and_read_back_by_minari_itself(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    minari = pytest.importorskip("minari")
    import minari_dataset

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    arguments = ["minari_dataset.py", "--policy", name, "--benchmark", name, "--trucks", "4", "--episodes", "2"]
    monkeypatch.setattr(sys, "argv", arguments)
    minari_dataset.main()
    assert f"offtrack/{name}-{name}-v0: 8 episodes" in capsys.readouterr().out
    dataset = minari.load_dataset(f"offtrack/{name}-{name}-v0")
    episode = dataset[0]
    assert len(episode.observations) == len(episode.actions) + 1
    assert episode.terminations[-1] or episode.truncations[-1]
