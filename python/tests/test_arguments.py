"""What a caller may get wrong: refused at once, by the argument's name, whatever its size."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import offtrack_sim
from offtrack_sim import Batch, Policy, export

#: For calls that a checker of types would refuse.
sim: Any = offtrack_sim

ID = "offtrack_sim:offtrack/Roundabout-v0"
ROOT = Path(__file__).parents[2]
#: More than any memory holds.
MANY = 2**40


def broadcast(value: Any, *shape: int) -> Any:
    return np.broadcast_to(np.asarray(value), shape)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda batch: batch.step(broadcast(3, MANY)), ValueError, f"actions: {MANY} of them; 4 are needed"),
        (lambda batch: batch.begin(iter(int, 1)), ValueError, "envs: more than 4 of them"),
        (lambda batch: batch.begin(seeds=broadcast(3, MANY)), ValueError, f"seeds: {MANY} of them; 4 are needed"),
        (lambda batch: batch.begin(streams=broadcast(3, MANY, 2)), ValueError, f"streams: {MANY} of them"),
        (lambda batch: batch.begin(routes=broadcast("16m", MANY)), ValueError, f"routes: {MANY} of them"),
        (lambda batch: batch.begin(starts=broadcast(0.0, MANY, 2)), ValueError, f"starts: {MANY} of them"),
        (
            lambda batch: batch.restore({**batch.state(), "reward": broadcast(np.float32(0), MANY)}),
            ValueError,
            r"reward: float32 of shape \(1099511627776,\)",
        ),
        (
            lambda batch: batch.restore({**batch.state(), "stream": broadcast(0, MANY, 2)}),
            ValueError,
            "stream: int64 of shape",
        ),
    ],
)
def test_an_array_longer_than_any_memory_is_refused_by_its_length(
    call: Callable[[Batch], Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        call(Batch(num_envs=4))


def layers(*shapes: tuple[tuple[int, int], int]) -> list[Any]:
    return [(broadcast(np.float32(0.01), *weights), broadcast(np.float32(0), biases)) for weights, biases in shapes]


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (
            layers(((69, 9), 8)),
            r"layers\[0\]: biases of shape \(8,\) beside weights of shape \(69, 9\); \(9,\) is needed",
        ),
        (layers(((69, 4), 4), ((5, 9), 9)), r"layers\[1\]: weights of shape \(5, 9\); \(4, 9\) is needed"),
        (layers(((69, 0), 0)), r"layers\[0\]: weights of shape \(69, 0\)"),
        (layers(((69, MANY), MANY), ((MANY, 9), 9)), "layers: .* a policy file has at most 16777216"),
        (layers(((69, 8), 8)), "its last layer has 8 outputs, and its action table 9 actions"),
        ([], "layers: none; at least one is needed"),
    ],
)
def test_a_network_whose_biases_or_layers_do_not_fit_is_refused(model: list[Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=message):
        export.save(tmp_path / "policy.safetensors", model)
    assert not list(tmp_path.iterdir())


def test_a_policy_whose_logits_would_not_be_finite_is_refused(tmp_path: Path) -> None:
    huge = [(np.full((69, 8), 1e30, np.float32), np.zeros(8, np.float32))]
    huge.append((np.full((8, 9), 1e30, np.float32), np.zeros(9, np.float32)))
    with pytest.raises(ValueError, match=r"the outputs of actor.1 may reach 6e63, beyond 32-bit floats"):
        export.save(tmp_path / "policy.safetensors", huge)
    observations = np.zeros((3, 69))
    observations[1, 7] = np.nan
    with pytest.raises(ValueError, match=r"observations\[1, 7\]: NaN; every value must be finite"):
        Policy.shipped().act(observations)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda truck: truck["position"].__setitem__((2, 0), np.nan), r"truck\[2\].position\[0\]: NaN; must lie in"),
        (lambda truck: truck["speed"].__setitem__(1, np.inf), r"truck\[1\].speed: inf; must lie in -1000.0..1000.0"),
        (lambda truck: truck["steering"].__setitem__(3, 5.0), r"truck\[3\].steering: 5.0; must lie in"),
        (lambda truck: truck["held"].__setitem__(0, 23), r"truck\[0\].held: 23; must lie in 0..1"),
    ],
)
def test_a_state_that_cannot_be_is_not_restored(change: Callable[[Any], None], message: str) -> None:
    batch = Batch(num_envs=4)
    state = batch.state()
    before = {name: column.copy() for name, column in state.items()}
    change(state["truck"])
    with pytest.raises(ValueError, match=message):
        batch.restore(state)
    assert all(before[name].tobytes() == column.tobytes() for name, column in batch.state().items())


def step_into_one_array_of_flags() -> None:
    flags = np.zeros(2, bool)
    batch_of_two().step_into(np.full(2, 4), np.zeros((2, 69), np.float32), np.zeros(2, np.float32), flags, flags)


def batch_of_two() -> Any:
    return Batch(num_envs=2)


def begun() -> Any:
    env = sim.Roundabout()
    env.reset(seed=1)
    return env


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: sim.Batch(split=3), "split"),
        (lambda: sim.Batch(routes=3), "routes"),
        (lambda: sim.Batch(device=3), "device"),
        (lambda: sim.Batch(autoreset=3), "autoreset"),
        (lambda: sim.Batch(b"attard2023"), "scenario"),
        (lambda: sim.Batch(max_episode_steps=1.5), "max_episode_steps"),
        (lambda: batch_of_two().begin(3), "envs"),
        (lambda: batch_of_two().begin([0.5]), r"envs\[0\]"),
        (lambda: batch_of_two().begin(seeds=3), "seeds"),
        (lambda: batch_of_two().begin(seeds=[1, 1.5]), r"seeds\[1\]"),
        (lambda: batch_of_two().begin(streams=[3, None]), r"streams\[0\]"),
        (lambda: batch_of_two().begin(streams=[(1, 2), (0.5, 0)]), r"streams\[1\]\[0\]"),
        (lambda: batch_of_two().begin(routes=3), "routes"),
        (lambda: batch_of_two().begin(routes=[3, None]), r"routes\[0\]"),
        (lambda: batch_of_two().begin(starts=3), "starts"),
        (lambda: batch_of_two().restore(3), "state"),
        (lambda: batch_of_two().columns(3), "column"),
        (lambda: batch_of_two().render(0.5), "env"),
        (lambda: batch_of_two().kerb_distance("16m/N-left-3", [["1", "2"]]), "points"),
        (lambda: sim.Policy.shipped().act([["0"] * 69]), "observations"),
        (lambda: sim.Policy.shipped().act(np.zeros((1, 69), complex)), "observations"),
        (lambda: sim.Policy.shipped().check("attard2023"), "batch"),
        (lambda: sim.Policy.shipped().check(sim.Policy.shipped()), "batch"),
        (lambda: sim.export.to_onnx(None, "a.onnx"), "policy"),
        (lambda: sim.export.save("a", layers(((69, 9), 9)), values=5), "values"),
        (lambda: sim.speed_control(None, 8.0, 8.0), "observer"),
        (lambda: sim.benchmark("attard2023").changed([1]), "changes"),
        (lambda: begun().step(True), "action"),
        (lambda: sim.Policy.load(3), "file"),
        (lambda: sim.Policy.shipped(3), "name"),
        (lambda: sim.Policy.shipped().act("left"), "observations"),
        (lambda: sim.Policy.shipped().logits([["a"]]), "observations"),
        (lambda: sim.export.save(3, layers(((69, 9), 9))), "file"),
        (lambda: sim.export.save("a", [3]), r"layers\[0\]"),
        (lambda: sim.export.save("a", layers(((69, 9), 9)), scenario=3), "scenario"),
        (lambda: sim.export.save("a", layers(((69, 9), 9)), mean="a", variance=np.ones(69)), "mean"),
        (lambda: sim.export.save("a", layers(((69, 9), 9)), mean=np.ones(69), variance="a"), "variance"),
        (lambda: sim.export.save("a", layers(((69, 9), 9)), mean=[0], variance=[1], epsilon="a"), "epsilon"),
        (lambda: sim.evaluate(3), "policy"),
        (lambda: sim.evaluate(lambda observations: np.full(len(observations), 3.7), episodes=1), "policy"),
        (lambda: sim.evaluate(lambda observations: 3, episodes=1), "policy"),
        (lambda: sim.evaluate(lambda observations: [[1], [1, 2]], episodes=1), "policy"),
        (lambda: sim.Batch(num_envs=2).step(np.ma.array([0, 8], mask=[True, False])), "actions"),
        (lambda: sim.Benchmark({}, folder=5), "folder"),
        (lambda: sim.evaluate(sim.Policy.shipped(), episodes=1.5), "episodes"),
        (lambda: sim.evaluate(sim.Policy.shipped(), seed=1.5), "seed"),
        (lambda: sim.make_vec(num_envs=1.5), "num_envs"),
        (lambda: sim.make_vec(seed="x"), "seed"),
        (lambda: sim.Batch(seed=True), "seed"),
        (lambda: sim.Batch(weights={"16m": True}), r"weights\['16m'\]"),
        (lambda: batch_of_two().begin([False, True]), r"envs\[0\]"),
        (lambda: sim.Observer("laden2026", ["16m/N-left-3"], ("daf_xf", "laden")), r"vehicles\[0\]"),
        (lambda: sim.make_vec().reset(seed=1.5), "seed"),
        (lambda: sim.make_vec().reset(seed="5"), "seed"),
        (lambda: sim.make_vec().reset(seed=[1.5]), "seed"),
        (lambda: sim.make_vec().reset(options=3), "options"),
        (lambda: sim.make_vec().reset(options={"routes": 3}), r"options\['routes'\]"),
        (lambda: sim.Roundabout().reset(seed=1.5), "seed"),
        (lambda: sim.Roundabout().reset(options=["route"]), "options"),
    ],
)
def test_a_value_of_a_wrong_type_is_refused_by_the_arguments_name(call: Callable[[], Any], name: str) -> None:
    with pytest.raises(TypeError, match=f"^{name}: .* needed"):
        call()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: batch_of_two().begin([0, 0], seeds=[1, 2]), "envs: 0 stands twice"),
        (lambda: batch_of_two().begin([1], starts=[sim.Start(10**400)]), r"starts\[1\].offset: too large for a float"),
        (lambda: batch_of_two().begin(starts=[None, (0, -(10**5000))]), r"starts\[1\].heading: too large .* -1..1$"),
        (lambda: step_into_one_array_of_flags(), "truncated: shares memory with another array"),
        (lambda: sim.Batch(device=""), 'device: \'\'; "cpu", "gpu" or'),
        (lambda: sim.Batch("\ud800"), "scenario: .* is no UTF-8"),
        (lambda: sim.Batch(routes=["\ud800"]), "routes: .* is no UTF-8"),
        (lambda: sim.Benchmark({"vehicle": "\ud800"}), "vehicle: .* is no UTF-8"),
        (
            lambda: sim.benchmark("attard2023").changed({"reward.failure": 10**400}),
            "reward.failure: an integer of 1329",
        ),
        (lambda: sim.Batch(routes=["16m"], split="tset"), 'split: "tset"; must be one of train, '),
        (
            lambda: sim.evaluate(
                sim.Policy.shipped("traffic2026"), sim.benchmark("traffic2026").changed({"traffic.group": 4})
            ),
            "scenario: traffic.group: 4; an evaluation drives trucks alone: leave the key out",
        ),
    ],
)
def test_a_value_that_cannot_be_is_refused_by_the_arguments_name(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}"):
        call()


def test_no_panic_crosses_into_python(tmp_path: Path) -> None:
    text = (ROOT / "scenarios/attard2023.toml").read_text()
    for folder in ("roundabouts", "vehicles"):
        text = text.replace(f'"{folder}/', f'"{ROOT}/scenarios/{folder}/')
    # Slower than 3.6 km/h: a case that the feasible clock once panicked at.
    text = text.replace("speeds_kmh = [30.0]", "speeds_kmh = [2.0]") + '\n[ending]\nclock = "feasible"\n'
    file = tmp_path / "slow.toml"
    file.write_text(text)
    try:
        batch = Batch(file)
    except (ValueError, RuntimeError) as error:
        assert str(error)
    else:
        batch.step(np.array([4]))


def test_more_threads_than_the_address_space_holds_are_fewer() -> None:
    code = "import offtrack_sim as sim; batch = sim.Batch(); batch.step_at_random(); print(batch.tally())"
    # Stacks of 60 GB would not fit into 3. The threads of numpy's library take some of it for each core.
    command = f"ulimit -v 3000000; OPENBLAS_NUM_THREADS=1 RAYON_NUM_THREADS=30000 exec {sys.executable} -c '{code}'"
    found = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
    assert "'env_steps': 1" in found.stdout, found


#: Many roads, and so many seconds of work.
SLOW: dict[str, Callable[[str], Any]] = {
    "Batch": lambda benchmark: Batch(benchmark, 4),
    "make_vec": lambda benchmark: offtrack_sim.make_vec(benchmark, 4),
    "evaluate": lambda benchmark: offtrack_sim.evaluate(Policy.shipped(), benchmark, split="train", episodes=1),
    "save": lambda benchmark: export.save("never.safetensors", layers(((69, 9), 9)), scenario=benchmark),
}


@pytest.mark.parametrize("call", SLOW.values(), ids=SLOW)
@pytest.mark.parametrize("after", [0.3, 3.0])
def test_ctrl_c_while_roads_are_drawn_and_baked_is_answered_at_once(
    call: Callable[[str], Any], after: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OFFTRACK_CACHE", "")
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "scenarios/random2026.toml").read_text()
    text = text.replace('"vehicles/', f'"{ROOT}/scenarios/vehicles/').replace(
        "train = [0, 200]", "train = [340, 20340]"
    )
    text = text.replace("count = 340", "count = 20340")
    text = text.replace('"distributions/', f'"{ROOT}/scenarios/distributions/')
    file = tmp_path / "many.toml"
    file.write_text(text)
    pressed: list[float] = []

    def press() -> None:
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(after, press)
    # A job in the background of a script begins with the signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            call(str(file))
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)
    # A second on an idle machine; this one may be busy.
    assert time.monotonic() - pressed[0] < 5.0


def test_a_random_road_is_named_as_on_the_command_line() -> None:
    batch = Batch("attard2023", routes=["wide/7/12", "16m/N-left-3", "wide/7/13/" + names_of("wide/7/13")[0]])
    names = batch.split_routes
    assert names[0] == "16m/N-left-3" and sum(name.startswith("wide/7/13/") for name in names) == 1
    assert sum(name.startswith("wide/7/12/") for name in names) == len(names) - 2 > 4
    with pytest.raises(ValueError, match='routes: "wide/7/12/X-left-9"; attard2023 has'):
        Batch("attard2023", routes=["wide/7/12/X-left-9"])
    assert offtrack_sim.evaluate(Policy.shipped(), routes=["wide/7/12"], episodes=1).success > 0.8


def names_of(road: str) -> list[str]:
    return [name.rsplit("/", 1)[1] for name in Batch("attard2023", routes=[road]).split_routes]


def test_a_shorter_time_limit_truncates_as_gymnasiums_wrapper_does() -> None:
    kwargs: dict[str, Any] = {"num_envs": 3, "max_episode_steps": 5}
    ours = gymnasium.make_vec(ID, vectorization_mode="vector_entry_point", autoreset_mode="same_step", **kwargs)
    theirs = gymnasium.make_vec(ID, vectorization_mode="sync", vector_kwargs={"autoreset_mode": "SameStep"}, **kwargs)
    assert isinstance(ours.unwrapped, offtrack_sim.RoundaboutVector)
    seeds: Any = [1, 2, 3]
    one, other = ours.reset(seed=seeds), theirs.reset(seed=seeds)
    assert (one[0] == other[0]).all()
    n_truncated = 0
    for _ in range(17):
        one_step, other_step = ours.step(np.full(3, 4)), theirs.step(np.full(3, 4))
        for mine, its in zip(one_step[:4], other_step[:4]):
            assert (mine == its).all()
        n_truncated += int(one_step[3].sum())
    assert n_truncated == 9
    # The benchmark's own limit stands where it is the shorter one, and in another batch of the same benchmark.
    assert Batch(max_episode_steps=None).fingerprint() == Batch(max_episode_steps=10**6).fingerprint()
    assert Batch(max_episode_steps=5).fingerprint() != Batch().fingerprint()


@pytest.mark.parametrize("start", ["11", ("0.5", "-0.5"), (True, False), [np.bool_(True), 0.0]])
def test_texts_and_booleans_are_no_starts(start: Any) -> None:
    batch = Batch("attard2023", 4)
    with pytest.raises(TypeError, match=r"starts\[2\]: .*; a tuple of offset, heading error, speed"):
        batch.begin([2], starts=[start])


def test_a_masked_reset_names_the_truck_whose_route_or_start_is_wrong() -> None:
    env = offtrack_sim.make_vec("attard2023", 3)
    env.reset(seed=1)
    mask = np.array([False, False, True])
    for key, wrong in [("routes", 5), ("starts", "xyz"), ("starts", (2.0, 0))]:
        with pytest.raises((TypeError, ValueError), match=rf"{key}\[2\]"):
            env.reset(options={"reset_mask": mask, key: [None, None, wrong]})


@pytest.mark.filterwarnings("error")
def test_numbers_beyond_float32_are_refused_without_a_warning() -> None:
    observer = offtrack_sim.Observer("attard2023", ["20m/E-left-2"])
    position, heading = np.zeros((1, 2)), np.zeros(1)
    observer.begin(position, heading, heading, 8.0)
    for call in (
        lambda: Policy.shipped().act(np.full((1, 69), 1e39)),
        lambda: observer.observe(position, heading, heading, 8.0, acceleration=1e39),
        lambda: offtrack_sim.speed_control(observer, 8.0, 1e39),
        lambda: export.save("never", [(np.full((69, 9), 1e39), np.zeros(9))]),
        lambda: export.save("never", layers(((69, 9), 9)), mean=np.full(69, -1e39), variance=np.ones(69)),
        lambda: export.save("never", layers(((69, 9), 9)), mean=np.ones(69), variance=np.full(69, 1e-90), epsilon=0),
    ):
        with pytest.raises(ValueError, match="inf"):
            call()


def test_a_policy_of_levels_is_not_written_for_a_benchmark_that_takes_commands(tmp_path: Path) -> None:
    layers = [(np.zeros((77, 2), np.float32), np.zeros(2, np.float32))]
    with pytest.raises(ValueError, match="squash: None; laden2026-continuous takes commands: give tanh or clip"):
        export.save(tmp_path / "policy.safetensors", layers, scenario="laden2026-continuous")
    assert not list(tmp_path.iterdir())
