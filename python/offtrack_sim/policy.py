"""Policies that drive: the one that comes with the package, and trained ones."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _offtrack
from .arguments import file_name

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
    def action_table(self) -> npt.NDArray[np.float32]:
        """Steer angle [rad] and speed [m/s] of each action, ``[n, 2]``: a batch must have the same table."""
        return self._network.action_table

    def check(self, batch: Batch | Observer) -> None:
        """Checks that it can drive the trucks of this batch or observer.

        Raises:
            ValueError: Where the batch has other extras or another action table; the message says which.
        """
        if self.extras != batch.extras:
            its, needed = (", ".join(extras) or "none" for extras in (self.extras, batch.extras))
            raise ValueError(f"{self.name}: observes other extras than {batch.scenario}: {its}; {needed} are needed")
        tables = self.action_table, batch.action_table
        if tables[0].shape != tables[1].shape or not np.allclose(*tables, atol=1e-5):
            raise ValueError(f"{self.name}: has another action table than {batch.scenario}; see action_table of both")

    def act(self, observations: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """The most probable action for each observation: ``[n, n_values]`` gives ``[n]``, ``[n_values]`` a number.

        Raises:
            TypeError: For what is no array of numbers.
            ValueError: For another number of values than 69 and one for each of ``extras``, and for one that is not
                finite; the message names them.
        """
        rows = _rows(observations)
        if rows.ndim == 1:
            return self._network.act(rows[None])[0]  # type: ignore[no-any-return]
        return self._network.act(rows)

    def logits(self, observations: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
        """The network's output for each observation, ``[n, n_values]`` to ``[n, n_actions]``.

        Their softmax gives probabilities.

        Raises:
            ValueError: As for :meth:`act`.
        """
        return self._network.logits(_rows(observations))

    def __repr__(self) -> str:
        return f"Policy({self.name!r})"


def _rows(observations: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    """Observations as the network takes them."""
    try:
        return np.ascontiguousarray(observations, dtype=np.float32)
    except (TypeError, ValueError):
        kind = type(observations).__name__
        raise TypeError(f"observations: {kind}; an array of numbers, [n, n_values], is needed") from None
