"""One truck as an environment of Gymnasium."""

from __future__ import annotations

import copy
import operator
from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from .arguments import check_commands, checked_seed, numbers, within
from .batch import Batch
from .layout import EXTRAS, OBSERVATION, VEHICLES, Ended
from .scenarios import Scenario


def observation_space(n_extras: int = 0, *, vehicles: bool = False) -> gymnasium.spaces.Box:
    """69 values of float32, angles in -1..1, all others in 0..1; behind them a benchmark's extras, in -1..1, and where
    it observes other vehicles 42 values of them."""
    groups = (*OBSERVATION, *EXTRAS[:n_extras], *(VEHICLES if vehicles else ()))
    low = np.concatenate([np.full(values.n, values.low, np.float32) for values in groups])
    return gymnasium.spaces.Box(low, np.ones_like(low), dtype=np.float32)


def action_space(batch: Batch) -> gymnasium.spaces.Discrete | gymnasium.spaces.Box:
    """An index into the batch's action table or, where actions are continuous, a command: float32 in -1..1."""
    if batch.n_commands:
        return gymnasium.spaces.Box(-1.0, 1.0, (batch.n_commands,), np.float32)
    return gymnasium.spaces.Discrete(len(batch.action_table))


class Roundabout(gymnasium.Env[npt.NDArray[np.float32], Any]):
    """A tractor-trailer on a route through a roundabout; a step is 0.1 s.

    ``gymnasium.make("offtrack_sim:offtrack/Roundabout-v0", scenario=..., split=...)`` makes one.

    - Observation: :func:`observation_space`, see ``offtrack_sim.OBSERVATION`` and ``offtrack_sim.EXTRAS``.
    - Action: index into ``env.unwrapped.batch.action_table``, pairs of steer angle [rad] and speed [m/s]; where actions
      are continuous a command, float32 ``[n_commands]`` in -1..1, see :meth:`offtrack_sim.Batch.step`.
    - Reward: the benchmark's weighted sum; for attard2023 +100 a waypoint, up to -1.5 a step for the distance to the
      lane's centre, -500 for a failure. Wrap it in ``gymnasium.wrappers.NormalizeReward`` where a learner wants less.
    - Info after a reset: ``route``, and where the benchmark has several ``vehicle`` and ``load``. After the step that
      ends an episode: these with ``ended`` (:class:`offtrack_sim.Ended`) and ``is_success``. Otherwise empty.

    Args:
        scenario: Benchmark, as for :class:`offtrack_sim.Batch`.
        split: Routes that episodes are drawn from.
        routes: Names of routes or roundabouts in place of a split.
        render_mode: None, or ``"rgb_array"`` for pictures.
        render_size: Side of a picture [px].
        device: ``"cpu"``, ``"gpu"`` or part of an adapter's name.
        numeric_infos: Whether infos have indices in place of names, ``route`` in ``batch.route_names`` and ``vehicle``
            in ``batch.vehicle_classes``, as ``gymnasium.wrappers.NumpyToTorch`` needs them.
        max_episode_steps: Steps after which an episode is truncated in any case; None for the benchmark's limit alone.
            ``gymnasium.make`` keeps an argument of this name to itself and wraps the environment in its ``TimeLimit``,
            whose ends have no infos: make a ``Roundabout`` where they are needed, or :func:`offtrack_sim.make_vec`.
        weights: How often routes are drawn, as for :class:`offtrack_sim.Batch`; ``batch.weigh`` changes it.

    Copies (``copy.copy``, ``copy.deepcopy``) and pickles go on from the environment's state, independent of it.

    ``reset(seed=s)`` begins the first episode of the stream ``(s, 0)``, and each later ``reset()`` the next one.
    ``reset(options={"route": name, "start": Start(...)})`` states the route or the start (:class:`offtrack_sim.Start`)
    with its vehicle and its place along the route, or both; ``(offset, heading)`` is that of the first vehicle at the
    route's beginning.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(
        self,
        scenario: Scenario = "attard2023",
        *,
        split: str = "train",
        routes: Iterable[str] | None = None,
        render_mode: str | None = None,
        render_size: int = 480,
        device: str = "cpu",
        numeric_infos: bool = False,
        max_episode_steps: int | None = None,
        weights: Mapping[str, float] | None = None,
    ) -> None:
        check_render_mode(render_mode, render_size)
        self.batch = Batch(
            scenario,
            1,
            split=split,
            routes=routes,
            autoreset="disabled",
            num_threads=1,
            device=device,
            max_episode_steps=max_episode_steps,
            weights=weights,
        )
        self.observation_space = observation_space(len(self.batch.extras), vehicles=self.batch.observes_vehicles)  # type: ignore[assignment]
        self.action_space = action_space(self.batch)
        self.metadata = {**self.metadata, "render_fps": frames_per_second(self.batch)}
        self.render_mode = render_mode
        self.render_size = render_size
        self.numeric_infos = numeric_infos
        self._has_stream = False

    def __copy__(self) -> Roundabout:
        # A step of a copy that shared the batch would move this one's truck.
        return copy.deepcopy(self)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        if seed is not None:
            seed = checked_seed(seed)
        options = checked_options(options, "route", "start")
        super().reset(seed=seed)
        if seed is None and not self._has_stream:
            seed = int(self.np_random.integers(2**32))
        self.batch.begin(
            [0],
            seeds=None if seed is None else [seed],
            routes=None if options.get("route") is None else [options["route"]],
            starts=None if options.get("start") is None else [options["start"]],
        )
        self._has_stream = True
        return self.batch.observation()[0], self._named(self.batch.routes()[0], self.batch.vehicles()[0])

    def step(self, action: Any) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        if not self._has_stream or self.batch.waiting()[0]:
            raise gymnasium.error.ResetNeeded("call reset() before the first step and after the end of an episode")
        observation, reward, terminated, truncated = self.batch.step(self._row_of(action))
        info: dict[str, Any] = {}
        ended = self.batch.ended()
        if ended is not None:
            code = Ended(int(ended.codes[0]))
            info = {"ended": int(code), "is_success": code == Ended.ARRIVED}
            info |= self._named(ended.routes[0], ended.vehicles[0])
        return observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), info

    def _row_of(self, action: Any) -> npt.NDArray[Any]:
        """The action as those of a batch of one truck."""
        if isinstance(self.action_space, gymnasium.spaces.Box):
            command = numbers("action", action, f"float32 of shape {self.action_space.shape} is needed")
            if command.dtype.kind != "f":
                raise TypeError(f"action: {action!r}; float32 of shape {self.action_space.shape} is needed")
            if command.shape != self.action_space.shape:
                raise ValueError(f"action: shape {command.shape}; {self.action_space.shape} is needed")
            check_commands("action", command)
            return command[None].astype(np.float32)
        try:
            if isinstance(action, bool | np.bool_):
                raise TypeError
            index = operator.index(action)
        except TypeError:
            raise TypeError(f"action: {action!r}; an integer is needed") from None
        n_actions = len(self.batch.action_table)
        if not 0 <= index < n_actions:
            raise ValueError(f"action: {index}; must lie in 0..{n_actions - 1}")
        return np.array([index])

    def _named(self, route: np.int64, vehicle: np.int64) -> dict[str, Any]:
        if self.numeric_infos:
            return self.batch.named(int(route), int(vehicle), numeric=True)
        return self.batch.named(route, vehicle)

    def render(self) -> npt.NDArray[np.uint8] | None:
        """A picture from above, uint8 ``[render_size, render_size, 3]``; None without a render mode."""
        return None if self.render_mode is None else self.batch.render(0, self.render_size)


def check_render_mode(render_mode: str | None, render_size: int) -> None:
    """An error for a mode that no environment of this package has, and for a size that no picture has."""
    within("render_size", render_size, 64, 4097)
    if render_mode not in (None, "rgb_array"):
        raise ValueError(
            f'render_mode: {render_mode!r}; must be None or "rgb_array" (for a window: HumanRendering of gymnasium)'
        )


def check_alone(batch: Batch, learner: str) -> None:
    """An error where trucks share a road: one whose episode has ended waits for the others, which a learner that knows
    nothing of it takes for steps."""
    if batch.group != 1:
        needed = f"{learner} takes trucks that drive alone: leave the key out, or use Batch and its waiting()"
        raise ValueError(f"scenario: traffic.group: {batch.group}; {needed}")


def frames_per_second(batch: Batch) -> int:
    """Of a film in real time."""
    return max(1, round(1 / batch.step_seconds))


def checked_options(options: dict[str, Any] | None, *known: str) -> dict[str, Any]:
    """The options of a reset, if all are known."""
    if not isinstance(options, (dict, type(None))):
        raise TypeError(f"options: {options!r}; a dict is needed, or None")
    unknown = [name for name in options or {} if name not in known]
    if unknown:
        raise ValueError(f"options: {unknown[0]!r}; must be one of {', '.join(known)}")
    return dict(options or {})
