"""Several learning trucks on a road: one policy drives all of them, and learns from what each meets.

    python self_play.py --out together

Needs ``offtrack-sim`` and ``torch``. Groups of ``--trucks`` share a roundabout with other vehicles and with each other.
The policy begins as ``traffic2026``, which has never met another truck, and goes on by PPO (Schulman et al., "Proximal
policy optimization algorithms", 2017) with the steps of all trucks, but for those in which a truck waits for its group.
It learns among fitted drivers on training roads and is evaluated on test roads, beside ``traffic2026``, in groups of as
many trucks, among drivers that it never met: aggressive, timid and distracted ones.

Writes ``together.safetensors``, which ``offtrack evaluate --policy`` drives, and ``together.json`` with the curve and
both policies' success. Ctrl-C ends the training early; what was learned is kept.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from results import about, write_json
from torch import nn

from offtrack_sim import Batch, Benchmark, Ended, Policy, benchmark, export

#: Who drives the other vehicles where the policies are evaluated.
DRIVERS = ["fitted", "aggressive", "timid", "distracted"]
#: As `traffic.toml` of the learner weighs them: a truck that may wait must not take a risk to save time.
REWARD = {"reward.failure": -8000.0, "reward.clearance": -100.0}
ARRIVAL = 14000.0


class Actor(nn.Module):
    """A policy as a PyTorch module: ``[n, n_values]`` to logits ``[n, n_actions]``."""

    def __init__(self, policy: Policy) -> None:
        super().__init__()
        parts = export.network(policy)
        assert parts.normalisation is not None and parts.activation == "relu"
        self.mean, self.factor = (torch.from_numpy(array.copy()) for array in parts.normalisation)
        layers: list[nn.Module] = []
        for weight, bias in parts.layers:
            linear = nn.Linear(*weight.shape)
            linear.load_state_dict({"weight": torch.from_numpy(weight.T.copy()), "bias": torch.from_numpy(bias.copy())})
            layers += [linear, nn.ReLU()]
        self.layers = nn.Sequential(*layers[:-1])

    def normalised(self, observation: torch.Tensor) -> torch.Tensor:
        return ((observation - self.mean) * self.factor).clamp(-export.CLIP, export.CLIP)

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        return self.layers(self.normalised(observation))

    def save(self, file: Path, scenario: Benchmark) -> None:
        variance = 1 / self.factor.double().numpy() ** 2
        export.save(file, self.layers, scenario=scenario, mean=self.mean.numpy(), variance=variance, epsilon=0.0)


class Fragment:
    """Some steps of all trucks, ``[T, N, ...]``, in order."""

    def __init__(self, n_steps: int, batch: Batch) -> None:
        shape = (n_steps, batch.num_envs)
        self.observation = torch.zeros(n_steps + 1, batch.num_envs, batch.n_values)  # the last follows the last step
        self.action = torch.zeros(shape, dtype=torch.int64)
        self.log_prob, self.reward = torch.zeros(shape), torch.zeros(shape)
        self.ended, self.waited = torch.zeros(shape, dtype=torch.bool), torch.zeros(shape, dtype=torch.bool)
        # Value of what a step ended by the time limit led to: the task goes on.
        self.beyond = torch.zeros(shape)


def driven(batch: Batch, actor: Actor, critic: nn.Module, args: argparse.Namespace, ends: list[int]) -> Fragment:
    """Steps all trucks with sampled actions; the codes of the episodes that end are added to ``ends``."""
    fragment = Fragment(args.fragment, batch)
    observation = torch.from_numpy(batch.observation())
    for step in range(args.fragment):
        fragment.observation[step] = observation
        fragment.waited[step] = torch.from_numpy(batch.waiting())
        with torch.no_grad():
            log_probs = actor(observation).log_softmax(-1)  # [N, A]
        action = torch.multinomial(log_probs.exp(), 1)  # [N, 1]
        fragment.action[step] = action.squeeze(-1)
        fragment.log_prob[step] = log_probs.gather(1, action).squeeze(-1)
        after, reward, terminated, truncated = batch.step(fragment.action[step].numpy())
        fragment.reward[step] = args.reward_scale * torch.from_numpy(reward)
        fragment.ended[step] = torch.from_numpy(terminated | truncated)
        if (found := batch.ended()) is not None:
            ends += found.codes.tolist()
            arrived, late = found.codes == Ended.ARRIVED, found.codes == Ended.TIMED_OUT
            fragment.reward[step, found.envs[arrived]] += args.reward_scale * ARRIVAL
            if late.any():
                with torch.no_grad():
                    last = critic(actor.normalised(torch.from_numpy(found.observations[late]))).squeeze(-1)
                fragment.beyond[step, found.envs[late]] = last
        observation = torch.from_numpy(after)
    fragment.observation[-1] = observation
    return fragment


@torch.no_grad()
def advantages(
    actor: Actor, critic: nn.Module, fragment: Fragment, args: argparse.Namespace
) -> tuple[torch.Tensor, torch.Tensor]:
    """Generalised advantage estimation; advantages and targets of the value, ``[T, N]`` each."""
    values = critic(actor.normalised(fragment.observation)).squeeze(-1)  # [T + 1, N]
    goes_on = ~fragment.ended
    following = torch.where(goes_on, values[1:], fragment.beyond)
    delta = fragment.reward + args.gamma * following - values[:-1]
    advantage, later = torch.zeros_like(delta), torch.zeros(delta.shape[1])
    for step in reversed(range(len(delta))):
        later = delta[step] + args.gamma * args.gae_lambda * later * goes_on[step]
        advantage[step] = later
    return advantage, advantage + values[:-1]


def learn(
    actor: Actor,
    critic: nn.Module,
    optimizers: list[torch.optim.Optimizer],
    fragment: Fragment,
    args: argparse.Namespace,
    learns_to_act: bool,
) -> None:
    """Some epochs over the steps of the fragment in which a truck drove."""
    kept = ~fragment.waited.flatten()
    advantage, target = (values.flatten()[kept] for values in advantages(actor, critic, fragment, args))
    observation = fragment.observation[:-1].flatten(0, 1)[kept]
    action, old = fragment.action.flatten()[kept], fragment.log_prob.flatten()[kept]
    gain = ((advantage - advantage.mean()) / (advantage.std() + 1e-8)).clamp(-10, 10)
    for _ in range(args.epochs):
        for rows in torch.randperm(len(action)).split(args.minibatch):
            value = critic(actor.normalised(observation[rows])).squeeze(-1)
            loss = (value - target[rows]).square().mean()
            if learns_to_act:
                log_probs = actor(observation[rows]).log_softmax(-1)
                ratio = (log_probs.gather(1, action[rows, None]).squeeze(-1) - old[rows]).exp()
                clipped = ratio.clamp(1 - args.clip, 1 + args.clip)
                loss = loss - torch.min(gain[rows] * ratio, gain[rows] * clipped).mean()
            for optimizer in optimizers:
                optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_([*actor.parameters(), *critic.parameters()], 0.5)
            for optimizer in optimizers[: 2 if learns_to_act else 1]:
                optimizer.step()


def trained(actor: Actor, scenario: Benchmark, args: argparse.Namespace) -> list[dict[str, float]]:
    """Lets the actor learn; returns the curve."""
    batch = Batch(scenario, args.groups * args.trucks, split="train", seed=args.seed)
    critic = nn.Sequential(nn.Linear(batch.n_values, 128), nn.ReLU(), nn.Linear(128, 128), nn.ReLU(), nn.Linear(128, 1))
    optimizers: list[torch.optim.Optimizer] = [
        torch.optim.Adam(critic.parameters(), lr=1e-3),
        torch.optim.Adam(actor.layers.parameters(), lr=args.learning_rate, eps=1e-5),
    ]
    curve: list[dict[str, float]] = []
    ends: list[int] = []
    start, env_steps = time.perf_counter(), 0
    try:
        while env_steps < args.steps:
            fragment = driven(batch, actor, critic, args, ends)
            # First the critic learns alone what the actor is worth.
            optimizers[1].param_groups[0]["lr"] = args.learning_rate * (1 - env_steps / args.steps)
            learn(actor, critic, optimizers, fragment, args, learns_to_act=0.1 < env_steps / args.steps)
            env_steps += int((~fragment.waited).sum())
            if len(ends) >= 2000 or env_steps >= args.steps:
                row = {
                    "env_steps": env_steps,
                    "seconds": round(time.perf_counter() - start, 1),
                    "episodes": len(ends),
                    "success": round(float(np.mean(np.array(ends) == Ended.ARRIVED)), 4) if ends else 0.0,
                }
                curve.append(row)
                print("  ".join(f"{name} {value:,}" for name, value in row.items()), flush=True)
                ends = []
    except KeyboardInterrupt:
        print("interrupted: what was learned is kept", flush=True)
    return curve


def in_groups(policy: Policy, scenario: Benchmark, split: str, args: argparse.Namespace) -> dict[str, Any]:
    """Success of a policy where it drives all trucks of each group: of the first ``--episodes`` episodes of each."""
    n = args.evaluation_groups * args.trucks
    batch = Batch(scenario, n, split=split, seed=1)
    counts, codes = np.zeros(n, np.int64), np.zeros(len(Ended), np.int64)
    while counts.min() < args.episodes:
        batch.step(policy.act(batch.observation()))
        if (found := batch.ended()) is not None:
            counted = counts[found.envs] < args.episodes
            np.add.at(codes, found.codes[counted], 1)
            counts[found.envs] += 1
    total = int(codes.sum())
    ends = {end.name.lower(): int(codes[end]) for end in Ended if codes[end]}
    return {"episodes": total, "success": round(ends.get("arrived", 0) / total, 4), "ends": ends}


def main() -> None:
    parser = argparse.ArgumentParser(
        description="One policy for several trucks on a road", formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("--trucks", type=int, default=4, help="trucks on a road, 2 to 8")
    parser.add_argument("--groups", type=int, default=64, help="groups that learn side by side")
    parser.add_argument("--steps", type=int, default=3_000_000, help="env steps of all trucks together")
    parser.add_argument("--fragment", type=int, default=128, help="steps between two updates")
    parser.add_argument("--learning-rate", type=float, default=1e-4, help="at the beginning; it falls to zero linearly")
    parser.add_argument("--gamma", type=float, default=0.997)
    parser.add_argument("--gae-lambda", type=float, default=0.95)
    parser.add_argument("--clip", type=float, default=0.1)
    parser.add_argument("--epochs", type=int, default=2)
    parser.add_argument("--minibatch", type=int, default=4096)
    parser.add_argument("--reward-scale", type=float, default=0.0003)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--evaluation-groups", type=int, default=256, help="groups that are evaluated side by side")
    parser.add_argument("--episodes", type=int, default=4, help="episodes of each of their trucks that count")
    parser.add_argument("--split", default="test", help="roads of the evaluation: test, or validation to choose by")
    parser.add_argument("--out", type=Path, default=Path("together"), help="files to write, without their endings")
    args = parser.parse_args()
    # Networks this small gain little from more threads, and wait for them on a busy machine.
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    group = {"traffic.group": args.trucks}
    scenario = benchmark("traffic2026-training").changed({**group, **REWARD}, name="traffic2026-training")
    before = Policy.shipped("traffic2026")
    actor = Actor(before)
    curve = trained(actor, scenario, args)
    file = Path(f"{args.out}.safetensors")
    actor.save(file, scenario)
    policies = {"traffic2026": before, "self-play": Policy.load(file)}
    found: dict[str, dict[str, Any]] = {name: {} for name in policies}
    for drivers in DRIVERS:
        roads = benchmark("traffic2026-random").changed({**group, "traffic.drivers": drivers}, name="groups")
        for name, policy in policies.items():
            found[name][drivers] = in_groups(policy, roads, args.split, args)
            print(f"{name} among {drivers} drivers: {found[name][drivers]['success']:.1%}", flush=True)
    settings = {name: str(value) if isinstance(value, Path) else value for name, value in vars(args).items()}
    result = {"example": "self_play", **about("numpy", "torch"), "settings": settings}
    write_json(Path(f"{args.out}.json"), {**result, "success": found, "curve": curve})
    print(f"wrote {file} and {args.out}.json")


if __name__ == "__main__":
    main()
