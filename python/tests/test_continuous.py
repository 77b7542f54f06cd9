"""Continuous actions: a steer angle and a target speed in place of an index."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import offtrack_sim
from offtrack_sim import Batch, export
from offtrack_sim.parallel import RoundaboutParallel

N = 16
#: Any numbers: float32 in -1..1.
Commands = np.ndarray[Any, np.dtype[np.float32]]


def commands(rng: np.random.Generator, n: int, n_commands: int) -> Commands:
    return rng.uniform(-1, 1, (n, n_commands)).astype(np.float32)


@pytest.mark.parametrize(("scenario", "n_commands"), [("attard2023-continuous", 1), ("laden2026-continuous", 2)])
def test_commands_are_fractions_of_the_lock_and_of_the_range_of_speeds(scenario: str, n_commands: int) -> None:
    batch = Batch(scenario, N, seed=3)
    assert batch.n_commands == n_commands and batch.action_table.shape == (2, 2)
    (right, slow), (left, fast) = batch.action_table
    assert left == -right and np.isclose(left, np.radians(40))
    given = commands(np.random.default_rng(1), N, n_commands)
    batch.step(given)
    columns = batch.columns("command", "control", "action")
    assert (columns["command"]["steering"] == given[:, 0]).all() and not columns["action"].any()
    assert (columns["control"]["steering"] == given[:, 0] * left).all()
    target = slow + (given[:, -1] + 1) / 2 * (fast - slow)
    assert np.allclose(columns["control"]["target_speed"], target, rtol=1e-6)
    assert Batch("attard2023").n_commands == 0


def test_commands_that_equal_levels_drive_as_the_levels() -> None:
    levels, continuous = Batch("attard2023", N, seed=3), Batch("attard2023-continuous", N, seed=3)
    fractions = np.linspace(-0.8, 0.8, 9).round(1)
    rng = np.random.default_rng(2)
    for _ in range(100):
        actions = rng.integers(0, 9, N)
        one, other = levels.step(actions), continuous.step(fractions[actions, None])
        assert all((mine == its).all() for mine, its in zip(one, other))


WRONG: list[tuple[Any, type[Exception], str]] = [
    (np.zeros(4, np.int64), TypeError, r"actions: ndarray of int64 and shape \(4,\); a numpy array of float32 of"),
    (np.zeros((4, 2), np.int64), TypeError, "actions: ndarray of int64 and shape"),
    (np.zeros((4, 2), np.float16), TypeError, "actions: ndarray of float16 and shape"),
    (np.zeros(4, np.float32), TypeError, r"shape \(4,\); a numpy array of float32 of shape \(4, 2\) is needed"),
    ([[0.0, 0.0]] * 4, TypeError, r"actions: list; a numpy array of float32 of shape \(4, 2\) is needed"),
    (np.zeros((4, 1), np.float32), ValueError, r"actions: shape \(4, 1\); \(4, 2\) is needed, a row a truck"),
    (np.broadcast_to(np.float32(0), (2**40, 2)), ValueError, r"actions: shape \(1099511627776, 2\); \(4, 2\)"),
    (np.full((4, 2), np.nan, np.float32), ValueError, r"actions\[0, 0\]: NaN; must lie in -1..1"),
    (np.array([[0, 0], [0, 0], [0, 1.5], [0, 0]], np.float32), ValueError, r"actions\[2, 1\]: 1.5; must lie in -1..1"),
    (np.full((4, 2), -1 - 1e-12), ValueError, r"actions\[0, 0\]: -1.000000000001; must lie in -1..1"),
]


@pytest.mark.parametrize(("actions", "error", "message"), WRONG)
def test_wrong_commands_are_refused_by_truck_and_value_and_no_truck_moves(
    actions: Any, error: type[Exception], message: str
) -> None:
    batch = Batch("laden2026-continuous", 4, seed=1)
    before = batch.observation()
    with pytest.raises(error, match=message):
        batch.step(actions)
    assert (batch.observation() == before).all()


def test_commands_are_refused_where_actions_are_indices() -> None:
    with pytest.raises(TypeError, match=r"actions: ndarray of float32 .*; a numpy array of integers"):
        Batch("attard2023", 4).step(np.zeros((4, 1), np.float32))


@pytest.mark.parametrize(("scenario", "n_commands"), [("attard2023-continuous", 1), ("laden2026-continuous", 2)])
def test_one_truck_has_a_box_of_commands_and_says_what_is_wrong_with_one(scenario: str, n_commands: int) -> None:
    env = gymnasium.make("offtrack_sim:offtrack/Roundabout-v0", scenario=scenario, disable_env_checker=True)
    assert env.action_space == gymnasium.spaces.Box(-1, 1, (n_commands,), np.float32)
    env.reset(seed=1)
    env.step(env.action_space.sample())
    bare: Any = env.unwrapped
    wrong: list[tuple[Any, type[Exception], str]] = [
        (3, TypeError, "action: 3; float32 of shape"),
        (np.zeros(n_commands + 1, np.float32), ValueError, rf"action: shape \({n_commands + 1},\); \({n_commands},\)"),
        (np.full(n_commands, 2.0, np.float32), ValueError, r"action\[0\]: 2.0; must lie in -1..1"),
        (np.full(n_commands, np.nan, np.float32), ValueError, r"action\[0\]: nan; must lie in -1..1"),
    ]
    for action, error, message in wrong:
        with pytest.raises(error, match=message):
            bare.step(action)


def test_the_environment_passes_gymnasiums_checker() -> None:
    from gymnasium.utils.env_checker import check_env

    check_env(offtrack_sim.Roundabout("laden2026-continuous"), skip_render_check=True)


def test_a_clipped_action_drives_as_the_end_of_the_range() -> None:
    envs = [offtrack_sim.Roundabout("attard2023-continuous") for _ in range(2)]
    clipped: Any = gymnasium.wrappers.ClipAction(envs[1])
    assert all((one.reset(seed=4)[0] == clipped.reset(seed=4)[0]).all() for one in envs[:1])
    for _ in range(10):
        one, other = envs[0].step(np.ones(1, np.float32)), clipped.step(np.full(1, 1.7, np.float32))
        assert (one[0] == other[0]).all() and one[1] == other[1]


def test_many_trucks_equal_as_many_single_ones_and_a_copy_goes_on_alike() -> None:
    vector = pytest.importorskip("gymnasium.vector")
    if not hasattr(vector, "AutoresetMode"):
        with pytest.raises(ImportError, match="vector environments need 1.1"):
            offtrack_sim.make_vec("laden2026-continuous", 2)
        return
    mode = vector.AutoresetMode.SAME_STEP
    ours = offtrack_sim.make_vec("laden2026-continuous", N, autoreset_mode=mode)
    theirs = vector.SyncVectorEnv(
        [lambda: offtrack_sim.Roundabout("laden2026-continuous") for _ in range(N)], autoreset_mode=mode
    )
    assert ours.single_action_space == theirs.single_action_space
    assert ours.action_space == theirs.action_space and ours.action_space.shape == (N, 2)
    seeds = list(range(N))
    assert (ours.reset(seed=seeds)[0] == theirs.reset(seed=seeds)[0]).all()
    rng = np.random.default_rng(7)
    ended = 0
    for _ in range(150):
        actions = commands(rng, N, 2)
        one, other = ours.step(actions), theirs.step(actions)
        assert all((mine == its).all() for mine, its in zip(one[:4], other[:4]))
        ended += int((one[2] | one[3]).sum())
    assert 10 < ended
    twin = copy.deepcopy(ours)
    actions = commands(rng, N, 2)
    assert all((mine == its).all() for mine, its in zip(ours.step(actions)[:4], twin.step(actions)[:4]))


def test_a_function_of_observations_drives_an_evaluation_by_commands() -> None:
    def straight(observations: Any) -> Any:
        return np.zeros((len(observations), 1), np.float32)

    found = offtrack_sim.evaluate(straight, "attard2023-continuous", episodes=1)
    levels = offtrack_sim.evaluate(lambda rows: np.full(len(rows), 4), "attard2023", episodes=1)
    assert (found.ended == levels.ended).all()
    wrong: list[tuple[Any, type[Exception], str]] = [
        (lambda rows: straight(rows) + 3, ValueError, r"actions\[0, 0\]: 3; must lie in -1..1"),
        (lambda rows: np.zeros(len(rows), int), TypeError, r"policy: gave int64 of shape \(23,\); float32 of shape"),
    ]
    for function, error, message in wrong:
        with pytest.raises(error, match=message):
            offtrack_sim.evaluate(function, "attard2023-continuous", episodes=1)


def test_an_observer_says_what_a_command_asks_for_on_the_map() -> None:
    observer = offtrack_sim.Observer("laden2026-continuous", ["20m/N-left-4"] * 2, vehicles=[("daf_xf", "laden")] * 2)
    steering, target = observer.command(np.array([[0.5, -1.0], [-1.0, 1.0]], np.float32))
    assert np.allclose(np.degrees(steering), [20, -40]) and np.allclose(target * 3.6, [10, 30])
    with pytest.raises(ValueError, match=r"actions\[1, 0\]: 1.1; must lie in -1..1"):
        observer.command(np.array([[0, 0], [1.1, 0]]))


def test_fields_of_packed_records_are_read_as_their_numbers(tmp_path: Path) -> None:
    batch = Batch("laden2026-continuous", 2, seed=1)
    kept = np.zeros(2, [("command", np.float32, 2), ("speed", np.float32), ("done", bool)])
    kept["command"], kept["speed"] = [[0.5, 0.25], [-0.75, 1.0]], [5.0, 6.0]
    state = batch.state()
    batch.step(kept["command"])
    after = batch.columns("command")["command"]
    batch.restore(state)
    batch.step(kept["command"].copy())
    assert (after == batch.columns("command")["command"]).all() and after["speed"][1] == 1.0
    observer = offtrack_sim.Observer("laden2026", ["20m/N-left-4"] * 2, vehicles=[("daf_xf", "laden")] * 2)
    chosen = np.zeros(2, [("action", np.int16), ("done", bool)])
    chosen["action"] = [3, 7]
    packed = observer.command(chosen["action"], kept["speed"])
    plain = observer.command(np.array([3, 7]), [5.0, 6.0])
    assert all((found == expected).all() for found, expected in zip(packed, plain))
    biases = np.zeros(9, [("bias", np.float32), ("used", bool)])
    biases["bias"] = np.arange(9)
    export.save(tmp_path / "own.safetensors", [(np.zeros((69, 9), np.float32), biases["bias"])])
    policy = offtrack_sim.Policy.load(tmp_path / "own.safetensors")
    assert (policy.logits(np.zeros((1, 69), np.float32)) == np.arange(9)).all()


@pytest.mark.parametrize(("scenario", "n_commands"), [("attard2023-continuous", 1), ("laden2026-continuous", 2)])
def test_a_policy_file_of_commands_is_evaluated_as_the_function_that_it_is(
    scenario: str, n_commands: int, tmp_path: Path
) -> None:
    batch = Batch(scenario, 2)
    rng = np.random.default_rng(3)
    weights = rng.normal(0, 0.3, (batch.n_values, n_commands)).astype(np.float32)
    file = tmp_path / "own.safetensors"
    export.save(file, [(weights, np.zeros(n_commands, np.float32))], scenario=scenario, squash="clip")
    policy = offtrack_sim.Policy.load(file)
    assert policy.head == "continuous" and (policy.action_table == batch.action_table).all()
    rows = batch.observation()
    assert np.allclose(policy.act(rows), (rows @ weights).clip(-1, 1), atol=1e-5)
    found = offtrack_sim.evaluate(policy, scenario, episodes=2)
    again = offtrack_sim.evaluate(policy.act, scenario, episodes=2)
    assert (found.ended == again.ended).all()
    levels = scenario.removesuffix("-continuous")
    with pytest.raises(ValueError, match=f"gives commands; {levels} has a table of actions"):
        offtrack_sim.evaluate(policy, levels)
    with pytest.raises(ValueError, match=f"chooses among 9 actions; {scenario} takes commands"):
        offtrack_sim.evaluate(offtrack_sim.Policy.shipped(), scenario)


def test_a_command_is_judged_before_it_is_rounded() -> None:
    actions = {"kind": "continuous", "speeds_kmh": [0.0, 30.0]}
    continuous = offtrack_sim.benchmark("traffic2026").changed({"actions": actions})
    env = RoundaboutParallel(continuous, 2, routes=["20m"])
    env.reset(seed=1)
    with pytest.raises(ValueError, match=r"actions\['truck_0'\]\[0\]: 1.00000000001; must lie in -1..1"):
        env.step({"truck_0": np.array([1.00000000001, 0.0]), "truck_1": np.array([0.0, 0.0])})
    with pytest.raises(ValueError, match=r"actions\[0, 0\]: 1.000000001; must lie in -1..1"):
        offtrack_sim.evaluate(
            lambda seen: np.full((len(seen), 2), 1 + 1e-9), "laden2026-continuous", routes=["16m/N-left-3"], episodes=1
        )
