"""Networks of PyTorch and of learning libraries, known by the names of their classes: nothing of them is imported."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from .arguments import numbers, real, single
from .episodes import Floats
from .network import Layer, Network

#: Where a normalised observation is clamped.
CLIP = 10.0

ACTIVATIONS = {"ReLU": "relu", "Tanh": "tanh"}
RECURRENT = {"GRU": ("gru", 3), "LSTM": ("lstm", 4)}


def network_of(model: Any, squash: str | None, *, says: bool = False) -> Network:
    """The network of any model that is known; ``squash`` is what the caller says. ``says``: whether a warning is due
    where nobody knows how the model's observations were normalised."""
    if isinstance(model, Network):
        return model if squash is None else replace(model, squash=squash)
    if isinstance(model, list) and not (model and _is("Module", model[0])):
        return Network([_given(index, layer) for index, layer in enumerate(model)], squash=squash)
    if isinstance(model, list) or _is("Sequential", model):
        return _of_modules([leaf for module in _listed(model) for leaf in _flat(module)], squash)
    if _is("RLModule", model):
        return _of_rllib(model, squash)
    if getattr(model, "policy", None) is None:
        raise TypeError(
            f"model: {_kind(model)}; PPO, A2C, DQN, SAC or TD3 of Stable-Baselines3, an RLModule of RLlib, a "
            "torch.nn.Sequential or a list of modules is needed (of a network of your own give its Sequential, for "
            "CleanRL `agent.actor` or `q_network.network`)"
        )
    found = _of_sb3(model.policy, model)
    if squash is not None and squash != found.squash:
        raise ValueError(f"squash: {squash!r}; the model's own is {found.squash!r}: leave it out")
    if found.squash is not None:
        space = model.action_space
        if not ((space.low == -1).all() and (space.high == 1).all()):
            raise ValueError(f"action_space: {space}; the policy file's commands lie in -1..1: rescale the actions")
    if says and getattr(model, "get_env", lambda: model)() is None:
        message = (
            "model: has no environment, and a VecNormalize or VecFrameStack around it would count: load it with env=, "
            "or give mean and variance"
        )
        warnings.warn(message, stacklevel=3)
    return replace(found, frames=_frames(model), normalisation=_normalisation_of(model))


def normalisation(mean: npt.ArrayLike, variance: npt.ArrayLike, epsilon: float) -> tuple[Floats, Floats]:
    """Mean and factor of each value."""
    added = real("epsilon", epsilon, "be finite and at least 0")
    if not 0 <= added < np.inf:
        raise ValueError(f"epsilon: {added}; must be finite and at least 0")
    spread = _numbers("variance", variance)
    if not np.isfinite(spread).all():
        raise ValueError(f"variance: {spread[~np.isfinite(spread)][0]}; every value must be finite")
    if not (spread + added > 0).all():
        raise ValueError("variance: every value plus epsilon must be greater than 0")
    return _vector("mean", mean), _vector("variance", 1 / np.sqrt(spread + added))


def _of_sb3(policy: Any, model: Any) -> Network:
    """The network of Stable-Baselines3's algorithms and of sb3-contrib's RecurrentPPO."""
    if hasattr(policy, "q_net"):
        _check_extractor(policy.q_net.features_extractor)
        return _of_modules(list(_flat(policy.q_net.q_net)), None)
    actor = getattr(policy, "actor", None)
    if actor is not None and hasattr(actor, "latent_pi") and hasattr(actor, "mu"):  # SAC
        _check_extractor(actor.features_extractor)
        return _of_modules([*_flat(actor.latent_pi), *_flat(actor.mu)], "tanh")
    if actor is not None and hasattr(actor, "mu"):  # TD3, DDPG
        _check_extractor(actor.features_extractor)
        return _of_modules(list(_flat(actor.mu)), "tanh")
    if not (hasattr(policy, "mlp_extractor") and hasattr(policy, "action_net")):
        raise TypeError(
            f"model: {_kind(model)}; of Stable-Baselines3 only PPO, A2C, DQN, SAC, TD3 and RecurrentPPO can be written"
        )
    _check_extractor(policy.pi_features_extractor)
    if not _is("MlpExtractor", policy.mlp_extractor):
        raise TypeError(f"policy.mlp_extractor: {_kind(policy.mlp_extractor)}; MlpExtractor is needed")
    if _is("CategoricalDistribution", policy.action_dist):
        squash = None
    elif _is("DiagGaussianDistribution", policy.action_dist):
        squash = "clip"
    else:
        raise TypeError(
            f"policy.action_dist: {_kind(policy.action_dist)}; CategoricalDistribution or DiagGaussianDistribution is "
            "needed: discrete actions or commands"
        )
    recurrent = getattr(policy, "lstm_actor", None)
    before = [] if recurrent is None else [recurrent]
    return _of_modules([*before, *_flat(policy.mlp_extractor.policy_net), policy.action_net], squash)


def _of_rllib(module: Any, squash: str | None) -> Network:
    """The actor of an RLModule: its encoder and its head."""
    if not (hasattr(module, "encoder") and hasattr(module, "pi")):
        raise TypeError(f"model: {_kind(module)}; an RLModule with an encoder and a head pi is needed, as of PPO")
    encoder = module.encoder
    encoder = getattr(encoder, "actor_encoder", None) or getattr(encoder, "encoder", None) or encoder
    found = _of_modules([leaf for part in (encoder, module.pi) for leaf in _leaves(part)], squash)
    if squash is None or _is("TorchFreeLogStdMLPHead", module.pi):
        return found
    # The means, and behind them the logarithms of the standard deviations.
    weights, biases = found.layers[-1]
    n = len(biases) // 2
    return replace(found, layers=[*found.layers[:-1], (np.ascontiguousarray(weights[:, :n]), biases[:n])])


def _given(index: int, layer: Any) -> Layer:
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


def _listed(model: Any) -> list[Any]:
    return model if isinstance(model, list) else [model]


def _flat(module: Any) -> Iterator[Any]:
    """The layers of a Sequential, of those in it too."""
    if _is("Sequential", module):
        for child in module:
            yield from _flat(child)
    elif not _is("Identity", module):
        yield module


def _leaves(module: Any) -> Iterator[Any]:
    """The modules within a module that have none themselves, in their order."""
    children = list(module.children())
    for child in children:
        yield from _leaves(child)
    if not children and not _is("Identity", module):
        yield module


def _of_modules(modules: list[Any], squash: str | None) -> Network:
    """Linear, activation, Linear, ..., Linear, with recurrent layers where a Linear may stand, but at the end."""
    layers: list[Layer] = []
    cells: list[tuple[Layer, Layer]] = []
    activations: set[str] = set()
    gates, after = None, 0
    last = ""
    # The last activation of a network that gives commands squashes them.
    if squash == "tanh" and modules and type(modules[-1]).__name__ == "Tanh":
        modules = modules[:-1]
    for index, module in enumerate(modules):
        kind = type(module).__name__
        if kind in ACTIVATIONS and last == "Linear":
            activations.add(ACTIVATIONS[kind])
        elif last != "Linear" and _is_linear(module):
            layers.append(_linear(module.weight, module.bias))
            kind = "Linear"
        elif last != "Linear" and kind in RECURRENT and (not cells or last == kind):
            if not cells:
                gates, after = RECURRENT[kind][0], len(layers)
            cells.extend(_cells(index, module, RECURRENT[kind][1]))
        elif kind in RECURRENT and last != "Linear":
            raise TypeError(
                f"layer {index}: {_kind(module)}; a policy file has recurrent layers in one place, all alike"
            )
        else:
            needed = "ReLU or Tanh is" if last == "Linear" else "Linear, GRU or LSTM is"
            raise TypeError(f"layer {index}: {_kind(module)}; {needed} needed here")
        last = kind
    if last != "Linear":
        found = _kind(modules[-1]) if modules else "none"
        raise TypeError(f"last layer: {found}; Linear is needed, whose outputs are the actions' values")
    if len(activations) > 1:
        raise TypeError("layers: ReLU and Tanh; a policy file has one activation for all of its layers")
    activation = activations.pop() if activations else "relu"
    return Network(layers, activation, squash=squash, gates=gates, after=after, cells=cells)


def _linear(weight: Any, bias: Any) -> Layer:
    """A layer whose weights are ``[outputs, inputs]``, as PyTorch keeps them."""
    weights = np.ascontiguousarray(_array(weight).T)
    return weights, np.zeros(weights.shape[1], np.float32) if bias is None else _array(bias)


def _cells(index: int, module: Any, n_gates: int) -> Iterator[tuple[Layer, Layer]]:
    """The layers of a GRU or LSTM."""
    for name, least in (("bidirectional", False), ("proj_size", 0)):
        if getattr(module, name, least) != least:
            value = getattr(module, name)
            raise TypeError(f"layer {index}: {_kind(module)} with {name}={value}; a policy file holds none such")
    for layer in range(module.num_layers):
        of_inputs, of_hidden = (
            _linear(getattr(module, f"weight_{part}_l{layer}"), getattr(module, f"bias_{part}_l{layer}", None))
            for part in ("ih", "hh")
        )
        if of_hidden[0].shape != (module.hidden_size, n_gates * module.hidden_size):
            raise TypeError(f"layer {index}: {_kind(module)} with weights of shape {of_hidden[0].T.shape}")
        yield of_inputs, of_hidden


def _wrappers(model: Any) -> Iterator[Any]:
    """The vector environments that a model of Stable-Baselines3 was trained with, from the outermost on."""
    env = getattr(model, "get_env", lambda: None)()
    while env is not None:
        yield env
        env = getattr(env, "venv", None)


def _frames(model: Any) -> int:
    """Frames of the VecFrameStack that a model of Stable-Baselines3 was trained with."""
    stacks = [env for env in _wrappers(model) if _is("VecFrameStack", env)]
    if len(stacks) > 1:
        raise TypeError(f"VecFrameStack: {len(stacks)} of them; a policy file holds the frames of one")
    return int(stacks[0].stacked_obs.n_stack) if stacks else 1


def _normalisation_of(model: Any) -> tuple[Floats, Floats] | None:
    """Mean and factor of the VecNormalize that a model of Stable-Baselines3 was trained with."""
    found = None
    for normalize in _wrappers(model):
        if not _is("VecNormalize", normalize) or not normalize.norm_obs:
            continue
        if found is not None:
            raise TypeError("VecNormalize: two of them; a policy file normalises once")
        if normalize.clip_obs != CLIP:
            raise ValueError(f"VecNormalize: clip_obs is {normalize.clip_obs:g}; a policy file clips at {CLIP:g}")
        statistics = normalize.obs_rms
        found = normalisation(statistics.mean, statistics.var, float(normalize.epsilon))
    return found


def _array(tensor: Any) -> Floats:
    """A tensor of any device, or an array."""
    if hasattr(tensor, "detach"):
        tensor = tensor.detach().cpu()
        tensor = (tensor.float() if tensor.is_floating_point() else tensor).numpy()
    return single(numbers("layers", tensor, "numbers are needed"))


def _vector(name: str, values: npt.ArrayLike) -> Floats:
    vector = np.ascontiguousarray(single(_numbers(name, values)))
    if vector.ndim != 1:
        raise ValueError(f"{name}: shape {vector.shape}; one dimension is needed, a number for each value")
    return vector


def _numbers(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    return numbers(name, values, "numbers are needed").astype(np.float64)


def _is(name: str, thing: Any) -> bool:
    """Whether a class of this name is among the thing's classes."""
    return any(known.__name__ == name for known in type(thing).__mro__)


def _is_linear(module: Any) -> bool:
    """Whether it is a Linear that computes what PyTorch's does: a class that extends it may do more."""
    linears = [known for known in type(module).__mro__ if known.__name__ == "Linear"]
    return bool(linears) and getattr(type(module), "forward", None) is getattr(linears[-1], "forward", None)


def _kind(thing: Any) -> str:
    return f"{type(thing).__module__}.{type(thing).__qualname__}"
