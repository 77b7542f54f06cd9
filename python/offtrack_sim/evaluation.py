"""Evaluates a policy: a number of episodes on every route of a split, every one counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _offtrack
from .arguments import check_commands, checked_integer, checked_seed, device_name, numbers, single
from .batch import Batch
from .layout import Ended
from .policy import Policy
from .scenarios import Scenario, whole


@dataclass(frozen=True, eq=False, repr=False)
class Evaluation:
    """What an evaluation found."""

    scenario: str
    """Name of the benchmark."""
    split: str
    """Which routes of the benchmark: those of ``"train"``, ``"validation"`` or ``"test"``, or ``"routes"`` where some
    were named that are not all of one split."""
    seed: int
    """Seed of the starts."""
    routes: list[str]
    """Names of the routes, n of them."""
    ended: npt.NDArray[np.int64]
    """Why each episode ended, as :class:`offtrack_sim.Ended`, ``[n, episodes]``."""
    table: npt.NDArray[np.void]
    """A row an episode, route by route, ``[n * episodes]``, with the fields

    - ``route``, ``episode``: the route's name, and the episode's index among those of its route;
    - ``start_offset``, ``start_heading``, ``start_speed``, ``start_along``, ``vehicle``: the start, as
      :class:`offtrack_sim.Start`;
    - ``ended``, ``steps``: why it ended, as :class:`offtrack_sim.Ended`, and its steps of 0.1 s;
    - ``reward``, and what the reward weighs, each summed over the steps: ``term_waypoints``, waypoints passed;
      ``term_lane_distance``, distances as fractions of their limit; ``term_clearance``, depths in the margin kept from
      kerbs, 0..1; ``term_failure``, 1 for a failure;
    - ``lane_distance_mean``, ``lane_distance_max`` [m]; ``outside_lane``, a fraction of the steps
      (``outside_lane_mean`` of a JSON report is that of episodes that arrived);
    - ``tractor_clearance_min``, ``trailer_clearance_min`` [m], negative beyond a kerb;
    - ``load_transfer_ratio_peak``, 1 where wheels lift; ``articulation_peak`` [rad]; ``off_tracking_peak`` [m];
    - ``on_apron``, furthest that a wheel of the trailer was on an apron [m], 0 on a road without one.

    ``pandas.DataFrame(table)`` takes it, and ``np.savetxt(file, table, "%s", ",", header=",".join(table.dtype.names),
    comments="")`` writes it.
    """

    @property
    def success(self) -> float:
        """Fraction of the episodes that arrived."""
        return float((self.ended == Ended.ARRIVED).mean())

    @property
    def success_interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of that fraction, as if each episode were a sample of its own."""
        return _offtrack.wilson(int((self.ended == Ended.ARRIVED).sum()), self.ended.size)

    @property
    def success_interval_over_routes(self) -> tuple[float, float] | None:
        """The 95 % interval over routes of that fraction, see :meth:`interval_over_routes`."""
        return self.interval_over_routes(self.ended == Ended.ARRIVED)

    def interval_over_routes(self, values: npt.ArrayLike) -> tuple[float, float] | None:
        """The 95 % interval of the mean of a figure, such as ``table["lane_distance_mean"]``; None on one route alone.

        Routes are drawn with replacement, each with all its episodes: these have nearly the same start and end alike,
        so that 30 of them are not 30 samples. The numbers are those of ``offtrack evaluate --json``.

        Args:
            values: A number for each episode, ``[n * episodes]`` as the rows of :attr:`table`, or ``[n, episodes]``.

        Raises:
            TypeError, ValueError: For what are no finite numbers, or another number of them.
        """
        if isinstance(values, np.ndarray) and values.dtype == np.bool_:
            values = values.astype(np.float64)
        found = numbers("values", values, "a number for each episode is needed").astype(np.float64)
        if found.shape not in (self.ended.shape, (self.ended.size,)) or not np.isfinite(found).all():
            needed = f"finite numbers of shape ({self.ended.size},) or {self.ended.shape} are needed"
            raise ValueError(f"values: {found.dtype} of shape {found.shape}; {needed}")
        routes = np.repeat(np.arange(len(self.ended), dtype=np.uint32), self.ended.shape[1])
        return _offtrack.interval_over_routes(routes, found.ravel())

    @property
    def success_by_route(self) -> dict[str, float]:
        """The same for each route."""
        arrived = (self.ended == Ended.ARRIVED).mean(axis=1)
        return {name: float(fraction) for name, fraction in zip(self.routes, arrived)}

    @property
    def counts(self) -> dict[str, int]:
        """Episodes by why they ended."""
        counted = Counter(int(code) for code in self.ended.ravel())
        return {ended.name.lower(): counted[ended] for ended in Ended if counted[ended]}

    def as_dict(self) -> dict[str, Any]:
        """The same for a JSON file, with the keys of ``offtrack evaluate --json``; ``routes`` has the success of each
        route by its name, where the command lists records."""
        low, high = self.success_interval
        over_routes = self.success_interval_over_routes
        ends = {} if over_routes is None else {"low": over_routes[0], "high": over_routes[1]}
        return {
            "benchmark": self.scenario,
            "split": self.split,
            "seed": self.seed,
            "episodes": self.ended.size,
            "arrived": self.counts.get("arrived", 0),
            "success": self.success,
            "success_low": low,
            "success_high": high,
            **{f"success_{end}_over_routes": value for end, value in ends.items()},
            # Those of other vehicles only where there are any.
            "ends": {ended.name.lower(): 0 for ended in Ended if 0 < ended < Ended.MET_VEHICLE} | self.counts,
            "routes": self.success_by_route,
        }

    def __str__(self) -> str:
        arrived = int((self.ended == Ended.ARRIVED).sum())
        counts = ", ".join(f"{name} {count}" for name, count in self.counts.items())
        return f"{self.scenario} {self.split}: {self.success:.1%} ({arrived}/{self.ended.size}); {counts}"

    def __repr__(self) -> str:
        return f"<Evaluation on {self}>"


def evaluate(
    policy: Policy | Callable[..., Any],
    scenario: Scenario = "attard2023",
    *,
    split: str = "test",
    routes: Iterable[str] | None = None,
    episodes: int = 30,
    seed: int = 0,
    device: str = "cpu",
    begins: bool = False,
) -> Evaluation:
    """Drives every route of a split ``episodes`` times and counts how the episodes ended.

    The starts are those of ``offtrack evaluate`` with the same seed and number of episodes.

    Args:
        policy: A :class:`offtrack_sim.Policy`, or any function from observations ``[n, n_values]`` to actions
            ``[n]``, of continuous ones ``[n, n_commands]``: 69 values, and behind them the benchmark's extras. Rows are
            those of the trucks that still drive.
        scenario, split, routes, device: As for :class:`offtrack_sim.Batch`. A :class:`offtrack_sim.Policy` acts on the
            device, too.
        episodes: Episodes on each route.
        seed: Seed of the starts.
        begins: Whether the function remembers: then it is called with observations and a mask ``[n]`` of the trucks
            whose episode begins, as of ``episode_start`` in Stable-Baselines3's ``predict``, and the rows are those of
            all trucks at each step, in one order. What it gives for one whose episode has ended has no effect.

    Raises:
        TypeError: For a function that gives anything but integers, or commands, one for each observation.
        ValueError: As :class:`offtrack_sim.Batch` says, and for a policy with another action table or other extras
            than the benchmark's.
    """
    if not callable(policy) and not isinstance(policy, Policy):
        raise TypeError(f"policy: {policy!r}; a Policy, or a function from observations to actions, is needed")
    per_route = checked_integer("episodes", episodes)
    if per_route < 1:
        raise ValueError(f"episodes: {episodes}; must be at least 1")
    seed = checked_seed(seed)
    try:
        batch = Batch(scenario, 1, split=split, routes=routes)
    except ValueError:
        _check_alone(scenario)
        raise
    if isinstance(policy, Policy):
        policy.check(batch)
    if begins and isinstance(policy, Policy):
        raise ValueError("begins: True; a Policy remembers by itself: leave it out")
    chooser = _chooser(policy, batch.n_commands)
    columns = dict(_offtrack.drive(batch, chooser, min(per_route, 2**62), seed, device_name(device), bool(begins)))
    names = batch.split_routes
    ended = columns["ended"].reshape(len(names), per_route)
    return Evaluation(batch.scenario, batch.split, seed, names, ended, _table(names, per_route, columns))


def _check_alone(scenario: Scenario) -> None:
    """An error where trucks share a road: as the command line has it."""
    traffic = whole(scenario).keys.get("traffic")
    group = traffic.get("group", 1) if isinstance(traffic, dict) else 1
    if group != 1:
        needed = "an evaluation drives trucks alone: leave the key out"
        raise ValueError(f"scenario: traffic.group: {group}; {needed}")


def _table(routes: list[str], per_route: int, columns: dict[str, npt.NDArray[Any]]) -> npt.NDArray[np.void]:
    """The columns of episodes as rows."""
    columns = {
        "route": np.repeat(np.array(routes, np.str_), per_route),
        "episode": np.tile(np.arange(per_route), len(routes)),
        **columns,
    }
    table = np.empty(len(columns["route"]), [(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        table[name] = column
    return table


def _chooser(policy: Policy | Callable[..., Any], n_commands: int) -> _offtrack.Network | Callable[..., Any]:
    """What drives: a policy's network itself, unless a class that extends `Policy` acts otherwise."""
    if type(policy) is Policy:
        return policy._network
    act = policy.act if isinstance(policy, Policy) else policy
    return lambda observations, *begins: _checked(act(observations, *begins), len(observations), n_commands)


def _checked(actions: Any, n: int, n_commands: int) -> npt.NDArray[Any]:
    """What a policy gave for ``n`` observations: as indices, numbers with a fraction would lose it where they are
    stored."""
    found = numbers("policy", actions, "an array of integers, or of commands, is needed")
    if n_commands:
        if found.dtype.kind != "f" or found.shape != (n, n_commands):
            needed = f"float32 of shape ({n}, {n_commands}) is needed"
            raise TypeError(f"policy: gave {found.dtype} of shape {found.shape}; {needed}")
        rounded = single(found)
        # The batch judges what it is given; what rounding would hide from it is judged here.
        check_commands("actions", np.where(abs(rounded) <= 1, found, 0.0))
        return rounded
    if found.dtype.kind not in "iu" or found.shape != (n,):
        raise TypeError(f"policy: gave {found.dtype} of shape {found.shape}; integers of shape ({n},) are needed")
    return found
