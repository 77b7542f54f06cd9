"""Where things stand in an order, what has none of its own, and bytes, are refused by the argument's name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import offtrack_sim
from offtrack_sim import Batch

#: For calls that a checker of types would refuse.
sim: Any = offtrack_sim
LAYERS = [(np.zeros((2, 9), np.float32), np.zeros(9, np.float32))]


def batch_of_two() -> Any:
    return Batch(num_envs=2)


def observer_of_two() -> Any:
    return sim.Observer("attard2023", ["20m/E-left-2"] * 2)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: sim.Batch(routes={"16m", "50m"}), "routes: set"),
        (lambda: sim.Batch(routes=frozenset(["16m"])), "routes: frozenset"),
        (lambda: sim.Batch(routes={"16m": 1.0}), "routes: dict"),
        (lambda: sim.Batch(routes={"16m": 1.0}.keys()), "routes: dict_keys"),
        (lambda: sim.make_vec(routes={"16m"}), "routes: set"),
        (lambda: sim.Roundabout(routes={"16m"}), "routes: set"),
        (lambda: sim.evaluate(sim.Policy.shipped(), routes={"16m"}), "routes: set"),
        (lambda: sim.Observer("attard2023", {"20m/E-left-2"}), "routes: set"),
        (lambda: batch_of_two().begin({1, 0}, seeds=[1, 2]), "envs: set"),
        (lambda: batch_of_two().begin({1: 5, 0: 6}), "envs: dict"),
        (lambda: batch_of_two().begin(b"\0\1"), "envs: bytes"),
        (lambda: batch_of_two().begin(bytearray(2)), "envs: bytearray"),
        (lambda: batch_of_two().begin(memoryview(b"\0\1")), "envs: memoryview"),
        (lambda: batch_of_two().begin(seeds=b"12"), "seeds: b'12'"),
        (lambda: batch_of_two().begin(seeds={1, 2}), "seeds: {1, 2}"),
        (lambda: batch_of_two().begin(streams=[{5, 3}, None]), r"streams\[0\]: set"),
        (lambda: batch_of_two().begin(streams=[b"ab", None]), r"streams\[0\]: bytes"),
        (lambda: batch_of_two().begin(starts=[None, {0.5, 0.25}]), r"starts\[1\]: {"),
        (lambda: batch_of_two().begin(starts=[None, b"\0\1"]), r"starts\[1\]: b"),
        (lambda: sim.make_vec(num_envs=3).reset(seed=b"123"), "seed: b'123'"),
        (lambda: sim.make_vec(num_envs=3).reset(seed=bytearray(3)), "seed: bytearray"),
        (lambda: sim.make_vec(num_envs=3).reset(seed=memoryview(b"123")), "seed: <memory"),
        (lambda: sim.make_vec(num_envs=2).reset(options={"routes": {"16m": 1, "50m": 2}}), r"options\['routes'\]: {"),
        (lambda: observer_of_two().begin(np.zeros((2, 2)), 0.0, 0.0, 8.0, trucks=b"\0\1"), "trucks: b"),
        (lambda: sim.export.save("never", LAYERS, values={"speed", "waypoint_distance"}), "values: set"),
    ],
)
def test_what_has_no_order_and_bytes_are_refused_by_the_arguments_name(call: Callable[[], Any], name: str) -> None:
    with pytest.raises(TypeError, match=f"^{name}.* needed"):
        call()


def test_random_roads_stand_in_the_order_named_behind_the_benchmarks_own() -> None:
    for named in (["wide/7/13", "16m", "wide/7/12"], ["wide/7/12", "wide/7/13", "16m"]):
        roads = list(dict.fromkeys(name.rpartition("/")[0] for name in Batch(routes=iter(named)).split_routes))
        assert roads == ["16m", *(name for name in named if name != "16m")]
