"""The vector environment is as many single ones: the checker that Gymnasium does not have."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import offtrack_sim

MODES = list(AutoresetMode)
N = 24


def assert_same(ours: Any, theirs: Any, path: str = "infos") -> None:
    """Equal keys, types and values, through dicts and arrays of arrays."""
    assert type(ours) is type(theirs), path
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys(), path
        for key in ours:
            assert_same(ours[key], theirs[key], f"{path}/{key}")
    elif isinstance(ours, np.ndarray):
        assert ours.dtype == theirs.dtype and ours.shape == theirs.shape, path
        if ours.dtype == object:
            for one, other in zip(ours, theirs):
                assert_same(one, other, path)
        else:
            assert (ours == theirs).all(), path
    else:
        assert ours == theirs, path


def drive_both(ours: Any, theirs: Any, mode: AutoresetMode, steps: int, action: Any) -> int:
    """Steps both alike and compares everything; returns how many episodes ended."""
    ended = 0
    for step in range(steps):
        actions = action(step)
        one, other = ours.step(actions), theirs.step(actions)
        for mine, its in zip(one[:4], other[:4]):
            assert (mine == its).all(), step
        assert_same(one[4], other[4])
        done = one[2] | one[3]
        ended += int(done.sum())
        if mode is AutoresetMode.DISABLED and done.any():
            again, reference = (
                ours.reset(options={"reset_mask": done}),
                theirs.reset(options={"reset_mask": done.copy()}),
            )
            assert (again[0] == reference[0]).all()
            assert_same(again[1], reference[1])
    return ended


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("scenario", ["attard2023", "laden2026"])
def test_many_trucks_equal_as_many_single_ones_in_every_value(scenario: str, mode: AutoresetMode) -> None:
    ours = offtrack_sim.make_vec(scenario, num_envs=N, autoreset_mode=mode)
    theirs = SyncVectorEnv([lambda: offtrack_sim.Roundabout(scenario) for _ in range(N)], autoreset_mode=mode)
    n_actions = len(ours.batch.action_table)
    seeds: list[int | None] = list(range(100, 100 + N))
    one, other = ours.reset(seed=seeds), theirs.reset(seed=seeds)
    assert (one[0] == other[0]).all()
    assert_same(one[1], other[1])
    rng = np.random.default_rng(3)
    ended = drive_both(ours, theirs, mode, 400, lambda _: rng.integers(0, n_actions, N))
    assert 200 < ended
    # Another reset goes on with the next episodes.
    one, other = ours.reset(), theirs.reset()
    assert (one[0] == other[0]).all()
    assert_same(one[1], other[1])


@pytest.mark.parametrize("mode", MODES)
def test_the_end_of_the_clock_truncates_alike(mode: AutoresetMode, short_benchmark: str) -> None:
    ours = offtrack_sim.make_vec(short_benchmark, num_envs=6, autoreset_mode=mode)
    theirs = SyncVectorEnv([lambda: offtrack_sim.Roundabout(short_benchmark) for _ in range(6)], autoreset_mode=mode)
    ours.reset(seed=list(range(6)))
    theirs.reset(seed=list(range(6)))
    truncated = 0
    # Straight on, slowly: the time is over before the ring is reached.
    actions = np.full(6, 13)
    for _ in range(700):
        one, other = ours.step(actions), theirs.step(actions)
        for mine, its in zip(one[:4], other[:4]):
            assert (mine == its).all()
        assert_same(one[4], other[4])
        truncated += int(one[3].sum())
        assert not (one[2] & one[3]).any()
        if mode is AutoresetMode.DISABLED and (one[2] | one[3]).any():
            done = one[2] | one[3]
            ours.reset(options={"reset_mask": done})
            theirs.reset(options={"reset_mask": done.copy()})
    assert 12 <= truncated
    assert ours.batch.tally()["timed_out"] == truncated


def test_a_truck_drives_the_same_whatever_place_size_and_threads() -> None:
    rng = np.random.default_rng(5)
    actions = rng.integers(0, 9, (300, 40))
    whole = offtrack_sim.make_vec(num_envs=40, autoreset_mode="same_step", num_threads=2)
    part = offtrack_sim.make_vec(num_envs=7, autoreset_mode="same_step", num_threads=1)
    seeds = [int(seed) for seed in rng.integers(0, 2**32, 40)]
    chosen = [39, 3, 17, 0, 8, 25, 11]
    whole.reset(seed=seeds)
    part.reset(seed=[seeds[env] for env in chosen])
    for row in actions:
        one, other = whole.step(row), part.step(row[chosen])
        for mine, its in zip(one[:4], other[:4]):
            assert (mine[chosen] == its).all()
    assert 40 < whole.batch.tally()["episodes"]


def test_an_int_seed_is_the_batch_of_that_seed_and_none_goes_on() -> None:
    env = offtrack_sim.make_vec(num_envs=5)
    batch = offtrack_sim.Batch(num_envs=5, seed=11)
    first, infos = env.reset(seed=11)
    assert env.np_random_seed == 11
    assert (first == batch.observation()).all()
    assert infos["_route"].all() and infos["route"][2] == batch.route_names[batch.routes()[2]]
    second, _ = env.reset()
    batch.begin()
    assert (second == batch.observation()).all() and (second != first).any()
    seeded, _ = env.reset(seed=[None, 11, None, None, None])
    assert (seeded[1] == offtrack_sim.Roundabout().reset(seed=11)[0]).all()
    # Before the first reset there is nothing to go on from: a truck without a seed begins with its first episode.
    begun, _ = offtrack_sim.make_vec(num_envs=5, seed=11).reset(seed=[None, 11, None, None, None])
    assert (begun[[0, 2, 3, 4]] == first[[0, 2, 3, 4]]).all() and (begun[1] == seeded[1]).all()


def test_without_a_seed_two_environments_differ_and_with_one_they_do_not() -> None:
    def first(**kwargs: Any) -> Any:
        return offtrack_sim.make_vec(num_envs=3, **kwargs).reset()[0]

    assert (first() != first()).any()
    assert (first(seed=4) == first(seed=4)).all()


def test_without_copies_the_last_arrays_are_overwritten() -> None:
    kept, fresh = (offtrack_sim.make_vec(num_envs=4, seed=1, copy=copy) for copy in (False, True))
    one, other = kept.reset()[0], fresh.reset()[0]
    assert (one == other).all()
    for _ in range(3):
        ours, theirs = kept.step(np.full(4, 8)), fresh.step(np.full(4, 8))
        assert ours[0] is one
        assert all((mine == its).all() for mine, its in zip(ours[:4], theirs[:4]))
    assert theirs[0] is not other


def test_a_reset_states_routes_and_starts_of_the_marked_trucks_alone() -> None:
    env = offtrack_sim.make_vec(num_envs=3, seed=2, autoreset_mode="disabled")
    before, _ = env.reset()
    mask = np.array([False, True, False])
    options = {"reset_mask": mask, "routes": [None, "50m/W-left-2", "16m/N-left-1"], "starts": [None, (0.0, 0.0), None]}
    after, infos = env.reset(options=options)
    assert list(options) == ["reset_mask", "routes", "starts"], "the caller's options are left alone"
    assert infos["route"].tolist() == [None, "50m/W-left-2", None] and infos["_route"].tolist() == mask.tolist()
    assert (after[[0, 2]] == before[[0, 2]]).all() and (after[1] != before[1]).any()
    assert env.batch.columns("progress")["progress"]["lane_distance"][1] < 1e-4


def test_a_batch_that_was_put_elsewhere_is_believed() -> None:
    env = offtrack_sim.make_vec("attard2023", 2, seed=1)
    env.reset(seed=1)
    running = env.batch.state()
    while not env.batch.waiting()[0]:
        env.step(np.array([0, 4]))
    env.batch.restore(running)
    assert env.step(np.array([4, 4]))[4] == {}
    single = offtrack_sim.Roundabout()
    single.reset(seed=1)
    running = single.batch.state()
    while not single.batch.waiting()[0]:
        single.step(0)
    single.batch.restore(running)
    single.step(4)


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_who_writes_into_a_mask_of_infos_changes_no_other(mode: str, short_benchmark: str) -> None:
    envs = offtrack_sim.make_vec(short_benchmark, num_envs=2, autoreset_mode=mode)
    envs.reset(seed=0)
    infos: dict[str, Any] = {}
    while not infos:
        infos = envs.step(np.zeros(2, np.int64))[4]
    of_end = infos.get("final_info", infos)
    assert of_end["_ended"].any()
    of_end["_ended"][:] = False
    assert of_end["_is_success"].any() and of_end["_route"].any() and infos.get("_final_info", of_end["_route"]).any()


def test_seeds_and_starts_are_sequences() -> None:
    env = offtrack_sim.make_vec("attard2023", 2)
    first = env.reset(seed=np.array(7))[0]
    assert (first == env.reset(seed=7)[0]).all()
    for given in ({"a": None, "b": None}, {None}, "ab"):
        with pytest.raises(TypeError, match="starts.*; a sequence is needed, one a truck"):
            env.reset(options={"starts": given})
        with pytest.raises(TypeError, match="^starts: .*; a sequence is needed, one a truck"):
            env.batch.begin(starts=given)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match='^autoreset_mode: "NEVER"; must be one of next_step, same_step, disabled'):
        offtrack_sim.make_vec("attard2023", 2, autoreset_mode="NEVER")
