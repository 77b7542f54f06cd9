"""Writes a network that was trained elsewhere as a policy file, for ``offtrack evaluate --policy`` and ``Policy``.

Nothing of PyTorch or of a learning library is imported: their objects are known by the names of their classes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _offtrack
from .arguments import file_name
from .episodes import Floats
from .scenarios import Scenario, given

#: A normalised observation is clamped to this, see docs/policies.md.
CLIP = 10.0

Layers = list[tuple[Floats, Floats]]


def save(
    file: str | os.PathLike[str],
    model: Any,
    *,
    scenario: Scenario = "attard2023",
    mean: npt.ArrayLike | None = None,
    variance: npt.ArrayLike | None = None,
    epsilon: float = 1e-8,
) -> None:
    """Writes a policy file: the greedy policy of a network.

    The file's policy takes the action with the largest output, as ``predict(observation, deterministic=True)`` of
    Stable-Baselines3 does. Where two outputs differ by less than the rounding of 32-bit floats, it may take the other.

    Args:
        file: Where to; an existing file is replaced, whole or not at all.
        model: One of

            - PPO or A2C of Stable-Baselines3 with ``MlpPolicy``: the layers up to ``action_net``;
            - DQN of Stable-Baselines3 with ``MlpPolicy``: ``q_net``;
            - a ``torch.nn.Sequential`` of ``Linear`` with all ``ReLU`` or all ``Tanh`` between, none behind the last:
              CleanRL's ``agent.actor`` of PPO and ``q_network.network`` of DQN;
            - a list of ``(weights, biases)``, arrays ``[inputs, outputs]`` and ``[outputs]``, with ``ReLU`` between.
        scenario: The benchmark it was trained on, a name or a file: the file keeps its table of actions and the names
            of the extras that it observes.
        mean: Mean of each observation's value, ``[n_values]``, extras included, where the network was trained with
            normalised ones; a model of Stable-Baselines3 with ``VecNormalize`` brings its own.
        variance: Their variance, ``[n_values]``: a value becomes ``(value - mean) / sqrt(variance + epsilon)``, clamped
            to -10..10.
        epsilon: Added to the variance.

    Raises:
        TypeError: For a model or layer that a policy file cannot hold; the message names it.
        ValueError: For sizes that do not fit each other or the benchmark, numbers so large that outputs may not be
            finite, a mean without a variance, a ``VecNormalize`` that clips
            elsewhere than at 10, and numbers that are not finite.
        OSError: Where the file cannot be written.
    """
    layers, activation = _layers(model)
    if (mean is None) != (variance is None):
        raise ValueError("mean, variance: only one of them is given; both are needed")
    found = _normalisation(model)
    if found is not None:
        if mean is not None:
            raise ValueError("mean, variance: the model has those of its VecNormalize; leave them out")
        mean, variance, epsilon = found
    normalisation = None
    if mean is not None and variance is not None:
        spread = _numbers("variance", variance) + _numbers("epsilon", epsilon)
        if not (spread > 0).all():
            raise ValueError("variance: every value plus epsilon must be greater than 0")
        normalisation = _vector("mean", mean), _vector("variance", 1 / np.sqrt(spread))
    _offtrack.write_policy(file_name(file), given(scenario), layers, activation, normalisation)


def _layers(model: Any) -> tuple[Layers, str]:
    """The layers of any model that is known, and the activation between them."""
    if isinstance(model, list):
        return [_given(index, layer) for index, layer in enumerate(model)], "relu"
    if _is("Sequential", model):
        return _of_modules(list(_flat(model)))
    policy = getattr(model, "policy", None)
    if policy is None:
        raise TypeError(
            f"model: {_kind(model)}; PPO, A2C or DQN of Stable-Baselines3 or a torch.nn.Sequential is needed "
            "(of a network of your own give its Sequential, for CleanRL `agent.actor` or `q_network.network`)"
        )
    if hasattr(policy, "q_net"):
        _check_extractor(policy.q_net.features_extractor)
        return _of_modules(list(_flat(policy.q_net.q_net)))
    if hasattr(policy, "mlp_extractor") and hasattr(policy, "action_net"):
        if getattr(policy, "lstm_actor", None) is not None:
            raise TypeError("policy.lstm_actor: a policy file holds no recurrent layers")
        _check_extractor(policy.pi_features_extractor)
        if not _is("MlpExtractor", policy.mlp_extractor):
            raise TypeError(f"policy.mlp_extractor: {_kind(policy.mlp_extractor)}; MlpExtractor is needed")
        if not _is("CategoricalDistribution", policy.action_dist):
            raise TypeError(
                f"policy.action_dist: {_kind(policy.action_dist)}; CategoricalDistribution is needed: discrete actions"
            )
        return _of_modules([*_flat(policy.mlp_extractor.policy_net), policy.action_net])
    raise TypeError(f"model: {_kind(model)}; of Stable-Baselines3 only PPO, A2C and DQN can be written")


def _given(index: int, layer: Any) -> tuple[Floats, Floats]:
    """A layer of a list."""
    try:
        weights, biases = (_array(part) for part in layer)
    except (TypeError, ValueError):
        raise TypeError(f"layers[{index}]: {_kind(layer)}; a pair of arrays, weights and biases, is needed") from None
    if (weights.ndim, biases.ndim) != (2, 1):
        needed = "[inputs, outputs] and [outputs] are needed"
        raise ValueError(f"layers[{index}]: shapes {weights.shape} and {biases.shape}; {needed}")
    return weights, biases


def _check_extractor(extractor: Any) -> None:
    if not _is("FlattenExtractor", extractor):
        raise TypeError(
            f"policy.features_extractor: {_kind(extractor)}; FlattenExtractor is needed, which MlpPolicy has"
        )


def _flat(module: Any) -> Iterator[Any]:
    """The layers of a Sequential, of those in it too."""
    if _is("Sequential", module):
        for child in module:
            yield from _flat(child)
    elif not _is("Identity", module):
        yield module


def _of_modules(modules: list[Any]) -> tuple[Layers, str]:
    """Linear, activation, Linear, ..., Linear."""
    names = {"ReLU": "relu", "Tanh": "tanh"}
    layers: Layers = []
    activations: set[str] = set()
    for index, module in enumerate(modules):
        kind = type(module).__name__
        is_linear_due = index % 2 == 0
        if is_linear_due and _is("Linear", module):
            weights = _array(module.weight).T
            biases = np.zeros(weights.shape[1], np.float32) if module.bias is None else _array(module.bias)
            layers.append((np.ascontiguousarray(weights), biases))
        elif not is_linear_due and kind in names:
            activations.add(names[kind])
        else:
            needed = "Linear is needed here" if is_linear_due else "ReLU or Tanh is needed here"
            raise TypeError(f"layer {index}: {_kind(module)}; {needed}")
    if len(modules) % 2 == 0:
        last = _kind(modules[-1]) if modules else "none"
        raise TypeError(f"last layer: {last}; Linear is needed, whose outputs are the actions' values")
    if len(activations) > 1:
        raise TypeError("layers: ReLU and Tanh; a policy file has one activation for all of its layers")
    return layers, activations.pop() if activations else "relu"


def _normalisation(model: Any) -> tuple[npt.ArrayLike, npt.ArrayLike, float] | None:
    """Mean, variance and epsilon of the VecNormalize that a model of Stable-Baselines3 was trained with."""
    normalize = getattr(model, "get_vec_normalize_env", lambda: None)()
    if normalize is None or not normalize.norm_obs:
        return None
    if normalize.clip_obs != CLIP:
        raise ValueError(f"VecNormalize: clip_obs is {normalize.clip_obs:g}; a policy file clips at {CLIP:g}")
    return normalize.obs_rms.mean, normalize.obs_rms.var, float(normalize.epsilon)


def _array(tensor: Any) -> Floats:
    """A tensor of any device, or an array."""
    if hasattr(tensor, "detach"):
        tensor = tensor.detach().cpu().float().numpy()
    return np.asarray(tensor, np.float32)


def _vector(name: str, values: npt.ArrayLike) -> Floats:
    vector = np.ascontiguousarray(_numbers(name, values), np.float32)
    if vector.ndim != 1:
        raise ValueError(f"{name}: shape {vector.shape}; one dimension is needed, a number for each value")
    return vector


def _numbers(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    try:
        return np.asarray(values, np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: {_kind(values)}; numbers are needed") from None


def _is(name: str, thing: Any) -> bool:
    """Whether a class of this name is among the thing's classes."""
    return any(known.__name__ == name for known in type(thing).__mro__)


def _kind(thing: Any) -> str:
    return f"{type(thing).__module__}.{type(thing).__qualname__}"
