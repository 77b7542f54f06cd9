"""The benchmarks of the package as files."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import offtrack_sim
from offtrack_sim import export
from offtrack_sim.scenarios import Scenario


def stepped(scenario: Scenario) -> np.ndarray:
    batch = offtrack_sim.Batch(scenario, 32, seed=3)
    for _ in range(20):
        batch.step(np.arange(32) % len(batch.action_table))
    return np.array(batch.observation())


def test_written_scenarios_are_the_packages_own_and_can_be_changed_without_the_repository(tmp_path: Path) -> None:
    files = offtrack_sim.write_scenarios(tmp_path)
    names = {file.stem for file in files if file.parent == tmp_path}
    assert names == set(offtrack_sim.scenario_names())
    assert (stepped(tmp_path / "attard2023.toml") == stepped("attard2023")).all()
    text = (tmp_path / "attard2023.toml").read_text()
    slow = tmp_path / "slow.toml"
    slow.write_text(text.replace("speeds_kmh = [30.0]", "speeds_kmh = [15.0]"))
    assert not (stepped(slow) == stepped("attard2023")).all()


def test_files_that_are_there_are_left_alone_or_refused_before_anything_is_written(tmp_path: Path) -> None:
    assert offtrack_sim.write_scenarios(tmp_path) == offtrack_sim.write_scenarios(str(tmp_path))
    changed, gone = tmp_path / "attard2023.toml", tmp_path / "laden2026.toml"
    changed.write_text("mine")
    gone.unlink()
    with pytest.raises(FileExistsError, match=r"attard2023\.toml is there with another text; another folder"):
        offtrack_sim.write_scenarios(tmp_path)
    assert changed.read_text() == "mine" and not gone.exists()
    with pytest.raises(TypeError, match="folder: 3; the path of a folder is needed"):
        offtrack_sim.write_scenarios(3)  # type: ignore[arg-type]


def test_a_benchmark_in_memory_is_driven_as_its_file_and_with_changes_as_the_changed_one(tmp_path: Path) -> None:
    shipped = offtrack_sim.benchmark("attard2023")
    assert shipped.name == "attard2023" and (stepped(shipped) == stepped("attard2023")).all()
    assert shipped.keys["actions"]["speeds_kmh"] == [30.0] and shipped.keys["roundabout"][1]["train"][0] == "E-left-3"
    # Keys written anew, in another order, are the same benchmark.
    assert (stepped(shipped.changed({})) == stepped(shipped)).all()
    assert (stepped(dict(reversed(shipped.keys.items()))) == stepped(shipped)).all()
    slow = shipped.changed({"actions.speeds_kmh": np.array([15.0]), "reward.clearance": -2}, name="slow")
    assert offtrack_sim.Batch(slow).scenario == "slow" and slow.keys["reward"]["clearance"] == -2
    offtrack_sim.write_scenarios(tmp_path)
    slow.write(tmp_path / "slow.toml")
    assert (stepped(slow) == stepped(tmp_path / "slow.toml")).all()
    assert not (stepped(slow) == stepped(shipped)).all()
    # A file's paths are relative to it, and stay so.
    (tmp_path / "roundabouts" / "mine.toml").write_text((tmp_path / "roundabouts" / "32m.toml").read_text())
    mine = offtrack_sim.benchmark(tmp_path / "slow.toml").changed(
        {"roundabout": [{"file": "roundabouts/mine.toml", "train": "all"}]}, name="mine"
    )
    assert offtrack_sim.Batch(mine).route_names[0].startswith("mine/")
    assert (
        shipped.changed({"reward.clearance_limit": 0.4}).changed({"reward.clearance_limit": None}).keys == shipped.keys
    )


def test_changes_of_one_dict_count_tables_as_they_are() -> None:
    shipped = offtrack_sim.benchmark("attard2023")
    files = [table["file"] for table in shipped.keys["roundabout"]]
    changed = shipped.changed({"roundabout[0]": None, "roundabout[1].train": ["E-left-3"], "roundabout[4]": None})
    tables = changed.keys["roundabout"]
    assert [table["file"] for table in tables] == files[1:4]
    assert [table.get("train") for table in tables[:2]] == [["E-left-3"], "all"]
    with pytest.raises(KeyError, match="there is no such table"):
        shipped.changed({"roundabout[0]": None, "roundabout[0].train": "all"})


def test_a_shipped_name_is_that_benchmark_whatever_lies_in_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("attard2023").write_text("no benchmark")
    assert offtrack_sim.benchmark("attard2023").folder is None
    assert (stepped("attard2023") == stepped(offtrack_sim.benchmark("attard2023"))).all()


def test_wherever_a_benchmarks_name_stands_one_in_memory_may_stand(tmp_path: Path) -> None:
    keys = offtrack_sim.benchmark("attard2023").keys
    keys["roundabout"] = [{"file": "16m", "train": ["N-left-3"], "test": ["E-left-2"]}]
    own = offtrack_sim.Benchmark(keys, "mine")
    batch = offtrack_sim.Batch(own, 4)
    for _ in range(3):
        batch.step(np.zeros(4, np.int64))
    copy = pickle.loads(pickle.dumps(batch))
    assert copy.scenario == "mine" and (copy.observation() == batch.observation()).all()
    assert offtrack_sim.evaluate(offtrack_sim.Policy.shipped(), keys, episodes=2).routes == ["16m/E-left-2"]
    assert offtrack_sim.Observer(own, ["16m/N-left-3"]).num_trucks == 1
    assert offtrack_sim.make_vec(own, 2).reset(seed=1)[0].shape == (2, 69)
    layers = [(np.ones((69, 9), np.float32), np.zeros(9, np.float32))]
    export.save(tmp_path / "own.safetensors", layers, scenario=own)
    assert offtrack_sim.Policy.load(tmp_path / "own.safetensors").benchmark == "mine"


def test_a_wrong_benchmark_names_key_value_and_what_would_do() -> None:
    shipped = offtrack_sim.benchmark("attard2023")
    for changes, said in {
        "reward.clearence": (1.0, r"mine \(a text\).*unknown field `clearence`"),
        "time.step": (7.0, r"mine \(a text\): time\.step: 7 s; must lie in 0\.01\.\.1"),
        "vehicle": ("vehicles/nothing.toml", r"mine \(a text\): vehicle: .*nothing"),
    }.items():
        with pytest.raises(offtrack_sim.ScenarioError, match=said[1]):
            offtrack_sim.Batch(shipped.changed({changes: said[0]}, name="mine"))
    with pytest.raises(ValueError, match="attard2024; must be"):
        offtrack_sim.benchmark("attard2024")
    with pytest.raises(ValueError, match=r"reward\.waypoint: None; leave the key out"):
        offtrack_sim.Benchmark({"reward": {"waypoint": None}})
    with pytest.raises(ValueError, match=r"actions\.steer_levels\[1\]: inf; must be finite"):
        offtrack_sim.Benchmark({"actions": {"steer_levels": [0.0, float("inf")]}})
    with pytest.raises(TypeError, match="vehicle: .1.; a number, a text, a list or a table"):
        offtrack_sim.Benchmark({"vehicle": {1}})
    # What is not there need not be removed, nor the table that it would be in.
    assert shipped.changed({"traffic.group": None, "vehicle": None}).keys.keys() == shipped.keys.keys() - {"vehicle"}
    for key in ("roundabout[9].train", "vehicle.file", "a..b", ""):
        with pytest.raises(KeyError, match="there is no such table|names with dots"):
            shipped.changed({key: 1})
    with pytest.raises(TypeError, match="scenario: 3; the name of a benchmark"):
        offtrack_sim.Batch(3)  # type: ignore[arg-type]


def test_routes_are_drawn_by_their_weights_and_by_others_from_then_on() -> None:
    def shares(batch: offtrack_sim.Batch) -> dict[str, float]:
        batch.begin()
        names = np.array(batch.route_names)[batch.routes()]
        return {name: float((names == name).mean()) for name in np.unique(names)}

    routes = ["16m/N-left-3", "16m/E-left-2", "32m/N-left-2", "32m/S-left-2"]
    make = dict(routes=routes, seed=5, weights={"16m": 0.0, "16m/E-left-2": 6.0, "32m/S-left-2": 3.0})
    batch = offtrack_sim.Batch("attard2023", 20_000, **make)  # type: ignore[arg-type]
    found = shares(batch)
    assert found.keys() == {"16m/E-left-2", "32m/N-left-2", "32m/S-left-2"}
    for name, weight in {"16m/E-left-2": 0.6, "32m/N-left-2": 0.1, "32m/S-left-2": 0.3}.items():
        assert abs(found[name] - weight) < 0.02
    batch.weigh({"32m": 0.0})
    assert shares(batch).keys() == {"16m/N-left-3", "16m/E-left-2"}
    other = pickle.loads(pickle.dumps(batch))
    assert shares(other).keys() == {"16m/N-left-3", "16m/E-left-2"} and (other.routes() != batch.routes()).sum() >= 0
    batch.begin()
    for weights, said in (
        ({"32m": -1.0}, r'weights\["32m"\]: -1; must lie in 0\.\.1e6'),
        ({"50m": 1.0}, 'weights: "50m"; the batch draws from 16m/'),
        ({name: 0.0 for name in routes}, "weights: 0 for every route; one must be greater"),
    ):
        with pytest.raises(ValueError, match=said):
            batch.weigh(weights)
    with pytest.raises(TypeError, match=r"weights\['16m'\]: 'a'; a number is needed"):
        batch.weigh({"16m": "a"})  # type: ignore[dict-item]
    with pytest.raises(ValueError, match="weights: the batch was made without"):
        offtrack_sim.Batch().weigh({})
    with pytest.raises(TypeError, match="weights: 3; a dict"):
        offtrack_sim.Batch(weights=3)  # type: ignore[arg-type]


def test_weights_hold_among_thousands_of_routes_too() -> None:
    batch = offtrack_sim.Batch("random2026", 20_000, split="validation", seed=5, weights={})
    names = np.unique(np.array(batch.route_names))
    assert len(names) > 500
    heavy = names[: len(names) // 2]
    batch.weigh({name: 3.0 for name in heavy})
    batch.begin()
    share = np.isin(np.array(batch.route_names)[batch.routes()], heavy).mean()
    assert abs(share - 3 * len(heavy) / (2 * len(heavy) + len(names))) < 0.015


def test_roads_kerbs_and_vehicles_are_there_as_arrays_that_fit_each_other() -> None:
    batch = offtrack_sim.Batch("attard2023", 64, seed=3)
    for name in ("16m/N-left-3", "32m/E-left-3"):
        road = batch.road(name)
        assert road.waypoints.shape == (len(road.widths), 3)
        on_lane = batch.kerb_distance(name, road.waypoints[:, :2])
        assert (on_lane > 1.5).all()
        # Both edges lie half a lane's width from the centre, and on the road.
        for edge in road.edges():
            apart = np.linalg.norm(edge - road.waypoints[:, :2], axis=1)
            np.testing.assert_allclose(apart, road.widths / 2)
            assert (batch.kerb_distance(name, edge) > -0.05).all()
        for kerb in road.kerbs:
            assert np.abs(batch.kerb_distance(name, kerb)).max() < 0.06
            # The road is on a kerb's left.
            along = np.diff(kerb, axis=0)
            side = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
            middle = 0.5 * (kerb[1:] + kerb[:-1]) + 0.3 * side
            assert (batch.kerb_distance(name, middle) > 0).mean() > 0.98
        assert len(road.lanes) >= 4
    # Trucks stand on the lanes: the frame is that of the columns.
    trucks = batch.columns("truck")["truck"]
    for env in range(8):
        route = batch.route_names[batch.routes()[env]]
        assert batch.kerb_distance(route, trucks["position"][env : env + 1].astype(float))[0] > 0.5
    observer = offtrack_sim.Observer("attard2023", ["16m/N-left-3"])
    assert batch.dimensions() == observer.dimensions()
    for points in (np.zeros(2), np.full((1, 2), np.nan), np.zeros((2, 3))):
        with pytest.raises(ValueError, match="points: "):
            batch.kerb_distance("16m/N-left-3", points)
    with pytest.raises(ValueError, match='route: "20m/N-left-4"; the batch drives'):
        batch.road("20m/N-left-4")


def test_every_column_and_field_says_what_it_is_and_in_which_unit() -> None:
    docs = offtrack_sim.COLUMN_DOCS
    fields = {f"{name}.{field}" for name, dtype in offtrack_sim.COLUMNS.items() for field in dtype.base.names or ()}
    assert docs.keys() == fields | offtrack_sim.COLUMNS.keys()
    assert all(doc.strip() and "`[" not in doc for doc in docs.values())
    assert "m/s" in docs["truck.speed"] and "limit" in docs["terms.lane_distance"]
