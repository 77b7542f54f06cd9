"""Policies, evaluations, and episodes that the command line recorded."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from offtrack_sim import Batch, Evaluation, Policy, evaluate

DATA = Path(__file__).parent / "data"


def test_the_shipped_policy_arrives_on_roundabouts_it_has_never_seen() -> None:
    found = evaluate(Policy.shipped(), split="test", episodes=10)
    assert found.success == 1.0 and found.ended.shape == (23, 10)
    assert found.routes[0] == "20m/E-left-2" and set(found.success_by_route.values()) == {1.0}
    assert str(found) == "attard2023 test: 100.0% (230/230); arrived 230"
    assert repr(found) == "<Evaluation on attard2023 test: 100.0% (230/230); arrived 230>"


def test_an_evaluation_counts_what_the_command_line_counts() -> None:
    reported = json.loads((DATA / "maps2026.json").read_text())
    episodes, seed = reported["episodes_per_route"], reported["seed"]
    found = evaluate(Policy.shipped(), "maps2026", split="test", episodes=episodes, seed=seed)
    assert found.counts == reported["ended"]


def test_named_routes_are_reported_as_those_of_their_split() -> None:
    splits = {("16m/N-left-3",): "train", ("20m",): "test", ("16m/N-left-3", "20m/E-left-2"): "routes"}
    # It is none of the benchmark's.
    splits["wide/7/12",] = "routes"
    for routes, split in splits.items():
        found = evaluate(Policy.shipped(), routes=routes, episodes=1)
        assert (found.split, found.as_dict()["split"]) == (split, split)
        assert str(found).startswith(f"attard2023 {split}: ")


def test_any_function_is_evaluated() -> None:
    found = evaluate(lambda observations: np.full(len(observations), 4), routes=["16m"], episodes=2)
    assert found.success == 0.0 and sum(found.counts.values()) == found.ended.size == 38
    with pytest.raises(ValueError, match="episodes: 0; must be at least 1"):
        evaluate(Policy.shipped(), episodes=0)
    with pytest.raises(ValueError, match="has another action table than attard2023-as-run"):
        evaluate(Policy.shipped(), "attard2023-as-run")


def test_a_function_drives_as_the_policy_that_it_calls_and_on_the_callers_own_thread() -> None:
    policy, threads, rows = Policy.shipped(), set(), []

    def act(observations: npt.NDArray[np.float32]) -> Any:
        threads.add(threading.get_ident())
        rows.append(len(observations))
        return policy.act(observations).astype(np.uint8)

    asked = {"scenario": "maps2026", "split": "test", "episodes": 2, "seed": 7}
    called, native = evaluate(act, **asked), evaluate(policy, **asked)  # type: ignore[arg-type]
    assert (called.ended == native.ended).all() and 1 < len(native.counts)
    # Trucks whose episode has ended are not asked about.
    assert threads == {threading.get_ident()} and rows[0] == native.ended.size and rows[-1] < rows[0]


def test_a_class_that_extends_policy_drives_by_its_own_act() -> None:
    class Straight(Policy):
        def act(self, observations: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
            return np.full(len(observations), 4)

    straight = Straight(Policy.shipped()._network)
    expected = evaluate(lambda observations: np.full(len(observations), 4), routes=["16m"], episodes=1)
    assert (evaluate(straight, routes=["16m"], episodes=1).ended == expected.ended).all()


def test_what_a_function_raises_and_an_action_that_there_is_none_of_end_an_evaluation() -> None:
    def failing(observations: npt.NDArray[np.float32]) -> Any:
        raise KeyError("of the policy itself")

    with pytest.raises(KeyError, match="of the policy itself"):
        evaluate(failing, episodes=1)
    with pytest.raises(ValueError, match=r"actions\[0\]: 9; must lie in 0..8"):
        evaluate(lambda observations: np.full(len(observations), 9), episodes=1)


def test_more_episodes_than_fit_into_memory_are_refused_before_any_is_begun() -> None:
    for episodes in (10**9, 10**12, 10**30):
        with pytest.raises(
            MemoryError, match=r"episodes: [0-9]+ on each of 23 routes; memory is free for [0-9]+ on each"
        ):
            evaluate(Policy.shipped(), episodes=episodes)


def test_ctrl_c_while_trucks_drive_is_answered_at_once() -> None:
    def press() -> None:
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    pressed: list[float] = []
    # A job in the background of a script begins with the signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    evaluate(Policy.shipped(), episodes=1)
    timer = threading.Timer(0.5, press)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            evaluate(Policy.shipped(), episodes=5000)
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - pressed[0] < 5.0


def test_the_interval_of_a_success_is_wilsons_as_published_and_has_the_fraction_in_it() -> None:
    def interval(arrived: int, episodes: int) -> tuple[float, float]:
        ended = np.where(np.arange(episodes) < arrived, 1, 2).reshape(1, -1)
        return Evaluation("attard2023", "test", 0, ["16m/N-left-3"], ended, np.empty(0, [])).success_interval

    # The study's own result.
    assert interval(506, 690) == pytest.approx((0.6991, 0.7650), abs=5e-4)
    assert interval(690, 690)[1] == 1.0 and interval(0, 690)[0] == 0.0


def test_logits_agree_with_actions_whatever_the_number_of_rows() -> None:
    policy = Policy.shipped()
    assert policy.benchmark and policy.action_table.shape == (9, 2)
    batch = Batch(num_envs=300, seed=1)
    for _ in range(50):
        batch.step_at_random()
    observations = batch.observation()
    actions, logits = policy.act(observations), policy.logits(observations)
    assert (logits.argmax(axis=1) == actions).all() and 1 < len(set(actions.tolist()))
    assert all(policy.act(observations[env]) == actions[env] for env in range(300))
    assert (policy.logits(observations[7:8]) == logits[7:8]).all()


def test_observations_of_another_shape_are_refused_by_it() -> None:
    policy = Policy.shipped()
    one, many = np.zeros(69, np.float32), np.zeros((2, 3, 69), np.float32)
    either = r"\(n, n_values\) or \(n_values,\) is needed"
    for call, message in (
        (lambda: policy.logits(one), r"shape \(69,\); \(n, n_values\) is needed"),
        (lambda: policy.act(many), rf"shape \(2, 3, 69\); {either}"),
        (lambda: policy.act(np.float32(3)), rf"shape \(\); {either}"),  # type: ignore[arg-type]
        (lambda: policy.driver(2).act(one), r"shape \(69,\); \(n, n_values\) is needed"),
    ):
        with pytest.raises(ValueError, match=f"^observations: {message}$"):
            call()


def test_files_that_are_no_policies_are_refused_by_name(tmp_path: Path) -> None:
    file = tmp_path / "policy.safetensors"
    with pytest.raises(ValueError, match="policy.safetensors: cannot be read"):
        Policy.load(file)
    file.write_bytes(b"not a policy")
    with pytest.raises(ValueError, match="policy.safetensors: is not a policy file"):
        Policy.load(file)
    with pytest.raises(ValueError, match="policy: 50m; the program comes with attard2023, "):
        Policy.shipped("50m")
    with pytest.raises((TypeError, ValueError), match="observations"):
        Policy.shipped().act(np.zeros((3, 68)))


def test_a_recorded_episode_is_driven_again() -> None:
    recording = json.loads((DATA / "episode.json").read_text())
    split = Batch(recording["benchmark"], 1, split="test").split_routes
    batch = Batch(recording["benchmark"], 1, split="test", autoreset="disabled")
    # The index of the episode's truck in the evaluation that counts it.
    index = split.index(recording["route"]) * recording["episodes"] + recording["episode"]
    batch.begin(streams=[(recording["seed"], index)], routes=[recording["route"]])
    for frame in recording["frames"]:
        if frame["action"] is not None:
            batch.step(np.array([frame["action"]]))
        columns = batch.columns("truck", "ranges", "reward")
        # The recording has millimetres and tenths of a milliradian.
        assert np.allclose(columns["truck"]["position"][0], frame["position"], atol=6e-4)
        assert np.allclose(columns["truck"]["heading"][0], frame["heading"], atol=6e-5)
        assert np.allclose(columns["ranges"][0], frame["ranges"], atol=6e-4)
        assert np.allclose(columns["reward"][0], frame["reward"], atol=6e-4)
    ends = batch.ended()
    assert ends is not None and recording["ended"] == "arrived" and ends.codes[0] == 1
