"""Copies and pickles go on from where the original is, and leave it alone."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cloudpickle
import numpy as np
import pytest

import offtrack_sim
from offtrack_sim import Batch, Observer, Policy

MODES = ["same_step", "next_step", "disabled"]
WAYS: dict[str, Callable[[Any], Any]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
    "old pickle": lambda thing: pickle.loads(pickle.dumps(thing, protocol=2)),
    "cloudpickle": lambda thing: pickle.loads(cloudpickle.dumps(thing)),
}
everyway = pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)


def bytes_of(batch: Batch) -> dict[str, bytes]:
    return {name: column.tobytes() for name, column in batch.state().items()}


def assert_same(one: Any, other: Any) -> None:
    """Equal through dicts, tuples and arrays."""
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_same(one[key], other[key])
    elif isinstance(one, tuple | list):
        assert len(one) == len(other)
        for pair in zip(one, other):
            assert_same(*pair)
    elif isinstance(one, np.ndarray) and one.dtype == object:
        assert_same(list(one), list(other))
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype and one.tobytes() == other.tobytes()
    else:
        assert one == other


@everyway
def test_a_step_of_a_copied_environment_leaves_the_original_where_it_is(way: Callable[[Any], Any]) -> None:
    env = offtrack_sim.Roundabout()
    env.reset(seed=1)
    for _ in range(5):
        env.step(np.int64(4))
    before = bytes_of(env.batch)
    twin = way(env)
    steps = [twin.step(np.int64(8)) for _ in range(60) if not twin.batch.waiting()[0]]
    assert bytes_of(env.batch) == before
    again = [env.step(np.int64(8)) for _ in range(60) if not env.batch.waiting()[0]]
    assert_same(again, steps)
    # What is drawn next is the same too.
    assert_same(env.reset(), twin.reset())


@everyway
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("scenario", ["attard2023", "laden2026"])
def test_a_copied_vector_environment_goes_on_as_the_original(
    scenario: str, mode: str, way: Callable[[Any], Any]
) -> None:
    env = offtrack_sim.make_vec(scenario, num_envs=12, autoreset_mode=mode, seed=5)
    env.reset()
    rng = np.random.default_rng(2)

    def drive(steps: int, *envs: Any) -> list[Any]:
        found: list[Any] = [[] for _ in envs]
        for _ in range(steps):
            actions = rng.integers(0, 9, 12)
            for env, results in zip(envs, found):
                results.append(env.step(actions))
                done = results[-1][2] | results[-1][3]
                if mode == "disabled" and done.any():
                    results.append(env.reset(options={"reset_mask": done}))
        return found

    # Until a truck has just ended: its next step differs from those of the others.
    while not (drive(1, env)[0][0][2]).any():
        pass
    twin = way(env)
    assert_same(env.batch.ended(), twin.batch.ended())
    one, other = drive(150, env, twin)
    assert_same(one, other)
    assert (env.batch.routes() == twin.batch.routes()).all()
    assert env.batch.tally() == twin.batch.tally() and 12 < env.batch.tally()["episodes"]


@everyway
def test_a_copied_batch_has_its_attributes_streams_and_sums(way: Callable[[Any], Any]) -> None:
    class Own(Batch):
        """A user's own."""

        remark: list[str]

    # Pickle finds a class by its name.
    globals()["Own"], Own.__qualname__ = Own, "Own"
    batch = Own("attard2023", 6, routes=["16m"], seed=4, num_threads=1, max_episode_steps=40)
    batch.remark = ["mine"]
    batch.begin([2], seeds=[77])
    for _ in range(50):
        batch.step_at_random()
    twin = way(batch)
    assert type(twin) is Own and twin.remark == ["mine"] and repr(twin) == repr(batch)
    for _ in range(3):
        # A copy of a copy counts on too.
        twin = way(twin)
        for each in (batch, twin):
            each.step_at_random()
        assert bytes_of(batch) == bytes_of(twin) and batch.tally() == twin.tally()
    assert batch.tally()["env_steps"] == 53 * 6


@everyway
def test_a_copied_policy_drives_as_the_original(way: Callable[[Any], Any]) -> None:
    policy = Policy.shipped()
    twin = way(policy)
    observations = Batch(num_envs=64, seed=1).observation()
    assert twin.name == policy.name and (twin.logits(observations) == policy.logits(observations)).all()


def test_another_process_takes_a_policy_and_an_environment(tmp_path: Path, short_benchmark: str) -> None:
    env = offtrack_sim.make_vec(short_benchmark, num_envs=3, seed=1)
    env.reset()
    file = tmp_path / "both.pickle"
    file.write_bytes(pickle.dumps((env, Policy.shipped("attard2023"))))
    # From another folder.
    code = (
        f"import pickle; env, policy = pickle.load(open({str(file)!r}, 'rb'));"
        "print(env.step(policy.act(env.batch.observation()))[0].tobytes().hex())"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd="/")
    step = env.step(Policy.shipped("attard2023").act(env.batch.observation()))
    assert found.stdout.strip() == step[0].tobytes().hex()


def test_a_pickle_of_a_benchmark_that_has_changed_since_is_refused(short_benchmark: str) -> None:
    kept = pickle.dumps(Batch(short_benchmark, 2))
    file = Path(short_benchmark)
    file.write_text(file.read_text().replace("time_limit = 1.0", "time_limit = 1.5"))
    with pytest.raises(ValueError, match="scenario: short has changed since this state was kept"):
        pickle.loads(kept)


def test_a_pickle_of_a_batch_on_a_road_of_a_file_is_read_in_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    offtrack_sim.write_scenarios(tmp_path / "all")
    (tmp_path / "own.toml").write_text((tmp_path / "all/roundabouts/50m.toml").read_text())
    (tmp_path / "16m.toml").write_text((tmp_path / "own.toml").read_text())
    monkeypatch.chdir(tmp_path)
    batch = Batch("attard2023", 2, routes=["own.toml"], seed=5)
    observer = Observer("attard2023", [f"own.toml/{batch.route_names[0].split('/')[1]}"])
    kept = pickle.dumps((batch, observer))
    # A copy and the original know the road by any path of the file, and so do weights.
    route = batch.route_names[0].split("/")[1]
    for one in (batch, copy.copy(batch)):
        for path in ("own.toml", "./own.toml", str(tmp_path / "own.toml")):
            one.begin(routes=[f"{path}/{route}"] * 2)
    assert Batch("attard2023", 2, routes=["own.toml"], weights={"own.toml": 2.0}).route_names == batch.route_names
    batch = pickle.loads(kept)[0]
    # A road of a file is not one of the benchmark's that has its name.
    with pytest.raises(ValueError, match="another road of the batch is 16m too: rename one"):
        Batch("attard2023", 2, routes=["./16m.toml"])
    monkeypatch.chdir("/")
    there, other = pickle.loads(kept)
    assert there.route_names == batch.route_names and (there.observation() == batch.observation()).all()
    assert other.waypoints(other.routes[0]).shape == observer.waypoints(observer.routes[0]).shape


def test_trucks_that_were_held_when_a_state_was_kept_are_known_by_their_new_routes() -> None:
    batch = Batch(num_envs=16, seed=3, autoreset="next_step")
    while not batch.columns("truck")["truck"]["held"].any():
        batch.step_at_random()
    batch.restore(batch.state())
    batch.step(np.full(16, 4))
    assert (batch.routes() == batch.columns("truck")["truck"]["route"]).all()
