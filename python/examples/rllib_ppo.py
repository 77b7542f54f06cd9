"""PPO of RLlib's new API stack.

    python rllib_ppo.py --out rllib

Needs ``offtrack-sim``, ``ray[rllib]``, ``gymnasium == 1.2.2`` (RLlib demands it) and ``torch``. Each env runner steps a
batch of trucks of its own, by ``gym_env_vectorize_mode="vector_entry_point"``. Writes ``rllib.safetensors``, which
``offtrack evaluate --policy rllib.safetensors`` drives, and ``rllib.json`` with the curve and the success on the test
routes. Ctrl-C ends the training early; what was learned is kept.

RLlib handles every env step in Python, which costs many times what the simulator does. Where speed matters, see
ray_actors.py. Rewards, -500 to +100, are multiplied by ``--reward-scale`` where the environment is made.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import ray
import torch
from gymnasium.vector import VectorWrapper
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.tune.registry import register_env
from results import about, prepare, write_json, written

import offtrack_sim
from offtrack_sim import Ended, export


class Scaled(VectorWrapper):
    """Rewards times a factor, and a count of the episodes that ended."""

    def __init__(self, env: offtrack_sim.RoundaboutVector, factor: float) -> None:
        super().__init__(env)
        self.factor = factor
        self.arrived = self.ended = 0

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        observation, reward, terminated, truncated, infos = self.env.step(np.asarray(actions))
        if "ended" in infos:
            self.ended += int(infos["_ended"].sum())
            self.arrived += int((infos["ended"] == Ended.ARRIVED).sum())
        return observation, reward * self.factor, terminated, truncated, infos


def make(context: Any) -> Scaled:
    """The trucks of an env runner, with one thread; RLlib gives them a seed of their own when it resets them."""
    return Scaled(
        offtrack_sim.make_vec(context["scenario"], context["num_envs"], num_threads=1), context["reward_scale"]
    )


def counted(runner: Any) -> tuple[int, int]:
    """Episodes of an env runner that arrived and that ended, since it was last asked."""
    env = runner.env
    while env is not None and not isinstance(env, Scaled):
        env = getattr(env, "env", None)
    if env is None:
        return 0, 0
    found = env.arrived, env.ended
    env.arrived = env.ended = 0
    return found


def linear_layers(module: Any) -> torch.nn.Sequential:
    """The actor's layers, in order: those of the encoder and of the policy head."""
    encoder = module.encoder.actor_encoder if hasattr(module.encoder, "actor_encoder") else module.encoder.encoder
    layers = [layer for part in (encoder, module.pi) for layer in part.modules()]
    return torch.nn.Sequential(
        *[layer for layer in layers if isinstance(layer, (torch.nn.Linear, torch.nn.Tanh, torch.nn.ReLU))]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="PPO of RLlib", formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument(
        "--scenario", default="attard2023", help="benchmark to train on; its actions are those of --benchmark"
    )
    parser.add_argument(
        "--benchmark", default="attard2023", help="benchmark whose test routes the policy is evaluated on"
    )
    parser.add_argument("--steps", type=int, default=500_000, help="env steps of all trucks together")
    parser.add_argument("--minutes", type=float, default=1e9, help="time after which training ends earlier [min]")
    parser.add_argument("--runners", type=int, default=2, help="number of env runners; 0: the driver steps the trucks")
    parser.add_argument("--envs", type=int, default=64, help="trucks of each env runner")
    parser.add_argument("--reward-scale", type=float, default=0.01)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--address", help="of a running Ray, HOST:PORT or auto; without it one is started for this run")
    parser.add_argument(
        "--split", default="test", help="routes of the evaluation at the end: test, or train while choosing settings"
    )
    parser.add_argument("--out", type=Path, default=Path("rllib"), help="files to write, without their endings")
    args = parser.parse_args()
    prepare(args)

    examples = str(Path(__file__).resolve().parent)
    ray.init(address=args.address, runtime_env={"working_dir": examples}, log_to_driver=False)
    register_env("roundabouts", make)
    settings = {"scenario": args.scenario, "reward_scale": args.reward_scale}
    batch = 64 * args.envs * max(1, args.runners)
    config = (
        PPOConfig()
        .environment("roundabouts", env_config=settings)
        .env_runners(
            num_env_runners=args.runners,
            num_envs_per_env_runner=args.envs,
            gym_env_vectorize_mode="vector_entry_point",
            rollout_fragment_length=64,
        )
        .training(
            train_batch_size_per_learner=batch,
            minibatch_size=2048,
            num_epochs=4,
            lr=1e-3,
            gamma=0.97,
            lambda_=0.95,
            entropy_coeff=0.005,
            clip_param=0.2,
            use_kl_loss=False,
            vf_clip_param=1e6,
            grad_clip=0.5,
        )
        .rl_module(
            model_config=DefaultModelConfig(fcnet_hiddens=[128, 128], fcnet_activation="tanh", vf_share_layers=False)
        )
        .debugging(seed=args.seed)
    )
    algorithm = config.build_algo()
    curve: list[dict[str, float]] = []
    start, env_steps = time.perf_counter(), 0
    try:
        while env_steps < args.steps and time.perf_counter() - start < 60 * args.minutes:
            before = time.perf_counter()
            found = algorithm.train()
            steps = int(found["num_env_steps_sampled_lifetime"]) - env_steps
            env_steps += steps
            counts = np.sum(algorithm.env_runner_group.foreach_env_runner(counted), axis=0)
            now = time.perf_counter()
            row = {
                "env_steps": env_steps,
                "seconds": round(now - start, 2),
                "env_steps_per_second": round(steps / (now - before)),
                "success": round(float(counts[0] / max(1, counts[1])), 4),
            }
            curve.append(row)
            print("  ".join(f"{name} {value:,}" for name, value in row.items()), flush=True)
    except KeyboardInterrupt:
        print("interrupted: what was learned is kept", flush=True)
    seconds = time.perf_counter() - start

    file = written(args, ".safetensors")
    export.save(file, linear_layers(algorithm.get_module()), scenario=args.scenario)
    result = {
        "example": "rllib_ppo",
        **about("numpy", "torch", "gymnasium", "ray"),
        "settings": {name: str(value) if isinstance(value, Path) else value for name, value in vars(args).items()},
        "env_steps": env_steps,
        "seconds": round(seconds, 1),
        "env_steps_per_second": round(env_steps / seconds),
        "env_steps_per_second_median": float(np.median([row["env_steps_per_second"] for row in curve] or [0])),
        "evaluation": offtrack_sim.evaluate(offtrack_sim.Policy.load(file), args.benchmark, split=args.split).as_dict(),
        "curve": curve,
    }
    write_json(written(args, ".json"), result)
    algorithm.stop()
    ray.shutdown()
    found = result["evaluation"]
    print(f"{args.split} routes: {found['arrived']} of {found['episodes']} arrived, {found['success']:.1%}")
    print(f"wrote {file} and {written(args, '.json')}")


if __name__ == "__main__":
    main()
