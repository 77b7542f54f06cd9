"""PPO by commands, in the manner of CleanRL's ppo_continuous_action.py: any steer angle in place of one of nine.

    python cleanrl_ppo_continuous.py --out ppo-continuous

What is not of commands is cleanrl_ppo.py's. The actor gives the mean of each command; a deviation that does not depend
on the observation is learned beside it. The simulator refuses a command outside -1..1, so what is drawn beyond is
clipped before it is given, and the policy file clips its means likewise.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from cleanrl_ppo import Agent, arguments, train
from results import prepare
from torch import nn
from torch.distributions import Normal

import offtrack_sim


class GaussianAgent(Agent):
    """Actor and critic; the actor's outputs are means of commands."""

    def __init__(self, n_values: int, n_commands: int, hidden: int) -> None:
        super().__init__(n_values, n_commands, hidden)
        self.log_deviation = nn.Parameter(torch.full((n_commands,), -0.7))

    def distribution(self, observation: torch.Tensor) -> Normal:
        return Normal(self.actor(observation), self.log_deviation.exp())  # [B, n_commands]

    def act(self, observation: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """A command drawn for each observation, and the logarithm of its density."""
        distribution = self.distribution(observation)
        command = distribution.sample()  # [B, n_commands]
        return command, distribution.log_prob(command).sum(-1)

    def judge(self, observation: torch.Tensor, action: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        distribution = self.distribution(observation)
        return distribution.log_prob(action).sum(-1), distribution.entropy().sum(-1)  # [M] each

    @torch.no_grad()
    def greedy(self, observation: np.ndarray) -> np.ndarray:
        return self.actor(torch.from_numpy(observation)).clip(-1, 1).numpy()


def main() -> None:
    parser = arguments("PPO by commands, all trucks stepped together")
    parser.set_defaults(
        scenario="attard2023-continuous", benchmark="attard2023-continuous", entropy=0.0, out=Path("ppo-continuous")
    )
    args = parser.parse_args()
    prepare(args)
    # Networks this small gain little from more threads, and wait for them on a busy machine.
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    envs = offtrack_sim.make_vec(args.scenario, args.envs, seed=args.seed, autoreset_mode="same_step", copy=False)
    agent = GaussianAgent(envs.batch.n_values, envs.batch.n_commands, args.hidden)
    train(args, envs, agent).finish(agent, "cleanrl_ppo_continuous", "gymnasium", squash="clip")


if __name__ == "__main__":
    main()
