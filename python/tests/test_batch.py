"""The simulator itself, and everything that a caller can get wrong about it."""

from __future__ import annotations

import re
import threading
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from offtrack_sim import COLUMNS, OBSERVATION, Batch, Ended, ScenarioError, make_vec


def fnv_1a(data: bytes) -> int:
    """The hash of tests/simulator/pinned.rs."""
    found = 0xCBF29CE484222325
    for byte in data:
        found = ((found ^ byte) * 0x100000001B3) & (2**64 - 1)
    return found


def test_python_and_rust_see_the_same_bytes() -> None:
    batch = Batch("attard2023", 512, seed=7)
    for _ in range(300):
        batch.step_at_random()
    # tests/simulator/pinned.rs has these hashes too.
    pinned = {
        "observation": 0x7FF7F3A189249B08,
        "reward": 0x389FA7D600C478BE,
        "ended": 0x09A0A2A24AFE7F83,
        "truck": 0x4872ED0CAB20F30A,
    }
    columns = batch.columns(*pinned)
    # A truck's fields that came later stand behind the 64 bytes that were pinned.
    found = {name: column.view(np.uint8).reshape(512, -1) for name, column in columns.items()}
    found["truck"] = found["truck"][:, :64]
    assert {name: fnv_1a(column.tobytes()) for name, column in found.items()} == pinned


def test_columns_have_their_declared_rows_and_agree_with_the_step() -> None:
    batch = Batch(num_envs=6, seed=3)
    observation, reward, terminated, truncated = batch.step(np.full(6, 8))
    columns = batch.columns()
    assert columns.keys() == COLUMNS.keys()
    # Without other vehicles those of vehicles have no rows.
    rows = {name: 0 if name in ("cars", "around", "next_around") else 6 for name in COLUMNS}
    for name, column in columns.items():
        assert column.dtype == COLUMNS[name].base and column.shape == (rows[name], *COLUMNS[name].shape)
    assert (columns["observation"] == observation).all() and (columns["reward"] == reward).all()
    assert (columns["action"] == 8).all()
    truck = columns["truck"]
    speed = next(values for values in OBSERVATION if values.name == "speed")
    assert np.allclose(truck["speed"] / 27.8, observation[:, speed.first])
    assert truck["position"].shape == (6, 2) and (truck["steps"] == 1).all()
    assert [batch.route_names[route] for route in truck["route"]] == [
        batch.route_names[route] for route in batch.routes()
    ]
    assert not terminated.any() and not truncated.any()
    assert set(batch.columns("reward")) == {"reward"}


def test_observations_stay_in_their_bounds() -> None:
    low = np.concatenate([np.full(values.n, values.low) for values in OBSERVATION])
    batch = Batch(num_envs=256, seed=1)
    rng = np.random.default_rng(0)
    for _ in range(400):
        observation = batch.step(rng.integers(0, 9, 256))[0]
        assert (low <= observation).all() and (observation <= 1).all()
        ends = batch.ended()
        if ends is not None:
            assert (low <= ends.observations).all() and (ends.observations <= 1).all()
    assert 1000 < batch.tally()["episodes"]


def test_a_step_into_arrays_gives_what_a_step_returns() -> None:
    one, other = Batch(num_envs=5, seed=2), Batch(num_envs=5, seed=2)
    fragment = (
        np.zeros((40, 5, 69), np.float32),
        np.zeros((40, 5), np.float32),
        np.zeros((40, 5), bool),
        np.zeros((40, 5), bool),
    )
    for step in range(40):
        actions = np.full(5, step % 9)
        one.step_into(actions, *(array[step] for array in fragment))
        for mine, its in zip(fragment, other.step(actions)):
            assert (mine[step] == its).all()
    assert fragment[0].any() and fragment[1].any()


@pytest.mark.parametrize("autoreset", ["same_step", "next_step"])
def test_what_ended_is_told_once_with_the_last_observation(autoreset: str) -> None:
    # Where trucks start on a kerb, episodes of one step follow each other.
    routes = ["50m/E-right-1", "50m/NE-right-1", "50m/E-left-3"]
    batch = Batch("attard2023-as-run", 64, routes=routes, seed=4, autoreset=autoreset)
    told, of_one_step = 0, 0
    for _ in range(300):
        before = batch.columns("truck")["truck"]
        episodes = batch.tally()["episodes"]
        assert (batch.routes() == before["route"]).all()
        terminated = batch.step(np.full(64, 0))[2]
        ends = batch.ended()
        assert (batch.tally()["episodes"] - episodes) == (0 if ends is None else len(ends.envs))
        if ends is None:
            continue
        told += len(ends.envs)
        of_one_step += int((before["steps"][ends.envs] == 0).sum())
        assert terminated[ends.envs].all() and (ends.routes == before["route"][ends.envs]).all()
        assert (ends.observations == batch.columns("next_observation")["next_observation"][ends.envs]).all()
        assert (ends.codes == batch.columns("ended")["ended"][ends.envs]).all() and (ends.codes != Ended.RUNNING).all()
        # Nothing has happened since: it is told again, and a step later no more.
        assert batch.ended() is not None
    assert 100 < told and 10 < of_one_step


@pytest.mark.parametrize("scenario", ["transfer2026", "traffic2026", "laden2026-continuous"])
def test_columns_after_an_end_are_of_the_step_or_of_the_next_episode_as_it_is_said(scenario: str) -> None:
    said = re.sub(r"\s+", " ", str(Batch.columns.__doc__))
    parts = re.search(r"are of that step: (.*?)\. The others are the next episode's: (.*?)\. In", said)
    assert parts
    of_step, of_next = (set(re.findall("``(.*?)``", part)) for part in parts.groups())
    assert of_step | of_next == set(COLUMNS) and not of_step & of_next
    same, kept = (Batch(scenario, 32, seed=3, autoreset=mode) for mode in ("same_step", "disabled"))
    rng, ends, differ = np.random.default_rng(0), 0, set()
    while ends < 8:
        actions: Any = rng.integers(0, len(same.action_table), 32)
        if same.n_commands:
            actions = rng.uniform(-1, 1, (32, same.n_commands)).astype(np.float32)
        done = same.step(actions)[2]
        kept.step(actions)
        if not done.any():
            continue
        ends += 1
        found, last = same.columns(), kept.columns()
        kept.begin(np.flatnonzero(done))
        begun = kept.columns()
        for name in (name for name in COLUMNS if len(found[name])):
            expected = last if name in of_step else begun
            assert found[name][done].tobytes() == expected[name][done].tobytes(), name
            if last[name][done].tobytes() != begun[name][done].tobytes():
                differ.add(name)
    # What begins an episode leaves these as they were, so that they may be either.
    assert set(COLUMNS) - differ <= {"action", "command", "clearance", "poses", "cars", "extras", "next_extras"} | {
        "around",
        "next_around",
    }


def test_a_state_is_restored_bit_for_bit_with_its_streams() -> None:
    batch = Batch(num_envs=12, seed=5)
    batch.begin([3, 7], seeds=[1, None])
    for _ in range(70):
        batch.step_at_random()
    state = batch.state()
    other = Batch(num_envs=12, seed=99)
    other.restore(state)
    for _ in range(120):
        batch.step_at_random()
        other.step_at_random()
    mine, its = batch.state(), other.state()
    assert mine["truck"]["episode"].min() > 0
    assert all(mine[name].tobytes() == its[name].tobytes() for name in mine)
    before = other.state()
    for wrong, message in [
        (
            {**state, "reward": state["reward"][:3]},
            r"reward: float32 of shape \(3,\); float32 of shape \(12,\) is needed",
        ),
        ({name: column for name, column in state.items() if name != "stream"}, "state: stream is missing"),
        (Batch(num_envs=12, split="test").state(), "scenario: attard2023 has changed since .* or is another one here"),
        ({**state, "action": np.full(12, 77, np.uint32)}, r"action\[0\]: 77; the world has actions 0..8"),
    ]:
        with pytest.raises(ValueError, match=message):
            other.restore(wrong)
        assert all(before[name].tobytes() == column.tobytes() for name, column in other.state().items())
    shorter = Batch(num_envs=12, max_episode_steps=9)
    with pytest.raises(ValueError, match="; benchmark file, routes or split, and max_episode_steps must be alike"):
        shorter.restore(state)
    # NumPy makes an array of one number of what is a number.
    other.restore({name: np.ascontiguousarray(column) for name, column in state.items()})


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"scenario": "attard"}, ValueError, "benchmark: attard; must be a path ending in .toml or one of attard2023"),
        ({"scenario": "no/such.toml"}, ScenarioError, "no/such.toml: cannot be read"),
        ({"split": "tests"}, ValueError, 'split: "tests"; must be one of train, validation, test'),
        ({"split": "validation"}, ValueError, 'split: "validation"; attard2023 has no such routes, only train, test'),
        ({"routes": ["17m"]}, ValueError, 'routes: "17m"; attard2023 has 16m/'),
        ({"routes": []}, ValueError, "routes: empty"),
        ({"routes": [3]}, TypeError, "routes: 3; names of routes or roundabouts are needed"),
        ({"num_envs": 0}, ValueError, "num_envs: 0; must be at least 1"),
        ({"num_envs": -5}, ValueError, "num_envs: -5; must be at least 1"),
        (
            {"scenario": 5},
            TypeError,
            "scenario: 5; the name of a benchmark, the path of its file, a Benchmark or a dict of its keys is needed",
        ),
        ({"num_envs": "3"}, TypeError, "num_envs: '3'; an integer is needed"),
        ({"num_envs": 2.0}, TypeError, "num_envs: 2.0; an integer is needed"),
        ({"num_envs": 10**12}, MemoryError, "num_envs: 1000000000000"),
        ({"num_envs": 10**30}, MemoryError, "num_envs"),
        ({"num_envs": 2**31}, MemoryError, "num_envs: 2147483648; the columns would take"),
        ({"seed": -1}, ValueError, "seed: -1; must lie in 0..4294967295"),
        ({"seed": 2**32}, ValueError, "seed: 4294967296; must lie in"),
        ({"seed": 1.5}, TypeError, "seed: 1.5; an integer is needed"),
        ({"autoreset": "never"}, ValueError, 'autoreset: "never"; must be one of next_step, same_step, disabled'),
        ({"num_threads": 0}, ValueError, "num_threads: 0; must lie in 1..1024"),
        ({"device": "no such card"}, RuntimeError, "device: "),
    ],
)
def test_a_batch_that_cannot_be_is_refused(arguments: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error) as caught:
        Batch(**arguments)
    assert message in str(caught.value)


def test_a_bad_file_is_refused_with_its_key(tmp_path: Path, short_benchmark: str) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(Path(short_benchmark).read_text().replace("range = 20.0", "range = -3.0"))
    with pytest.raises(ScenarioError, match=r"bad.toml: sensors.range: -3"):
        Batch(file)


@pytest.mark.parametrize(
    ("actions", "error", "message"),
    [
        (np.array([0, -1, 0, 0]), ValueError, r"actions\[1\]: -1; must lie in 0..8"),
        (np.array([0, 0, 9, 0]), ValueError, r"actions\[2\]: 9; must lie in 0..8"),
        (np.array([0, 0, 2**40, 0]), ValueError, r"actions\[2\]: 1099511627776; must lie in 0..8"),
        (np.array([0, 0, 0]), ValueError, "actions: 3 of them; 4 are needed"),
        (
            np.zeros(4),
            TypeError,
            r"actions: ndarray of float64 and shape \(4,\); a numpy array of integers of shape \(4,\)",
        ),
        (np.zeros((4, 1), int), TypeError, r"actions: ndarray of int64 and shape \(4, 1\)"),
        (np.zeros(4, bool), TypeError, "actions: ndarray of bool"),
        ([0, 0, 0, 0], TypeError, "actions: list; a numpy array of integers"),
        (None, TypeError, "actions: NoneType"),
    ],
)
def test_wrong_actions_change_nothing(actions: Any, error: type[Exception], message: str) -> None:
    batch = Batch(num_envs=4)
    before = batch.state()
    with pytest.raises(error, match=message):
        batch.step(actions)
    assert all(before[name].tobytes() == column.tobytes() for name, column in batch.state().items())


def test_actions_of_any_integer_type_and_layout_are_taken() -> None:
    for dtype in (np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64):
        batch = Batch(num_envs=4)
        batch.step(np.arange(8, dtype=dtype)[::2])
        assert batch.columns("action")["action"].tolist() == [0, 2, 4, 6]


def test_wrong_outputs_and_requests_are_refused() -> None:
    batch = Batch(num_envs=3)
    good: list[Any] = [np.zeros((3, 69), np.float32), np.zeros(3, np.float32), np.zeros(3, bool), np.zeros(3, bool)]
    for index, wrong in [
        (0, np.zeros((3, 69))),
        (0, np.zeros((4, 69), np.float32)),
        (0, np.zeros((69, 3), np.float32)),
        (1, np.zeros(2, np.float32)),
        (2, np.zeros(3)),
        (3, np.zeros(6, bool)[::2]),
    ]:
        with pytest.raises(TypeError, match="must be a writable, contiguous numpy array"):
            batch.step_into(np.zeros(3, int), *[*good[:index], wrong, *good[index + 1 :]])
    frozen = np.zeros(3, np.float32)
    frozen.flags.writeable = False
    with pytest.raises(TypeError, match="reward: must be a writable"):
        batch.step_into(np.zeros(3, int), good[0], frozen, good[2], good[3])
    for request, message in [
        ({"envs": [3]}, "envs: 3; the batch has trucks 0..2"),
        ({"envs": [0], "routes": ["20m/N-left-3"]}, 'routes: "20m/N-left-3"; the batch drives 16m/'),
        (
            {"envs": [0], "starts": [(2.0, 0.0)]},
            r"starts\[0\].offset: 2; must lie in -1..1, a fraction of the largest error or range",
        ),
        ({"envs": [0], "seeds": [1, 2]}, "seeds: 2 of them; 1 are needed"),
        ({"envs": [0], "seeds": [1], "streams": [(1, 2)]}, "seeds, streams: give one of them"),
    ]:
        with pytest.raises(ValueError, match=message):
            batch.begin(**request)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="column: 'speed'|column: \"speed\"; must be one of action, control"):
        batch.columns("speed")
    with pytest.raises(IndexError, match="vehicle: 5; there are 0..0"):
        batch.dimensions_of(5)
    with pytest.raises(ValueError, match="env: 3; must lie in 0..2"):
        batch.render(3)
    with pytest.raises(ValueError, match="size: 10; must lie in 64..4096"):
        batch.render(0, 10)


def test_an_ended_truck_needs_another_episode_where_none_begins_by_itself() -> None:
    batch = Batch(num_envs=8, autoreset="disabled")
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"truck \d: its episode has ended"):
        for _ in range(300):
            batch.step(np.full(8, 0))
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"truck \d: its episode has ended"):
        batch.step_at_random()
    held = np.flatnonzero(batch.columns("truck")["truck"]["held"])
    batch.begin(held)
    batch.step(np.full(8, 4))


def test_two_threads_may_not_share_a_batch() -> None:
    batch = Batch(num_envs=20_000)
    actions = np.full(20_000, 4)
    errors: list[Exception] = []

    def drive() -> None:
        try:
            for _ in range(20):
                batch.step(actions)
        except RuntimeError as error:
            errors.append(error)

    threads = [threading.Thread(target=drive) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(errors) == 1 and "in use by another thread" in str(errors[0])
    batch.step(actions)


def test_other_python_threads_run_while_trucks_are_stepped() -> None:
    batch = Batch(num_envs=50_000)
    counted, stop = 0, threading.Event()

    def count() -> None:
        nonlocal counted
        while not stop.is_set():
            counted += 1
            time.sleep(0.0005)

    counter = threading.Thread(target=count)
    counter.start()
    start = counted
    batch.step(np.full(50_000, 4))
    during = counted - start
    stop.set()
    counter.join()
    # A step of so many trucks takes tens of milliseconds.
    assert 3 < during


def test_a_tally_counts_every_step() -> None:
    batch = Batch(num_envs=10)
    total = 0.0
    for _ in range(100):
        total += float(batch.step(np.full(10, 4))[1].sum())
    tally = batch.tally()
    assert tally["env_steps"] == 1000 and tally["episodes"] == sum(
        tally[ended.name.lower()] for ended in Ended if ended
    )
    assert tally["reward"] == pytest.approx(total, abs=1000 / 512)


def test_an_array_in_fortrans_order_is_not_written_into() -> None:
    batch = Batch("attard2023", 5, seed=1)
    arrays = np.zeros(5, np.float32), np.zeros(5, np.bool_), np.zeros(5, np.bool_)
    with pytest.raises(TypeError, match=r"observation: .*float32 of shape \(5, 69\)"):
        batch.step_into(np.zeros(5, int), np.zeros((5, 69), np.float32, order="F"), *arrays)


def test_a_state_in_which_trucks_wait_is_refused_where_none_waits() -> None:
    waits = Batch("attard2023", 4, seed=3, autoreset="next_step")
    while not waits.waiting()[0]:
        waits.step(np.array([0, 4, 4, 4]))
    with pytest.raises(ValueError, match=r"truck\[0\].held: 1; no truck waits with the autoreset same_step"):
        Batch("attard2023", 4, autoreset="same_step").restore(waits.state())


def test_a_mode_is_named_as_gymnasium_names_it() -> None:
    assert Batch("attard2023", 1, autoreset="NEXT_STEP").autoreset == "next_step"
    assert make_vec("attard2023", 1, autoreset_mode="SAME_STEP").batch.autoreset == "same_step"


def test_what_no_number_holds_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="num_envs"):
        Batch("attard2023", -(2**70))
    with pytest.raises(ValueError, match=r"weights\['16m'\]: "):
        Batch("attard2023", 1, weights={"16m": 10**400})
    with pytest.raises(TypeError, match="points: "):
        Batch("attard2023", 1).kerb_distance("16m/N-left-3", [["a", "b"]])
