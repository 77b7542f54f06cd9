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

import cleanrl_ppo
import numpy as np
import torch
from cleanrl_ppo import Fragment, advantages
from distil import Network
from results import about, write_json
from torch import nn

from offtrack_sim import Batch, Benchmark, Ended, Policy, benchmark

#: Who drives the other vehicles where the policies are evaluated.
DRIVERS = ["fitted", "aggressive", "timid", "distracted"]
#: As `traffic.toml` of the learner weighs them: a truck that may wait must not take a risk to save time.
REWARD = {"reward.failure": -8000.0, "reward.clearance": -100.0}
ARRIVAL = 14000.0


class Agent(cleanrl_ppo.Agent):
    """The policy as the actor, and a critic that sees what it sees."""

    def __init__(self, policy: Policy) -> None:
        nn.Module.__init__(self)
        self.actor = Network(policy)
        n_values, hidden = len(self.actor.mean), 128
        layers = [nn.Linear(n_values, hidden), nn.ReLU(), nn.Linear(hidden, hidden), nn.ReLU(), nn.Linear(hidden, 1)]
        self.critic = nn.Sequential(*layers)

    def value(self, observation: torch.Tensor) -> torch.Tensor:
        return self.critic(self.actor.normalised(observation)).squeeze(-1)  # [B]


def driven(batch: Batch, agent: Agent, args: argparse.Namespace, ends: list[int]) -> tuple[Fragment, np.ndarray]:
    """Steps all trucks with sampled actions; which of these steps trucks waited in, ``[T, N]``. The codes of the
    episodes that end are added to ``ends``."""
    fragment = Fragment(args.fragment, batch.num_envs, batch.n_values)
    waited = np.zeros((args.fragment, batch.num_envs), np.bool_)
    observation = batch.observation()
    for step in range(args.fragment):
        fragment.observation[step], waited[step] = observation, batch.waiting()
        with torch.no_grad():
            fragment.action[step], fragment.log_prob[step] = agent.act(torch.from_numpy(observation))
        observation, reward, terminated, truncated = batch.step(fragment.action[step])
        fragment.reward[step] = args.reward_scale * reward
        fragment.terminated[step], fragment.truncated[step] = terminated, truncated
        if (found := batch.ended()) is not None:
            ends += found.codes.tolist()
            arrived, late = found.codes == Ended.ARRIVED, found.codes == Ended.TIMED_OUT
            fragment.reward[step, found.envs[arrived]] += args.reward_scale * ARRIVAL
            fragment.limits += [(step, found.envs[row], found.observations[row]) for row in np.flatnonzero(late)]
    fragment.observation[-1] = observation
    return fragment, waited


def learn(
    agent: Agent,
    optimizers: list[torch.optim.Optimizer],
    fragment: Fragment,
    waited: np.ndarray,
    args: argparse.Namespace,
    learns_to_act: bool,
) -> None:
    """Some epochs over the steps of the fragment in which a truck drove."""
    kept = torch.from_numpy(~waited).flatten()
    estimates = advantages(agent, fragment, args.gamma, args.gae_lambda)
    advantage, target = (values.flatten()[kept] for values in estimates)
    observation = torch.from_numpy(fragment.observation[:-1]).flatten(0, 1)[kept]
    action, old = (torch.from_numpy(values).flatten()[kept] for values in (fragment.action, fragment.log_prob))
    gain = ((advantage - advantage.mean()) / (advantage.std() + 1e-8)).clamp(-10, 10)
    for _ in range(args.epochs):
        for rows in torch.randperm(len(action)).split(args.minibatch):
            loss = (agent.value(observation[rows]) - target[rows]).square().mean()
            if learns_to_act:
                ratio = (agent.judge(observation[rows], action[rows])[0] - old[rows]).exp()
                clipped = ratio.clamp(1 - args.clip, 1 + args.clip)
                loss = loss - torch.min(gain[rows] * ratio, gain[rows] * clipped).mean()
            for optimizer in optimizers:
                optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            for optimizer in optimizers[: 2 if learns_to_act else 1]:
                optimizer.step()


def trained(agent: Agent, scenario: Benchmark, args: argparse.Namespace) -> list[dict[str, float]]:
    """Lets the agent learn; returns the curve."""
    batch = Batch(scenario, args.groups * args.trucks, split="train", seed=args.seed)
    optimizers: list[torch.optim.Optimizer] = [
        torch.optim.Adam(agent.critic.parameters(), lr=1e-3),
        torch.optim.Adam(agent.actor.parameters(), lr=args.learning_rate, eps=1e-5),
    ]
    curve: list[dict[str, float]] = []
    ends: list[int] = []
    start, env_steps = time.perf_counter(), 0
    try:
        while env_steps < args.steps:
            fragment, waited = driven(batch, agent, args, ends)
            # First the critic learns alone what the actor is worth.
            optimizers[1].param_groups[0]["lr"] = args.learning_rate * (1 - env_steps / args.steps)
            learn(agent, optimizers, fragment, waited, args, learns_to_act=0.1 < env_steps / args.steps)
            env_steps += int((~waited).sum())
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
    agent = Agent(before)
    curve = trained(agent, scenario, args)
    file = Path(f"{args.out}.safetensors")
    agent.actor.save(file, scenario)
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
