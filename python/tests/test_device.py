"""A graphics device, real or in software, against the processor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import offtrack_sim
import offtrack_sim.export


@pytest.fixture(scope="module")
def device() -> str:
    """The first device there is: tests need one, as those of the simulator with the feature gpu do."""
    return offtrack_sim.Batch(num_envs=1, device="gpu").device


def test_a_device_and_the_processor_drive_the_same_episodes(device: str) -> None:
    name = device.split(" (")[0]
    for mode in ("same_step", "next_step"):
        here = offtrack_sim.make_vec(num_envs=96, autoreset_mode=mode)
        there = offtrack_sim.make_vec(num_envs=96, autoreset_mode=mode, device=name[: len(name) // 2])
        assert there.batch.device == device
        one, other = here.reset(seed=3), there.reset(seed=3)
        assert np.allclose(one[0], other[0], atol=1e-4)
        rng = np.random.default_rng(1)
        for step in range(150):
            actions = rng.integers(0, 9, 96)
            one_step, other_step = here.step(actions), there.step(actions)
            # Sensors of 20 m that meet a kerb at a small angle differ by centimetres.
            assert np.allclose(one_step[0], other_step[0], atol=2e-3), step
            assert (one_step[2] == other_step[2]).all() and (one_step[3] == other_step[3]).all()
            assert np.allclose(one_step[1], other_step[1], atol=1e-2)
            assert one_step[4].keys() == other_step[4].keys()
        assert here.batch.tally()["episodes"] == there.batch.tally()["episodes"] > 100


def test_a_device_and_the_processor_observe_the_same_extras(device: str) -> None:
    here = offtrack_sim.Batch("laden2026", 64, seed=5)
    there = offtrack_sim.Batch("laden2026", 64, seed=5, device="gpu")
    assert here.extras == there.extras and (here.vehicles() == there.vehicles()).all()
    assert np.allclose(here.observation()[:, 69:], there.observation()[:, 69:], atol=1e-5)
    rng = np.random.default_rng(1)
    n_ends = 0
    for step in range(60):
        actions = rng.integers(0, 45, 64)
        one, other = here.step(actions), there.step(actions)
        # A software device and the processor differ by 4e-7.
        assert np.allclose(one[0][:, 69:], other[0][:, 69:], atol=1e-5), step
        ends, others = here.ended(), there.ended()
        assert (ends is None) == (others is None), step
        if ends is not None and others is not None:
            n_ends += len(ends.envs)
            assert (ends.vehicles == others.vehicles).all() and ends.observations.shape == (len(ends.envs), 77)
            assert np.allclose(ends.observations[:, 69:], others.observations[:, 69:], atol=1e-5), step
    assert 20 < n_ends


def test_an_unknown_device_is_refused_with_those_there_are(device: str) -> None:
    with pytest.raises(RuntimeError) as caught:
        offtrack_sim.Batch(device="no such card")
    assert "no such card" in str(caught.value) and device.split(" (")[0] in str(caught.value)


@pytest.mark.parametrize("benchmark", ["attard2023", "laden2026"])
def test_a_policy_on_a_device_ends_every_episode_as_on_the_processor(device: str, benchmark: str) -> None:
    policy = offtrack_sim.Policy.shipped(benchmark)
    here, there = (offtrack_sim.evaluate(policy, benchmark, episodes=1, seed=4, device=d) for d in ("cpu", device[:8]))
    assert (here.ended == there.ended).all() and 20 < here.ended.size


def test_a_policy_too_wide_for_a_device_is_refused_by_name(device: str, tmp_path: Path) -> None:
    wide = tmp_path / "wide.safetensors"
    weights = [np.zeros((69, 1025), np.float32), np.zeros((1025, 9), np.float32)]
    offtrack_sim.export.save(wide, [(weight, np.zeros(weight.shape[1], np.float32)) for weight in weights])
    policy = offtrack_sim.Policy.load(wide)
    with pytest.raises(ValueError, match=r"wide\.safetensors: is a policy too wide for a device: actor\.0 has 1025"):
        offtrack_sim.evaluate(policy, episodes=1, device="gpu")


def test_a_policy_with_a_memory_drives_the_trucks_of_a_device_from_the_processor(device: str, tmp_path: Path) -> None:
    shipped = offtrack_sim.Policy.shipped()
    network = offtrack_sim.export.network(shipped)
    weights, biases = network.layers[0]
    # Of two frames it heeds the last.
    first = np.concatenate([np.zeros_like(weights), weights]), biases
    offtrack_sim.export.save(tmp_path / "two", replace(network, layers=[first, *network.layers[1:]], frames=2))
    two = offtrack_sim.Policy.load(tmp_path / "two")
    here = offtrack_sim.evaluate(shipped, episodes=1, seed=4)
    there = offtrack_sim.evaluate(two, episodes=1, seed=4, device="gpu")
    assert two.has_memory and (here.table["steps"] == there.table["steps"]).all()
    assert np.allclose(here.table["lane_distance_mean"], there.table["lane_distance_mean"], atol=1e-3)
