"""Infos of numbers alone, for wrappers that turn every array into a tensor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.wrappers.vector import ArrayConversion

import offtrack_sim

MODES = ["same_step", "next_step", "disabled"]


def assert_numbers(infos: Any) -> None:
    for value in infos.values():
        if isinstance(value, dict):
            assert_numbers(value)
        else:
            assert isinstance(value, np.ndarray) and value.dtype.kind in "bif"


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("scenario", ["attard2023", "laden2026"])
def test_infos_of_numbers_say_what_infos_of_names_say(scenario: str, mode: str) -> None:
    numeric, named = (
        offtrack_sim.make_vec(scenario, num_envs=16, autoreset_mode=mode, numeric_infos=is_numeric)
        for is_numeric in (True, False)
    )
    # The wrapper under NumpyToTorch, which refuses arrays of objects.
    wrapped = ArrayConversion(numeric, env_xp=np, target_xp=np)
    batch = numeric.batch
    numbers, names = wrapped.reset(seed=3)[1], named.reset(seed=3)[1]
    assert_told_alike(batch, numbers, names)
    n_told = 0
    for _ in range(150):
        numbers, names = wrapped.step(np.full(16, 3))[4], named.step(np.full(16, 3))[4]
        assert_numbers(numbers)
        assert_told_alike(batch, numbers, names)
        n_told += bool(names)
        if mode == "disabled" and (done := names.get("_ended", np.zeros(16, bool))).any():
            options = {"reset_mask": done}
            assert_told_alike(batch, numeric.reset(options=options)[1], named.reset(options=options)[1])
    assert 5 < n_told


def assert_told_alike(batch: offtrack_sim.Batch, numbers: dict[str, Any], names: dict[str, Any]) -> None:
    assert ("route" in numbers) == ("route" in names)
    if "final_info" in names:
        mask = names["_final_obs"]
        assert (numbers["_final_obs"] == mask).all()
        assert (numbers["final_obs"][mask] == np.stack(names["final_obs"][mask])).all()
        assert not numbers["final_obs"][~mask].any()
        assert_told_alike(batch, numbers["final_info"], names["final_info"])
    if "route" in names:
        mask = names["_route"]
        assert (numbers["_route"] == mask).all()
        assert [batch.route_names[route] for route in numbers["route"][mask]] == names["route"][mask].tolist()
        if "vehicle" in names:
            classes = [batch.classes[index] for index in batch.vehicle_classes[numbers["vehicle"][mask]]]
            assert classes == list(zip(names["vehicle"][mask], names["load"][mask]))


def test_infos_of_one_truck_are_numbers_too() -> None:
    env = offtrack_sim.Roundabout(numeric_infos=True)
    info = env.reset(seed=1)[1]
    route = offtrack_sim.Roundabout().reset(seed=1)[1]["route"]
    assert set(map(type, info.values())) == {int} and env.batch.route_names[info["route"]] == route
    done = False
    while not done:
        *_, terminated, truncated, info = env.step(np.int64(0))
        done = terminated or truncated
    assert info.keys() == {"ended", "is_success", "route", "vehicle"}
