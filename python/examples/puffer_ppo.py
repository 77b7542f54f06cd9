"""PufferLib's own trainer.

    python puffer_ppo.py --out puffer

Needs ``offtrack-sim`` and ``pufferlib == 3.0.0``, with numpy below 2 and gymnasium 0.29.1; tests/consumers/run.py shows
an installation without PufferLib's own environments, which its setup would download. Writes ``puffer.safetensors``,
which ``offtrack evaluate --policy puffer.safetensors`` drives, and ``puffer.json`` with the curve and the success on
the test routes. Ctrl-C ends the training early; what was learned is kept.

The trainer clamps rewards to -1..1: ``RoundaboutPuffer`` multiplies them by ``--reward-scale``, 0.002, which makes a
failure -1. The trainer of 3.0.0 lets the value run on over the end of an episode that the time limit ended.
"""

from __future__ import annotations

import argparse
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import pufferlib.pufferl
import pufferlib.vector
import torch
from results import about, prepare, write_json, written
from torch import nn

import offtrack_sim
from offtrack_sim import export
from offtrack_sim.puffer import RoundaboutPuffer


class Agent(nn.Module):
    """Actor and critic, each with two hidden layers, as PufferLib calls them."""

    def __init__(self, env: RoundaboutPuffer, hidden: int = 128) -> None:
        super().__init__()
        n_values, n_actions = env.single_observation_space.shape[0], int(env.single_action_space.n)
        self.actor = network(n_values, hidden, n_actions)
        self.critic = network(n_values, hidden, 1)

    def forward(self, observations: torch.Tensor, state: object = None) -> tuple[torch.Tensor, torch.Tensor]:
        return self.actor(observations), self.critic(observations)  # [B, A], [B, 1]

    forward_eval = forward


def network(inputs: int, hidden: int, outputs: int) -> nn.Sequential:
    layers = [nn.Linear(inputs, hidden), nn.Tanh(), nn.Linear(hidden, hidden), nn.Tanh(), nn.Linear(hidden, outputs)]
    # A small last layer: all actions about as probable at first.
    for layer, gain in zip(layers[::2], (2**0.5, 2**0.5, 0.01)):
        nn.init.orthogonal_(layer.weight, gain)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(*layers)


class Quiet(pufferlib.pufferl.PuffeRL):
    """The trainer without its dashboard, which redraws the screen."""

    def print_dashboard(self, *args: object, **kwargs: object) -> None:
        pass


def main() -> None:
    parser = argparse.ArgumentParser(
        description="PufferLib's trainer", formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument(
        "--scenario", default="attard2023", help="benchmark to train on; its actions are those of --benchmark"
    )
    parser.add_argument(
        "--benchmark", default="attard2023", help="benchmark whose test routes the policy is evaluated on"
    )
    parser.add_argument("--steps", type=int, default=3_000_000, help="env steps of all trucks together")
    parser.add_argument("--minutes", type=float, default=1e9, help="time after which training ends earlier [min]")
    parser.add_argument("--envs", type=int, default=256, help="number of trucks")
    parser.add_argument("--reward-scale", type=float, default=0.002)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--split", default="test", help="routes of the evaluation at the end: test, or train while choosing settings"
    )
    parser.add_argument("--out", type=Path, default=Path("puffer"), help="files to write, without their endings")
    args = parser.parse_args()
    prepare(args)

    # Networks this small gain little from more threads, and wait for them on a busy machine.
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    warnings.filterwarnings("ignore", message=".*CUDA.*")
    kwargs = {"scenario": args.scenario, "num_envs": args.envs, "num_threads": None, "reward_scale": args.reward_scale}
    envs = pufferlib.vector.make(
        RoundaboutPuffer, env_kwargs=kwargs, backend=pufferlib.vector.PufferEnv, seed=args.seed
    )
    agent = Agent(envs.driver_env)
    # Every key that the trainer reads; those without a remark are its defaults.
    config = {
        "env": "roundabouts", "seed": args.seed, "torch_deterministic": True, "cpu_offload": False, "device": "cpu",
        "optimizer": "adam",  # its default, muon, compiles
        "anneal_lr": True, "precision": "float32", "total_timesteps": args.steps,
        "learning_rate": 1e-3,  # of Adam
        "gamma": 0.97,  # as in the other examples
        "gae_lambda": 0.95,  # as in the other examples
        "update_epochs": 4,  # as in the other examples
        "clip_coef": 0.2, "vf_coef": 2.0, "vf_clip_coef": 0.2, "max_grad_norm": 1.5,
        "ent_coef": 0.005,  # as in the other examples
        "adam_beta1": 0.9, "adam_beta2": 0.999, "adam_eps": 1e-8, "data_dir": tempfile.mkdtemp(),
        "checkpoint_interval": 10**9,  # the file is written at the end
        "batch_size": "auto",
        "minibatch_size": 2048,  # as in the other examples
        "max_minibatch_size": 32768, "bptt_horizon": 64, "compile": False, "use_rnn": False,
        "vtrace_rho_clip": 1.0, "vtrace_c_clip": 1.0, "prio_alpha": 0.8, "prio_beta0": 0.2,
    }  # fmt: skip
    trainer = Quiet(config, envs, agent)
    curve: list[dict[str, float]] = []
    start = time.perf_counter()
    try:
        while trainer.global_step < args.steps and time.perf_counter() - start < 60 * args.minutes:
            before, steps = time.perf_counter(), trainer.global_step
            stats = trainer.evaluate()
            success = float(np.mean(stats["is_success"])) if stats.get("is_success") is not None else 0.0
            trainer.train()
            now = time.perf_counter()
            row = {
                "env_steps": trainer.global_step,
                "seconds": round(now - start, 2),
                "env_steps_per_second": round((trainer.global_step - steps) / (now - before)),
                "success": round(success, 4),
            }
            curve.append(row)
            print("  ".join(f"{name} {value:,}" for name, value in row.items()), flush=True)
    except KeyboardInterrupt:
        print("interrupted: what was learned is kept", flush=True)
    seconds = time.perf_counter() - start
    trainer.utilization.stop()

    file = written(args, ".safetensors")
    export.save(file, agent.actor, scenario=args.scenario)
    result = {
        "example": "puffer_ppo",
        **about("numpy", "torch", "gymnasium", "pufferlib"),
        "settings": {name: str(value) if isinstance(value, Path) else value for name, value in vars(args).items()},
        "env_steps": trainer.global_step,
        "seconds": round(seconds, 1),
        "env_steps_per_second": round(trainer.global_step / seconds),
        "env_steps_per_second_median": float(np.median([row["env_steps_per_second"] for row in curve] or [0])),
        "evaluation": offtrack_sim.evaluate(offtrack_sim.Policy.load(file), args.benchmark, split=args.split).as_dict(),
        "curve": curve,
    }
    write_json(written(args, ".json"), result)
    found = result["evaluation"]
    print(f"{args.split} routes: {found['arrived']} of {found['episodes']} arrived, {found['success']:.1%}")
    print(f"wrote {file} and {written(args, '.json')}")


if __name__ == "__main__":
    main()
