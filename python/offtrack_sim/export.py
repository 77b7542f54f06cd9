"""Writes a network that was trained elsewhere as a policy file, for ``offtrack evaluate --policy`` and ``Policy``.

Nothing of PyTorch or of a learning library is imported: their objects are known by the names of their classes.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy.typing as npt

from . import _offtrack, onnx_graph, trained
from .arguments import checked_integer, file_name, names_of_values, text
from .episodes import Floats
from .network import Network
from .policy import Policy
from .scenarios import Scenario, given

#: A normalised observation is clamped to this, see docs/policies.md.
CLIP = trained.CLIP


def save(
    file: str | os.PathLike[str],
    model: Any,
    *,
    scenario: Scenario = "attard2023",
    mean: npt.ArrayLike | None = None,
    variance: npt.ArrayLike | None = None,
    epsilon: float | None = None,
    values: Iterable[str] | None = None,
    frames: int | None = None,
    padding: str | None = None,
    squash: str | None = None,
) -> None:
    """Writes a policy file: the greedy policy of a network.

    The file's policy takes the action with the largest output, or gives the means as commands, as
    ``predict(observation, deterministic=True)`` of Stable-Baselines3 does. Where two outputs differ by less than the
    rounding of 32-bit floats, it may take the other.

    Args:
        file: Where to; an existing file is replaced, whole or not at all.
        model: One of

            - PPO, A2C, DQN, SAC, TD3 or DDPG of Stable-Baselines3 with ``MlpPolicy``, and RecurrentPPO of sb3-contrib
              with ``MlpLstmPolicy``;
            - an RLModule of RLlib with an MLP, and an LSTM behind it if it has one;
            - a ``torch.nn.Sequential``, or a list of modules in their order: ``Linear`` with all ``ReLU`` or all
              ``Tanh`` between, and ``GRU`` or ``LSTM`` before, between or behind them, but before the last. CleanRL's
              ``agent.actor`` of PPO and ``q_network.network`` of DQN; with ``squash`` its ``agent.actor_mean``;
            - a list of ``(weights, biases)``, arrays ``[inputs, outputs]`` and ``[outputs]``, with ``ReLU`` between;
            - a :class:`Network`, as :func:`from_onnx` and :func:`network` give it.
        scenario: The benchmark it was trained on, a name or a file: the file keeps its table of actions and, unless
            ``values`` says what it reads, the names of the extras that it observes.
        mean: Mean of each observation's value, ``[n_values]``, extras included, where the network was trained with
            normalised ones. A model of Stable-Baselines3 brings those of its environment's ``VecNormalize``; where it
            was loaded without ``env`` it has none, of which a warning tells. ``[frames * n_values]`` where stacks of
            frames were normalised.
        variance: Their variance, ``[n_values]``: a value becomes ``(value - mean) / sqrt(variance + epsilon)``, clamped
            to -10..10.
        epsilon: Added to the variance, at least 0; None for 1e-8.
        values: Names of the values that it reads, in its order, for a network that was trained on some of them: groups
            of :data:`offtrack_sim.OBSERVATION` (``"tractor_range"``), single values (``"bearing[2]"``), extras.
        frames: Number of steps' values that it sees side by side, oldest first. A model of Stable-Baselines3 with
            ``VecFrameStack`` brings its own.
        padding: What stands before an episode's first frame: ``"zero"``, as of ``VecFrameStack``, or ``"reset"``, the
            first one again, as of Gymnasium's ``FrameStackObservation``.
        squash: For a network whose outputs are means of commands: ``"tanh"``, or ``"clip"`` to -1..1. A model of
            Stable-Baselines3 brings its own.

    Raises:
        TypeError: For a model or layer that a policy file cannot hold; the message names it.
        ValueError: For sizes that do not fit each other or the benchmark, numbers so large that outputs may not be
            finite, a mean without a variance, an epsilon without both, a ``VecNormalize`` that clips elsewhere than at
            10, what a model brings itself, and numbers that are not finite.
        OSError: Where the file cannot be written.
    """
    found = trained.network_of(
        model, None if squash is None else text("squash", squash), says=mean is None and variance is None
    )
    if frames is not None:
        n = checked_integer("frames", frames)
        if found.frames not in (1, n):
            raise ValueError(f"frames: {n}; the model has a VecFrameStack of {found.frames}: leave it out")
        if not 1 <= n <= 1024:
            raise ValueError(f"frames: {n}; must lie in 1..1024")
        found = replace(found, frames=n)
    if padding is not None:
        if found.frames == 1:
            raise ValueError(f"padding: {padding!r}; there is one frame: give frames, or leave it out")
        found = replace(found, padding=text("padding", padding))
    if values is not None:
        found = replace(found, values=names_of_values(values))
    if (mean is None) != (variance is None):
        raise ValueError("mean, variance: only one of them is given; both are needed")
    if epsilon is not None and mean is None:
        raise ValueError(f"epsilon: {epsilon!r}; is added to a variance: give mean and variance, or leave it out")
    if mean is not None and variance is not None:
        if found.normalisation is not None:
            raise ValueError("mean, variance: the model has those of its VecNormalize; leave them out")
        found = replace(
            found, normalisation=trained.normalisation(mean, variance, 1e-8 if epsilon is None else epsilon)
        )
    _offtrack.write_policy(file_name(file), given(scenario), found)


def network(policy: Policy) -> Network:
    """The network of a policy, as arrays."""
    if not isinstance(policy, Policy):
        raise TypeError(f"policy: {policy!r}; a Policy is needed")
    return Network(**policy._network.parts())


def to_onnx(policy: Policy, file: str | os.PathLike[str]) -> None:
    """Writes a policy's network as an ONNX graph; needs the package ``onnx``, as of ``offtrack-sim[onnx]``.

    Its input ``observation`` is ``[n, frames * values]``: what the policy reads, before any normalisation, oldest frame
    first. Before an episode's first frame stands the padding, which is the mean in place of zeros where each frame is
    normalised by itself. Its output ``output`` is ``[n, outputs]``: a value an action, or commands. A recurrent layer
    ``N`` has the input ``hidden_N``, ``[1, n, units]``, zeros at an episode's start, and the output ``next_hidden_N``;
    an LSTM ``cell_N`` and ``next_cell_N`` too.

    Raises:
        ImportError: Without the package ``onnx``.
        OSError: Where the file cannot be written.
    """
    onnx_graph.write(network(policy), file_name(file), policy.name)


def from_onnx(file: str | os.PathLike[str]) -> Network:
    """The network of an ONNX graph, for :func:`save`; needs the package ``onnx``, as of ``offtrack-sim[onnx]``.

    The graph is a chain from an input to its first output: ``Gemm``, or ``MatMul`` and ``Add``, with all ``Relu`` or
    all ``Tanh`` between; ``GRU`` (with ``linear_before_reset``) and ``LSTM`` of one direction; before them ``Sub``,
    ``Mul`` or ``Div``, and ``Clip`` to -10..10, which normalise; behind them ``ArgMax``, or ``Tanh`` or ``Clip`` to
    -1..1 of commands. Nodes that only change shapes are passed over.

    Raises:
        ImportError: Without the package ``onnx``.
        TypeError: For another node; the message names it.
        ValueError: For a file that is no ONNX graph.
    """
    return onnx_graph.read(file_name(file))


__all__ = ["CLIP", "Floats", "Network", "from_onnx", "network", "save", "to_onnx"]
