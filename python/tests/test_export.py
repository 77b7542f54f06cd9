"""Networks of learning libraries as policy files, by classes that have their names."""

from __future__ import annotations

import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import standins as torch
from standins import GRU, LSTM, Linear, ReLU, Sequential, Tanh

from offtrack_sim import Policy, export
from offtrack_sim.export import Network


def written(tmp_path: Path, model: Any, **given: Any) -> Network:
    file = tmp_path / "policy.safetensors"
    export.save(file, model, **given)
    return export.network(Policy.load(file))


def same(found: Network, *linear: Linear) -> bool:
    """Whether the network has these layers."""
    return len(found.layers) == len(linear) and all(
        (mine[0] == its.weight.T).all() and (mine[1] == (0 if its.bias is None else its.bias)).all()
        for mine, its in zip(found.layers, linear)
    )


A, B, C = Linear(69, 16, 1), Linear(16, 12, 2, bias=False), Linear(12, 9, 3)
ONE = Linear(12, 1, 4)


def test_each_algorithm_of_stable_baselines3_is_written_as_it_predicts(tmp_path: Path) -> None:
    q_net = SimpleNamespace(features_extractor=torch.FlattenExtractor(), q_net=Sequential(A, ReLU(), B, ReLU(), C))
    actor = {"features_extractor": torch.FlattenExtractor()}
    sac = SimpleNamespace(latent_pi=Sequential(A, ReLU(), B, ReLU()), mu=ONE, **actor)
    td3 = SimpleNamespace(mu=Sequential(A, ReLU(), B, ReLU(), ONE, Tanh()), **actor)
    categorical, gaussian = torch.CategoricalDistribution(), torch.DiagGaussianDistribution()
    models: list[tuple[Any, Linear, str, str | None]] = [
        (torch.on_policy(A, Tanh(), B, Tanh(), C, distribution=categorical), C, "tanh", None),
        (torch.on_policy(A, Tanh(), B, Tanh(), ONE, distribution=gaussian), ONE, "tanh", "clip"),
        (SimpleNamespace(q_net=q_net), C, "relu", None),
        (SimpleNamespace(actor=sac), ONE, "relu", "tanh"),
        (SimpleNamespace(actor=td3), ONE, "relu", "tanh"),
    ]
    for policy, last, activation, squash in models:
        found = written(tmp_path, torch.sb3(policy, actions=torch.box(-1, 1)))
        assert same(found, A, B, last) and (found.activation, found.squash) == (activation, squash)
    half = torch.sb3(SimpleNamespace(actor=sac), actions=torch.box(0, 1))
    with pytest.raises(ValueError, match=r"action_space: .*; the policy file's commands lie in -1..1"):
        written(tmp_path, half)
    with pytest.raises(ValueError, match="squash: 'clip'; the model's own is 'tanh': leave it out"):
        written(tmp_path, torch.sb3(SimpleNamespace(actor=sac), actions=torch.box(-1, 1)), squash="clip")


def test_the_lstm_of_recurrent_ppo_stands_before_its_layers(tmp_path: Path) -> None:
    lstm, first = LSTM(69, 8, 5), Linear(8, 12, 6)
    policy = torch.on_policy(first, Tanh(), C, distribution=torch.CategoricalDistribution(), lstm=lstm)
    found = written(tmp_path, torch.sb3(policy))
    assert same(found, first, C) and (found.gates, found.after) == ("lstm", 0)
    ((of_inputs, of_hidden),) = found.cells
    assert (of_inputs[0] == lstm.weight_ih_l0.T).all() and (of_inputs[1] == lstm.bias_ih_l0).all()  # type: ignore[attr-defined]
    assert (of_hidden[0] == lstm.weight_hh_l0.T).all() and (of_hidden[1] == lstm.bias_hh_l0).all()  # type: ignore[attr-defined]


def test_frames_and_statistics_are_those_of_the_models_vector_environments(tmp_path: Path) -> None:
    wide = Linear(138, 9, 1)
    policy = torch.on_policy(wide, distribution=torch.CategoricalDistribution())

    def normalize(n: int, venv: Any) -> Any:
        statistics = SimpleNamespace(mean=np.full(n, 0.5), var=np.full(n, 4.0))
        return torch.VecNormalize(norm_obs=True, clip_obs=10.0, epsilon=0.0, obs_rms=statistics, venv=venv)

    def stack(venv: Any) -> Any:
        return torch.VecFrameStack(stacked_obs=SimpleNamespace(n_stack=2), venv=venv)

    trucks = SimpleNamespace()
    for env, n in ((stack(normalize(69, trucks)), 69), (normalize(138, stack(trucks)), 138)):
        found = written(tmp_path, torch.sb3(policy, env))
        assert (found.frames, found.padding) == (2, "zero") and found.normalisation is not None
        mean, factor = found.normalisation
        assert len(mean) == len(factor) == n and (mean == 0.5).all() and (factor == 0.5).all()
    assert written(tmp_path, torch.sb3(policy, stack(trucks)), frames=2).frames == 2
    assert written(tmp_path, torch.sb3(policy, trucks), frames=2, padding="reset").padding == "reset"
    for given, message in (
        ({"frames": 3}, "frames: 3; the model has a VecFrameStack of 2: leave it out"),
        ({"mean": np.ones(69), "variance": np.ones(69)}, "mean, variance: the model has those of its VecNormalize"),
    ):
        with pytest.raises(ValueError, match=message):
            written(tmp_path, torch.sb3(policy, stack(normalize(69, trucks))), **given)
    with pytest.raises(TypeError, match="VecFrameStack: 2 of them"):
        written(tmp_path, torch.sb3(policy, stack(stack(trucks))))
    with pytest.raises(TypeError, match="VecNormalize: two of them"):
        written(tmp_path, torch.sb3(policy, normalize(69, normalize(69, trucks))))
    clipping = normalize(69, trucks)
    clipping.clip_obs = 5.0
    with pytest.raises(ValueError, match="clip_obs is 5; a policy file clips at 10"):
        written(tmp_path, torch.sb3(policy, clipping))


def test_a_model_without_its_environment_may_lack_what_normalised_it_and_that_is_said(tmp_path: Path) -> None:
    policy = torch.on_policy(Linear(69, 9, 1), distribution=torch.CategoricalDistribution())
    with pytest.warns(UserWarning, match="model: has no environment, and a VecNormalize or VecFrameStack around it"):
        written(tmp_path, torch.sb3(policy, None))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        written(tmp_path, torch.sb3(policy, SimpleNamespace()))
        written(tmp_path, torch.sb3(policy, None), mean=np.zeros(69), variance=np.ones(69))


def test_a_class_that_extends_linear_and_computes_otherwise_is_refused(tmp_path: Path) -> None:
    class Lora(Linear):
        def forward(self, values: Any) -> Any:
            return 2 * self(values)

    class Named(Linear):
        pass

    assert same(written(tmp_path, Sequential(Named(69, 9, 1))), Linear(69, 9, 1))
    with pytest.raises(TypeError, match="layer 0: .*Lora; Linear, GRU or LSTM is needed here"):
        written(tmp_path, Sequential(Lora(69, 9, 1)))


def test_a_module_of_rllib_is_its_encoder_and_its_head(tmp_path: Path) -> None:
    def part(kind: type[torch.Module], **parts: torch.Module) -> torch.Module:
        made = kind()
        vars(made).update(parts)
        return made

    def module(*head: Linear, pi: type[torch.Module] = torch.Module, lstm: GRU | None = None) -> torch.Module:
        tokenizer = part(torch.Module, mlp=Sequential(A, Tanh(), B, Tanh()))
        encoder = tokenizer if lstm is None else part(torch.Module, tokenizer=tokenizer, lstm=lstm)
        actor_critic = part(torch.Module, actor_encoder=encoder, critic_encoder=Sequential(torch.SiLU()))
        return part(torch.RLModule, encoder=actor_critic, pi=part(pi, net=Sequential(*head)))

    found = written(tmp_path, module(C))
    assert same(found, A, B, C) and found.activation == "tanh"
    gru, last = GRU(12, 7, 8), Linear(7, 9, 9)
    found = written(tmp_path, module(last, lstm=gru))
    assert same(found, A, B, last) and (found.gates, found.after, len(found.cells)) == ("gru", 2, 1)
    # The head has a standard deviation beside each mean, unless that is a parameter of its own.
    both = Linear(12, 2, 4)
    found = written(tmp_path, module(both), squash="clip")
    assert found.squash == "clip" and (found.layers[-1][0] == both.weight.T[:, :1]).all()
    assert same(written(tmp_path, module(ONE, pi=torch.TorchFreeLogStdMLPHead), squash="tanh"), A, B, ONE)


def test_modules_in_a_row_may_have_recurrent_layers_where_a_linear_one_may_stand_but_at_the_end(tmp_path: Path) -> None:
    gru, last = GRU(12, 7, 8, num_layers=2), Linear(7, 9, 9)
    found = written(tmp_path, [Sequential(A, ReLU(), B, ReLU()), torch.Identity(), gru, last])
    assert same(found, A, B, last) and (found.gates, found.after, len(found.cells)) == ("gru", 2, 2)
    lstm = LSTM(12, 7, 8)
    both_ways = GRU(12, 7, 8)
    both_ways.bidirectional = True
    for model, message in (
        ([A, ReLU(), B, ReLU(), gru], "last layer: .*GRU; Linear is needed"),
        ([A, gru, last], "layer 1: .*GRU; ReLU or Tanh is needed here"),
        ([A, ReLU(), B, ReLU(), lstm, GRU(7, 7, 1), last], "recurrent layers in one place, all alike"),
        ([A, ReLU(), B, ReLU(), lstm, Linear(7, 7, 1), ReLU(), LSTM(7, 7, 1), last], "in one place, all alike"),
        ([A, ReLU(), B, ReLU(), both_ways, last], "GRU with bidirectional=True; a policy file holds none such"),
        ([A, torch.SiLU(), C], "layer 1: .*SiLU; ReLU or Tanh is needed here"),
        ([A, ReLU(), B, Tanh(), C], "layers: ReLU and Tanh"),
        ([A, ReLU(), B, ReLU(), C, Tanh()], "last layer: .*Tanh; Linear is needed"),
        (Sequential(), "last layer: none; Linear is needed"),
        (torch.RLModule(), "model: standins.RLModule; an RLModule with an encoder and a head pi is needed"),
        (SimpleNamespace(), "model: types.SimpleNamespace; PPO, A2C, DQN, SAC or TD3 of Stable-Baselines3"),
    ):
        with pytest.raises(TypeError, match=message):
            written(tmp_path, model)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"values": ["spede"]}, r'values: "spede"; must be one of speed, waypoint_distance, '),
        ({"values": []}, "values: none; at least one is needed"),
        ({"values": ["speed", "speed"]}, "a value that stands before it is among these"),
        ({"frames": 0}, "frames: 0; must lie in 1..1024"),
        ({"padding": "reset"}, "padding: 'reset'; there is one frame"),
        ({"frames": 2, "padding": "ones"}, r'padding: "ones"; must be one of zero, reset'),
        ({"squash": "relu"}, r'squash: "relu"; must be one of tanh, clip'),
        ({"frames": 2}, r"layers\[0\]: weights of shape \(69, 16\); \(138, 16\) is needed"),
        ({"values": ["speed", "bearing"]}, r"layers\[0\]: weights of shape \(69, 16\); \(6, 16\) is needed"),
    ],
)
def test_what_a_network_reads_and_gives_is_refused_by_its_argument(
    given: dict[str, Any], message: str, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=message):
        export.save(tmp_path / "policy.safetensors", [A, ReLU(), B, ReLU(), C], **given)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"variance": np.where(np.arange(69) == 3, np.inf, 1.0)}, "variance: inf; every value must be finite"),
        ({"variance": np.full(69, np.nan)}, "variance: nan; every value must be finite"),
        ({"variance": np.zeros(69), "epsilon": 0.0}, "variance: every value plus epsilon must be greater than 0"),
        ({"variance": np.ones(69), "epsilon": -0.5}, "epsilon: -0.5; must be finite and at least 0"),
        ({"variance": np.ones(69), "epsilon": np.nan}, "epsilon: nan; must be finite and at least 0"),
        ({"variance": np.ones(69), "epsilon": np.inf}, "epsilon: inf; must be finite and at least 0"),
        ({"variance": np.ones(69), "epsilon": 10**400}, "epsilon: too large for a float; must be finite"),
        ({"mean": None, "epsilon": 1e-8}, "epsilon: 1e-08; is added to a variance: give mean and variance, or leave"),
        ({"mean": None, "epsilon": "a"}, "epsilon: 'a'; is added to a variance"),
    ],
)
def test_a_variance_or_an_epsilon_that_cannot_be_is_refused(
    given: dict[str, Any], message: str, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=message):
        export.save(tmp_path / "policy.safetensors", [A, ReLU(), B, ReLU(), C], **{"mean": np.zeros(69), **given})
    assert not list(tmp_path.iterdir())


def test_without_an_epsilon_it_is_1e_8(tmp_path: Path) -> None:
    def factor(**given: Any) -> float:
        found = written(tmp_path, [Linear(69, 9, 1)], mean=np.zeros(69), variance=np.full(69, 1e-8), **given)
        assert found.normalisation is not None
        return float(found.normalisation[1][0])

    assert factor() == factor(epsilon=1e-8) == pytest.approx(2**-0.5 * 1e4)
    assert factor(epsilon=np.float32(0)) == pytest.approx(1e4)


@pytest.mark.parametrize("weights", [np.full((69, 9), 1 + 2j), np.full((69, 9), "0.5"), np.full((69, 9), True)])
def test_weights_that_are_no_real_numbers_are_refused(weights: Any, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match=r"layers\[0\]: .*; a pair of arrays, weights and biases, is needed"):
        export.save(tmp_path / "policy.safetensors", [(weights, np.zeros(9))])
    assert not list(tmp_path.iterdir())


def test_statistics_are_of_each_frame_or_of_all_of_them(tmp_path: Path) -> None:
    model = [Linear(138, 9, 1)]
    for n in (69, 138):
        found = written(tmp_path, model, frames=2, mean=np.ones(n), variance=np.ones(n))
        assert found.normalisation is not None and len(found.normalisation[0]) == n
    with pytest.raises(ValueError, match=r"mean: shape \(70,\); \(69,\), or \(138,\) of all frames, is needed"):
        written(tmp_path, model, frames=2, mean=np.ones(70), variance=np.ones(70))
    with pytest.raises(ValueError, match=r"variance: shape \(69,\) beside a mean of shape \(138,\)"):
        written(tmp_path, model, frames=2, mean=np.ones(138), variance=np.ones(69))
