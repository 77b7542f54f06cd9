"""A policy drives the multibody truck of the examples, which no policy was trained in."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

if sys.version_info < (3, 11):
    pytest.skip("the truck's files are read by Python 3.11 or later", allow_module_level=True)
pytest.importorskip("mujoco")

import mujoco_truck

import offtrack_sim


class Recorded:
    """Trucks that note what they are asked for."""

    def __init__(self) -> None:
        self.steering: list[float] = []

    def advance(self, steering: Any, acceleration: Any, steps: int) -> None:
        self.steering += [float(steering[0])] * steps


@pytest.mark.parametrize(("delay", "late"), [(0.0, 0), (0.05, 5), (0.1, 10), (0.25, 25)])
def test_a_steer_command_arrives_after_the_delay(delay: float, late: int) -> None:
    trucks, given = Recorded(), mujoco_truck.Late(delay, 0.01, 0.1)
    for step in range(1, 5):
        given.drive(trucks, np.array([float(step)]), np.zeros(1))  # type: ignore[arg-type]
    expected = [0.0] * late + [float(1 + step // 10) for step in range(40)]
    assert trucks.steering == expected[:40]


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> None:
    monkeypatch.setattr(sys, "argv", ["mujoco_truck.py", *arguments])
    mujoco_truck.main()


def test_laden2026_drives_a_laden_multibody_truck_to_the_end_of_its_routes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pytest.importorskip("PIL")
    file, film = tmp_path / "truck.json", tmp_path / "truck.gif"
    routes = "20m/E-left-2", "20m/N-right-1"
    run(monkeypatch, "--routes", *routes, "--starts", "2", "--json", str(file), "--film", str(film))
    found = json.loads(file.read_text())
    assert found["routes"] == list(routes)
    laden = found["loads"]["laden"]
    assert (laden["arrived"], laden["episodes"], laden["arrived_in_simulator"]) == (4, 4, 4)
    assert laden["failures"] == {} and 0.2 < laden["load_transfer_ratio_max"] < 0.9
    assert "| laden | 100.0% | 100.0% (4 of 4) |" in capsys.readouterr().out
    assert film.read_bytes()[:6] == b"GIF89a"


def test_a_film_draws_the_distances_where_an_observation_has_them() -> None:
    ranges = [group for group in offtrack_sim.OBSERVATION if group.name.endswith("_range")]
    places = [place for group in ranges for place in range(group.first, group.first + group.n)]
    assert places == list(range(69))[mujoco_truck.RANGES]


def test_the_same_seed_drives_the_same_and_ice_ends_an_episode(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def driven(*arguments: str) -> dict[str, Any]:
        file = tmp_path / "truck.json"
        run(monkeypatch, "--routes", "20m/E-left-3", "--starts", "2", "--json", str(file), *arguments)
        loads: dict[str, Any] = json.loads(file.read_text())["loads"]
        return loads

    assert driven("--seed", "3") == driven("--seed", "3") != driven("--seed", "4")
    ice = driven("--mu", "0.1")["laden"]
    assert ice["arrived"] == 0 and ice["failed"] == {"20m/E-left-3": 2}


def test_a_truck_or_a_policy_that_is_not_there_is_refused_with_what_is(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="--vehicle: us_wb62; attard2023 has a trailer with a wheelbase of 7.756 m"):
        run(monkeypatch, "--policy", "attard2023", "--load", "empty", "--vehicle", "us_wb62", "--starts", "1")
    with pytest.raises(SystemExit, match="policy: none; the program comes with"):
        run(monkeypatch, "--policy", "none")
    with pytest.raises(SystemExit, match="benchmark: distil_roads; .*; --benchmark names another one"):
        run(monkeypatch, "--policy", "attard2023-lane", "--load", "empty")
    with pytest.raises(SystemExit):
        run(monkeypatch, "--film", "film.xyz")
    assert "--film: a name that ends in .gif is needed" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="Is a directory"):
        run(monkeypatch, "--json", str(tmp_path))
    with pytest.raises(SystemExit, match="--load: daf_xf laden_worst; laden2026 has daf_xf empty, daf_xf half"):
        run(monkeypatch, "--load", "laden_worst")
