#!/usr/bin/env python3
"""Trains the default learner with one choice changed at a time and says how often each drives the unseen routes.

Every choice gets the env steps that one core of the measuring machine makes in 36 seconds with nothing else to do: about the same time, but
what else the machine does changes no result. As many run side by side as there are cores. A run whose report is there already is not made
again, so an interrupted series goes on where it was. Standard library only.

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

# What is changed beside training/configs/default.toml: name -> settings. Each line of the table is one of them.
CHOICES = {
    "default": [],
    "no mirror": ["learning.mirror=false"],
    "no noise on observations": ["learning.observation_noise=0.0"],
    "1-step returns": ["learning.n_steps=1"],
    "3-step returns": ["learning.n_steps=3"],
    "discount 0.99": ["learning.discount=0.99"],
    "entropy in the actor alone": ["learning.entropy.in_target=false"],
    "layers of the critics normalised": ["learning.layer_norm=true"],
    "lower of the two critics": ["learning.critics=lowest"],
    "critics clipped to their targets": ["learning.value_clip=0.5"],
    "categorical critics": [
        "learning.categories.count=51",
        "learning.categories.low=-15.0",
        "learning.categories.high=15.0",
    ],
    "prioritised memory": ["memory.priority.exponent=0.6", "memory.priority.correction=0.4"],
    "chance per truck": [
        "exploration.first=0.4",
        "exploration.last=0.4",
        "exploration.steps=1",
        "exploration.spread=7.0",
    ],
    "observations as they are": ["learning.scale_observations=false"],
    "rewards as they are": ["learning.reward_scale=1.0"],
    "128 trucks": ["n_envs=128"],
    "updates of 2,048 transitions": ["learning.batch=2048"],
    "layers of 512, 512, 1,024": ["learning.hidden=[512, 512, 1024]"],
    "the last actor, no running average": ["learning.average_rate=1.0"],
    "practice on the benchmark itself": ["practice="],
}

# Env steps of a run, and of those that take longer over one.
STEPS = 900_000
FEWER_STEPS = {
    "layers of the critics normalised": 700_000,
    "critics clipped to their targets": 750_000,
    "categorical critics": 410_000,
    "128 trucks": 285_000,
    "updates of 2,048 transitions": 320_000,
    "layers of 512, 512, 1,024": 140_000,
}


def train(core, args, name, settings, seed):
    """One run pinned to a core; its report."""
    folder = args.runs / f"{name.replace(' ', '-').replace(',', '')}-{seed}"
    report = folder / "report.json"
    if not report.is_file():
        if folder.exists():
            # Cut short before: its remains are in the way of a whole run.
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
    # No run goes on from here, and its memory fills the disk.
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
    parser.add_argument("--cores", default=None, help="cores to run on, as in 0,1; all without it")
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
        # A seed of every choice before the next seed: a series cut short is even.
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
    print("| choice | unseen routes, each seed | mean | training | updates |\n|---|---|---|---|---|")
    for row in rows.values():
        good = [run for run in row["runs"] if "failed" not in run]
        shares = [100 * run["arrived"] / run["episodes"] for run in good]
        if not shares:
            print(f"| {row['choice']} | no run ended | | | |")
            continue
        each = ", ".join(f"{share:.1f}" for share in shares)
        training = statistics.mean(100 * run["training_success"] for run in good)
        updates = statistics.mean(run["updates"] for run in good)
        print(f"| {row['choice']} | {each} | {statistics.mean(shares):.1f} % | {training:.1f} % | {updates:,.0f} |")


if __name__ == "__main__":
    main()
