"""Other vehicles around the trucks: traffic2026 observes 42 values of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import offtrack_sim
from offtrack_sim import OBSERVATION, VEHICLES, Batch, Policy, export, make_vec

N = 16


def test_what_is_observed_of_vehicles_stands_behind_the_69_values() -> None:
    batch = Batch("traffic2026", N, seed=1, routes=["20m"])
    assert batch.observes_vehicles and batch.extras == [] and batch.n_values == 69 + 42
    assert [values.first for values in VEHICLES] == np.cumsum([0, *(values.n for values in VEHICLES)])[:-1].tolist()
    assert sum(values.n for values in VEHICLES) == 42 and {values.low for values in VEHICLES} == {0.0, -1.0}
    n_there = 0
    for _ in range(60):
        actions = np.full(N, 13)
        observation, *_ = batch.step(actions)
        columns = batch.columns("observation", "around")
        assert (observation == np.concatenate([columns["observation"], columns["around"]], axis=1)).all()
        first = 69 + next(values.first for values in VEHICLES if values.name == "vehicle")
        n_there += int(observation[:, first : first + 6].sum())
        ends = batch.ended()
        if ends is not None:
            last = batch.columns("next_observation", "next_around")
            expected = np.concatenate([last["next_observation"], last["next_around"]], axis=1)[ends.envs]
            assert (ends.observations == expected).all()
    assert 1000 < n_there


def test_environments_have_a_space_of_all_values_and_stay_in_it() -> None:
    trucks = make_vec("traffic2026", 4, routes=["20m"])
    assert trucks.single_observation_space.shape == (111,) and trucks.single_action_space.n == 36  # type: ignore[attr-defined]
    observations, _ = trucks.reset(seed=3)
    for _ in range(50):
        assert all(row in trucks.single_observation_space for row in observations)
        observations, *_ = trucks.step(trucks.action_space.sample())
    single = offtrack_sim.Roundabout("traffic2026", routes=["20m"])
    assert single.reset(seed=3)[0].shape == (111,)
    low = single.observation_space.low  # type: ignore[attr-defined]
    assert low.tolist() == [values.low for values in (*OBSERVATION, *VEHICLES) for _ in range(values.n)]


def test_a_picture_shows_vehicles() -> None:
    pictures = []
    for name in ("attard2023", "traffic2026"):
        batch = Batch(name, 1, seed=1, routes=["20m"])
        pictures.append(batch.render(0, 400))
    car = np.array([0x5A, 0x78, 0x87])
    counts = [int((np.abs(picture.astype(int) - car).max(axis=2) < 4).sum()) for picture in pictures]
    assert counts[0] == 0 and 50 < counts[1]


def test_a_policy_of_python_that_observes_vehicles_is_written_and_drives(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    layers = [(0.1 * rng.standard_normal((n, m)), np.zeros(m)) for n, m in ((111, 16), (16, 36))]
    file = tmp_path / "policy.safetensors"
    export.save(file, layers, scenario="traffic2026")
    policy = Policy.load(file)
    batch = Batch("traffic2026", N, seed=1, routes=["20m"])
    assert policy.vehicles and policy.extras == []
    policy.check(batch)
    assert policy.act(batch.observation()).shape == (N,)
    with pytest.raises(ValueError, match="111 are needed, those of other vehicles last"):
        policy.act(batch.observation()[:, :69])
    with pytest.raises(ValueError, match="observes other vehicles, which attard2023 does not"):
        policy.check(Batch("attard2023", 1))
    with pytest.raises(ValueError, match="observes no other vehicles, as traffic2026 does"):
        Policy.shipped("attard2023").check(batch)
