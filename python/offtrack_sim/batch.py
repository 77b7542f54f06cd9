"""The simulator itself: a batch of trucks, stepped together."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _offtrack
from .arguments import (
    check_length,
    checked_integer,
    checked_seed,
    device_name,
    mode_name,
    names_of,
    numbers,
    stream_of,
    text,
    trucks_of,
    weights_of,
    within,
)
from .episodes import Ends, Floats, GivenStart, Ints, Start, start_of
from .geometry import Road
from .layout import COLUMNS
from .scenarios import Scenario, given, kept, kept_routes
from .state import checked_state

Array = npt.NDArray[Any]
Bools = npt.NDArray[np.bool_]


class Batch(_offtrack.Batch):
    """Many trucks in one world.

    Args:
        scenario: Name of a benchmark that comes with the package, see :func:`offtrack_sim.scenario_names`; the path of
            a benchmark file; a :class:`offtrack_sim.Benchmark`; or a dict of a benchmark's keys.
        num_envs: Number of trucks.
        split: Routes that episodes are drawn from: ``"train"``, ``"validation"`` or ``"test"``.
        routes: Names of routes (``"16m/N-left-3"``) or of roundabouts (``"16m"``) of any split, in place of a split;
            and of random roads, as on the command line (``"wide/7/12"``), or files of roads, which stand in the order
            named behind the benchmark's own.
        seed: Seed of routes, starts and random actions, ``0..2**32``. Truck ``i`` draws from the stream ``(seed, i)``.
        autoreset: What follows the end of an episode: ``"same_step"``, ``"next_step"``, ``"disabled"``, or Gymnasium's
            ``AutoresetMode``.
        num_threads: Threads that step the trucks; None for one a core. No result depends on it.
        device: ``"cpu"``, ``"gpu"`` for the first graphics device, or a part of a graphics device's name.
        max_episode_steps: Steps after which an episode is timed out in any case; None for the benchmark's limit alone.
        weights: How often routes are drawn: 0 to 1e6 by the name of a route or a roundabout, 1 for those that it does
            not name, kept to 1 in 4,096; ``{}`` for equal ones that :meth:`weigh` may change. Without it each is
            as likely, by other random numbers.

    Attributes:
        num_envs: Number of trucks.
        scenario: Name of the benchmark.
        device: ``"cpu"``, or the graphics device with its interface and driver.
        autoreset: ``"same_step"``, ``"next_step"`` or ``"disabled"``.
        step_seconds: Time of a step [s].
        action_table: Steer angle [rad] and target speed [m/s] of each action, float32 ``[n_actions, 2]``; where actions
            are continuous, what commands of -1 and of 1 ask for.
        n_commands: Numbers of a command where actions are continuous: 1, the steer angle over the lock, or 2, with the
            target speed from the lowest (-1) to the highest (1); 0 where an action is an index.
        route_names: Names of the routes, in the order of the indices that columns have.
        extras: Names of the extras that stand behind an observation's 69 values, see :data:`offtrack_sim.EXTRAS`.
        observes_vehicles: Whether what is observed of vehicles stands behind these, :data:`offtrack_sim.VEHICLES`.
        group: Neighbouring trucks that share a road and its vehicles, ``traffic.group`` of the benchmark. They see and
            touch each other, and begin together once all their episodes have ended: see :meth:`waiting`.
        n_values: Number of an observation's values, all of these included.
        classes: Names of vehicle and load of each class that episodes draw from, pairs in the benchmark's order. The
            vehicle of a benchmark that has one is ``""``.
        vehicle_classes: Index into ``classes`` of each vehicle that episodes draw from, ``[n_vehicles]``: vehicles of
            one class differ where the benchmark draws dimensions.
        split: Which split's routes these are; ``"routes"`` where some were named that are not all of one, or of none.
        split_routes: The same names in the benchmark's order. Episode ``e`` of ``episodes`` on its n-th route has the
            stream ``(seed, n * episodes + e)`` in an evaluation.

    The batch begins with the first episode of every truck. One thread at a time may use it; the GIL is released while
    it steps.

    Copies (``copy.copy``, ``copy.deepcopy``) and pickles go on from the batch's state, independent of it: every later
    step is the same, bit for bit. A pickle names the benchmark, and is refused where that has changed.

    Raises:
        ValueError: For an unknown scenario, split, route or mode, and a number out of range; the message names the
            choices. :class:`ScenarioError` for a file that is refused.
        MemoryError: Where so many trucks do not fit into memory.
        RuntimeError: Where there is no such device; the message lists those there are.
    """

    def __new__(
        cls,
        scenario: Scenario = "attard2023",
        num_envs: int = 1,
        *,
        split: str = "train",
        routes: Iterable[str] | None = None,
        seed: int = 0,
        autoreset: str | enum.Enum = "same_step",
        num_threads: int | None = None,
        device: str = "cpu",
        max_episode_steps: int | None = None,
        weights: Mapping[str, float] | None = None,
    ) -> Batch:
        threads = 0 if num_threads is None else within("num_threads", num_threads, 1, 1025)
        # Gymnasium's -1 is no limit.
        limit = None if max_episode_steps in (None, -1) else within("max_episode_steps", max_episode_steps, 1, 2**32)
        names = None if routes is None else names_of(routes)
        batch = super().__new__(
            cls,
            given(scenario),
            max(-(2**62), min(checked_integer("num_envs", num_envs), 2**62)),
            split=text("split", split),
            routes=names,
            seed=checked_seed(seed),
            autoreset=mode_name("autoreset", autoreset),
            num_threads=threads,
            device=device_name(device),
            max_episode_steps=limit,
            weights=None if weights is None else weights_of(weights),
        )
        known = {"route": batch.route_names}
        if len(batch.classes) > 1:
            known["vehicle"], known["load"] = ([pair[i] for pair in batch.classes] for i in (0, 1))
        batch._names = {key: np.array(values, dtype=object) for key, values in known.items()}
        batch._rows = batch.vehicle_classes
        batch._arguments = {
            "scenario": kept(scenario),
            "num_envs": batch.num_envs,
            "split": split,
            "routes": kept_routes(names),
            "autoreset": batch.autoreset,
            "num_threads": num_threads,
            "device": device,
            "max_episode_steps": limit,
            "weights": None if weights is None else dict(weights),
        }
        return batch

    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]:
        return (), self._arguments

    def __getstate__(self) -> dict[str, Any]:
        made = ("_names", "_rows", "_arguments")
        attributes = {name: value for name, value in vars(self).items() if name not in made}
        return {
            "state": self.state(),
            "ended": self.last_ended(),
            "progress": self.progress(),
            "attributes": attributes,
        }

    def __setstate__(self, kept: dict[str, Any]) -> None:
        self.restore(kept["state"])
        self.resume(kept["progress"], kept["ended"])
        vars(self).update(kept["attributes"])

    _names: dict[str, Array]
    """Names by key of an info: of each route, and of vehicle and load of each class where there are several."""
    _rows: Ints
    """Index of each vehicle's class."""
    _arguments: dict[str, Any]
    """What makes a batch of the same trucks in the same world."""

    def step(self, actions: Array) -> tuple[Floats, Floats, Bools, Bools]:
        """One step of every truck: 0.1 s.

        Args:
            actions: Index of each truck's action in ``action_table``, integers ``[num_envs]``. Where actions are
                continuous each truck's command, float32 ``[num_envs, n_commands]``, in -1..1: left is positive, on a
                left-hand road right. None is clipped: ``gymnasium.wrappers.ClipAction`` does that.

        Returns:
            Observation ``[num_envs, n_values]``, reward, terminated and truncated, ``[num_envs]`` each. Where an
            episode ended and another began in the same step, the observation is the new one's first: :meth:`ended` has
            the last one.

        Raises:
            TypeError: For anything but an array of integers, or of numbers.
            ValueError: For another shape, for an action outside the table, and a number outside -1..1.
            gymnasium.error.ResetNeeded: Where ``autoreset`` is ``"disabled"`` and an episode has ended.
            RuntimeError: Where another thread uses the batch.
        """
        return super().step(actions)

    def step_into(
        self, actions: Array, observation: Floats, reward: Floats, terminated: Bools, truncated: Bools
    ) -> None:
        """The same into arrays of the caller: float32 ``[num_envs, n_values]`` and ``[num_envs]``, bool twice.

        They must be contiguous; a slice ``fragment[t]`` of an array of many steps is.
        """
        super().step_into(actions, observation, reward, terminated, truncated)

    def step_at_random(self) -> None:
        """One step of every truck with actions that are drawn from its stream, for measuring; nothing is returned, and
        :meth:`ended` tells nothing of it."""
        super().step_at_random()

    def observation(self) -> Floats:
        """What every truck observes before its next action, ``[num_envs, n_values]``."""
        return super().observation()

    def waiting(self) -> Bools:
        """Whether each truck's episode has ended and no other has begun, bool ``[num_envs]``.

        A truck of a group that waits for the others ignores its action and has a reward of 0; its next end is one of
        its next episode. What a learner keeps of its steps must leave those out that began with True.
        """
        return super().waiting()

    def routes(self) -> Ints:
        """Index in ``route_names`` of the route that each truck is on, ``[num_envs]``."""
        return super().routes()

    def vehicles(self) -> Ints:
        """Index in ``vehicle_classes`` of the vehicle that each truck is, ``[num_envs]``."""
        return super().vehicles()

    def named(self, routes: Any, vehicles: Any, numeric: bool = False) -> dict[str, Any]:
        """Names of routes and vehicles by their indices, as infos have them.

        ``route``, and where the benchmark has several classes ``vehicle`` and ``load``: arrays of names for arrays of
        indices, names for single ones. With ``numeric`` the indices themselves: ``route`` and ``vehicle``.
        """
        if numeric:
            return {"route": routes, "vehicle": vehicles}
        found = {"route": self._names["route"][routes]}
        if "vehicle" in self._names:
            classes = self._rows[vehicles]
            found |= {key: self._names[key][classes] for key in ("vehicle", "load")}
        return found

    def ended(self) -> Ends | None:
        """The episodes that the last step ended, None where it ended none or was ``step_at_random``, or ``begin`` or
        ``restore`` came after it."""
        found = self.last_ended()
        return None if found is None else Ends(*found)

    def begin(
        self,
        envs: Iterable[int] | None = None,
        *,
        seeds: Sequence[int | None] | npt.NDArray[np.integer[Any]] | None = None,
        streams: Sequence[tuple[int, int] | None] | None = None,
        routes: Sequence[str | None] | None = None,
        starts: Sequence[Start | tuple[Any, ...] | None] | None = None,
    ) -> None:
        """Begins an episode of some trucks and leaves the others as they are.

        Args:
            envs: Indices of the trucks, k of them; None for all.
            seeds: A seed for each: the episode is the first of the stream ``(seed, 0)``, as in a batch of one truck
                with that seed. None: the next episode of the truck's own stream.
            streams: The same with the whole stream, ``(seed, index)``.
            routes: Name of each one's route, of those that the batch drives; None for one as drawn.
            starts: Each one's :class:`Start`, or a tuple of its first values: ``(offset, heading)`` is that of the
                first vehicle at the middle of the speeds. None for one as drawn, with a vehicle as drawn.

        Raises:
            TypeError, ValueError: For what is not as above; the message names it, and no truck has begun.
        """
        indices = list(range(self.num_envs)) if envs is None else trucks_of(envs, self.num_envs)
        if seeds is not None and streams is not None:
            raise ValueError("seeds, streams: give one of them")
        for name, values in {"seeds": seeds, "streams": streams, "routes": routes, "starts": starts}.items():
            check_length(name, values, len(indices))
        checked: list[tuple[int, int] | None] | None = None
        if seeds is not None:
            checked = [
                None if seed is None else (within(f"seeds[{env}]", seed, 0, 2**32), 0)
                for env, seed in zip(indices, seeds)
            ]
        elif streams is not None:
            checked = [stream_of(f"streams[{env}]", stream) for env, stream in zip(indices, streams)]
        if routes is not None:
            routes = [None if name is None else text(f"routes[{env}]", name) for env, name in zip(indices, routes)]
        stated = None if starts is None else [self._start(env, start) for env, start in zip(indices, starts)]
        self.begin_episodes(indices, checked, routes, stated)

    def weigh(self, weights: Mapping[str, float]) -> None:
        """Draws the routes of later episodes by these weights, as ``weights`` of the batch; those under way go on.

        Copies and pickles keep them.

        Raises:
            TypeError, ValueError: For a name that the batch does not draw, a weight outside 0..1e6, weights of 0 alone,
                and a batch that was made without ``weights``; nothing has changed then.
        """
        if self._arguments["weights"] is None:
            raise ValueError("weights: the batch was made without; make it with weights={}")
        self.weigh_routes(weights_of(weights))
        self._arguments = {**self._arguments, "weights": dict(weights)}

    def road(self, route: str) -> Road:
        """A route, its lanes and kerbs as arrays, in the frame of ``columns("truck")``, see :class:`Road`."""
        return Road(*self.geometry_of(text("route", route)))

    def kerb_distance(self, route: str, points: npt.ArrayLike) -> Floats:
        """Distance of points ``[n, 2]`` from the nearest kerb of a route's road [m], negative off the road, ``[n]``.

        Inside the road's field, up to 5 m from a kerb, it is within 1 cm, or 3 cm where two kerbs are equally near;
        beyond 7.5 m inside a solid and 15.9 m from all kerbs it stays. Off the field, which ends some metres beyond the
        outermost kerbs, everything is solid, and the value falls with the distance from the field. The frame is that of
        :meth:`road`.
        """
        found = numbers("points", points, "numbers of shape (n, 2) are needed").astype(np.float64)
        if found.ndim != 2 or found.shape[1] != 2 or not np.isfinite(found).all():
            raise ValueError(f"points: {found.dtype} of shape {found.shape}; finite numbers of shape (n, 2) are needed")
        return self.kerb_distances(text("route", route), found)

    def dimensions(self, vehicle: int | tuple[str, str] = 0) -> dict[str, float]:
        """Lengths [m], masses [kg] and limits (SI, rad) of a vehicle, which is given as in :class:`Start`.

        Ends of the tractor are ahead of its drive axle, those of the trailer ahead of its axle group.
        """
        return self.dimensions_of(self._vehicle("vehicle", vehicle))

    def _start(self, index: int, given: Start | tuple[float, ...] | None) -> GivenStart | None:
        """A start with the index of its vehicle."""
        if given is None:
            return None
        start = start_of(f"starts[{index}]", given)
        return (*start[:3], self._vehicle(f"starts[{index}].vehicle", start.vehicle), start.along)

    def _vehicle(self, name: str, given: int | tuple[str, str] | list[str]) -> int:
        """Index of a vehicle, which may be given as a class."""
        rows = self._rows
        if not isinstance(given, tuple | list):
            return within(name, given, 0, len(rows))
        found = [index for index, known in enumerate(self.classes) if known == tuple(given) and (rows == index).any()]
        if not found:
            known = ", ".join(str(self.classes[index]) for index in np.unique(rows))
            raise ValueError(f"{name}: {given!r}; {self.scenario} has {known}")
        return int(np.flatnonzero(rows == found[0])[0])

    def columns(self, *names: str) -> dict[str, Array]:
        """Copies of columns, all where none is named: arrays of ``num_envs`` rows, see :data:`COLUMNS`, of those of
        vehicles without rows where there are none. From a graphics device only the named ones are read.

        ``batch.columns("truck")["truck"]["speed"]`` is every truck's speed [m/s].

        Where an episode ended and another began in the same step (``"same_step"``), these are of that step:
        ``action``, ``command``, ``clearance``, ``ended``, ``terms``, ``reward``, ``next_observation``, ``next_extras``
        and ``next_around``. The others are the next episode's: ``truck``, ``control``, ``progress``, ``ranges``,
        ``poses``, ``observation``, ``extras``, ``cars`` and ``around``. In the other modes all are of the episode that
        has ended until the next one begins. ``clearance`` stays until the first step of an episode.
        """
        wanted = [text("column", name) for name in names] or list(COLUMNS)
        rows = self.column_bytes(wanted)
        return {name: row.view(COLUMNS[name].base).reshape(-1, *COLUMNS[name].shape) for name, row in zip(wanted, rows)}

    def state(self) -> dict[str, Array]:
        """What :meth:`restore` needs: all columns, ``"stream"`` ``[num_envs, 2]`` and ``"world"`` ``[]``, uint32."""
        stream = np.array(self.streams(), dtype=np.uint32).reshape(self.num_envs, 2)
        return {**self.columns(), "stream": stream, "world": np.array(self.fingerprint(), dtype=np.uint32)}

    def restore(self, state: Mapping[str, Array]) -> None:
        """Goes on from a state: every later step is the same, bit for bit.

        The benchmark and its files, routes or split, and ``max_episode_steps`` must be those of the batch that it is
        from, and ``num_envs``.

        Raises:
            TypeError: For anything but a mapping of names to arrays.
            ValueError: For a state of another batch, and for the first value that no truck of this batch can have, by
                column, truck and field: a steer angle beyond the lock, a number that is not finite, a truck that waits
                where ``autoreset`` is ``"same_step"``. The batch is left as it was.
        """
        columns, streams = checked_state(state, self.num_envs, self.scenario, self.fingerprint())
        self.restore_bytes(columns, streams)

    def render(self, env: int = 0, size: int = 480) -> npt.NDArray[np.uint8]:
        """A picture of a truck on its roundabout from above, RGB ``[size, size, 3]``; size in 64..4096 pixels."""
        return self.picture(within("env", env, 0, self.num_envs), within("size", size, 64, 4097))

    def tally(self) -> dict[str, float]:
        """Sums since the batch was made: ``env_steps``, ``episodes``, ``reward``, and episodes by why they ended."""
        return super().tally()

    def __repr__(self) -> str:
        return (
            f"Batch({self.scenario!r}, num_envs={self.num_envs}, autoreset={self.autoreset!r}, device={self.device!r})"
        )
