#!/usr/bin/env python3
"""Trains on random roads with one choice changed at a time and prints the success on the validation roads.

No test route and no measured roundabout is looked at. Each choice gets the env steps that take about the same time of
one core, so load from other programs does not change a result. One run at a time is pinned to each core. A run that has
a report is not repeated, so an interrupted series can go on. Standard library only.

    python3 benches/ablations/ablate.py --offtrack target/release/offtrack --json ablations.json
"""

import json
import statistics

import series

# What all choices have in common on top of learner/configs/default.toml, so that the table stays what it is when that
# file changes. The policy is evaluated once, at the end, with three episodes on each validation route.
COMMON = [
    "benchmark=random2026-training",
    "also_evaluate=",
    "validation.times=1",
    "validation.episodes=3",
    "learning.hidden=[256, 256]",
    "learning.gamma=0.97",
    "learning.entropy.coefficient=0.05",
    "learning.observation_noise=0.2",
    "learning.layer_norm=false",
    "learning.actor_ema_rate=0.005",
    "learning.final_learning_rate_fraction=0.1",
    "replay_buffer.priority=",
    "level_replay=",
    "reward=",
]
SMALL = ["learning.batch=256", "learning.updates_per_step=4"]
LARGE = ["learning.batch=512", "learning.updates_per_step=2"]
PRIORITY = ["replay_buffer.priority.exponent=0.6", "replay_buffer.priority.correction=0.4"]
GAMMA = ["learning.gamma=0.99"]
CHOSEN = SMALL + GAMMA + PRIORITY + ["learning.entropy.coefficient=0.2"]
REPLAY = ["level_replay.fraction=0.5", "level_replay.rate=0.2"]
SLOW = ["replay_buffer.capacity=2000000", "learning.actor_ema_rate=0.001"]
NEAR = ["reward.clearance_limit=0.5"]

# Name, settings, env steps.
CHOICES = [
    ("batches of 512, 2 a step", LARGE, 3_200_000),
    ("512: gamma 0.99", LARGE + ["learning.gamma=0.99"], 3_200_000),
    ("512: noise 0.1", LARGE + ["learning.observation_noise=0.1"], 3_200_000),
    ("512: 1,024 trucks, half the updates a step", LARGE + ["n_envs=1024"], 6_400_000),
    ("512: layer normalisation", LARGE + ["learning.layer_norm=true"], 2_700_000),
    ("batches of 256, 4 a step", SMALL, 3_200_000),
    ("batches of 128, 8 a step", ["learning.batch=128", "learning.updates_per_step=8"], 3_200_000),
    ("256: level replay", SMALL + REPLAY, 3_200_000),
    ("256: prioritised replay", SMALL + PRIORITY, 3_000_000),
    ("256: gamma 0.99", SMALL + GAMMA, 3_200_000),
    ("256: gamma 0.99, noise 0.1", SMALL + GAMMA + ["learning.observation_noise=0.1"], 3_200_000),
    ("256: gamma 0.99, level replay", SMALL + GAMMA + REPLAY, 3_200_000),
    ("256: gamma 0.99, prioritised replay", SMALL + GAMMA + PRIORITY, 3_000_000),
    ("256: gamma 0.98, prioritised replay", SMALL + ["learning.gamma=0.98"] + PRIORITY, 3_000_000),
    ("chosen: 256, gamma 0.99, prioritised replay, more entropy", CHOSEN, 3_000_000),
    ("chosen: lane distance -30, clearance within 0.5 m", CHOSEN + NEAR + ["reward.lane_distance=-30"], 3_000_000),
    ("chosen: lane distance -60, clearance within 0.5 m", CHOSEN + NEAR + ["reward.lane_distance=-60"], 3_000_000),
    ("chosen: clearance within 0.5 m", CHOSEN + NEAR, 4_800_000),
    ("chosen: 2,000,000 transitions held, EMA rate 0.001", CHOSEN + SLOW, 4_800_000),
    (
        "chosen: 2,000,000 transitions held, EMA rate 0.001, lane distance -60",
        CHOSEN + SLOW + ["reward.lane_distance=-60"],
        4_800_000,
    ),
    (
        "chosen: 2,048 trucks, lane distance -60",
        CHOSEN
        + ["n_envs=2048", "replay_buffer.capacity=2400000", "replay_buffer.warmup=80000"]
        + ["reward.lane_distance=-60"],
        17_200_000,
    ),
    (
        "chosen: noise 0.05, target entropy 0.04",
        CHOSEN + ["learning.observation_noise=0.05", "learning.entropy.target_fraction=0.04"],
        4_800_000,
    ),
    ("chosen: lane distance -2", CHOSEN + ["reward.lane_distance=-2"], 3_000_000),
    ("chosen: no noise", CHOSEN + ["learning.observation_noise=0"], 3_000_000),
    (
        "chosen: EMA rate 0.0005, learning rates to 0",
        CHOSEN + ["learning.actor_ema_rate=0.0005", "learning.final_learning_rate_fraction=0"],
        3_000_000,
    ),
    ("chosen: layer normalisation", CHOSEN + ["learning.layer_norm=true"], 2_500_000),
    ("chosen: level replay", CHOSEN + REPLAY, 3_000_000),
    (
        "chosen: learning rates 6e-4",
        CHOSEN + ["learning.actor_learning_rate=6e-4", "learning.critic_learning_rate=6e-4"],
        3_000_000,
    ),
    ("chosen: no mirror augmentation", CHOSEN + ["learning.mirror_augmentation=false"], 3_000_000),
    ("chosen: three layers of 256", CHOSEN + ["learning.hidden=[256, 256, 256]"], 2_100_000),
    ("chosen: two layers of 512", CHOSEN + ["learning.hidden=[512, 512]"], 1_100_000),
]


def train(core, args, name, settings, steps, seed):
    """One run, pinned to a core; returns its row of the result."""
    folder = args.runs / f"{series.folder_name(name)}-{seed}"
    if failure := series.trained(core, args, folder, "default", seed, steps, COMMON + settings):
        return {"seed": seed, "failed": failure}
    finished = json.loads((folder / "report.json").read_text())
    validation = finished["validation"]
    return {
        "seed": seed,
        "updates": finished["updates"],
        "env_steps": finished["env_steps"],
        "seconds": round(finished["seconds"], 1),
        "training_success": finished["training_success"],
        "arrived": validation["last"]["arrived"],
        "episodes": validation["episodes"],
        "lane_distance_mean_arrived": validation["last"]["lane_distance_mean_arrived"],
        "machine": finished["machine"],
        "commit": finished["commit"],
    }


def table(rows):
    """The rows as a Markdown table."""
    lines = ["| choice | validation roads, each seed | mean | lane distance [m] | updates |", "|---|---|---|---|---|"]
    for row in rows:
        good = [run for run in row["runs"] if "failed" not in run]
        rates = [100 * run["arrived"] / run["episodes"] for run in good]
        if not rates:
            lines.append(f"| {row['choice']} | no run ended | | | |")
            continue
        each = ", ".join(f"{rate:.1f}" for rate in rates)
        lane = statistics.mean(run["lane_distance_mean_arrived"] for run in good)
        updates = statistics.mean(run["updates"] for run in good)
        lines.append(f"| {row['choice']} | {each} | {statistics.mean(rates):.1f} % | {lane:.2f} | {updates:,.0f} |")
    return "\n".join(lines)


def main():
    args = series.arguments(__doc__, "runs/ablations", [choice[0] for choice in CHOICES])
    choices = {
        name: (settings, steps) for name, settings, steps in CHOICES if args.choice is None or name in args.choice
    }
    wanted = {name: {"choice": name, "settings": settings, "runs": []} for name, (settings, _) in choices.items()}
    run = lambda core, name, seed: train(core, args, name, *choices[name], seed)
    series.run_all(args, wanted, run, {"common": COMMON}, table)


if __name__ == "__main__":
    main()
