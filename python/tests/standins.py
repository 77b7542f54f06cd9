"""Classes named as those of PyTorch and of learning libraries, for tests without them: what `export` looks at."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]


class Module:
    def children(self) -> Iterator[Module]:
        return (part for part in vars(self).values() if isinstance(part, Module))


class Linear(Module):
    """Weights are ``[outputs, inputs]``, as PyTorch keeps them."""

    def __init__(self, n_inputs: int, n_outputs: int, seed: int, bias: bool = True) -> None:
        random = np.random.default_rng(seed)
        self.weight = random.normal(0, n_inputs**-0.5, (n_outputs, n_inputs)).astype(np.float32)
        self.bias = random.normal(0, 0.1, n_outputs).astype(np.float32) if bias else None

    def __call__(self, values: Floats) -> Floats:
        return values @ self.weight.T + (0 if self.bias is None else self.bias)


class ReLU(Module):
    def __call__(self, values: Floats) -> Floats:
        return np.maximum(values, 0)


class Tanh(Module):
    def __call__(self, values: Floats) -> Floats:
        return np.tanh(values)


class SiLU(Module):
    pass


class Identity(Module):
    def __call__(self, values: Floats) -> Floats:
        return values


class Sequential(Module):
    def __init__(self, *parts: Module) -> None:
        self.parts = parts

    def __iter__(self) -> Iterator[Module]:
        return iter(self.parts)

    def children(self) -> Iterator[Module]:
        return iter(self.parts)


class _Recurrent(Module):
    bidirectional = False
    proj_size = 0
    n_gates = 0

    def __init__(self, n_inputs: int, hidden_size: int, seed: int, num_layers: int = 1) -> None:
        self.hidden_size, self.num_layers = hidden_size, num_layers
        random = np.random.default_rng(seed)
        n_rows = self.n_gates * hidden_size
        for layer in range(num_layers):
            for part, n in (("ih", hidden_size if layer else n_inputs), ("hh", hidden_size)):
                setattr(self, f"weight_{part}_l{layer}", random.normal(0, 0.6, (n_rows, n)).astype(np.float32))
                setattr(self, f"bias_{part}_l{layer}", random.normal(0, 0.2, n_rows).astype(np.float32))

    def begin(self, n: int) -> list[list[Floats]]:
        return [[np.zeros((n, self.hidden_size), np.float32)] * 2 for _ in range(self.num_layers)]

    def __call__(self, values: Floats, state: list[list[Floats]]) -> Floats:
        """One step; the state is changed."""
        for layer in range(self.num_layers):
            hidden, cell = state[layer]
            inputs, kept = (
                np.split(rows @ getattr(self, f"weight_{part}_l{layer}").T + getattr(self, f"bias_{part}_l{layer}"),
                         self.n_gates, 1)
                for part, rows in (("ih", values), ("hh", hidden))
            )  # fmt: skip
            state[layer] = self.gated(inputs, kept, hidden, cell)
            values = state[layer][0]
        return values

    def gated(self, inputs: list[Floats], kept: list[Floats], hidden: Floats, cell: Floats) -> list[Floats]:
        raise NotImplementedError


class GRU(_Recurrent):
    """As PyTorch documents it: reset, update, new."""

    n_gates = 3

    def gated(self, inputs: list[Floats], kept: list[Floats], hidden: Floats, cell: Floats) -> list[Floats]:
        reset, update = (_sigmoid(inputs[gate] + kept[gate]) for gate in (0, 1))
        new = np.tanh(inputs[2] + reset * kept[2])
        return [(1 - update) * new + update * hidden, cell]


class LSTM(_Recurrent):
    """As PyTorch documents it: input, forget, cell, output."""

    n_gates = 4

    def gated(self, inputs: list[Floats], kept: list[Floats], hidden: Floats, cell: Floats) -> list[Floats]:
        add, keep, new, show = (a + b for a, b in zip(inputs, kept))
        cell = _sigmoid(keep) * cell + _sigmoid(add) * np.tanh(new)
        return [_sigmoid(show) * np.tanh(cell), cell]


def _sigmoid(values: Floats) -> Any:
    return 1 / (1 + np.exp(-values))


class FlattenExtractor(Module):
    pass


class MlpExtractor(Module):
    def __init__(self, *parts: Module) -> None:
        self.policy_net = Sequential(*parts)


class CategoricalDistribution:
    pass


class DiagGaussianDistribution:
    pass


class VecNormalize(SimpleNamespace):
    pass


class VecFrameStack(SimpleNamespace):
    pass


class RLModule(Module):
    pass


class TorchFreeLogStdMLPHead(Module):
    pass


def box(low: float, high: float) -> Any:
    return SimpleNamespace(low=np.full(2, low), high=np.full(2, high))


#: An environment without wrappers.
PLAIN = SimpleNamespace()


def sb3(policy: Any, env: Any = PLAIN, actions: Any = None) -> Any:
    """An algorithm of Stable-Baselines3 with this policy."""
    return SimpleNamespace(policy=policy, get_env=lambda: env, action_space=actions)


def on_policy(*parts: Module, distribution: Any, lstm: LSTM | None = None) -> Any:
    """The policy of PPO or A2C: the layers of its extractor, and ``action_net``."""
    return SimpleNamespace(
        pi_features_extractor=FlattenExtractor(),
        mlp_extractor=MlpExtractor(*parts[:-1]),
        action_net=parts[-1],
        action_dist=distribution,
        lstm_actor=lstm,
    )
