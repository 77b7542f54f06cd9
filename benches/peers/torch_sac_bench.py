"""Time of one update of a discrete twin-Q SAC, in PyTorch and by `offtrack bench`, in turns on the same machine.

Both do the same work, see README.md beside this file.
"""

import argparse
import datetime
import json
import math
import os
import platform
import statistics
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import torch
from torch import nn

REPOSITORY = Path(__file__).resolve().parents[2]
N_VALUES, N_ACTIONS = 69, 9
CELLS = [([512, 512, 1024], 256), ([512, 512, 1024], 1024), ([256, 256], 256), ([256, 256], 1024)]
WINDOW = 8  # updates timed together


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=5, help="rounds of each size, in turns")
    parser.add_argument("--seconds", type=float, default=3.0, help="time for a round [s]")
    parser.add_argument("--threads", type=int, default=2, help="PyTorch's threads")
    parser.add_argument(
        "--offtrack", type=Path, default=REPOSITORY / "target/release/offtrack", help="the program to compare with"
    )
    parser.add_argument("--json", type=Path, help="write the result to this file")
    args = parser.parse_args()
    if not args.offtrack.is_file():
        sys.exit(f"--offtrack: {args.offtrack}; no such file: build it with `cargo build --release` or name another")
    if args.rounds < 1:
        sys.exit(f"--rounds: {args.rounds}; must be 1 or more")
    torch.set_num_threads(args.threads)
    torch.manual_seed(0)

    print(f"{machine()}; PyTorch {version('torch')}, {args.threads} threads; medians of {args.rounds} rounds")
    print(
        f"{'hidden':>16}{'batch':>7}{'offtrack':>13}{'PyTorch':>13}{'ratio':>8}{'fastest':>13}{'PyTorch':>13}"
        f"{'ratio':>8}   of each round"
    )
    cells = []
    for hidden, batch in CELLS:
        cells.append(compared(hidden, batch, args))
        cell = cells[-1]
        ratios = " ".join(f"{ratio:.2f}" for ratio in cell["ratios"])
        times = f"{cell['offtrack']:10.2f} ms{cell['pytorch']:10.2f} ms"
        fastest = (
            f"{cell['offtrack_fastest']:10.2f} ms{cell['pytorch_fastest']:10.2f} ms{cell['ratio_of_fastest']:8.2f}"
        )
        print(f"{'-'.join(map(str, hidden)):>16}{batch:7}{times}{cell['ratio']:8.2f}{fastest}   {ratios}", flush=True)
    result = {
        "machine": machine(),
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "commit": commit(),
        "load": round(os.getloadavg()[0], 1),
        "versions": {"python": platform.python_version(), "torch": version("torch")},
        "threads": args.threads,
        "seconds_a_round": args.seconds,
        "values": N_VALUES,
        "actions": N_ACTIONS,
        "times": "milliseconds an update, its batch ready: medians over rounds; offtrack_with_sampling draws the batch "
        "as well",
        "ratio": "offtrack's time over PyTorch's: the median of the rounds' ratios",
        "fastest": "the shortest of all windows, which other programs disturbed least",
        "cells": cells,
    }
    if args.json:
        args.json.write_text(json.dumps(result, indent=2) + "\n")


def compared(hidden, batch, args):
    """One size: rounds of offtrack and of PyTorch in turns, and the ratio of each pair."""
    sizes = ["--hidden", ",".join(map(str, hidden)), "--batch", str(batch), "--seconds", str(args.seconds)]
    command = [args.offtrack, "bench", "--lines", *sizes]
    learner = Learner(hidden, batch)
    ours, theirs = [], []
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=REPOSITORY) as program:
        for _ in range(args.rounds):
            program.stdin.write("round\n")
            program.stdin.flush()
            ours.append(json.loads(program.stdout.readline()))
            theirs.append(learner.round(args.seconds))
        program.stdin.close()
    medians = [statistics.median(windows) for windows in theirs]
    ratios = [own["update"] / other for own, other in zip(ours, medians)]
    fastest = min(own["fastest"] for own in ours), min(min(windows) for windows in theirs)
    return {
        "hidden": hidden,
        "batch": batch,
        "offtrack": round(statistics.median(own["update"] for own in ours), 3),
        "offtrack_with_sampling": round(statistics.median(own["with_sampling"] for own in ours), 3),
        "pytorch": round(statistics.median(medians), 3),
        "ratio": round(statistics.median(ratios), 3),
        "ratios": [round(ratio, 3) for ratio in ratios],
        "offtrack_fastest": round(fastest[0], 3),
        "pytorch_fastest": round(fastest[1], 3),
        "ratio_of_fastest": round(fastest[0] / fastest[1], 3),
    }


def network(hidden):
    """Linear layers with ReLU between them."""
    sizes = [N_VALUES, *hidden, N_ACTIONS]
    layers = []
    for inputs, outputs in zip(sizes, sizes[1:]):
        layers += [nn.Linear(inputs, outputs), nn.ReLU()]
    return nn.Sequential(*layers[:-1])


def frozen(module_hidden, module):
    """A copy without gradients: a target network, or the EMA of the actor."""
    copy = network(module_hidden)
    copy.load_state_dict(module.state_dict())
    return copy.requires_grad_(False)


class Learner:
    """The update of learner/src/sac.rs that `offtrack bench` measures, with the same steps in the same order."""

    def __init__(self, hidden, batch):
        self.batch = batch
        self.actor, self.first, self.second = (network(hidden) for _ in range(3))
        self.targets = [frozen(hidden, critic) for critic in (self.first, self.second)]
        self.ema = frozen(hidden, self.actor)
        self.critic_parameters = [*self.first.parameters(), *self.second.parameters()]
        self.target_parameters = [parameter for target in self.targets for parameter in target.parameters()]
        self.actor_parameters = list(self.actor.parameters())
        self.ema_parameters = list(self.ema.parameters())
        self.critic_optimizer = torch.optim.Adam(self.critic_parameters, lr=3e-4, eps=1e-5, fused=True)
        self.actor_optimizer = torch.optim.Adam(self.actor_parameters, lr=3e-4, eps=1e-5, fused=True)
        self.log_alpha, self.moments, self.updates = math.log(0.05), [0.0, 0.0], 0

    def transitions(self):
        """A batch of transitions."""
        return (
            torch.rand(self.batch, N_VALUES) * 2 - 1,
            torch.randint(N_ACTIONS, (self.batch, 1)),
            torch.rand(self.batch, 1) * 2 - 1,
            torch.full((self.batch, 1), 0.97**3),
            torch.rand(self.batch, N_VALUES) * 2 - 1,
            torch.ones(self.batch, 1),
        )

    def update(self, observation, action, reward, discount, next_observation, weight):
        alpha = math.exp(self.log_alpha)
        # Soft value of the next state: expectation over actions.
        with torch.no_grad():
            log_probs = self.actor(next_observation).log_softmax(1)
            q = (self.targets[0](next_observation) + self.targets[1](next_observation)) * 0.5
            value = (log_probs.exp() * (q - alpha * log_probs)).sum(1, keepdim=True)
            target = reward + discount * value

        # Each critic is fitted to the TD target of the action that was taken.
        values = [self.first(observation), self.second(observation)]
        taken = [q.gather(1, action) for q in values]
        critic_loss = (((taken[0] - target).square() + (taken[1] - target).square()) * weight).mean()

        # The actor's loss takes the same values as constants.
        q = ((values[0] + values[1]) * 0.5).detach()
        log_probs = self.actor(observation).log_softmax(1)
        probs = log_probs.exp()
        actor_loss = (probs * (alpha * log_probs - q)).sum(1).mean()
        with torch.no_grad():
            entropy = -(probs * log_probs).sum(1).mean().item()
            value = (taken[0] + taken[1]) * 0.5
            errors = (value - target).abs().squeeze(1).numpy()
            value = value.mean().item()

        for optimizer, loss in ((self.critic_optimizer, critic_loss), (self.actor_optimizer, actor_loss)):
            optimizer.zero_grad(set_to_none=True)
            loss.backward()
            optimizer.step()
        self.update_entropy_coefficient(entropy)
        with torch.no_grad():
            torch._foreach_lerp_(self.target_parameters, self.critic_parameters, 0.005)
            torch._foreach_lerp_(self.ema_parameters, self.actor_parameters, 0.005)
        return critic_loss.item(), actor_loss.item(), entropy, value, errors

    def update_entropy_coefficient(self, entropy):
        """One Adam step of the entropy coefficient, a number on the host as in offtrack."""
        self.updates += 1
        gradient = math.exp(self.log_alpha) * (entropy - 0.1 * math.log(N_ACTIONS))
        corrected = []
        for index, (value, decay) in enumerate(((gradient, 0.9), (gradient * gradient, 0.999))):
            self.moments[index] = decay * self.moments[index] + (1 - decay) * value
            corrected.append(self.moments[index] / (1 - decay**self.updates))
        self.log_alpha -= 3e-4 * corrected[0] / (math.sqrt(corrected[1]) + 1e-8)

    def round(self, seconds):
        """Time of an update in each window [ms], after a tenth of the time as warm-up."""
        begun, windows = time.perf_counter(), []
        while time.perf_counter() - begun < 0.1 * seconds:
            self.update(*self.transitions())
        begun = time.perf_counter()
        while time.perf_counter() - begun < 0.9 * seconds or not windows:
            batches = [self.transitions() for _ in range(WINDOW)]
            window = time.perf_counter()
            for batch in batches:
                self.update(*batch)
            windows.append(1e3 * (time.perf_counter() - window) / WINDOW)
        return windows


def machine():
    """The processor's name and number of cores."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor() or platform.machine()
    return f"{name}, {os.cpu_count()} cores"


def commit():
    """The commit that the sources are at, with `-dirty` when they differ from it."""
    command = ["git", "-C", REPOSITORY, "describe", "--always", "--dirty", "--abbrev=12"]
    said = subprocess.run(command, capture_output=True, text=True)
    return said.stdout.strip() if said.returncode == 0 else "unknown"


if __name__ == "__main__":
    main()
