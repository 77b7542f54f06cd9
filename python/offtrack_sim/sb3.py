"""Trucks as a vector environment of Stable-Baselines3, which takes no vector environment of Gymnasium."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError:
    raise ImportError("sb3: stable-baselines3 is needed; pip install offtrack-sim[sb3]") from None

from .arguments import check_order, checked_seed, within
from .batch import Batch, Bools
from .episodes import Floats
from .layout import Ended
from .scenarios import Scenario
from .single import (
    action_space,
    check_alone,
    check_render_mode,
    checked_options,
    frames_per_second,
    observation_space,
)

Indices = int | Iterable[int] | None


class RoundaboutVecEnv(VecEnv):
    """Trucks that are stepped together, with the interface of ``stable_baselines3.common.vec_env.VecEnv``.

    - Observations ``[num_envs, n_values]`` float32, 69 and the benchmark's extras; actions ``[num_envs]`` integers or,
      where they are continuous, ``[num_envs, n_commands]`` float32; rewards ``[num_envs]`` float32.
    - A truck whose episode ends begins the next one in the same step. Its info then has ``terminal_observation``,
      ``TimeLimit.truncated``, ``is_success``, ``ended`` (:class:`offtrack_sim.Ended`), ``route``, and ``vehicle`` and
      ``load`` where the benchmark has several; all others are empty.
    - ``batch`` is the simulator, with all its columns.

    With the same seeds every value is that of ``DummyVecEnv`` with as many :class:`offtrack_sim.Roundabout`. Wrap it in
    ``VecMonitor`` for returns and lengths of episodes, and in ``VecNormalize`` for rewards that a learner can fit: the
    benchmark's are -501.5 to +200.

    Args:
        scenario: Benchmark, as for :class:`offtrack_sim.Batch`.
        num_envs: Number of trucks.
        split: Routes that episodes are drawn from.
        routes: Names of routes or roundabouts in place of a split.
        seed: Seed where :meth:`reset` is called without :meth:`seed`; None: another one each time.
        num_threads: Threads that step the trucks; None for one a core.
        device: ``"cpu"``, ``"gpu"`` or part of an adapter's name.
        render_mode: None, or ``"rgb_array"`` for pictures of ``render_size`` pixels a side.
        max_episode_steps: Steps after which an episode is truncated in any case; None for the benchmark's limit alone.
        weights: How often routes are drawn, as for :class:`offtrack_sim.Batch`; ``batch.weigh`` changes it.

    Raises:
        ValueError: As :class:`offtrack_sim.Batch` says, and for a benchmark whose trucks share roads.
    """

    def __init__(
        self,
        scenario: Scenario = "attard2023",
        num_envs: int = 1,
        *,
        split: str = "train",
        routes: Iterable[str] | None = None,
        seed: int | None = None,
        num_threads: int | None = None,
        device: str = "cpu",
        render_mode: str | None = None,
        render_size: int = 480,
        max_episode_steps: int | None = None,
        weights: Mapping[str, float] | None = None,
    ) -> None:
        check_render_mode(render_mode, render_size)
        if seed is None:
            seed = int(np.random.SeedSequence().generate_state(1)[0])
        self.batch = Batch(
            scenario,
            num_envs,
            split=split,
            routes=routes,
            seed=seed,
            num_threads=num_threads,
            device=device,
            max_episode_steps=max_episode_steps,
            weights=weights,
        )
        check_alone(self.batch, "Stable-Baselines3")
        self.render_mode = render_mode
        self.render_size = render_size
        self._streams: list[tuple[int, int] | None] = [(seed, env) for env in range(num_envs)]
        space = observation_space(len(self.batch.extras), vehicles=self.batch.observes_vehicles)
        super().__init__(num_envs, space, action_space(self.batch))
        # `VecVideoRecorder` reads it.
        self.metadata: dict[str, Any] = {**self.metadata, "render_fps": frames_per_second(self.batch)}

    def __copy__(self) -> RoundaboutVecEnv:
        # A step of a copy that shared the batch would move this one's trucks.
        return copy.deepcopy(self)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Gives truck ``i`` the seed ``seed + i`` at the next reset, as an environment of one truck has with it."""
        first = int(np.random.randint(2**32, dtype=np.uint32)) if seed is None else checked_seed(seed)
        self._seeds: list[int | None] = [(first + env) % 2**32 for env in range(self.num_envs)]
        return self._seeds

    def reset(self) -> Floats:
        """Begins an episode of every truck; ``set_options`` states the ``route`` and ``start`` of some or all."""
        options = [checked_options(own, "route", "start") for own in self._options]
        streams = [later if seed is None else (seed, 0) for seed, later in zip(self._seeds, self._streams)]
        routes, starts = ([own.get(key) for own in options] for key in ("route", "start"))
        self.batch.begin(streams=streams, routes=routes, starts=starts)
        # From now on each truck goes on in its stream.
        self._streams = [None] * self.num_envs
        self.reset_infos = [self.batch.named(*pair) for pair in zip(self.batch.routes(), self.batch.vehicles())]
        self._reset_seeds()
        self._reset_options()
        return self.batch.observation()

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """Keeps the actions; :meth:`step_wait` steps."""
        self._actions = actions

    def step_wait(self) -> tuple[Floats, Floats, Bools, list[dict[str, Any]]]:
        """One step of every truck, 0.1 s."""
        observation, reward, terminated, truncated = self.batch.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ends = self.batch.ended()
        if ends is not None:
            routes, vehicles = self.batch.routes(), self.batch.vehicles()
            for env, code, route, last, vehicle in zip(*ends):
                infos[env] = {
                    "terminal_observation": last,
                    "TimeLimit.truncated": bool(truncated[env] and not terminated[env]),
                    "is_success": bool(code == Ended.ARRIVED),
                    "ended": int(code),
                    **self.batch.named(route, vehicle),
                }
                self.reset_infos[env] = self.batch.named(routes[env], vehicles[env])
        return observation, reward, terminated | truncated, infos

    def close(self) -> None:
        """Nothing is left open."""

    def get_images(self) -> Sequence[npt.NDArray[np.uint8] | None]:
        """A picture of every truck, uint8 ``[render_size, render_size, 3]``; None each without a render mode."""
        if self.render_mode is None:
            warnings.warn('render_mode is None; "rgb_array" is needed for pictures', stacklevel=2)
            return [None] * self.num_envs
        return [self.batch.render(env, self.render_size) for env in range(self.num_envs)]

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """An attribute of the batch or of this environment, once for each of the trucks: it is the same for all."""
        owner = self if hasattr(self, attr_name) else self.batch
        return [getattr(owner, attr_name) for _ in self._chosen(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Sets an attribute of this environment, for all trucks: none has attributes of its own."""
        if len(self._chosen(indices)) != self.num_envs:
            raise ValueError(
                f"{attr_name}: trucks of one batch have no attributes of their own; set it for all, without indices"
            )
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Calls a method of the batch that takes a truck's index first, ``render`` alone, for each of the trucks."""
        if method_name != "render":
            raise AttributeError(
                f"{method_name}: trucks of one batch have no methods of their own but render; see `batch`"
            )
        if not method_args:
            method_kwargs = {"size": self.render_size} | method_kwargs
        return [self.batch.render(env, *method_args, **method_kwargs) for env in self._chosen(indices)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:
        """No truck is wrapped on its own."""
        return [False for _ in self._chosen(indices)]

    def _chosen(self, indices: Indices) -> list[int]:
        """The trucks meant."""
        if indices is None:
            return list(range(self.num_envs))
        check_order("indices", indices, "a sequence of indices of trucks is needed, or None for all")
        chosen = [indices] if isinstance(indices, (int, np.integer)) else list(indices)
        return [within("indices", int(env), 0, self.num_envs) for env in chosen]
