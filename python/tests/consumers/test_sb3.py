"""Trucks for Stable-Baselines3, and networks that it trained as policy files: run by run.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import A2C, DQN, PPO, SAC, TD3
from stable_baselines3.common.vec_env import DummyVecEnv, VecFrameStack, VecMonitor, VecNormalize

import offtrack_sim
from offtrack_sim import export
from offtrack_sim.sb3 import RoundaboutVecEnv

N = 12


@pytest.mark.parametrize("scenario", ["attard2023", "laden2026", "attard2023-continuous", "laden2026-continuous"])
def test_every_value_is_that_of_dummy_vec_env(scenario: str) -> None:
    ours = RoundaboutVecEnv(scenario, num_envs=N, num_threads=1)
    theirs = DummyVecEnv([lambda: offtrack_sim.Roundabout(scenario)] * N)
    assert ours.seed(7) == theirs.seed(7)
    assert np.array_equal(ours.reset(), theirs.reset())
    assert ours.reset_infos == theirs.reset_infos
    actions = np.random.default_rng(0)
    n_ends = 0
    for _ in range(300):
        action: np.ndarray
        if ours.batch.n_commands:
            action = actions.uniform(-1, 1, (N, ours.batch.n_commands)).astype(np.float32)
        else:
            action = actions.integers(0, ours.action_space.n, N)
        observation, reward, done, infos = ours.step(action)
        expected, expected_reward, expected_done, expected_infos = theirs.step(action)
        assert np.array_equal(observation, expected)
        assert np.array_equal(reward, expected_reward) and reward.dtype == expected_reward.dtype
        assert np.array_equal(done, expected_done)
        assert ours.reset_infos == theirs.reset_infos
        for env in np.flatnonzero(done):
            n_ends += 1
            assert set(infos[env]) == set(expected_infos[env])
            for key, value in expected_infos[env].items():
                assert np.array_equal(infos[env][key], value), key
    assert n_ends > N


def test_the_time_limit_is_told_apart_from_an_end() -> None:
    env = RoundaboutVecEnv(num_envs=2, seed=1)
    env.reset()
    state = env.batch.state()
    # The second truck has driven for longer than any route may take.
    state["truck"]["steps"][1] = 100_000
    env.batch.restore(state)
    straight = len(env.batch.action_table) // 2
    observation, _, done, infos = env.step(np.full(2, straight))
    assert done.tolist() == [False, True]
    assert infos[0] == {}
    assert infos[1]["TimeLimit.truncated"] and infos[1]["ended"] == offtrack_sim.Ended.TIMED_OUT
    assert not infos[1]["is_success"]
    assert not np.array_equal(infos[1]["terminal_observation"], observation[1])


def test_options_state_route_and_start() -> None:
    env = RoundaboutVecEnv(num_envs=3)
    route = env.batch.route_names[5]
    env.set_options({"route": route, "start": (0.0, 0.0)})
    observation = env.reset()
    assert env.reset_infos == [{"route": route}] * 3
    assert np.array_equal(observation[0], observation[2])


def test_attributes_are_those_of_the_batch() -> None:
    env = VecMonitor(RoundaboutVecEnv(num_envs=3, render_mode="rgb_array", render_size=64))
    assert env.get_attr("step_seconds") == [0.1] * 3
    assert env.get_attr("render_size", indices=[0, 2]) == [64, 64]
    assert not env.has_attr("no_such_attribute")
    env.set_attr("render_size", 80)
    assert env.get_images()[0].shape == (80, 80, 3)
    assert len(env.env_method("render", indices=1)) == 1
    with pytest.raises(TypeError, match="^indices: set; a sequence of indices of trucks is needed, or None for all"):
        env.get_attr("render_size", indices={0, 2})
    with pytest.raises(ValueError, match="without indices"):
        env.set_attr("render_size", 96, indices=[0])
    with pytest.raises(AttributeError, match="no_such_method"):
        env.env_method("no_such_method")
    assert env.env_is_wrapped(VecMonitor) == [False] * 3


def observations() -> np.ndarray:
    """Thousands of observations of trucks that drive, [n, 69]."""
    batch = offtrack_sim.Batch(num_envs=64, seed=3)
    policy = offtrack_sim.Policy.shipped()
    rows = [batch.observation()]
    for _ in range(60):
        rows.append(batch.step(policy.act(rows[-1]))[0])
    return np.concatenate(rows)


@pytest.mark.parametrize("algorithm", [PPO, A2C, DQN])
@pytest.mark.parametrize("normalised", [False, True])
def test_a_policy_file_acts_as_the_model_that_it_was_written_from(
    algorithm: type, normalised: bool, tmp_path: Path
) -> None:
    env = VecMonitor(RoundaboutVecEnv(num_envs=8, seed=1))
    if normalised:
        env = VecNormalize(env)
    settings = {"n_steps": 16} if algorithm is not DQN else {"learning_starts": 64}
    model = algorithm("MlpPolicy", env, seed=0, device="cpu", **settings)
    model.learn(512)
    # So short a training leaves outputs that favour one action everywhere.
    torch.manual_seed(0)
    for weights in model.policy.parameters():
        weights.data += 0.3 * torch.randn_like(weights)
    export.save(tmp_path / "policy.safetensors", model)
    rows = observations()
    seen = env.normalize_obs(rows) if normalised else rows
    expected = model.predict(seen, deterministic=True)[0]
    policy = offtrack_sim.Policy.load(tmp_path / "policy.safetensors")
    differs = policy.act(rows) != expected
    # Where the two sums round apart and the best two outputs are closer than that, either is right.
    logits = np.sort(policy.logits(rows[differs]), axis=1)
    assert (logits[:, -1] - logits[:, -2] < 1e-5 * np.abs(logits).max(initial=1.0)).all()
    assert differs.sum() < 5
    assert len(rows) == 3904 and len(np.unique(expected)) > 2


class Rays(gymnasium.Env[np.ndarray, np.ndarray]):
    """Random rays and commands: spaces for algorithms whose actions are no levels."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (29,), np.float32)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, **given: Any) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(**given)
        self.steps = 0
        return self.observation_space.sample(), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        self.steps += 1
        return self.observation_space.sample(), float(action[0]), self.steps == 7, False, {}


# Algorithms with a replay buffer take no VecNormalize within a VecFrameStack.
@pytest.mark.parametrize(
    ("algorithm", "normalised"), [(PPO, "each frame"), (PPO, "the stack"), (SAC, "the stack"), (TD3, "the stack")]
)
def test_commands_of_a_file_are_those_of_the_model_by_the_frames_of_its_environments(
    algorithm: type, normalised: str, tmp_path: Path
) -> None:
    env: Any = DummyVecEnv([Rays] * 4)
    if normalised == "each frame":
        normalize = VecNormalize(env)
        env = VecFrameStack(normalize, 3)
    else:
        env = normalize = VecNormalize(VecFrameStack(env, 3))
    settings = {"n_steps": 16} if algorithm is PPO else {"learning_starts": 64}
    model = algorithm("MlpPolicy", env, seed=0, device="cpu", policy_kwargs={"net_arch": [32, 32]}, **settings)
    model.learn(256)
    torch.manual_seed(0)
    for weights in model.policy.parameters():
        weights.data += 0.2 * torch.randn_like(weights)
    rays = [values for values in offtrack_sim.OBSERVATION if values.name.endswith("_range")]
    export.save(tmp_path / "policy.safetensors", model, values=[values.name for values in rays])
    driver = offtrack_sim.Policy.load(tmp_path / "policy.safetensors").driver(4)
    normalize.training = False
    seen, begins = env.reset(), np.ones(4, bool)
    for _ in range(30):
        # What the environment observed last, before it was stacked or normalised.
        rows = np.zeros((4, 69), np.float32)
        rows[:, 30:59] = raw(env)
        expected = model.predict(seen, deterministic=True)[0]
        assert driver.act(rows, begins) == pytest.approx(expected, abs=1e-4)
        seen, _, begins, _ = env.step(expected)


def raw(env: Any) -> np.ndarray:
    """What the innermost vector environment observed last."""
    while hasattr(env, "venv"):
        env = env.venv
    return np.asarray(env.buf_obs[None])


def test_a_file_of_recurrent_ppo_remembers_what_the_model_does(tmp_path: Path) -> None:
    from sb3_contrib import RecurrentPPO

    env = RoundaboutVecEnv(num_envs=8, seed=1)
    kwargs = {"net_arch": [32], "lstm_hidden_size": 24, "n_lstm_layers": 2}
    model = RecurrentPPO("MlpLstmPolicy", env, n_steps=16, seed=0, device="cpu", policy_kwargs=kwargs)
    model.learn(256)
    torch.manual_seed(0)
    for weights in model.policy.parameters():
        weights.data += 0.3 * torch.randn_like(weights)
    export.save(tmp_path / "policy.safetensors", model)
    driver = offtrack_sim.Policy.load(tmp_path / "policy.safetensors").driver(8)
    seen, begins, state, taken, n_begun = env.reset(), np.ones(8, bool), None, set(), 0
    for _ in range(120):
        expected, state = model.predict(seen, state, episode_start=begins, deterministic=True)
        assert (driver.act(seen, begins) == expected).all()
        taken.update(expected.tolist())
        seen, _, begins, _ = env.step(expected)
        n_begun += int(begins.sum())
    assert len(taken) > 2 and n_begun > 8


def test_modules_of_pytorch_with_a_gru_or_lstm_drive_as_they_do_there(tmp_path: Path) -> None:
    from torch import nn

    for kind in (nn.GRU, nn.LSTM):
        torch.manual_seed(1)
        encoder = nn.Sequential(nn.Linear(69, 32), nn.Tanh())
        recurrent, head = kind(32, 24, num_layers=2), nn.Linear(24, 9)
        for weights in [*encoder.parameters(), *recurrent.parameters(), *head.parameters()]:
            weights.data *= 3
        export.save(tmp_path / "policy.safetensors", [encoder, recurrent, head])
        driver = offtrack_sim.Policy.load(tmp_path / "policy.safetensors").driver(64)
        rows = observations().reshape(61, 64, 69)
        with torch.no_grad():
            outputs = head(recurrent(encoder(torch.as_tensor(rows)))[0]).numpy()
        for seen, expected in zip(rows, outputs):
            chosen = np.take_along_axis(expected, driver.act(seen)[:, None], 1)[:, 0]
            assert (expected.max(1) - chosen < 1e-3).all()
        assert len(np.unique(outputs.argmax(2))) > 2


def test_what_a_policy_file_cannot_hold_is_named() -> None:
    from torch import nn

    with pytest.raises(TypeError, match=r"layer 1: torch\.nn\.modules\.activation\.GELU; ReLU or Tanh is needed here"):
        export.save("never", nn.Sequential(nn.Linear(69, 8), nn.GELU(), nn.Linear(8, 9)))
    with pytest.raises(TypeError, match=r"layer 1: .*LayerNorm"):
        export.save("never", nn.Sequential(nn.Linear(69, 8), nn.LayerNorm(8), nn.ReLU(), nn.Linear(8, 9)))
    with pytest.raises(TypeError, match=r"last layer: .*ReLU"):
        export.save("never", nn.Sequential(nn.Linear(69, 9), nn.ReLU()))
    with pytest.raises(TypeError, match="ReLU and Tanh"):
        export.save("never", nn.Sequential(nn.Linear(69, 8), nn.ReLU(), nn.Linear(8, 8), nn.Tanh(), nn.Linear(8, 9)))
    with pytest.raises(TypeError, match="model: builtins.int"):
        export.save("never", 3)
    env = VecNormalize(RoundaboutVecEnv(num_envs=2), clip_obs=5.0)
    with pytest.raises(ValueError, match="clip_obs is 5"):
        export.save("never", PPO("MlpPolicy", env, n_steps=32, device="cpu"))
    with pytest.raises(ValueError, match="mean, variance"):
        export.save("never", nn.Sequential(nn.Linear(69, 9)), mean=np.zeros(69))
