"""One truck, and Gymnasium's own tools around it."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

import offtrack_sim

ID = "offtrack_sim:offtrack/Roundabout-v0"


def test_gymnasiums_checker_finds_nothing() -> None:
    check_env(gymnasium.make(ID, render_mode="rgb_array").unwrapped)


def test_older_versions_of_gymnasium_have_environments_of_one_truck_and_batches() -> None:
    # As gymnasium before 1.1: its vector environments have no modes.
    code = (
        "import gymnasium.vector; del gymnasium.vector.AutoresetMode; import offtrack_sim as sim;"
        "sim.Roundabout().reset(seed=1); sim.Batch(num_envs=2, autoreset='same_step').step_at_random();"
        "sim.make_vec(num_envs=2)"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "vector environments need 1.1 or later; Roundabout and Batch do not" in ran.stderr, ran.stderr


def test_it_is_made_by_its_id_alone_and_as_a_vector() -> None:
    env = gymnasium.make(ID, scenario="attard2023", split="test")
    assert env.reset(seed=3)[1]["route"].startswith(("20m/", "40m/"))
    vector = gymnasium.make_vec(ID, num_envs=4, split="test", vectorization_mode="vector_entry_point")
    assert isinstance(vector.unwrapped, offtrack_sim.RoundaboutVector) and vector.num_envs == 4
    assert vector.unwrapped.reset(seed=[3, 4, 5, 6])[1]["route"][0] == env.reset(seed=3)[1]["route"]


def test_an_episode_ends_with_its_reason_and_needs_a_reset() -> None:
    env = offtrack_sim.Roundabout(routes=["16m/N-left-2"])
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.int64(4))
    observation, info = env.reset(seed=1, options={"start": (0.0, 0.0)})
    assert info == {"route": "16m/N-left-2"} and env.observation_space.contains(observation)
    for _ in range(200):
        observation, reward, terminated, truncated, info = env.step(np.int64(0))
        if terminated or truncated:
            break
        assert info == {}
    assert terminated and info["ended"] in set(offtrack_sim.Ended) and info["is_success"] is False
    assert reward < -400
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.int64(0))
    env.reset()
    env.step(np.int64(0))


def test_a_shorter_time_limit_of_its_own_is_gymnasiums_with_infos() -> None:
    own = offtrack_sim.Roundabout(max_episode_steps=5)
    wrapped = gymnasium.make(ID, max_episode_steps=5)
    own.reset(seed=1)
    route = wrapped.reset(seed=1)[1]["route"]
    for step in range(5):
        mine, its = own.step(np.int64(4)), wrapped.step(np.int64(4))
        assert (mine[0] == its[0]).all() and mine[1:4] == its[1:4] and mine[3] == (step == 4)
    assert mine[4] == {"ended": offtrack_sim.Ended.TIMED_OUT, "is_success": False, "route": route}
    # As the documentation says of Gymnasium's wrapper.
    assert its[4] == {}


@pytest.mark.parametrize(
    ("action", "error", "message"),
    [
        (9, ValueError, "action: 9; must lie in 0..8"),
        (-1, ValueError, "action: -1"),
        (0.5, TypeError, "action: 0.5; an integer is needed"),
        ("left", TypeError, "action: 'left'"),
    ],
)
def test_wrong_actions_are_refused_as_given(action: Any, error: type[Exception], message: str) -> None:
    env = offtrack_sim.Roundabout()
    env.reset(seed=0)
    with pytest.raises(error, match=message):
        env.step(action)


def test_wrong_options_and_modes_are_refused() -> None:
    env = offtrack_sim.Roundabout()
    with pytest.raises(ValueError, match="options: 'routes'; must be one of route, start"):
        env.reset(options={"routes": ["16m/N-left-2"]})
    with pytest.raises(ValueError, match="seed: -1; must lie in 0..4294967295"):
        env.reset(seed=-1)
    with pytest.raises(ValueError, match="render_mode: 'human'; must be None or \"rgb_array\""):
        offtrack_sim.make_vec(render_mode="human")
    vector = offtrack_sim.make_vec(num_envs=2)
    with pytest.raises(gymnasium.error.ResetNeeded):
        vector.step(np.zeros(2, int))
    wrong: list[tuple[dict[str, Any], type[Exception], str]] = [
        ({"mask": [True, False]}, ValueError, "options: 'mask'"),
        ({"reset_mask": [True, False]}, TypeError, "reset_mask'.: list; a numpy array of bool is needed"),
        ({"reset_mask": np.array([1, 0])}, TypeError, "array of int64"),
        ({"reset_mask": np.array([True])}, ValueError, r"shape \(1,\); \(2,\) is needed"),
        ({"reset_mask": np.array([False, False])}, ValueError, "at least one must be"),
        ({"routes": ["16m/N-left-2"]}, ValueError, "1 of them; 2 are needed"),
    ]
    for options, error, message in wrong:
        with pytest.raises(error, match=message):
            vector.reset(options=options)
    with pytest.raises(ValueError, match="seed: 3 seeds for 2 trucks"):
        vector.reset(seed=[1, 2, 3])


def test_wrappers_of_gymnasium_work_around_both() -> None:
    from gymnasium.wrappers import FrameStackObservation, NormalizeReward, RecordEpisodeStatistics, TimeLimit
    from gymnasium.wrappers import vector as of_vectors

    env = TimeLimit(FrameStackObservation(NormalizeReward(RecordEpisodeStatistics(offtrack_sim.Roundabout())), 3), 20)
    observation, _ = env.reset(seed=1)
    assert observation.shape == (3, 69)
    truncated = False
    for _ in range(20):
        observation, _, terminated, truncated, _ = env.step(np.int64(4))
    assert truncated or terminated

    vector = of_vectors.NormalizeReward(of_vectors.RecordEpisodeStatistics(offtrack_sim.make_vec(num_envs=8)))
    vector.reset(seed=1)
    episodes = 0
    for _ in range(200):
        _, reward, _, _, infos = vector.step(np.zeros(8, int))
        episodes += int(infos.get("_episode", np.zeros(8)).sum())
    assert 8 < episodes and np.isfinite(reward).all()


def test_processes_of_their_own_give_the_same(tmp_path: Path) -> None:
    makers = [offtrack_sim.Roundabout for _ in range(3)]
    # Threads of the parent do not live in a forked child: each batch makes its own.
    parent = offtrack_sim.make_vec(num_envs=64)
    parent.reset(seed=0)
    parent.step(np.zeros(64, int))
    for context in ("fork", "forkserver"):
        envs = AsyncVectorEnv(makers, context=context)
        sync = SyncVectorEnv(makers)
        try:
            assert (envs.reset(seed=5)[0] == sync.reset(seed=5)[0]).all()
            for _ in range(60):
                one, other = envs.step(np.array([0, 4, 8])), sync.step(np.array([0, 4, 8]))
                assert (one[0] == other[0]).all() and (one[1] == other[1]).all()
        finally:
            envs.close()


def test_a_batch_goes_on_in_a_forked_child() -> None:
    batch = offtrack_sim.Batch(num_envs=256, seed=1, num_threads=2)
    actions = np.full(256, 4)
    batch.step(actions)
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe()

    def child() -> None:
        sender.send_bytes(batch.step(actions)[0].tobytes())

    process = context.Process(target=child)
    process.start()
    assert receiver.poll(60), "the child does not answer"
    there = receiver.recv_bytes()
    process.join()
    assert batch.step(actions)[0].tobytes() == there


def test_a_forked_child_does_not_wait_for_a_thread_of_its_parent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OFFTRACK_CACHE", str(tmp_path))  # no road is in it
    long = offtrack_sim.benchmark("random2026").changed({"procedural.seed": 71})
    thread = threading.Thread(target=lambda: offtrack_sim.Batch(long, num_envs=1))
    thread.start()
    context = multiprocessing.get_context("fork")
    children: list[Any] = []

    def child(sender: Any) -> None:
        sender.send(offtrack_sim.Batch("attard2023", num_envs=2).num_envs)

    while thread.is_alive() and len(children) < 20:
        receiver, sender = context.Pipe()
        process = context.Process(target=child, args=(sender,))
        process.start()
        children.append((process, receiver))
        time.sleep(0.3)
    thread.join()
    until = time.monotonic() + 60
    answered = [receiver.poll(max(0.0, until - time.monotonic())) for _, receiver in children]
    for process, _ in children:
        process.kill()
    assert len(children) > 2 and all(answered), "a child waits for a thread that it does not have"


def test_pictures_show_the_truck(tmp_path: Path) -> None:
    env = offtrack_sim.Roundabout(render_mode="rgb_array", render_size=240)
    env.reset(seed=1)
    first = env.render()
    assert first is not None and first.shape == (240, 240, 3) and first.dtype == np.uint8
    for _ in range(20):
        env.step(np.int64(4))
    second = env.render()
    assert second is not None
    changed = (first != second).any(axis=2).mean()
    assert 0.001 < changed < 0.3
    assert offtrack_sim.Roundabout().render() is None


def test_films_are_recorded_of_one_truck_and_of_many(tmp_path: Path) -> None:
    from gymnasium.wrappers import RecordVideo
    from gymnasium.wrappers import vector as of_vectors

    env = RecordVideo(offtrack_sim.Roundabout(render_mode="rgb_array", render_size=128), str(tmp_path / "one"))
    env.reset(seed=1)
    for _ in range(200):
        if any(env.step(np.int64(0))[2:4]):
            break
    env.close()  # type: ignore[no-untyped-call]
    vector = offtrack_sim.make_vec(num_envs=4, render_mode="rgb_array", render_size=64)
    films = of_vectors.RecordVideo(vector, str(tmp_path / "many"), step_trigger=lambda step: step == 0, video_length=20)
    films.reset(seed=1)
    for _ in range(25):
        films.step(np.zeros(4, int))
    films.close()
    for folder in ("one", "many"):
        found = list((tmp_path / folder).glob("*.mp4"))
        assert len(found) == 1 and 1000 < found[0].stat().st_size


def test_a_size_that_no_picture_has_is_refused_before_there_are_trucks() -> None:
    for make in (offtrack_sim.make_vec, offtrack_sim.RoundaboutVector):
        with pytest.raises(ValueError, match=r"^render_size: 10; must lie in 64\.\.4096"):
            make("attard2023", 2, render_mode="rgb_array", render_size=10)
    with pytest.raises(ValueError, match=r"^render_size: 5000; must lie in 64\.\.4096"):
        offtrack_sim.Roundabout("attard2023", render_mode="rgb_array", render_size=5000)
