"""Policies that remember, read some values or give commands; functions that remember; the table of an evaluation."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from standins import GRU, LSTM, Linear, ReLU, Tanh

import offtrack_sim
from offtrack_sim import Batch, Driver, Ended, Policy, Start, evaluate, export

RAYS = ["trailer_range", "tractor_range"]
Floats = npt.NDArray[np.float32]


def observed(n_steps: int, n: int) -> list[Floats]:
    """What trucks observe on their way."""
    batch = Batch(num_envs=n, seed=3)
    rows = []
    for _ in range(n_steps):
        rows.append(batch.observation().copy())
        batch.step_at_random()
    return rows


def remembering(tmp_path: Path, kind: type[GRU] | type[LSTM] = LSTM) -> tuple[Policy, list[Any]]:
    """A policy of the rays in two frames, and its modules."""
    modules = [Linear(58, 12, 1), Tanh(), kind(12, 10, 2, num_layers=2), Linear(10, 8, 3), Tanh(), Linear(8, 9, 4)]
    file = tmp_path / "remembering.safetensors"
    export.save(file, modules, values=RAYS, frames=2, padding="reset")
    return Policy.load(file), modules


@pytest.mark.parametrize("kind", [GRU, LSTM])
def test_recurrent_layers_do_what_pytorch_documents_and_begin_anew_where_an_episode_does(
    kind: type[GRU] | type[LSTM], tmp_path: Path
) -> None:
    policy, modules = remembering(tmp_path, kind)
    assert policy.values == RAYS and policy.frames == 2 and policy.has_memory and policy.head == "levels"
    n, random = 40, np.random.default_rng(0)
    driver, state, last = policy.driver(n), modules[2].begin(n), None
    taken = set()
    for step, observation in enumerate(observed(30, n)):
        begins = np.full(n, step == 0) if step == 0 else random.random(n) < 0.1
        rays = observation[:, 30:59]
        last = rays if last is None else np.where(begins[:, None], rays, last)
        state = [[np.where(begins[:, None], 0, part).astype(np.float32) for part in layer] for layer in state]
        values = np.tanh(modules[0](np.concatenate([last, rays], 1)))
        logits = modules[5](np.tanh(modules[3](modules[2](values, state))))
        actions = driver.act(observation, None if step == 0 else begins)
        # Sums are made in another order: actions whose outputs are nearly equal may change places.
        chosen = np.take_along_axis(logits, actions[:, None], 1)[:, 0]
        assert (logits.max(1) - chosen < 1e-4).all()
        taken.update(actions.tolist())
        last = rays
    assert len(taken) > 2


def test_a_copy_of_a_policy_with_a_memory_drives_as_it_does(tmp_path: Path) -> None:
    policy, _ = remembering(tmp_path, GRU)
    again = pickle.loads(pickle.dumps(policy))
    drivers = policy.driver(9), again.driver(9)
    for observation in observed(6, 9):
        one, other = (driver.act(observation) for driver in drivers)
        assert (one == other).all()
    assert again.values == RAYS and again.frames == 2


@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy])
def test_a_copied_driver_remembers_the_same_and_goes_on_by_itself(way: Callable[[Any], Any], tmp_path: Path) -> None:
    policy, _ = remembering(tmp_path, GRU)
    driver, undisturbed = policy.driver(9), policy.driver(9)
    elsewhere = np.zeros((9, 69), np.float32)
    for observation in observed(12, 9):
        branch = way(driver)
        branch.act(elsewhere)
        same = way(driver)
        actions = driver.act(observation)
        assert (actions == undisturbed.act(observation)).all() and (actions == same.act(observation)).all()
    with pytest.raises(TypeError, match="^Driver: what it remembers cannot be pickled"):
        pickle.dumps(driver)


def test_a_policy_with_a_memory_drives_by_a_driver_alone(tmp_path: Path) -> None:
    policy, _ = remembering(tmp_path)
    rows = np.zeros((3, 69))
    with pytest.raises(ValueError, match=r"remembering.safetensors: remembers earlier .*; policy.driver\(n\) keeps"):
        policy.act(rows)
    with pytest.raises(ValueError, match="remembers earlier"):
        policy.logits(rows)
    driver = policy.driver(3)
    assert isinstance(driver, Driver) and driver.n == 3 and driver.policy is policy
    for call, error, message in (
        (lambda: driver.act(rows[:2]), ValueError, "observations: 2 of them; 3 are needed, one a truck"),
        (lambda: driver.act(rows, np.zeros(3)), TypeError, r"begins: a numpy array of bool and shape \(3,\) is"),  # type: ignore[arg-type]
        (lambda: driver.act(rows, np.zeros(4, bool)), TypeError, r"shape \(3,\) is needed"),
        (lambda: driver.act(np.full((3, 69), np.nan)), ValueError, r"observations\[0, 0\]: NaN"),
        (lambda: driver.act(np.zeros((3, 82))), ValueError, "observations: 82 values each; 69 are needed"),
        (lambda: policy.driver(0), ValueError, "n: 0; must be at least 1"),
        (lambda: policy.driver(10**13), MemoryError, "^n: 10000000000000; a batch of so many"),
        (lambda: policy.driver(1.5), TypeError, "n: 1.5; an integer is needed"),  # type: ignore[arg-type]
    ):
        with pytest.raises(error, match=message):
            call()


def test_an_evaluation_of_a_policy_with_a_memory_is_that_of_a_function_that_remembers(tmp_path: Path) -> None:
    policy, _ = remembering(tmp_path)
    asked: dict[str, Any] = {"split": "test", "episodes": 2, "seed": 7}
    driver = policy.driver(46)
    begun: list[npt.NDArray[np.bool_]] = []

    def act(observations: Floats, begins: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
        begun.append(begins)
        return driver.act(observations, begins)

    native, called = evaluate(policy, **asked), evaluate(act, **asked, begins=True)
    assert (native.table == called.table).all() and 5 < len(set(native.table["steps"]))
    # All trucks at every step, also those whose episode has ended: rows stay where they are.
    assert begun[0].all() and not np.any(begun[1:]) and {len(begins) for begins in begun} == {46}
    assert len(begun) == native.table["steps"].max()
    # By what it observes now alone it would drive elsewhere.
    forgetful = evaluate(lambda observations: policy.driver(len(observations)).act(observations), **asked)
    assert (forgetful.table != native.table).any()
    with pytest.raises(ValueError, match="begins: True; a Policy remembers by itself"):
        evaluate(policy, begins=True)


def test_the_table_of_an_evaluation_has_what_the_trucks_of_a_batch_do() -> None:
    policy = Policy.shipped()
    found = evaluate(policy, "maps2026", split="test", episodes=2, seed=7)
    table = found.table
    assert len(table) == 2 * len(found.routes) and (table["ended"] == found.ended.ravel()).all()
    assert table["route"].tolist() == [route for route in found.routes for _ in range(2)]
    assert table["episode"].tolist() == [0, 1] * len(found.routes)
    failed = int(np.flatnonzero(table["ended"] != Ended.ARRIVED)[0])
    for index in (0, failed):
        row = table[index]
        batch = Batch("maps2026", 1, split="test", autoreset="disabled")
        batch.begin(streams=[(7, index)], routes=[row["route"]])
        sums = dict.fromkeys(("reward", "waypoints", "lane_distance", "clearance", "failure"), 0.0)
        distances, clearances, ratios = [], [], []
        while batch.ended() is None:
            batch.step(policy.act(batch.observation()))
            columns = batch.columns("reward", "terms", "progress", "clearance", "truck")
            sums["reward"] += float(columns["reward"][0])
            for term in columns["terms"].dtype.names or ():
                sums[term] += float(columns["terms"][term][0])
            distances.append(float(columns["progress"]["lane_distance"][0]))
            clearances.append([float(columns["clearance"][unit][0]) for unit in ("tractor", "trailer")])
            ratios += [abs(columns["truck"][f"{unit}_load_transfer_ratio"][0]) for unit in ("tractor", "trailer")]
        assert row["steps"] == len(distances) and row["reward"] == pytest.approx(sums["reward"])
        for term in ("waypoints", "lane_distance", "clearance", "failure"):
            assert row[f"term_{term}"] == pytest.approx(sums[term])
        assert row["term_failure"] == (index == failed)
        assert row["lane_distance_mean"] == pytest.approx(np.mean(distances))
        assert row["lane_distance_max"] == max(distances)
        assert [row["tractor_clearance_min"], row["trailer_clearance_min"]] == np.min(clearances, 0).tolist()
        assert row["load_transfer_ratio_peak"] == max(ratios)
        # Begun from the start that the table has, a truck drives the same episode.
        again = Batch("maps2026", 1, split="test", autoreset="disabled")
        offset, heading, speed = (float(row[f"start_{name}"]) for name in ("offset", "heading", "speed"))
        again.begin(routes=[row["route"]], starts=[Start(offset, heading, speed, int(row["vehicle"]))])
        steps = 0
        while again.ended() is None:
            again.step(policy.act(again.observation()))
            steps += 1
        assert steps == row["steps"]


def test_the_table_is_written_by_numpy(tmp_path: Path) -> None:
    table = evaluate(Policy.shipped(), routes=["16m"], episodes=1).table
    file = tmp_path / "episodes.csv"
    np.savetxt(file, table, "%s", ",", header=",".join(table.dtype.names or ()), comments="")
    first, second = file.read_text().splitlines()[:2]
    assert first.startswith("route,episode,start_offset,") and second.startswith("16m/")
    assert len(second.split(",")) == len(first.split(",")) == 23


def test_a_policy_that_reads_some_values_takes_them_from_observations_with_and_without_extras(tmp_path: Path) -> None:
    file = tmp_path / "some.safetensors"
    weights = np.eye(3, 9, dtype=np.float32)
    export.save(file, [(weights, np.zeros(9))], values=["bearing[1]", "speed", "articulation"])
    policy = Policy.load(file)
    assert not policy.has_memory and policy.extras == []
    rows = np.random.default_rng(1).normal(size=(5, 69)).astype(np.float32)
    expected = rows[:, [7, 0, 21]]
    assert (policy.logits(rows)[:, :3] == expected).all()
    beside = np.concatenate([rows, np.ones((5, 8), np.float32)], 1)
    assert (policy.logits(beside)[:, :3] == expected).all()
    policy.check(Batch("attard2023", 1))
    export.save(file, [(weights, np.zeros(9))], values=["speed", "trailer_mass", "steering"])
    with pytest.raises(ValueError, match="reads trailer_mass, steering, which attard2023 does not observe"):
        evaluate(Policy.load(file))
    with pytest.raises(ValueError, match="observations: 69 values each; 77 are needed"):
        Policy.load(file).act(rows)
    assert (Policy.load(file).logits(beside)[:, 1:3] == 1).all()


def test_frames_before_the_first_one_are_zeros_or_the_first_one_again(tmp_path: Path) -> None:
    file = tmp_path / "frames.safetensors"
    speeds = [np.full((1, 69), value, np.float32) for value in (0.5, 0.25, 0.125)]
    # The oldest frame's speed decides: above 0.2 the second action is the best.
    layer = np.array([[0, 1], [0, 0], [0, 0]], np.float32), np.array([0.2, 0], np.float32)
    padded = np.zeros((3, 9), np.float32), np.full(9, -1, np.float32)
    padded[0][:, :2], padded[1][:2] = layer
    for padding, expected in (("zero", [0, 0, 1]), ("reset", [1, 1, 1])):
        export.save(file, [padded], values=["speed"], frames=3, padding=padding)
        driver = Policy.load(file).driver(1)
        assert [int(driver.act(rows)[0]) for rows in speeds] == expected, padding


def test_a_policy_of_commands_gives_them_squashed_or_clipped(tmp_path: Path) -> None:
    file = tmp_path / "commands.safetensors"
    modules: list[Any] = [Linear(69, 8, 1), ReLU(), Linear(8, 1, 2)]
    rows = 9 * np.random.default_rng(1).normal(size=(50, 69)).astype(np.float32)
    means = modules[2](modules[1](modules[0](np.clip(rows, -10, 10))))
    for squash, expected in (("tanh", np.tanh(means)), ("clip", np.clip(means, -1, 1))):
        export.save(file, modules, squash=squash)
        policy = Policy.load(file)
        assert policy.head == "continuous" and policy.action_table[:, 0] == pytest.approx([-0.558505, 0.558505])
        assert policy.act(rows) == pytest.approx(expected, abs=1e-5) and policy.act(rows[0]).shape == (1,)
        assert policy.logits(rows) == pytest.approx(means, abs=1e-5)
    assert (abs(means) > 1).any()
    with pytest.raises(ValueError, match="gives commands; attard2023 has a table of actions"):
        evaluate(Policy.load(file))
    with pytest.raises(ValueError, match="its last layer has 1 outputs, and its actions ask for 2 commands"):
        export.save(
            file, modules, squash="tanh", scenario="transfer2026", values=[g.name for g in offtrack_sim.OBSERVATION]
        )
