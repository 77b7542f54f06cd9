"""Trucks as an environment of PufferLib: each truck is an agent, and results go straight into PufferLib's buffers."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

try:
    import pufferlib
except ImportError:
    raise ImportError("puffer: pufferlib 3 is needed; pip install 'pufferlib>=3,<4'") from None

from .arguments import checked_seed
from .batch import Batch, Bools
from .episodes import Floats
from .layout import Ended
from .scenarios import Scenario
from .single import action_space, check_alone, observation_space

Buffers = tuple[Floats, Floats, Bools, Bools, list[dict[str, list[float]]]]


class RoundaboutPuffer(pufferlib.PufferEnv):
    """Trucks that are stepped together, with the interface of ``pufferlib.PufferEnv`` of PufferLib 3.

    - Observations ``[num_envs, n_values]`` float32, 69 and the benchmark's extras; actions ``[num_envs]`` integers or,
      where they are continuous, ``[num_envs, n_commands]`` float32; a truck whose episode ends begins the next one in
      the same step.
    - Rewards ``[num_envs]`` float32 are the benchmark's times ``reward_scale``: PufferLib's trainer clamps rewards to
      -1..1, and the benchmark's are -501.5 to +200.
    - PufferLib 3.0's trainer cuts the future at ``terminals`` alone: an episode that the time limit ends runs on, for
      it, into the next one.
    - Infos are a list with one dict where episodes ended: ``is_success``, ``episode_return`` (unscaled) and
      ``episode_length`` (steps of 0.1 s), each a list with one value an episode. It is empty where none ended.
    - ``batch`` is the simulator, with all its columns.

    ``pufferlib.vector.make(RoundaboutPuffer, env_kwargs={"num_envs": 1024}, num_envs=2, backend=...)`` runs two of them
    in processes of their own, 1,024 trucks each.

    Args:
        scenario: Benchmark, as for :class:`offtrack_sim.Batch`.
        num_envs: Number of trucks.
        split: Routes that episodes are drawn from.
        routes: Names of routes or roundabouts in place of a split.
        num_threads: Threads that step the trucks: one, for one process a core; None for one a core.
        device: ``"cpu"``, ``"gpu"`` or part of an adapter's name.
        reward_scale: Factor of all rewards.
        buf: PufferLib's buffers; None: it makes them.
        seed: Seed where ``reset`` is called without one, ``0..2**32``.
        max_episode_steps: Steps after which an episode is truncated in any case; None for the benchmark's limit alone.
        weights: How often routes are drawn, as for :class:`offtrack_sim.Batch`; ``batch.weigh`` changes it.

    Raises:
        ValueError: As :class:`offtrack_sim.Batch` says, and for a benchmark whose trucks share roads.
    """

    def __init__(
        self,
        scenario: Scenario = "attard2023",
        num_envs: int = 1024,
        *,
        split: str = "train",
        routes: Iterable[str] | None = None,
        num_threads: int | None = 1,
        device: str = "cpu",
        reward_scale: float = 0.002,
        buf: Any = None,
        seed: int = 0,
        max_episode_steps: int | None = None,
        weights: Mapping[str, float] | None = None,
    ) -> None:
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
        check_alone(self.batch, "PufferLib")
        self.single_observation_space = observation_space(len(self.batch.extras), vehicles=self.batch.observes_vehicles)
        self.single_action_space = action_space(self.batch)
        self.num_agents = num_envs
        self.render_mode = "rgb_array"
        self.reward_scale = reward_scale
        self._seed = seed
        self._has_begun = False
        self._returns = np.zeros(num_envs)
        self._lengths = np.zeros(num_envs, np.int64)
        super().__init__(buf)

    def __copy__(self) -> RoundaboutPuffer:
        # A step of a copy that shared the batch would move this one's trucks.
        return copy.deepcopy(self)

    def reset(self, seed: int | None = None) -> tuple[Floats, list[dict[str, list[float]]]]:
        """Begins an episode of every truck; truck ``i`` draws from ``(seed, i)``, or goes on with its own stream."""
        if seed is None and not self._has_begun:
            seed = self._seed
        streams = None if seed is None else [(checked_seed(seed), env) for env in range(self.num_agents)]
        self.batch.begin(streams=streams)
        self._has_begun = True
        self._returns[:], self._lengths[:] = 0.0, 0
        self.observations[...] = self.batch.observation()
        return self.observations, []

    def step(self, actions: npt.NDArray[Any]) -> Buffers:
        """One step of every truck, 0.1 s."""
        self.batch.step_into(actions, self.observations, self.rewards, self.terminals, self.truncations)
        self._returns += self.rewards
        self._lengths += 1
        self.rewards *= self.reward_scale
        infos = []
        ends = self.batch.ended()
        if ends is not None:
            infos.append(
                {
                    "is_success": (ends.codes == Ended.ARRIVED).astype(float).tolist(),
                    "episode_return": self._returns[ends.envs].tolist(),
                    "episode_length": self._lengths[ends.envs].tolist(),
                }
            )
            self._returns[ends.envs], self._lengths[ends.envs] = 0.0, 0
        return self.observations, self.rewards, self.terminals, self.truncations, infos

    def render(self, env: int = 0, size: int = 480) -> npt.NDArray[np.uint8]:
        """A picture of a truck, RGB ``[size, size, 3]``."""
        return self.batch.render(env, size)

    def close(self) -> None:
        """Nothing is left open."""
