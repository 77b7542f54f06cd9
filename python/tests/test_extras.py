"""Benchmarks of several vehicles that observe extras: laden2026 has eight."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from gymnasium.spaces import Box

import offtrack_sim
from offtrack_sim import EXTRAS, OBSERVATION, Batch, Ended, Policy, Start, export

DATA = Path(__file__).parent / "data"
NAMES = [extra.name for extra in EXTRAS[:8]]
N = 32


def beside(batch: Batch, values: str, extras: str) -> Any:
    """Columns as an observation has them."""
    columns = batch.columns(values, extras)
    return np.concatenate([columns[values], columns[extras][:, :8]], axis=1)


def test_extras_stand_behind_the_values_of_an_observation() -> None:
    batch = Batch("laden2026", N, seed=1)
    assert batch.extras == NAMES and batch.n_values == 77
    assert [extra.first for extra in EXTRAS] == list(range(69, 81)) and {extra.n for extra in EXTRAS} == {1}
    for _ in range(20):
        batch.step_at_random()
    observed = dict(zip(NAMES, batch.observation()[:, 69:].T))
    columns = batch.columns("truck", "control")
    assert np.allclose(observed["target_speed"], columns["control"]["target_speed"] / 27.8)
    assert np.allclose(observed["lateral_acceleration"], columns["truck"]["lateral_acceleration"] / 9.81)
    loads = np.array([batch.classes[index][1] for index in batch.vehicle_classes[batch.vehicles()]])
    assert {"empty", "laden"} < set(loads)
    assert 2 * observed["trailer_mass"][loads == "empty"].max() < observed["trailer_mass"][loads == "laden"].min()


def test_a_benchmark_without_extras_has_69_values() -> None:
    batch = Batch("attard2023", 2)
    assert batch.extras == [] and batch.n_values == 69 and batch.observation().shape == (2, 69)
    assert batch.classes == [("", "empty")] and batch.vehicle_classes.tolist() == [0]
    assert batch.vehicles().tolist() == [0, 0]
    assert offtrack_sim.Roundabout().reset(seed=0)[1].keys() == {"route"}


@pytest.mark.parametrize("autoreset", ["same_step", "next_step"])
def test_every_step_and_every_end_has_the_extras_of_its_columns(autoreset: str) -> None:
    batch, into = (Batch("laden2026", N, seed=2, autoreset=autoreset) for _ in range(2))
    outputs = np.zeros((N, 77), np.float32), np.zeros(N, np.float32), np.zeros(N, bool), np.zeros(N, bool)
    rng = np.random.default_rng(0)
    n_ends, n_replaced = 0, 0
    for _ in range(200):
        actions = rng.integers(0, len(batch.action_table), N)
        vehicles = batch.vehicles()
        observation = batch.step(actions)[0]
        into.step_into(actions, *outputs)
        assert (observation == outputs[0]).all() and (observation == batch.observation()).all()
        assert (observation == beside(batch, "observation", "extras")).all()
        assert (batch.vehicles() == batch.columns("truck")["truck"]["vehicle"]).all()
        ends = batch.ended()
        if ends is None:
            continue
        assert (ends.observations == beside(batch, "next_observation", "next_extras")[ends.envs]).all()
        assert (ends.vehicles == vehicles[ends.envs]).all()
        n_ends += len(ends.envs)
        n_replaced += int((ends.observations[:, 69:] != observation[ends.envs, 69:]).any(axis=1).sum())
    with pytest.raises(TypeError, match=rf"observation: must be .*, float32 of shape \({N}, 77\)"):
        into.step_into(actions, outputs[0][:, :69].copy(), *outputs[1:])
    assert N < n_ends
    assert n_replaced == (n_ends if autoreset == "same_step" else 0)


def test_extras_stay_in_their_bounds() -> None:
    env = offtrack_sim.make_vec("laden2026", num_envs=64, autoreset_mode="same_step", copy=False)
    space = env.single_observation_space
    assert isinstance(space, Box)
    low = np.concatenate([np.full(values.n, values.low) for values in OBSERVATION])
    assert (space.low == [*low, *[-1.0] * 8]).all() and (space.high == 1.0).all()
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    least = np.ones(77)
    for _ in range(150):
        observation = env.step(rng.integers(0, len(env.batch.action_table), 64))[0]
        assert env.observation_space.contains(observation)
        least = np.minimum(least, observation.min(axis=0))
    is_below_0 = dict(zip(NAMES, least[69:] < 0))
    assert is_below_0["steering"] and is_below_0["trailer_roll"] and not is_below_0["trailer_mass"]


def test_a_start_states_vehicle_load_and_speed() -> None:
    batch = Batch("laden2026", 4, seed=3)
    row = len(batch.vehicle_classes) - 1
    starts = [Start(0.0, 0.0, 0.0, ("eu_4x2_13m6", "laden_high")), Start(vehicle=row), (0.5, 0.0), None]
    drawn = Batch("laden2026", 4, seed=3).vehicles()[3]
    batch.begin(streams=[(3, env) for env in range(4)], starts=starts)
    vehicles = batch.vehicles()
    first = int(np.argmax(batch.vehicle_classes == batch.classes.index(("eu_4x2_13m6", "laden_high"))))
    assert vehicles.tolist() == [first, row, 0, drawn] and 0 < first < row
    named = batch.named(batch.routes(), vehicles)
    assert named["vehicle"][:3].tolist() == ["eu_4x2_13m6", "eu_4x2_13m6", "daf_xf"]
    assert named["load"][:3].tolist() == ["laden_high", "laden_high", "empty"]
    single = offtrack_sim.Roundabout("laden2026")
    start = Start(vehicle=("daf_xf", "half"))
    assert single.reset(options={"start": start})[1].items() >= {"vehicle": "daf_xf", "load": "half"}.items()
    env = offtrack_sim.make_vec("laden2026", num_envs=2)
    infos = env.reset(options={"starts": [start, Start(vehicle=row)]})[1]
    assert infos["load"].tolist() == ["half", "laden_high"] and infos["_vehicle"].all()


def test_a_start_states_where_in_the_range_of_speeds_it_is(short_benchmark: str) -> None:
    file = Path(short_benchmark)
    file.write_text(file.read_text().replace("[ending]", "[start]\nspeed_kmh = [10.0, 30.0]\n\n[ending]"))
    batch = Batch(short_benchmark, 3)
    batch.begin(starts=[Start(speed=-1.0), (0.0, 0.0), Start(0.0, 0.0, 1.0)])
    assert np.allclose(3.6 * batch.columns("truck")["truck"]["speed"], [10.0, 20.0, 30.0])


def test_a_start_states_where_along_its_route_it_is_in_batches_and_environments() -> None:
    batch = Batch(num_envs=4, routes=["16m/N-left-3"])
    n = len(batch.road("16m/N-left-3").waypoints)
    starts = [Start(along=index / (n - 1)) for index in (0, 31, n - 2)]
    batch.begin(starts=[*starts, (0.0, 0.0)])
    columns = batch.columns("truck", "progress", "observation")
    assert columns["progress"]["waypoint"].tolist() == [1, 32, n - 1, 1]
    assert columns["observation"][0].tobytes() == columns["observation"][3].tobytes()
    waypoint, truck = batch.road("16m/N-left-3").waypoints[31], columns["truck"][1]
    ahead = 0.5 * batch.dimensions()["wheelbase"] * np.array([np.cos(truck["heading"]), np.sin(truck["heading"])])
    assert np.allclose(truck["position"] + ahead, waypoint[:2], atol=1e-4)
    assert abs(truck["heading"] - truck["trailer_heading"]) > 0.1
    options = {"route": "16m/N-left-3", "start": starts[1]}
    single = offtrack_sim.Roundabout(routes=["16m/N-left-3"])
    assert (single.reset(seed=0, options=options)[0] == columns["observation"][1]).all()
    env = offtrack_sim.make_vec(num_envs=2, routes=["16m/N-left-3"])
    assert (env.reset(seed=0, options={"starts": starts[:2]})[0] == columns["observation"][:2]).all()


def test_a_benchmark_draws_starts_along_its_routes_and_an_evaluation_says_where() -> None:
    anywhere = offtrack_sim.benchmark("attard2023").changed({"start.along": 0.9}, name="anywhere")
    batch = Batch(anywhere, 256, seed=1)
    waypoints = batch.columns("progress")["progress"]["waypoint"]
    assert waypoints.min() < 10 and len(set(waypoints.tolist())) > 50
    table = offtrack_sim.evaluate(offtrack_sim.Policy.shipped(), anywhere, episodes=3).table
    assert table["start_along"].min() < 0.2 and 0.7 < table["start_along"].max() < 0.9
    offset, heading, speed, along = (
        float(table[5][f"start_{name}"]) for name in ("offset", "heading", "speed", "along")
    )
    start = Start(offset, heading, speed, along=along)
    again, whole = Batch(anywhere, 1, split="test"), Batch(anywhere, 1, split="test")
    again.begin(routes=[str(table["route"][5])], starts=[start])
    whole.begin(streams=[(0, 5)], routes=[str(table["route"][5])])
    assert (again.observation() == whole.observation()).all()


def test_wrong_starts_are_refused_and_begin_nothing() -> None:
    batch = Batch("laden2026", 2)
    before = batch.state()
    wrong: list[tuple[Any, type[Exception], str]] = [
        (Start(vehicle=4096), ValueError, r"starts\[1\].vehicle: 4096; must lie in 0..4095"),
        (Start(vehicle=-1), ValueError, r"starts\[1\].vehicle: -1; must lie in 0..4095"),
        (Start(vehicle=cast(Any, "daf_xf")), TypeError, r"starts\[1\].vehicle: 'daf_xf'; an integer is needed"),
        (
            Start(vehicle=("daf_xf", "wet")),
            ValueError,
            r"starts\[1\].vehicle: \('daf_xf', 'wet'\); laden2026 has \('daf_xf', 'empty'\), \('daf_xf', 'half'\)",
        ),
        ((0.0, 0.0, 0.0, 0, 0.0, 1), TypeError, r"starts\[1\]: \(0.0, 0.0, 0.0, 0, 0.0, 1\); a tuple of offset"),
        (Start(along=1.5), ValueError, r"starts\[1\]: 1.5 of the way along the route; must lie in 0..1"),
        (Start(along=float("nan")), ValueError, r"starts\[1\]: NaN of the way along the route"),
        (Start(along=cast(Any, "half")), TypeError, r"starts\[1\]: Start\(.*along='half'\); a tuple of offset"),
        (("left", 0.0), TypeError, r"starts\[1\]: \('left', 0.0\); a tuple of offset"),
        (0.5, TypeError, r"starts\[1\]: 0.5; a tuple of offset"),
        (Start(speed=1.5), ValueError, r"starts\[1\].speed: 1.5; must lie in -1..1, a fraction of"),
        (Start(offset=-2.0), ValueError, r"starts\[1\].offset: -2; must lie in -1..1"),
        (Start(speed=float("nan")), ValueError, r"starts\[1\].speed: NaN; must lie in -1..1"),
    ]
    for start, error, message in wrong:
        with pytest.raises(error, match=message):
            batch.begin(starts=[None, start])
    after = batch.state()
    assert all(before[name].tobytes() == after[name].tobytes() for name in before)


def test_what_ended_is_told_with_the_vehicle_that_it_ended_with() -> None:
    env = offtrack_sim.make_vec("laden2026", num_envs=N, autoreset_mode="same_step")
    infos = env.reset(seed=4)[1]
    loads, vehicles = infos["load"].copy(), infos["vehicle"].copy()
    n_ends, n_changed = 0, 0
    for _ in range(150):
        infos = env.step(np.full(N, 4))[4]
        if not infos:
            continue
        final, ended = infos["final_info"], infos["_load"]
        assert (final["_load"] == ended).all() and (final["_vehicle"] == ended).all()
        assert (final["load"][ended] == loads[ended]).all() and (final["vehicle"][ended] == vehicles[ended]).all()
        assert {last.shape for last in infos["final_obs"][ended]} == {(77,)}
        n_ends += int(ended.sum())
        n_changed += int((infos["load"][ended] != loads[ended]).sum())
        loads[ended], vehicles[ended] = infos["load"][ended], infos["vehicle"][ended]
        assert (final["ended"][ended] != Ended.RUNNING).all()
    assert N < n_ends and N // 2 < n_changed < n_ends


def linear_policy(batch: Batch) -> list[tuple[Any, Any]]:
    """A layer by hand that steers by headings and sensors, and is the slower the heavier its trailer is."""
    first = {values.name: values.first for values in (*OBSERVATION, *EXTRAS)}
    steer, speed = np.zeros(77), np.zeros(77)
    steer[first["heading"] :][:5] = [-2.4, -1.2, -1.9, -0.9, 0.7]
    steer[first["bearing"] :][:5] = [-0.4, -0.7, 0.5, 0.9, 0.0]
    left = np.array([-0.4, 0.7, -0.2, 0.2, -0.4, 0.3])
    steer[first["tractor_range"] :][:13] = [*left, 0.0, *-left[::-1]]
    steer[first["steering"]], steer[first["articulation"]] = -1.2, 0.9
    speed[first["trailer_mass"]], speed[first["target_speed"]], speed[first["tractor_range"] + 6] = -4.0, 4.0, 4.0
    # The largest output is that of the action nearest to the steer angle and the speed wanted.
    angles, speeds = batch.action_table.T.astype(np.float64)
    weights = 400.0 * np.outer(steer, angles) + 2.0 * np.outer(speed, speeds)
    return [(weights.astype(np.float32), (-200.0 * angles**2 + 12.0 * speeds - speeds**2).astype(np.float32))]


def test_a_policy_with_extras_ends_as_the_command_line_has_it_end(tmp_path: Path) -> None:
    # Of the file that this test writes; its key `command` makes the report anew.
    reported = json.loads((DATA / "laden.json").read_text())
    file = tmp_path / "linear.safetensors"
    export.save(file, linear_policy(Batch("laden2026", 1)), scenario="laden2026")
    policy = Policy.load(file)
    assert policy.extras == NAMES and policy.benchmark == "laden2026"
    episodes, seed = reported["episodes_per_route"], reported["seed"]
    found = offtrack_sim.evaluate(policy, "laden2026", split="test", episodes=episodes, seed=seed)
    ends = [dict(Counter(Ended(code).name.lower() for code in row)) for row in found.ended]
    assert dict(zip(found.routes, ends)) == reported["routes"]
    # Vehicle and load of each episode, and how it ended.
    batch = Batch("laden2026", found.ended.size, split="test")
    batch.begin(streams=[(seed, env) for env in range(batch.num_envs)])
    classes, codes = batch.vehicle_classes[batch.vehicles()], found.ended.ravel()
    for index, (vehicle, load) in enumerate(batch.classes):
        own = codes[classes == index]
        counts = [len(own), int((own == Ended.ARRIVED).sum()), int((own == Ended.ROLLED_OVER).sum())]
        keys = ("vehicle", "load", "episodes", "arrived", "rolled_over")
        assert dict(zip(keys, [vehicle, load, *counts])) == reported["classes"][index]


def test_an_exported_policy_observes_the_extras_of_its_benchmark(tmp_path: Path) -> None:
    file = tmp_path / "policy.safetensors"
    batch = Batch("laden2026", N, seed=6)
    layers = linear_policy(batch)
    export.save(file, layers, scenario="laden2026", mean=np.full(77, 0.5), variance=np.full(77, 4.0), epsilon=0.0)
    policy = Policy.load(file)
    for _ in range(10):
        batch.step_at_random()
    observations = batch.observation()
    expected = 0.5 * (observations - 0.5) @ layers[0][0] + layers[0][1]
    assert np.allclose(policy.logits(observations), expected, atol=1e-3)
    assert (policy.act(observations) == policy.logits(observations).argmax(axis=1)).all()
    assert policy.act(observations[3]) == policy.act(observations)[3]
    # The mass alone changes what it does.
    lighter = observations.copy()
    lighter[:, 76] = 0.0
    assert (policy.logits(lighter) != policy.logits(observations)).any()
    needed = "77 are needed, 69 and the extras steering, target_speed, .*, trailer_mass"
    with pytest.raises(ValueError, match=f"observations: 69 values each; {needed}"):
        policy.act(observations[:, :69])
    with pytest.raises(ValueError, match="observations: 77 values each; 69 are needed$"):
        Policy.shipped().logits(observations)


def test_policies_and_benchmarks_of_other_extras_are_told_apart(tmp_path: Path) -> None:
    file = tmp_path / "policy.safetensors"
    layers = linear_policy(Batch("laden2026", 1))
    needed = r"\(77,\) is needed, 69 and the extras steering"
    with pytest.raises(ValueError, match=rf"mean: shape \(69,\); {needed}"):
        export.save(file, layers, scenario="laden2026", mean=np.zeros(69), variance=np.ones(69))
    with pytest.raises(ValueError, match=rf"variance: shape \(69,\); {needed}"):
        export.save(file, layers, scenario="laden2026", mean=np.zeros(77), variance=np.ones(69))
    with pytest.raises(ValueError, match=r"mean: shape \(1, 77\); one dimension is needed"):
        export.save(file, layers, scenario="laden2026", mean=np.zeros((1, 77)), variance=np.ones(77))
    with pytest.raises(ValueError, match=r"layers\[0\]: weights of shape \(69, 45\); \(77, 45\) is needed"):
        export.save(file, [(layers[0][0][:69], layers[0][1])], scenario="laden2026")
    assert not file.exists()
    export.save(file, layers, scenario="laden2026")
    with pytest.raises(ValueError, match="observes other extras than attard2023: steering, .*; none are needed"):
        offtrack_sim.evaluate(Policy.load(file), "attard2023")
    with pytest.raises(ValueError, match=r"\(shipped\): observes other extras than laden2026: none; steering, "):
        offtrack_sim.evaluate(Policy.shipped(), "laden2026")
