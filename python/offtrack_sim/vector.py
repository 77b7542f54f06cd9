"""Many trucks as a vector environment of Gymnasium."""

from __future__ import annotations

import copy as copies
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
import numpy.typing as npt

from .arguments import checked_seed, is_sequence, mode_name
from .batch import Batch
from .scenarios import Scenario
from .single import action_space, check_render_mode, checked_options, frames_per_second, observation_space

if TYPE_CHECKING:
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space

    Base = VectorEnv[npt.NDArray[np.float32], npt.NDArray[Any], npt.NDArray[Any]]
    HAS_MODES = True
else:
    try:
        from gymnasium.vector import AutoresetMode, VectorEnv
        from gymnasium.vector.utils import batch_space

        Base, HAS_MODES = VectorEnv, True
    except ImportError:
        # Vector environments of gymnasium before 1.1 reset themselves in another way.
        Base, HAS_MODES = object, False


class RoundaboutVector(Base):
    """Trucks that are stepped together, with the interface of ``gymnasium.vector.VectorEnv``; see :func:`make_vec`.

    - Observations ``[num_envs, n_values]`` float32, 69 and the benchmark's extras; actions ``[num_envs]`` integers or,
      where they are continuous, ``[num_envs, n_commands]`` float32; rewards ``[num_envs]`` float32.
    - ``batch`` is the simulator, with all its columns.
    - Infos have the form of Gymnasium's ``SyncVectorEnv``: an array ``key`` and a mask ``_key`` for ``route`` where an
      episode began and for ``ended``, ``is_success`` and ``route`` where one ended, and nothing where neither did. With
      ``SAME_STEP`` those of the end are in ``final_info``, and ``final_obs`` has the last observations. Where the
      benchmark has several vehicles or loads, ``vehicle`` and ``load`` stand beside ``route``. With ``numeric_infos``
      all of them are arrays of numbers.
    - Trucks that share a road (``batch.group``) begin together. What one does while it waits for the others is no
      transition in any mode: leave out the steps before which ``batch.waiting()`` marks it.
    - Copies (``copy.copy``, ``copy.deepcopy``) and pickles go on from the state, independent of this environment.

    With the same list of seeds every value is that of ``SyncVectorEnv`` with as many :class:`offtrack_sim.Roundabout`.
    One int gives the trucks other streams than Gymnasium's ``seed + i``, see :meth:`reset`.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(
        self,
        scenario: Scenario = "attard2023",
        num_envs: int = 1,
        *,
        split: str = "train",
        routes: Iterable[str] | None = None,
        seed: int | None = None,
        autoreset_mode: AutoresetMode | str | None = None,
        copy: bool = True,
        num_threads: int | None = None,
        device: str = "cpu",
        render_mode: str | None = None,
        render_size: int = 480,
        numeric_infos: bool = False,
        max_episode_steps: int | None = None,
        weights: Mapping[str, float] | None = None,
    ) -> None:
        if not HAS_MODES:
            message = (
                f"gymnasium {gymnasium.__version__}: vector environments need 1.1 or later; Roundabout and Batch do not"
            )
            raise ImportError(message)
        check_render_mode(render_mode, render_size)
        mode = "next_step" if autoreset_mode is None else mode_name("autoreset_mode", autoreset_mode)
        if seed is None:
            seed = int(np.random.SeedSequence().generate_state(1)[0])
        self.batch = Batch(
            scenario,
            num_envs,
            split=split,
            routes=routes,
            seed=seed,
            autoreset=mode,
            num_threads=num_threads,
            device=device,
            max_episode_steps=max_episode_steps,
            weights=weights,
        )
        self.num_envs = num_envs = self.batch.num_envs
        self.single_observation_space = observation_space(len(self.batch.extras), vehicles=self.batch.observes_vehicles)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.single_action_space = action_space(self.batch)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.autoreset_mode = AutoresetMode[mode.upper()]
        fps = frames_per_second(self.batch)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode, "render_fps": fps}
        self.render_mode = render_mode
        self.render_size = render_size
        self.numeric_infos = numeric_infos
        self._outputs = None if copy else _outputs(num_envs, self.batch.n_values)
        self._seed = seed
        self._has_begun = False

    def __copy__(self) -> RoundaboutVector:
        # A step of a copy that shared the batch would move this one's trucks.
        return copies.deepcopy(self)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | npt.NDArray[np.integer[Any]] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Begins an episode of every truck.

        Args:
            seed: An int gives truck ``i`` the stream ``(seed, i)``; a list gives it ``(seed[i], 0)``, which is what an
                environment of one truck has with that seed, and None in it leaves the truck its stream. None: every
                truck goes on with its next episode.
            options: ``reset_mask``, bool ``[num_envs]``: the trucks to begin, the others go on. ``routes`` and
                ``starts``: sequences of ``num_envs``, as for :meth:`offtrack_sim.Batch.begin`; a start has a vehicle
                and a place along its route.

        Returns:
            Observations and infos; trucks outside the mask have the observation they had.
        """
        options = checked_options(options, "reset_mask", "routes", "starts")
        mask = options.get("reset_mask")
        envs = list(range(self.num_envs)) if mask is None else _masked(mask, self.num_envs)
        # What goes on where no seed is given; before the first reset there is no episode to follow.
        own = [None if self._has_begun else (self._seed, env) for env in range(self.num_envs)]
        streams: list[tuple[int, int] | None]
        if seed is None:
            streams = [own[env] for env in envs]
        elif not is_sequence(seed):
            whole = checked_seed(seed)  # type: ignore[arg-type]
            super().reset(seed=whole)
            streams = [(whole, env) for env in envs]
        else:
            if len(seed) != self.num_envs:
                raise ValueError(f"seed: {len(seed)} seeds for {self.num_envs} trucks; one each is needed")
            streams = [own[env] if (given := seed[env]) is None else (checked_seed(given), 0) for env in envs]
        self.batch.begin(
            envs,
            streams=streams,
            routes=_chosen("routes", options.get("routes"), envs, self.num_envs),
            starts=_chosen("starts", options.get("starts"), envs, self.num_envs),
        )
        self._has_begun = True
        infos: dict[str, Any] = {}
        begun = np.zeros(self.num_envs, dtype=np.bool_)
        begun[envs] = True
        self._put_begun(infos, begun)
        return self._observation(), infos

    def step(
        self, actions: npt.NDArray[Any]
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[Any], npt.NDArray[np.bool_], npt.NDArray[np.bool_], dict[str, Any]]:
        """One step of every truck, 0.1 s; see the class for what it returns.

        Raises:
            TypeError, ValueError: For actions as :meth:`offtrack_sim.Batch.step` says.
            gymnasium.error.ResetNeeded: Before the first reset, and with ``DISABLED`` after the end of an episode.
        """
        if not self._has_begun:
            raise gymnasium.error.ResetNeeded("call reset() before the first step")
        waited = self.batch.waiting()
        if self._outputs is None:
            observation, reward, terminated, truncated = self.batch.step(actions)
        else:
            observation, reward, terminated, truncated = self._outputs
            self.batch.step_into(actions, observation, reward, terminated, truncated)
        infos = self.batch.end_infos(self.numeric_infos) or {}
        if waited.any():
            begun = waited & ~self.batch.waiting()
            if begun.any():
                self._put_begun(infos, begun)
        return observation, reward, terminated, truncated, infos

    def render(self) -> tuple[npt.NDArray[np.uint8], ...] | None:
        """A picture of every truck, uint8 ``[render_size, render_size, 3]`` each; None without a render mode."""
        if self.render_mode is None:
            return None
        return tuple(self.batch.render(env, self.render_size) for env in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Nothing is left open."""

    def _observation(self) -> npt.NDArray[np.float32]:
        found = self.batch.observation()
        if self._outputs is None:
            return found
        self._outputs[0][...] = found
        return self._outputs[0]

    def _put_begun(self, infos: dict[str, Any], begun: npt.NDArray[np.bool_]) -> None:
        """Adds the names of what trucks have begun with to what infos has of others."""
        routes, vehicles = self.batch.routes()[begun], self.batch.vehicles()[begun]
        for key, names in self.batch.named(routes, vehicles, self.numeric_infos).items():
            if key not in infos:
                # An array of None where it is one of objects.
                infos[key] = np.full(self.num_envs, 0 if self.numeric_infos else None, dtype=names.dtype)
            infos[key][begun] = names
            infos[f"_{key}"] = begun | infos.get(f"_{key}", False)


def make_vec(
    scenario: Scenario = "attard2023",
    num_envs: int = 1,
    *,
    split: str = "train",
    routes: Iterable[str] | None = None,
    seed: int | None = None,
    autoreset_mode: AutoresetMode | str | None = None,
    copy: bool = True,
    num_threads: int | None = None,
    device: str = "cpu",
    render_mode: str | None = None,
    render_size: int = 480,
    numeric_infos: bool = False,
    max_episode_steps: int | None = None,
    weights: Mapping[str, float] | None = None,
) -> RoundaboutVector:
    """Many trucks as a vector environment of Gymnasium (1.1 or later).

    Args:
        scenario: Benchmark: its name, its file, a :class:`offtrack_sim.Benchmark` or a dict of its keys.
        num_envs: Number of trucks.
        split: Routes that episodes are drawn from: ``"train"``, ``"validation"`` or ``"test"``.
        routes: Names of routes (``"16m/N-left-3"``) or of roundabouts (``"16m"``) of any split, in place of a split.
        seed: Seed where ``reset`` is called without one; None: another one each time.
        autoreset_mode: What follows the end of an episode, ``AutoresetMode`` or its name; None is ``NEXT_STEP``. Loops
            in the manner of CleanRL, which store every step, want ``SAME_STEP``: the step that begins an episode with
            ``NEXT_STEP`` is no transition.
        copy: Whether each step returns new arrays; False: it overwrites the last ones.
        num_threads: Threads that step the trucks; None for one a core. No result depends on it.
        device: ``"cpu"``, ``"gpu"`` for the first graphics device, or a part of a graphics device's name.
        render_mode: None, or ``"rgb_array"`` for a picture of every truck, ``render_size`` pixels a side.
        numeric_infos: Whether infos hold arrays of numbers alone, as ``gymnasium.wrappers.vector.NumpyToTorch`` needs
            them: ``route`` is the index in ``batch.route_names``, ``vehicle`` that in ``batch.vehicle_classes``, 0
            where there is none, and ``final_obs`` is float32 ``[num_envs, n_values]``.
        max_episode_steps: Steps after which an episode is truncated in any case; None for the benchmark's limit alone.
        weights: How often routes are drawn, as for :class:`offtrack_sim.Batch`; ``batch.weigh`` changes it.

    Raises:
        ValueError, MemoryError, RuntimeError: As :class:`offtrack_sim.Batch` says.
        ImportError: For an older gymnasium.
    """
    return RoundaboutVector(
        scenario,
        num_envs,
        split=split,
        routes=routes,
        seed=seed,
        autoreset_mode=autoreset_mode,
        copy=copy,
        num_threads=num_threads,
        device=device,
        render_mode=render_mode,
        render_size=render_size,
        numeric_infos=numeric_infos,
        max_episode_steps=max_episode_steps,
        weights=weights,
    )


Outputs = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], npt.NDArray[np.bool_], npt.NDArray[np.bool_]]


def _outputs(num_envs: int, n_values: int) -> Outputs:
    """Room for a step."""
    return (
        np.zeros((num_envs, n_values), np.float32),
        np.zeros(num_envs, np.float32),
        np.zeros(num_envs, np.bool_),
        np.zeros(num_envs, np.bool_),
    )


def _masked(mask: Any, num_envs: int) -> list[int]:
    """The trucks of a ``reset_mask``."""
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        kind = f"array of {mask.dtype}" if isinstance(mask, np.ndarray) else type(mask).__name__
        raise TypeError(f"options['reset_mask']: {kind}; a numpy array of bool is needed")
    if mask.shape != (num_envs,):
        raise ValueError(f"options['reset_mask']: shape {mask.shape}; ({num_envs},) is needed")
    if not mask.any():
        raise ValueError("options['reset_mask']: no truck is marked; at least one must be")
    return [int(env) for env in np.flatnonzero(mask)]


def _chosen(name: str, values: Sequence[Any] | None, envs: list[int], num_envs: int) -> list[Any] | None:
    """The values of these trucks."""
    if values is None:
        return None
    if not is_sequence(values):
        raise TypeError(f"options[{name!r}]: {values!r}; a sequence is needed, one a truck")
    if len(values) != num_envs:
        raise ValueError(f"options[{name!r}]: {len(values)} of them; {num_envs} are needed, one a truck")
    return [values[env] for env in envs]
