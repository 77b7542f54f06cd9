"""PPO in one file, in the manner of CleanRL, with all trucks stepped together.

    python cleanrl_ppo.py --out ppo

Needs ``offtrack-sim``, ``gymnasium >= 1.1`` and ``torch``. Writes ``ppo.safetensors``, which
``offtrack evaluate --policy ppo.safetensors`` drives, and ``ppo.json`` with the curve and the success on the test
routes. Ctrl-C ends the training early; what was learned is kept.

CleanRL's own ppo.py works with one line changed, ``envs = gym.vector.SyncVectorEnv(...)`` to

    envs = offtrack_sim.make_vec(num_envs=args.num_envs, seed=args.seed, autoreset_mode="same_step")

Rewards are multiplied by ``--reward-scale``: the benchmark's are -500 to +100, and a value function learns small
numbers sooner. Settings were chosen by the success on training routes alone.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch
from results import about, prepare, write_json, written
from torch import nn

import offtrack_sim
from offtrack_sim import export


class Agent(nn.Module):
    """Actor and critic, each with two hidden layers."""

    def __init__(self, n_values: int, n_actions: int, hidden: int) -> None:
        super().__init__()
        self.actor = network(n_values, hidden, n_actions, gain=0.01)
        self.critic = network(n_values, hidden, 1, gain=1.0)

    def value(self, observation: torch.Tensor) -> torch.Tensor:
        return self.critic(observation).squeeze(-1)  # [B]

    def act(self, observation: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """An action drawn for each observation, and the logarithm of its probability."""
        log_probs = torch.log_softmax(self.actor(observation), dim=-1)  # [B, A]
        action = torch.multinomial(log_probs.exp(), 1)  # [B, 1]
        return action.squeeze(-1), log_probs.gather(1, action).squeeze(-1)

    def judge(self, observation: torch.Tensor, action: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Logarithm of each action's probability, and the entropy of its distribution."""
        log_probs = torch.log_softmax(self.actor(observation), dim=-1)  # [M, A]
        return log_probs.gather(1, action[:, None]).squeeze(-1), -(log_probs * log_probs.exp()).sum(-1)  # [M] each

    @torch.no_grad()
    def greedy(self, observation: np.ndarray) -> np.ndarray:
        return self.actor(torch.from_numpy(observation)).argmax(-1).numpy()


def network(inputs: int, hidden: int, outputs: int, gain: float) -> nn.Sequential:
    layers = [nn.Linear(inputs, hidden), nn.Tanh(), nn.Linear(hidden, hidden), nn.Tanh(), nn.Linear(hidden, outputs)]
    for layer, scale in zip(layers[::2], (2**0.5, 2**0.5, gain)):
        nn.init.orthogonal_(layer.weight, scale)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(*layers)


class Fragment:
    """Some steps of all trucks, ``[T, N, ...]``, in order."""

    def __init__(self, n_steps: int, n_envs: int, n_values: int, n_commands: int = 0) -> None:
        self.observation = np.zeros((n_steps + 1, n_envs, n_values), np.float32)  # the last one follows the last step
        self.action = np.zeros((n_steps, n_envs), np.int64)
        if n_commands:
            self.action = np.zeros((n_steps, n_envs, n_commands), np.float32)
        self.log_prob = np.zeros((n_steps, n_envs), np.float32)
        self.reward = np.zeros((n_steps, n_envs), np.float32)
        self.terminated = np.zeros((n_steps, n_envs), np.bool_)
        self.truncated = np.zeros((n_steps, n_envs), np.bool_)
        # Of the steps that the time limit ended: where, and the observation that the action led to.
        self.limits: list[tuple[int, int, np.ndarray]] = []


@torch.no_grad()
def advantages(agent: Agent, fragment: Fragment, gamma: float, lam: float) -> tuple[torch.Tensor, torch.Tensor]:
    """Generalised advantage estimation; advantages and TD targets, ``[T, N]`` each."""
    values = agent.value(torch.from_numpy(fragment.observation))  # [T + 1, N]
    next_values = values[1:].clone()
    if fragment.limits:
        # A time limit does not end the task: the value of the last observation goes on.
        last = agent.value(torch.from_numpy(np.stack([observation for _, _, observation in fragment.limits])))
        for (step, env, _), value in zip(fragment.limits, last):
            next_values[step, env] = value
    goes_on = ~torch.from_numpy(fragment.terminated)
    same_episode = goes_on & ~torch.from_numpy(fragment.truncated)
    delta = torch.from_numpy(fragment.reward) + gamma * next_values * goes_on - values[:-1]  # [T, N]
    advantage = torch.zeros_like(delta)
    later = torch.zeros(delta.shape[1])
    for step in reversed(range(len(delta))):
        later = delta[step] + gamma * lam * later * same_episode[step]
        advantage[step] = later
    return advantage, advantage + values[:-1]


def update(
    agent: Agent, optimizer: torch.optim.Optimizer, fragments: list[Fragment], args: argparse.Namespace
) -> float:
    """Some epochs of clipped policy gradients over the fragments; returns the mean entropy [nat]."""
    estimates = [advantages(agent, fragment, args.gamma, args.gae_lambda) for fragment in fragments]
    advantage = torch.cat([estimate[0].flatten() for estimate in estimates])  # [B]
    target = torch.cat([estimate[1].flatten() for estimate in estimates])  # [B]
    observation = torch.cat(
        [torch.from_numpy(fragment.observation[:-1]).flatten(0, 1) for fragment in fragments]
    )  # [B, n_values]
    action = torch.cat([torch.from_numpy(fragment.action).flatten(0, 1) for fragment in fragments])  # [B, ...]
    log_prob = torch.cat([torch.from_numpy(fragment.log_prob).flatten() for fragment in fragments])  # [B]
    entropies = []
    for _ in range(args.epochs):
        for rows in torch.randperm(len(action)).split(args.minibatch):
            new_log_prob, entropy = agent.judge(observation[rows], action[rows])  # [M] each
            ratio = (new_log_prob - log_prob[rows]).exp()  # [M]
            gain = (advantage[rows] - advantage[rows].mean()) / (advantage[rows].std() + 1e-8)  # [M]
            policy_loss = -torch.min(gain * ratio, gain * ratio.clamp(1 - args.clip, 1 + args.clip)).mean()
            value_loss = (agent.value(observation[rows]) - target[rows]).square().mean()
            loss = policy_loss + 0.5 * value_loss - args.entropy * entropy.mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()
            entropies.append(float(entropy.detach().mean()))
    return float(np.mean(entropies))


def arguments(description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument(
        "--scenario", default="attard2023", help="benchmark to train on; its actions are those of --benchmark"
    )
    parser.add_argument(
        "--benchmark", default="attard2023", help="benchmark whose test routes the policy is evaluated on"
    )
    parser.add_argument("--steps", type=int, default=3_000_000, help="env steps of all trucks together")
    parser.add_argument("--minutes", type=float, default=1e9, help="time after which training ends earlier [min]")
    parser.add_argument("--envs", type=int, default=256, help="number of trucks")
    parser.add_argument("--fragment", type=int, default=64, help="steps between two updates")
    parser.add_argument("--hidden", type=int, default=128, help="width of both hidden layers")
    parser.add_argument("--learning-rate", type=float, default=1e-3, help="at the beginning; it falls to zero linearly")
    parser.add_argument("--gamma", type=float, default=0.97)
    parser.add_argument("--gae-lambda", type=float, default=0.95)
    parser.add_argument("--clip", type=float, default=0.2)
    parser.add_argument("--entropy", type=float, default=0.005, help="entropy coefficient")
    parser.add_argument("--epochs", type=int, default=4)
    parser.add_argument("--minibatch", type=int, default=2048)
    parser.add_argument("--reward-scale", type=float, default=0.01)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--split", default="test", help="routes of the evaluation at the end: test, or train while choosing settings"
    )
    parser.add_argument("--out", type=Path, default=Path("ppo"), help="files to write, without their endings")
    return parser


class Progress:
    """The curve of a training run, printed as it grows."""

    def __init__(self, args: argparse.Namespace) -> None:
        self.args = args
        self.curve: list[dict[str, float]] = []
        self.env_steps = 0
        self.start = time.perf_counter()
        self._successes: list[float] = []
        self._last = (self.start, 0)

    def left(self) -> float:
        """Fraction of the training that is left: 1 to 0."""
        minutes = (time.perf_counter() - self.start) / 60
        return max(0.0, 1 - max(self.env_steps / self.args.steps, minutes / self.args.minutes))

    def add(self, env_steps: int, successes: list[float], entropy: float) -> None:
        self.env_steps += env_steps
        self._successes += successes
        now = time.perf_counter()
        if len(self._successes) >= 500 or self.left() == 0:
            speed = (self.env_steps - self._last[1]) / (now - self._last[0])
            row = {
                "env_steps": self.env_steps,
                "seconds": round(now - self.start, 2),
                "env_steps_per_second": round(speed),
            }
            row |= {
                "success": round(float(np.mean(self._successes)), 4) if self._successes else 0.0,
                "entropy": round(entropy, 3),
            }
            self.curve.append(row)
            print("  ".join(f"{name} {value:,}" for name, value in row.items()), flush=True)
            self._successes, self._last = [], (now, self.env_steps)

    def finish(
        self, agent: Agent, kind: str, *packages: str, extra: dict[str, object] | None = None, **export_as: str
    ) -> None:
        """Writes the policy file, evaluates the policy once, and writes the results."""
        args = self.args
        seconds = time.perf_counter() - self.start
        file = written(args, ".safetensors")
        export.save(file, agent.actor, scenario=args.scenario, **export_as)
        policy = offtrack_sim.Policy.load(file)
        result = {
            "example": kind,
            **about("numpy", "torch", *packages),
            "settings": {name: str(value) if isinstance(value, Path) else value for name, value in vars(args).items()},
            "env_steps": self.env_steps,
            "seconds": round(seconds, 1),
            "env_steps_per_second": round(self.env_steps / seconds),
            "env_steps_per_second_median": float(np.median([row["env_steps_per_second"] for row in self.curve] or [0])),
            **(extra or {}),
            "evaluation": offtrack_sim.evaluate(policy, args.benchmark, split=args.split).as_dict(),
            "curve": self.curve,
        }
        write_json(written(args, ".json"), result)
        found = result["evaluation"]
        print(f"{args.split} routes: {found['arrived']} of {found['episodes']} arrived, {found['success']:.1%}")
        print(f"wrote {file} and {written(args, '.json')}")


def main() -> None:
    args = arguments("PPO in one file, all trucks stepped together").parse_args()
    prepare(args)
    # Networks this small gain little from more threads, and wait for them on a busy machine.
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    envs = offtrack_sim.make_vec(args.scenario, args.envs, seed=args.seed, autoreset_mode="same_step", copy=False)
    agent = Agent(envs.single_observation_space.shape[0], int(envs.single_action_space.n), args.hidden)
    train(args, envs, agent).finish(agent, "cleanrl_ppo", "gymnasium")


def train(args: argparse.Namespace, envs: offtrack_sim.RoundaboutVector, agent: Agent) -> Progress:
    """Drives and learns in turns until the steps or the minutes are over."""
    if args.minibatch < 2 or args.fragment < 1 or args.epochs < 1:
        raise SystemExit("--minibatch must be at least 2, --fragment and --epochs at least 1")
    n_values, n_commands = envs.batch.n_values, envs.batch.n_commands
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)
    observation, _ = envs.reset(seed=args.seed)
    progress = Progress(args)
    try:
        while progress.left() > 0:
            optimizer.param_groups[0]["lr"] = args.learning_rate * progress.left()
            fragment = Fragment(args.fragment, args.envs, n_values, n_commands)
            successes: list[float] = []
            for step in range(args.fragment):
                fragment.observation[step] = observation
                with torch.no_grad():
                    action, log_prob = agent.act(torch.from_numpy(fragment.observation[step]))
                fragment.action[step], fragment.log_prob[step] = action, log_prob
                # Of a command the simulator takes what lies in its range.
                given = fragment.action[step].clip(-1, 1) if n_commands else fragment.action[step]
                observation, reward, terminated, truncated, infos = envs.step(given)
                fragment.reward[step] = reward * args.reward_scale
                fragment.terminated[step], fragment.truncated[step] = terminated, truncated
                if "final_info" in infos:
                    ended = infos["_final_info"]
                    successes += infos["final_info"]["is_success"][ended].astype(float).tolist()
                    fragment.limits += [
                        (step, env, infos["final_obs"][env]) for env in np.flatnonzero(truncated & ~terminated)
                    ]
            fragment.observation[-1] = observation
            entropy = update(agent, optimizer, [fragment], args)
            progress.add(fragment.reward.size, successes, entropy)
    except KeyboardInterrupt:
        print("interrupted: what was learned is kept", flush=True)
    return progress


if __name__ == "__main__":
    main()
