"""Trucks that share a road, as a parallel environment of PettingZoo."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

try:
    from pettingzoo import ParallelEnv
except ImportError:
    raise ImportError("parallel: pettingzoo is needed; pip install offtrack-sim[pettingzoo]") from None

from .arguments import check_commands, checked_seed, numbers, within
from .batch import Batch
from .layout import Ended
from .scenarios import Scenario, whole
from .single import action_space, check_render_mode, frames_per_second, observation_space

Observation = npt.NDArray[np.float32]
#: Most trucks on a road.
MOST_TRUCKS = 8


class RoundaboutParallel(ParallelEnv[str, Observation, Any]):
    """Up to eight trucks on one road, and its other vehicles; a step is 0.1 s.

    ``"truck_0"``, ``"truck_1"``, ... begin together, on arms of their own or at least in lanes of their own, and see,
    follow and touch each other as they do other vehicles. An agent whose episode has ended leaves ``agents``, and its
    truck the road.

    - Observations, actions and rewards are those of :class:`offtrack_sim.Roundabout`, for each agent the same spaces.
    - Infos have ``route`` after a reset; after the step that ends an agent's episode ``route``, ``ended``
      (:class:`offtrack_sim.Ended`) and ``is_success``. Otherwise they are empty.

    Args:
        scenario: Benchmark with other vehicles, as for :class:`offtrack_sim.Batch`. ``{"traffic.demand": [0.0]}`` of
            :meth:`offtrack_sim.Benchmark.changed` leaves the trucks alone.
        n_trucks: Number of trucks, in place of the benchmark's ``traffic.group``.
        split: Routes that episodes are drawn from.
        routes: Names of routes or roundabouts in place of a split. Each roundabout needs as many lanes to begin in.
        render_mode: None, or ``"rgb_array"`` for pictures around the first agent.
        render_size: Side of a picture [px].
        device: ``"cpu"``, ``"gpu"`` or part of an adapter's name.

    ``reset(seed=s)`` begins the first episode of the streams ``(s, 0)``, ``(s, 1)``, ..., and each later ``reset()``
    the next one. ``reset(options={"routes": [...]})`` states a route for each truck.

    For many groups at once a :class:`offtrack_sim.Batch` of a benchmark with ``traffic.group`` has one after the other.

    Raises:
        ImportError: Without ``pip install offtrack-sim[pettingzoo]``.
        ValueError, RuntimeError: As for :class:`offtrack_sim.Batch`.
    """

    metadata: dict[str, Any] = {"name": "offtrack_roundabout_v0", "render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(
        self,
        scenario: Scenario = "traffic2026",
        n_trucks: int = 4,
        *,
        split: str = "train",
        routes: Iterable[str] | None = None,
        render_mode: str | None = None,
        render_size: int = 480,
        device: str = "cpu",
    ) -> None:
        check_render_mode(render_mode, render_size)
        n_trucks = within("n_trucks", n_trucks, 1, MOST_TRUCKS + 1)
        scenario = whole(scenario)
        if "traffic" not in scenario.keys:
            needed = (
                "trucks share a road among other vehicles: a benchmark with a table [traffic] is needed, as traffic2026"
            )
            raise ValueError(f"scenario: {scenario.name}; {needed}")
        shared = scenario.changed({"traffic.group": n_trucks}, name=scenario.name)
        self.batch = Batch(
            shared, n_trucks, split=split, routes=routes, autoreset="disabled", num_threads=1, device=device
        )
        self.possible_agents = [f"truck_{index}" for index in range(n_trucks)]
        self.agents: list[str] = []
        space = observation_space(len(self.batch.extras), vehicles=self.batch.observes_vehicles)
        self.observation_spaces = {agent: copy.deepcopy(space) for agent in self.possible_agents}
        self.action_spaces = {agent: action_space(self.batch) for agent in self.possible_agents}
        self.metadata = {**self.metadata, "render_fps": frames_per_second(self.batch)}
        self.render_mode = render_mode
        self.render_size = render_size
        self._has_begun = False

    def __copy__(self) -> RoundaboutParallel:
        # A step of a copy that shared the batch would move this one's trucks.
        return copy.deepcopy(self)

    def observation_space(self, agent: str) -> gymnasium.Space[Any]:
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begins an episode of every truck. Options other than ``routes`` are for wrappers."""
        if not isinstance(options, (dict, type(None))):
            raise TypeError(f"options: {options!r}; a dict is needed, or None")
        n = len(self.possible_agents)
        if seed is None and not self._has_begun:
            seed = int(np.random.SeedSequence().generate_state(1)[0])
        streams = None if seed is None else [(checked_seed(seed), index) for index in range(n)]
        self.batch.begin(streams=streams, routes=(options or {}).get("routes"))
        self._has_begun = True
        self.agents = list(self.possible_agents)
        observation = self.batch.observation()
        names = self.batch.named(self.batch.routes(), self.batch.vehicles())
        infos = {
            agent: {key: values[index] for key, values in names.items()} for index, agent in enumerate(self.agents)
        }
        return {agent: observation[index] for index, agent in enumerate(self.agents)}, infos

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """One step of the agents that there are, by the action of each.

        Raises:
            KeyError: For an agent without an action; the message names it. Actions of agents that have left are
                ignored.
            TypeError, ValueError: As :meth:`offtrack_sim.Batch.step`.
            gymnasium.error.ResetNeeded: Before the first reset, and once all agents have left.
        """
        if not self.agents:
            raise gymnasium.error.ResetNeeded("call reset() before the first step and once no agents are left")
        if not isinstance(actions, Mapping):
            raise TypeError(f"actions: {actions!r}; a dict of an action for each agent is needed")
        missing = [agent for agent in self.agents if agent not in actions]
        if missing:
            raise KeyError(f"actions: {missing[0]} is missing; an action of each of {', '.join(self.agents)} is needed")
        agents, rows = self.agents, [self.possible_agents.index(agent) for agent in self.agents]
        space = self.action_spaces[agents[0]]
        given = np.zeros((len(self.possible_agents), *(space.shape or ())), space.dtype)
        for agent, row in zip(agents, rows):
            given[row] = self._checked(agent, actions[agent])
        observation, reward, terminated, truncated = self.batch.step(given)
        infos: dict[str, dict[str, Any]] = {agent: {} for agent in agents}
        ended = self.batch.ended()
        if ended is not None:
            for env, code, route, vehicle in zip(ended.envs, ended.codes, ended.routes, ended.vehicles):
                end = Ended(int(code))
                infos[self.possible_agents[env]] = {
                    "ended": int(end),
                    "is_success": end == Ended.ARRIVED,
                    **self.batch.named(route, vehicle),
                }
        self.agents = [agent for agent, row in zip(agents, rows) if not (terminated[row] or truncated[row])]
        pairs = list(zip(agents, rows))
        return (
            {agent: observation[row] for agent, row in pairs},
            {agent: float(reward[row]) for agent, row in pairs},
            {agent: bool(terminated[row]) for agent, row in pairs},
            {agent: bool(truncated[row]) for agent, row in pairs},
            infos,
        )

    def _checked(self, agent: str, action: Any) -> npt.NDArray[Any]:
        """An agent's action, if its space has it."""
        space = self.action_spaces[agent]
        found = numbers(f"actions[{agent!r}]", action, f"one of {space} is needed")
        kinds = "f" if isinstance(space, gymnasium.spaces.Box) else "iu"
        if found.dtype.kind not in kinds or found.shape != (space.shape or ()):
            raise TypeError(f"actions[{agent!r}]: {action!r}; one of {space} is needed")
        if isinstance(space, gymnasium.spaces.Discrete):
            within(f"actions[{agent!r}]", found.item(), 0, int(space.n))
        else:
            check_commands(f"actions[{agent!r}]", found)
        return found

    def render(self) -> npt.NDArray[np.uint8] | None:
        """A picture around the first agent that there is, uint8 ``[render_size, render_size, 3]``; None without a
        render mode."""
        if self.render_mode is None:
            return None
        first = self.possible_agents.index(self.agents[0]) if self.agents else 0
        return self.batch.render(first, self.render_size)
