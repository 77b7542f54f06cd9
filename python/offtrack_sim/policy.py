"""Policies that drive: the one that comes with the package, and trained ones."""

from __future__ import annotations

import copy
import os
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _offtrack
from .arguments import checked_integer, file_name, numbers, single
from .layout import EXTRAS

if TYPE_CHECKING:
    from .batch import Batch
    from .observer import Observer


class Policy:
    """A network that chooses an action for an observation; :meth:`shipped` and :meth:`load` make one.

    Policy files are written by ``offtrack train`` and by :mod:`offtrack_sim.export`. Copies and pickles drive as it
    does: a task of Ray or another process may take one.
    """

    def __init__(self, network: _offtrack.Network) -> None:
        self._network = network

    @staticmethod
    def shipped(name: str = "attard2023") -> Policy:
        """The policy of this name that comes with the package.

        A benchmark's name, or ``attard2023-lane``, which drives nearer to its lane's centre on ``attard2023``. These
        two hold in the simulator's own truck at 30 km/h alone: to another simulator or a truck take
        ``transfer2026``, which chooses its speed and learned with other tyres, delays and noise.

        Raises:
            ValueError: Where there is none; the message names those there are.
        """
        if not isinstance(name, str):
            raise TypeError(f"name: {name!r}; the name of a policy is needed")
        return Policy(_offtrack.Network.shipped(name))

    @staticmethod
    def load(file: str | os.PathLike[str]) -> Policy:
        """The policy of a file.

        Raises:
            ValueError: For a file that cannot be read, is damaged, has another shape, or has numbers so large that its
                logits may not be finite; the message names file and fault.
        """
        return Policy(_offtrack.Network.load(file_name(file)))

    @property
    def name(self) -> str:
        """Its file, or the shipped policy's name and ``(shipped)``."""
        return self._network.name

    @property
    def benchmark(self) -> str:
        """The benchmark that it was trained on."""
        return self._network.benchmark

    @property
    def extras(self) -> list[str]:
        """Names of the extras that it observes behind an observation's 69 values: a batch must have the same."""
        return self._network.extras

    @property
    def vehicles(self) -> bool:
        """Whether it observes other vehicles, which a batch must then observe too."""
        return self._network.vehicles

    @property
    def values(self) -> list[str] | None:
        """Names of the values that it reads, in its order; ``None`` where it reads all 69 and ``extras``."""
        return self._network.values

    @property
    def frames(self) -> int:
        """Number of steps whose values it sees at once."""
        return self._network.frames

    @property
    def has_memory(self) -> bool:
        """Whether what it does depends on earlier observations: then a :meth:`driver` drives."""
        return self._network.has_memory

    @property
    def head(self) -> str:
        """What it gives: ``"levels"``, indices of actions, or ``"continuous"``, commands in -1..1."""
        return self._network.head

    @property
    def action_table(self) -> npt.NDArray[np.float32]:
        """Steer angle [rad] and speed [m/s] of each action, ``[n, 2]``: a batch must have the same table.

        Of a policy that gives commands what -1 and what 1 asks for.
        """
        return self._network.action_table

    def check(self, batch: Batch | Observer) -> None:
        """Checks that it can drive the trucks of this batch or observer.

        Raises:
            ValueError: Where the batch has other extras or another action table, or takes commands where the policy
                chooses among actions; the message says which.
        """
        if not hasattr(batch, "n_commands"):
            raise TypeError(f"batch: {batch!r}; a Batch or an Observer is needed")
        if self.head != "levels" and not batch.n_commands:
            raise ValueError(f"{self.name}: gives commands; {batch.scenario} has a table of actions")
        if self.head == "levels" and batch.n_commands:
            raise ValueError(
                f"{self.name}: chooses among {len(self.action_table)} actions; {batch.scenario} takes commands"
            )
        if self.values is not None:
            known = {values.name for values in EXTRAS} - set(batch.extras)
            missing = [name for name in self.values if name in known]
            if missing:
                lacks = ", ".join(missing)
                raise ValueError(f"{self.name}: reads {lacks}, which {batch.scenario} does not observe")
        elif self.extras != batch.extras:
            its, needed = (", ".join(extras) or "none" for extras in (self.extras, batch.extras))
            raise ValueError(f"{self.name}: observes other extras than {batch.scenario}: {its}; {needed} are needed")
        sees = getattr(batch, "observes_vehicles", False)
        if self.vehicles and not sees:
            blind = batch.scenario if hasattr(batch, "observes_vehicles") else "an observer"
            raise ValueError(f"{self.name}: observes other vehicles, which {blind} does not")
        if sees and not self.vehicles and self.values is None:
            raise ValueError(f"{self.name}: observes no other vehicles, as {batch.scenario} does")
        tables = self.action_table, batch.action_table
        if tables[0].shape != tables[1].shape or not np.allclose(*tables, atol=1e-5):
            raise ValueError(f"{self.name}: has another action table than {batch.scenario}; see action_table of both")

    def act(self, observations: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """The most probable action for each observation: ``[n, n_values]`` gives ``[n]``, ``[n_values]`` a number.

        A policy that gives commands has a row of them in place of a number, ``[n, n_commands]``.

        Raises:
            TypeError: For what is no array of numbers.
            ValueError: For another shape, another number of values than 69 and one for each of ``extras``, for one that
                is not finite, and for a policy with a memory; the message names them.
        """
        rows = _rows(observations, 1, 2)
        if rows.ndim == 1:
            return self._network.act(rows[None])[0]  # type: ignore[no-any-return]
        return self._network.act(rows)

    def logits(self, observations: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
        """The network's output for each observation, ``[n, n_values]`` to ``[n, n_actions]``.

        Their softmax gives probabilities. Of a policy that gives commands they are the means, before these are squashed
        or clipped.

        Raises:
            ValueError: As for :meth:`act`; one observation is ``observation[None]``.
        """
        return self._network.logits(_rows(observations, 2))

    def driver(self, n: int) -> Driver:
        """The policy with a memory for each of ``n`` trucks."""
        count = checked_integer("n", n)
        if count < 1:
            raise ValueError(f"n: {count}; must be at least 1")
        return Driver(self, self._network.driver(min(count, 2**62)), count)

    def __repr__(self) -> str:
        return f"Policy({self.name!r})"


class Driver:
    """A policy that drives some trucks and remembers what each has observed; :meth:`Policy.driver` makes one.

    What it gives for a truck depends on what that truck observed since its episode began, and on nothing else. A copy
    (``copy.copy``, ``copy.deepcopy``) remembers the same and goes on by itself.
    """

    def __init__(self, policy: Policy, native: _offtrack.Driver, n: int) -> None:
        self.policy = policy
        """What drives."""
        self.n = n
        """Number of trucks."""
        self._native = native

    def act(self, observations: npt.NDArray[Any], begins: npt.NDArray[np.bool_] | None = None) -> npt.NDArray[Any]:
        """The most probable action of each truck for what it observes now, or its commands, as :meth:`Policy.act`.

        Args:
            observations: What each truck observes, ``[n, n_values]``; one step after those of the last call.
            begins: Which of them are the first of an episode, ``[n]``: a truck's memory is empty then, as it is at
                the first call. With ``autoreset="same_step"`` what ended in the last step. None without.

        Raises:
            TypeError: For what is no array of numbers, and for ``begins`` that are no array of bool, one a truck.
            ValueError: For another shape or number of rows or values, and for a value that is not finite.
        """
        return self._native.act(_rows(observations, 2), begins)

    def __copy__(self) -> Driver:
        # A copy that shared the memory would make this one remember what the copy observes.
        return Driver(self.policy, self._native.copied(), self.n)

    def __deepcopy__(self, memo: dict[int, Any]) -> Driver:
        return copy.copy(self)

    def __reduce__(self) -> str:
        raise TypeError("Driver: what it remembers cannot be pickled; copy.copy copies it, Policy.driver begins anew")

    def __repr__(self) -> str:
        return f"Driver({self.policy.name!r}, {self.n})"


def _rows(observations: npt.NDArray[Any], *dimensions: int) -> npt.NDArray[np.float32]:
    """Observations as the network takes them, of so many dimensions."""
    found = numbers("observations", observations, "an array of numbers, [n, n_values], is needed")
    if found.ndim not in dimensions:
        needed = "(n, n_values) is needed" if 1 not in dimensions else "(n, n_values) or (n_values,) is needed"
        raise ValueError(f"observations: shape {found.shape}; {needed}")
    return np.ascontiguousarray(single(found))
