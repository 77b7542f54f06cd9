"""An observer sees what the simulator sees, bit for bit, from poses in the map's frame."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import offtrack_sim
from offtrack_sim import Batch, Ended, Observer, Policy, speed_control

TELEMETRY = (
    "steering",
    "acceleration",
    "lateral_acceleration",
    "trailer_roll",
    "trailer_roll_rate",
    "tractor_load_transfer_ratio",
    "trailer_load_transfer_ratio",
)
ROOT = Path(__file__).parents[2]


def pose(trucks: npt.NDArray[Any], origin: tuple[float, float] = (0.0, 0.0)) -> dict[str, Any]:
    """Poses of a batch's trucks in the map's frame."""
    position = trucks["position"].astype(float) + origin
    return {"position": position, **{name: trucks[name] for name in ("heading", "trailer_heading", "speed")}}


def telemetry(columns: dict[str, npt.NDArray[Any]]) -> dict[str, Any]:
    named = {name: columns["truck"][name] for name in TELEMETRY}
    return {**named, "target_speed": columns["control"]["target_speed"]}


@pytest.mark.parametrize("n", [1, 4096])
def test_an_observer_of_any_number_of_trucks_sees_the_bytes_that_the_batch_sees(n: int) -> None:
    batch = Batch("laden2026", n, split="test", seed=3, autoreset="disabled")
    names = [batch.route_names[route] for route in batch.routes()]
    observer = Observer("laden2026", names, batch.vehicles())
    policy = Policy.shipped("laden2026")
    policy.check(observer)
    seen = observer.begin(**pose(batch.columns("truck")["truck"]))
    assert seen.values.tobytes() == batch.observation().tobytes()
    steps = 0
    while not seen.ended.any() and steps < 60:
        steps += 1
        actions = policy.act(seen.values)
        batch.step(actions)
        columns = batch.columns("truck", "control", "clearance", "ended", "progress")
        seen = observer.observe(**pose(columns["truck"]), **telemetry(columns))
        assert seen.values.tobytes() == batch.observation().tobytes()
        assert seen.values.shape == (n, observer.n_values)
        clearance = columns["clearance"]
        assert np.array_equal(seen.clearance, np.stack([clearance["tractor"], clearance["trailer"]], axis=1))
        assert np.array_equal(seen.lane_distance, columns["progress"]["lane_distance"])
        assert np.array_equal(seen.waypoint, columns["progress"]["waypoint"])
        assert np.array_equal(seen.ended, columns["ended"])
    assert steps > 10
    # Indices may be those that numpy finds.
    trucks = np.flatnonzero(seen.ended == 0)
    on_their_way = {name: value[trucks] for name, value in pose(columns["truck"]).items()}
    again = observer.begin(**on_their_way, waypoint=seen.waypoint[trucks], trucks=trucks)
    assert np.array_equal(again.waypoint, seen.waypoint[trucks])


def test_a_map_has_its_own_frame_and_a_truck_on_a_lane_of_it_is_on_the_lane_of_its_route() -> None:
    route = "town03/E-left-1"
    observer = Observer("maps2026", [route])
    frame = observer.frame(route)
    assert frame == ((-0.4817, -0.265), False)
    heading = np.radians(179.147)
    ahead = 0.5 * observer.dimensions()["wheelbase"] * np.array([np.cos(heading), np.sin(heading)])
    seen = observer.begin(np.array([[64.0475, 4.0220]]) - ahead, heading, heading, 8.0)
    assert seen.lane_distance[0] < 0.01
    waypoints, kerbs = observer.waypoints(route), observer.kerbs(route)
    assert waypoints.shape[1] == 3 and np.hypot(*(waypoints[:, :2] - [64.0475, 4.0220]).T).min() < 2.0
    # The outer kerb reaches around all waypoints.
    assert len(kerbs) > 1 and max(np.ptp(kerb[:, 0]) for kerb in kerbs) > np.ptp(waypoints[:, 0])


def test_actions_are_commands_and_the_speed_control_is_the_simulators() -> None:
    batch = Batch("laden2026", 4, split="test", seed=1, autoreset="disabled")
    names = [batch.route_names[route] for route in batch.routes()]
    observer = Observer("laden2026", names, batch.vehicles().tolist())
    trucks = batch.columns("truck")["truck"]
    observer.begin(**pose(trucks))
    for step in range(12):
        actions = np.full(4, 4 + 9 * (step // 4))
        steering, target = observer.command(actions)
        assert np.array_equal(np.stack([steering, target], axis=1), observer.action_table[actions])
        asked = speed_control(observer, trucks["speed"], target)
        batch.step(actions)
        columns = batch.columns("truck", "control")
        assert np.array_equal(asked, columns["control"]["acceleration"])
        trucks = columns["truck"]


def test_named_vehicles_are_as_their_files_have_them() -> None:
    observer = Observer("laden2026", ["20m/E-left-2"], [("daf_xf", "empty"), ("eu_4x2_13m6", "laden")])
    assert observer.num_trucks == 2 and observer.routes == ["20m/E-left-2"] * 2
    text = (ROOT / "scenarios/vehicles/eu_4x2_13m6.toml").read_text()
    wheelbase = float(text.split("[trailer]")[1].split("wheelbase = ")[1].split()[0])
    assert observer.dimensions(("eu_4x2_13m6", "laden"))["trailer_wheelbase"] == pytest.approx(wheelbase)
    assert observer.dimensions() == observer.dimensions(("daf_xf", "empty"))
    assert Observer("attard2023", ["20m/E-left-2"]).vehicles == [("", "empty")]


def on_lane(n: int = 2) -> tuple[Observer, dict[str, Any]]:
    """Trucks on a waypoint of their route."""
    observer = Observer("attard2023", ["20m/E-left-2"] * n)
    x, y, heading = observer.waypoints("20m/E-left-2")[5]
    back = 0.5 * observer.dimensions()["wheelbase"]
    position = np.tile([x - back * np.cos(heading), y - back * np.sin(heading)], (n, 1))
    return observer, {"position": position, "heading": heading, "trailer_heading": heading, "speed": 8.0}


@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))])
def test_a_copy_goes_on_from_where_the_original_is_and_leaves_it_alone(way: Any) -> None:
    observer, place = on_lane()
    observer.begin(**place)
    speed_control(observer, 8.0, 8.2)
    ahead = {
        **place,
        "position": place["position"] + 4.0 * np.array([np.cos(place["heading"]), np.sin(place["heading"])]),
    }
    passed = observer.observe(**ahead).waypoint
    copied = way(observer)
    assert np.array_equal(copied.observe(**place).waypoint, passed) and copied.vehicles == observer.vehicles
    assert np.array_equal(speed_control(copied, 8.0, 8.2), speed_control(observer, 8.0, 8.2))
    before = observer.states()
    copied.begin(**place)
    assert observer.states() == before != copied.states()


def test_a_pickle_of_a_benchmark_that_has_changed_since_is_refused(short_benchmark: str) -> None:
    kept = pickle.dumps(Observer(short_benchmark, Batch(short_benchmark, 1).route_names[:1]))
    file = Path(short_benchmark)
    file.write_text(file.read_text().replace("time_limit = 1.0", "time_limit = 1.5"))
    with pytest.raises(ValueError, match="scenario: short has changed since this state was kept"):
        pickle.loads(kept)


def test_some_trucks_may_begin_and_be_observed_while_others_stay_where_they_are() -> None:
    observer, place = on_lane(3)
    observer.begin(**place)
    one = {**place, "position": place["position"][0]}
    aside = {**one, "position": one["position"] + 50.0}
    assert observer.observe(**aside, trucks=[1]).values.shape == (1, 69)
    ended = observer.observe(**place).ended
    assert ended[1] not in (Ended.RUNNING, Ended.ARRIVED) and ended[[0, 2]].tolist() == [0, 0]
    assert observer.begin(**one, trucks=[1]).ended.tolist() == [Ended.RUNNING]
    assert observer.observe(**place).ended.tolist() == [0, 0, 0]


def test_what_no_truck_can_have_is_refused_by_its_name_and_changes_nothing() -> None:
    observer, place = on_lane()
    observer.begin(**place)
    before = observer.states()
    cases: list[tuple[dict[str, Any], type[Exception], str]] = [
        ({"heading": [0.0, np.nan]}, ValueError, r"^heading\[1\]: NaN; must lie in "),
        ({"position": [[0.0, 0.0], [0.0, 1e9]]}, ValueError, r"^position\[1, 1\]: 1000000000"),
        ({"trailer_heading": 1e9}, ValueError, r"^trailer_heading\[0\]: "),
        ({"steering": np.inf}, ValueError, r"^steering\[0\]: inf; "),
        ({"trailer_load_transfer_ratio": [0.0, np.nan]}, ValueError, r"^trailer_load_transfer_ratio\[1\]: NaN"),
        ({"tractor_load_transfer_ratio": np.inf}, ValueError, r"^tractor_load_transfer_ratio\[0\]: inf"),
        ({"heading": np.ma.array([0.0, 0.0], mask=[False, True])}, ValueError, "^heading: some are masked"),
        ({"position": np.zeros((3, 2))}, ValueError, r"^position: shape \(3, 2\); \(2, 2\) is needed"),
        ({"heading": np.broadcast_to(0.0, (2**40,))}, ValueError, r"^heading: shape \(1099511627776,\)"),
        ({"speed": "fast"}, TypeError, "^speed: str; numbers of shape"),
        ({"trucks": [0, 2]}, ValueError, r"^trucks\[1\]: 2; must lie in 0..1"),
        ({"trucks": [0, 0]}, ValueError, "^trucks: one of them stands twice"),
    ]
    for changed, error, message in cases:
        with pytest.raises(error, match=message):
            observer.observe(**{**place, **changed})
    with pytest.raises(ValueError, match=r"^target\[1\]: NaN"):
        speed_control(observer, 8.0, [8.0, np.nan])
    with pytest.raises(ValueError, match=r"^target_speed\[0\]: inf; a finite number is needed"):
        observer.command(np.array([4, 0]), 1e39)
    with pytest.raises(ValueError, match=r"^actions\[0\]: 9; must lie in 0..8"):
        observer.command(np.array([9, 0]))
    assert observer.states() == before
    folded = observer.observe(**{**place, "trailer_heading": place["heading"] + np.radians(170.0)})
    assert np.isfinite(folded.values).all() and folded.ended.all()


def test_a_waypoint_says_which_pass_of_a_place_is_meant() -> None:
    route = "town03/N-left-1"
    observer = Observer("maps2026", [route, route])
    x, y, heading = observer.waypoints(route)[24]
    back = 0.5 * observer.dimensions()["wheelbase"]
    # Beside the lane, toward where the route comes back.
    right = 0.8 * np.array([np.sin(heading), -np.cos(heading)])
    position = np.array([x, y]) - back * np.array([np.cos(heading), np.sin(heading)]) + right
    at = (np.tile(position, (2, 1)), heading, heading, 8.0)
    assert (observer.begin(*at).waypoint > 80).all()
    assert observer.begin(*at, waypoint=25).waypoint.tolist() == [25, 25]
    mixed = observer.begin(*at, waypoint=[20, 90]).waypoint
    assert mixed[0] == 25 and mixed[1] > 80
    before = observer.states()
    wrong: list[tuple[Any, str]] = [
        (9999, "^waypoint"),
        (-1, r"^waypoint\[0\]: -1; must lie in 0\.\."),
        ([1], "^waypoint: 1 of them; 2 or 1 are needed"),
    ]
    for waypoint, message in wrong:
        with pytest.raises(ValueError, match=message):
            observer.begin(*at, waypoint=waypoint)
    with pytest.raises(IndexError, match=r"truck: 2; there are 0\.\.1"):
        observer.dimensions_of(2)
    assert observer.states() == before


def test_an_observer_of_unknown_routes_or_vehicles_is_refused_with_those_there_are() -> None:
    sim: Any = offtrack_sim
    for arguments, error, message in [
        (("attard2023", ["nowhere"]), ValueError, "^routes: "),
        (("attard2023", ["20m"]), ValueError, '^routes: "20m"; an observer follows one route a truck'),
        (("attard2023", []), ValueError, "^routes: empty"),
        (("laden2026", ["20m/E-left-2"], [("daf_xf", "gold")]), ValueError, r"^vehicles: .*\(\"daf_xf\", \"empty\"\)"),
        (("laden2026", ["20m/E-left-2"], [99_999]), ValueError, "^vehicles: 99999"),
        (("laden2026", ["20m/E-left-2"], ["daf_xf"]), TypeError, r"^vehicles\[0\]: 'daf_xf'"),
        (("laden2026", ["20m/E-left-2"] * 3, [0, 1]), ValueError, "^vehicles: 2 of them; 3 or 1 are needed"),
        (("attard2023", {"20m/E-left-2"}), TypeError, "^routes: .*; a sequence is needed"),
        (("laden2026", ["20m/E-left-2"], {0}), TypeError, "^vehicles: .*; a sequence is needed"),
    ]:
        with pytest.raises(error, match=message):
            sim.Observer(*arguments)
    observer = Observer("attard2023", ["20m/E-left-2"])
    with pytest.raises(ValueError, match="observes other extras"):
        Policy.shipped("laden2026").check(observer)
    with pytest.raises(ValueError, match="^vehicle: "):
        observer.dimensions(("a", "b"))
    with pytest.raises(ValueError, match='^route: "nowhere"'):
        observer.waypoints("nowhere")
