#!/usr/bin/env python3
"""Trains the default learner with one choice changed at a time and prints its success on the test routes.

Each choice gets the env steps that one idle core of the measuring machine makes in 36 seconds. So all take about the same
time, and load from other programs does not change a result. One run at a time is pinned to each core. A run that has a
report is not repeated, so an interrupted series can go on. Standard library only.

    python3 benches/ablations/ablate.py --offtrack target/release/offtrack --json docs/benchmarks/ablations.json
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue

# What differs from training/configs/default.toml: name -> settings. Each is a row of the table.
CHOICES = {
    "default": [],
    "no mirror augmentation": ["learning.mirror_augmentation=false"],
    "no observation noise": ["learning.observation_noise=0.0"],
    "1-step returns": ["learning.n_steps=1"],
    "3-step returns": ["learning.n_steps=3"],
    "gamma 0.99": ["learning.gamma=0.99"],
    "entropy in the actor loss alone": ["learning.entropy.in_target=false"],
    "layer normalisation in the critics": ["learning.layer_norm=true"],
    "lower of the two critics": ["learning.critics=minimum"],
    "prioritised replay": ["replay_buffer.priority.exponent=0.6", "replay_buffer.priority.correction=0.4"],
    "random actions with a rate per truck": [
        "exploration.initial_fraction=0.4",
        "exploration.final_fraction=0.4",
        "exploration.steps=1",
        "exploration.spread=7.0",
    ],
    "no observation normalisation": ["learning.normalise_observations=false"],
    "no reward scale": ["learning.reward_scale=1.0"],
    "128 trucks": ["n_envs=128"],
    "batch of 2,048": ["learning.batch=2048"],
    "layers of 512, 512, 1,024": ["learning.hidden=[512, 512, 1024]"],
    "no EMA of the actor": ["learning.actor_ema_rate=1.0"],
    "training on the benchmark itself": ["training_benchmark="],
}

# Env steps of a run, and of the choices that need more time for each.
STEPS = 900_000
FEWER_STEPS = {
    "layer normalisation in the critics": 700_000,
    "128 trucks": 285_000,
    "batch of 2,048": 320_000,
    "layers of 512, 512, 1,024": 140_000,
}


def train(core, args, name, settings, seed):
    """One run, pinned to a core; returns its row of the result."""
    folder = args.runs / f"{name.replace(' ', '-').replace(',', '')}-{seed}"
    report = folder / "report.json"
    if not report.is_file():
        if folder.exists():
            # It was interrupted before: a new run cannot use its folder.
            subprocess.run(["rm", "-r", str(folder)], check=True)
        command = [str(args.offtrack), "train", "training/configs/default.toml", "--name", folder.name]
        command += ["--out", str(args.runs), "--seed", str(seed), "--steps", str(FEWER_STEPS.get(name, STEPS))]
        for setting in settings:
            command += ["--set", setting]
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            preexec_fn=lambda: os.sched_setaffinity(0, {core}),
        )
        if done.returncode != 0:
            return {"seed": seed, "failed": done.stderr.strip().splitlines()[-1]}
    # Nothing resumes this run, and the replay buffer in its checkpoint fills the disk.
    (folder / "checkpoint.safetensors").unlink(missing_ok=True)
    finished = json.loads(report.read_text())
    evaluation = finished["evaluation"]
    return {
        "seed": seed,
        "updates": finished["updates"],
        "env_steps": finished["env_steps"],
        "seconds": finished["seconds"],
        "training_success": finished["training_success"],
        "arrived": evaluation["arrived"],
        "episodes": evaluation["episodes"],
        "lane_distance_mean": evaluation["lane_distance_mean"],
        "machine": finished["machine"],
        "commit": finished["commit"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--offtrack", type=Path, default=Path("target/release/offtrack"))
    parser.add_argument("--seeds", default="0,1,2", help="seeds of each choice")
    parser.add_argument("--cores", default=None, help="cores to run on, as in 0,1; default: all")
    parser.add_argument("--runs", type=Path, default=Path("runs/ablations"))
    parser.add_argument("--json", type=Path, required=True)
    args = parser.parse_args()
    cores = Queue()
    available = [int(core) for core in args.cores.split(",")] if args.cores else sorted(os.sched_getaffinity(0))
    for core in available:
        cores.put(core)
    args.runs.mkdir(parents=True, exist_ok=True)

    def job(name, seed):
        core = cores.get()
        try:
            return train(core, args, name, CHOICES[name], seed)
        finally:
            cores.put(core)

    with ThreadPoolExecutor(len(available)) as pool:
        # One seed of every choice before the next seed: an interrupted series has as many of each.
        jobs = {(name, seed): pool.submit(job, name, seed) for seed in map(int, args.seeds.split(",")) for name in CHOICES}
        rows = {name: {"choice": name, "settings": CHOICES[name], "runs": []} for name in CHOICES}
        for (name, seed), running in jobs.items():
            result = running.result()
            rows[name]["runs"].append(result)
            print(name, json.dumps(result), file=sys.stderr, flush=True)
            whole = {"cores_per_run": 1, "choices": list(rows.values())}
            temporary = args.json.with_suffix(".tmp")
            temporary.write_text(json.dumps(whole, indent=1) + "\n")
            temporary.replace(args.json)
    print("| choice | test routes, each seed | mean | training | updates |\n|---|---|---|---|---|")
    for row in rows.values():
        good = [run for run in row["runs"] if "failed" not in run]
        rates = [100 * run["arrived"] / run["episodes"] for run in good]
        if not rates:
            print(f"| {row['choice']} | no run ended | | | |")
            continue
        each = ", ".join(f"{rate:.1f}" for rate in rates)
        training = statistics.mean(100 * run["training_success"] for run in good)
        updates = statistics.mean(run["updates"] for run in good)
        print(f"| {row['choice']} | {each} | {statistics.mean(rates):.1f} % | {training:.1f} % | {updates:,.0f} |")


if __name__ == "__main__":
    main()
