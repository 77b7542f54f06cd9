"""Trucks for PufferLib. Where it is not installed, a small stand-in keeps the contract of its ``PufferEnv``."""

from __future__ import annotations

import importlib
import sys
import types
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import offtrack_sim

N = 16


class StandIn:
    """What ``pufferlib.PufferEnv`` of 3.0 demands and makes: spaces of one agent before, buffers after."""

    num_agents: int
    single_observation_space: Any
    single_action_space: Any

    def __init__(self, buf: Any = None) -> None:
        assert self.num_agents >= 1 and self.single_observation_space.shape > (1,) and self.single_action_space.n > 1
        assert not hasattr(self, "observation_space") and not hasattr(self, "action_space")
        n, shape = self.num_agents, self.single_observation_space.shape
        if buf is None:
            buf = {"observations": np.zeros((n, *shape), np.float32), "rewards": np.zeros(n, np.float32)}
            buf |= {name: np.zeros(n, bool) for name in ("terminals", "truncations")}
            buf |= {"masks": np.ones(n, bool), "actions": np.zeros(n, np.int32)}
        for name, values in buf.items():
            setattr(self, name, values)


@pytest.fixture(scope="module")
def puffer() -> Iterator[types.ModuleType]:
    try:
        importlib.import_module("pufferlib")
        is_installed = True
    except ImportError:
        sys.modules["pufferlib"] = types.ModuleType("pufferlib")
        sys.modules["pufferlib"].PufferEnv = StandIn  # type: ignore[attr-defined]
        is_installed = False
    yield importlib.import_module("offtrack_sim.puffer")
    if not is_installed:
        del sys.modules["pufferlib"], sys.modules["offtrack_sim.puffer"]


@pytest.mark.parametrize(("scenario", "n_values"), [("attard2023", 69), ("laden2026", 77)])
def test_results_are_those_of_a_batch_with_rewards_scaled(
    puffer: types.ModuleType, scenario: str, n_values: int
) -> None:
    env = puffer.RoundaboutPuffer(scenario, num_envs=N, reward_scale=0.5, seed=3)
    batch = offtrack_sim.Batch(scenario, num_envs=N, seed=3)
    assert env.single_observation_space.shape == (n_values,)
    observation, infos = env.reset(seed=3)
    assert infos == [] and np.array_equal(observation, batch.observation())
    actions = np.random.default_rng(0)
    returns, n_ends = np.zeros(N), 0
    for _ in range(200):
        # PufferLib's own type of actions.
        action = actions.integers(0, len(batch.action_table), N).astype(np.int32)
        observation, reward, terminated, truncated, infos = env.step(action)
        expected = batch.step(action)
        assert np.array_equal(observation, expected[0]) and observation is env.observations
        assert np.allclose(reward, 0.5 * expected[1])
        assert np.array_equal(terminated, expected[2]) and np.array_equal(truncated, expected[3])
        returns += expected[1]
        ends = batch.ended()
        assert len(infos) == (ends is not None)
        if ends is not None:
            n_ends += len(ends.envs)
            assert infos[0]["is_success"] == (ends.codes == offtrack_sim.Ended.ARRIVED).tolist()
            assert np.allclose(infos[0]["episode_return"], returns[ends.envs])
            returns[ends.envs] = 0.0
    assert n_ends > N


def test_the_first_reset_is_that_of_its_seed_and_later_ones_go_on(puffer: types.ModuleType) -> None:
    env, other = (puffer.RoundaboutPuffer(num_envs=N, seed=5) for _ in range(2))
    first = env.reset()[0].copy()
    assert np.array_equal(first, other.reset(seed=5)[0])
    assert not np.array_equal(first, env.reset()[0])
    assert np.array_equal(first, env.reset(seed=5)[0])


def test_a_step_of_a_copy_leaves_the_original_where_it_is(puffer: types.ModuleType) -> None:
    import copy

    env = puffer.RoundaboutPuffer(num_envs=N, seed=5)
    env.reset()
    twin = copy.copy(env)
    before = env.observations.copy(), env.batch.observation()
    actions = np.full(N, 4, np.int32)
    stepped = twin.step(actions)[0].copy()
    assert np.array_equal(env.observations, before[0]) and np.array_equal(env.batch.observation(), before[1])
    assert np.array_equal(env.step(actions)[0], stepped) and not np.array_equal(stepped, before[0])


def test_results_go_into_the_buffers_that_were_given(puffer: types.ModuleType) -> None:
    buffers: dict[str, Any] = {
        "observations": np.zeros((2 * N, 69), np.float32)[N:],
        "rewards": np.zeros(2 * N, np.float32)[N:],
    }
    buffers |= {name: np.zeros(2 * N, bool)[N:] for name in ("terminals", "truncations", "masks")}
    buffers |= {"actions": np.zeros(2 * N, np.int32)[N:]}
    env = puffer.RoundaboutPuffer(num_envs=N, buf=buffers)
    env.reset(seed=0)
    env.step(buffers["actions"])
    assert env.observations is buffers["observations"] and buffers["observations"].any()


def test_trucks_that_share_a_road_are_refused_and_routes_are_drawn_by_weights(puffer: types.ModuleType) -> None:
    shared = offtrack_sim.benchmark("traffic2026").changed({"traffic.group": 2})
    with pytest.raises(ValueError, match=r"traffic\.group: 2; PufferLib takes trucks that drive alone"):
        puffer.RoundaboutPuffer(shared, num_envs=4)
    env = puffer.RoundaboutPuffer(num_envs=N, weights={"32m": 0.0, "50m": 0.0}, max_episode_steps=5)
    env.reset()
    assert {env.batch.route_names[route].split("/")[0] for route in env.batch.routes()} == {"16m"}
    ended = [env.step(np.zeros(N, np.int64))[3].copy() for _ in range(5)]
    assert not ended[3].any() and ended[4].all()


def test_the_package_imports_no_learning_library() -> None:
    import subprocess

    code = "import sys, offtrack_sim; print({'torch', 'pufferlib', 'stable_baselines3', 'ray'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "set()"
