"""Several trucks on a road: groups of a batch, and the parallel environment of PettingZoo."""

from __future__ import annotations

import copy
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import offtrack_sim
from offtrack_sim import Batch, Ended, Policy, benchmark, make_vec
from offtrack_sim.parallel import RoundaboutParallel

with warnings.catch_warnings():
    # PettingZoo imports its own games for its tests, in a way that it warns of.
    warnings.simplefilter("ignore")
    from pettingzoo.test import parallel_api_test, parallel_seed_test

GROUPS = benchmark("traffic2026").changed({"traffic.group": 4}, name="groups")


def test_it_is_what_pettingzoo_asks_for() -> None:
    parallel_api_test(RoundaboutParallel(n_trucks=3, routes=["20m"]), num_cycles=400)
    with warnings.catch_warnings():
        # Its own comparison of seeds.
        warnings.simplefilter("ignore")
        parallel_seed_test(lambda: RoundaboutParallel(n_trucks=2, routes=["16m"]))


def test_agents_are_the_trucks_of_a_group_and_leave_with_their_episodes() -> None:
    env = RoundaboutParallel(n_trucks=4, routes=["20m"])
    batch = Batch(GROUPS, 4, routes=["20m"], autoreset="disabled", num_threads=1)
    batch.begin(streams=[(7, index) for index in range(4)])
    observations, infos = env.reset(seed=7)
    assert env.agents == env.possible_agents == ["truck_0", "truck_1", "truck_2", "truck_3"]
    roads = {infos[agent]["route"].split("-")[0] for agent in env.agents}
    assert len(roads) == 4, "each begins on an arm of its own"
    assert (np.stack(list(observations.values())) == batch.observation()).all()
    policy = Policy.shipped("traffic2026")
    n_left = []
    while env.agents:
        agents = list(env.agents)
        actions = policy.act(batch.observation())
        observations, rewards, terminations, truncations, infos = env.step(
            {agent: actions[int(agent[-1])] for agent in agents}
        )
        expected, reward, terminated, truncated = batch.step(actions)
        for agent in agents:
            row = int(agent[-1])
            assert (observations[agent] == expected[row]).all() and rewards[agent] == reward[row]
            assert (terminations[agent], truncations[agent]) == (terminated[row], truncated[row])
            has_left = agent not in env.agents
            assert has_left == (terminated[row] or truncated[row]) == batch.waiting()[row]
            assert ("ended" in infos[agent]) == has_left
            assert not has_left or infos[agent]["is_success"] == (infos[agent]["ended"] == Ended.ARRIVED)
        assert set(observations) == set(agents)
        n_left.append(len(env.agents))
    assert n_left[-1] == 0 and len(set(n_left)) > 2, "they do not end together"
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step({})


def test_a_truck_that_waits_for_its_group_has_no_reward_and_ends_once() -> None:
    for autoreset in ("same_step", "next_step"):
        batch = Batch(GROUPS, 16, routes=["16m"], seed=3, autoreset=autoreset)
        assert batch.group == 4
        waited = np.zeros(16, dtype=int)
        begun = batch.columns("truck")["truck"]["episode"].copy()
        for _ in range(400):
            before = batch.waiting()
            actions = np.random.default_rng(5).integers(36, size=16)
            _, reward, terminated, truncated = batch.step(actions)
            assert (reward[before] == 0).all() and not (terminated | truncated)[before].any()
            ends = batch.ended()
            ended = np.zeros(16, dtype=bool) if ends is None else np.isin(np.arange(16), ends.envs)
            assert (ended == (terminated | truncated)).all()
            episode = batch.columns("truck")["truck"]["episode"]
            for group in np.arange(16).reshape(4, 4):
                assert len(set(episode[group])) == 1
            waited += before
        # One group may stand through it.
        assert (episode > begun).sum() >= 8 and (waited > 0).sum() > 8


def test_a_picture_shows_the_other_trucks() -> None:
    quiet = {"traffic.demand": [0.0]}
    with_others = RoundaboutParallel(
        benchmark("traffic2026").changed(quiet), 4, routes=["20m"], render_mode="rgb_array"
    )
    with_others.reset(seed=1)
    picture = with_others.render()
    assert picture is not None and picture.shape == (480, 480, 3)
    # Both units in the colour of vans and what is larger.
    colour = np.array([0x87, 0x78, 0x5A])
    count = int((np.abs(picture.astype(int) - colour).max(axis=2) < 4).sum())
    assert count > 380, count
    assert RoundaboutParallel(n_trucks=2, routes=["20m"]).render() is None


def test_routes_are_stated_for_all_trucks() -> None:
    env = RoundaboutParallel(n_trucks=2, split="test")
    stated = ["20m/N-left-2", "20m/E-right-1"]
    _, infos = env.reset(seed=1, options={"routes": stated})
    assert [infos[agent]["route"] for agent in env.agents] == stated
    with pytest.raises(ValueError, match="begin in one lane; each needs its own"):
        env.reset(options={"routes": ["20m/N-left-2", "20m/N-left-4"]})
    with pytest.raises(ValueError, match="routes"):
        env.reset(options={"routes": ["20m/N-left-2"]})
    with pytest.raises(TypeError, match="routes: .*; a sequence is needed, one a truck"):
        env.reset(options={"routes": set(stated)})
    with pytest.raises(ValueError, match=r"starts.along: not where trucks share a road"):
        env.batch.begin(starts=[offtrack_sim.Start(along=0.5)] * 2)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"n_trucks": 9}, ValueError, "n_trucks: 9"),
        ({"n_trucks": 8, "routes": ["20m/N-left-2", "20m/N-right-1"]}, ValueError, "begin in 2 of the lanes of 20m"),
        ({"scenario": "attard2023"}, ValueError, "scenario: attard2023; .*with a table .traffic. is needed"),
        ({"render_mode": "human"}, ValueError, "render_mode: 'human'"),
    ],
)
def test_what_cannot_be_is_refused(arguments: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        RoundaboutParallel(**arguments)


def test_an_action_that_is_missing_or_none_is_named() -> None:
    env = RoundaboutParallel(n_trucks=2, routes=["20m"])
    env.reset(seed=1)
    with pytest.raises(KeyError, match="truck_1 is missing"):
        env.step({"truck_0": 3})
    with pytest.raises(TypeError, match="truck_1.*0.5"):
        env.step({"truck_0": 3, "truck_1": 0.5})
    with pytest.raises(ValueError, match=r"^actions\['truck_1'\]: 36; must lie in 0..35$"):
        env.step({"truck_0": 3, "truck_1": 36})
    with pytest.raises(TypeError, match="actions: None; a dict of an action for each agent"):
        env.step(None)  # type: ignore[arg-type]


def test_a_batch_of_groups_is_of_whole_ones_and_no_evaluation_of_single_trucks() -> None:
    with pytest.raises(ValueError, match="groups of 4 trucks"):
        Batch(GROUPS, 6)
    with pytest.raises(ValueError, match="traffic.group"):
        offtrack_sim.evaluate(Policy.shipped("traffic2026"), GROUPS, episodes=1)
    batch = Batch(GROUPS, 4)
    with pytest.raises(ValueError, match="not begun as a whole"):
        batch.begin([1])


def test_a_copy_goes_on_alone() -> None:
    env = RoundaboutParallel(n_trucks=2, routes=["20m"])
    env.reset(seed=1)
    before = env.batch.columns("truck")["truck"].copy()
    copied = copy.copy(env)
    copied.step({agent: 0 for agent in copied.agents})
    assert (env.batch.columns("truck")["truck"] == before).all()
    assert (copied.batch.columns("truck")["truck"] != before).any()


def test_a_benchmark_is_named_by_a_path_too() -> None:
    file = Path(__file__).parents[2] / "scenarios" / "traffic2026.toml"
    assert RoundaboutParallel(file, 2, routes=["20m"]).batch.group == 2


@pytest.mark.parametrize("mode", ["same_step", "next_step"])
def test_infos_of_a_vector_environment_tell_which_trucks_of_a_group_have_begun(mode: str) -> None:
    env = make_vec(GROUPS, 16, routes=["16m"], autoreset_mode=mode, seed=3)
    env.reset(seed=3)
    generator, n_begun = np.random.default_rng(5), 0
    for _ in range(300):
        waited, before = env.batch.waiting(), env.batch.columns("truck")["truck"]["episode"].copy()
        _, _, terminated, truncated, infos = env.step(generator.integers(36, size=16))
        begun = env.batch.columns("truck")["truck"]["episode"] != before
        routes = env.batch.routes()
        ended = terminated | truncated
        told = infos.get("_route", np.zeros(16, dtype=bool)) & (begun if mode == "next_step" else True)
        assert (told == begun).all() and not (begun & env.batch.waiting()).any()
        assert (begun <= (waited if mode == "next_step" else waited | ended)).all()
        for truck in np.flatnonzero(begun):
            assert infos["route"][truck] == env.batch.route_names[routes[truck]]
        n_begun += begun.sum()
    assert n_begun >= 8
