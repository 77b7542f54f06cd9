#!/usr/bin/env python3
"""Trains on random roads with loads, one choice changed at a time, and prints how it drives on the validation roads.

No test route and no measured roundabout is looked at. Each run gets the same env steps and is pinned to one core; its
policy is examined once, at the end, with four episodes on each validation route. A run that has a report is not repeated,
so an interrupted series can go on. Standard library only.

    python3 benches/ablations/laden.py --offtrack target/release/offtrack --json docs/benchmarks/ablations-laden.json
"""

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue

STEPS = 1_600_000
EPISODES = 4
SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"

# Name, and what is changed in the benchmarks: TABLE.KEY and its value. Rewards and endings are those that it trains with;
# it is examined with those of laden2026.
AT_ONE = {"ending.rollover_ratio": 1.0}
CHOICES = [
    ("as laden2026-training: rolled over from 0.85 on", {}),
    ("rolled over from 1 on", AT_ONE),
    (
        "from 1 on, load transfer above 0.7: -100",
        {**AT_ONE, "reward.load_transfer": -100.0, "reward.load_transfer_margin": 0.7},
    ),
    ("from 1 on, rollover -500", {**AT_ONE, "reward.rollover": -500.0}),
    ("rolled over from 0.75 on", {"ending.rollover_ratio": 0.75}),
    ("time -5", {"reward.time": -5.0}),
    ("lateral acceleration -20", {"reward.lateral_acceleration": -20.0}),
    ("jerk -10", {"reward.jerk": -10.0}),
    ("blind", {"observation.extras": '"blind"'}),
    ("oracle", {"observation.extras": '"oracle"'}),
    ("no extras", {"observation.extras": '"none"'}),
    ("changes of speed", {"actions.speed_changes_kmh": [-5.0, 0.0, 5.0]}),
]


def changed(text, changes):
    """A benchmark's text with other values, and with paths that hold in any folder."""
    for path, value in changes.items():
        table, key = path.split(".")
        head, rest = text.split(f"[{table}]\n", 1)
        rest = re.sub(rf"^{key} = .*\n", "", rest, count=1, flags=re.MULTILINE)
        text = f"{head}[{table}]\n{key} = {value}\n{rest}"
    return re.sub(r'^(file|distribution) = "(.*)"$', rf'\1 = "{SCENARIOS}/\2"', text, flags=re.MULTILINE)


def write_benchmarks(folder, name, changes):
    """The two benchmarks of a choice: to train on, and to be examined on."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for base in ["training", "random"]:
        own = {
            path: value
            for path, value in changes.items()
            if base == "training" or not path.startswith(("reward.", "ending."))
        }
        file = folder / f"{name}-{base}.toml"
        file.write_text(changed((SCENARIOS / f"laden2026-{base}.toml").read_text(), own))
        files.append(file)
    return files


def finished(command, core):
    """Runs a command on a core; the last line of its errors where it fails."""
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=lambda: os.sched_setaffinity(0, {core}))
    return None if done.returncode == 0 else done.stderr.strip().splitlines()[-1]


def run(core, args, choice, changes, seed):
    """One run and its examination; returns its row of the result."""
    name = re.sub(r"[^a-z0-9.]+", "-", choice)
    training, examined = write_benchmarks(args.runs / "scenarios", name, changes)
    folder = args.runs / f"{name}-{seed}"
    report, evaluation = folder / "report.json", args.runs / f"{name}-{seed}.json"
    if not report.is_file():
        if folder.exists():
            # It was interrupted before: a new run cannot use its folder.
            subprocess.run(["rm", "-r", str(folder)], check=True)
        command = [str(args.offtrack), "train", "best", "--name", folder.name, "--out", str(args.runs)]
        command += ["--seed", str(seed), "--steps", str(STEPS)]
        for key, value in [
            ("benchmark", training),
            ("training_benchmark", training),
            ("also_evaluate", ""),
            ("validation", ""),
        ]:
            command += ["--set", f"{key}={value}"]
        if failure := finished(command, core):
            return {"seed": seed, "failed": failure}
    # Nothing resumes this run, and the replay buffer in its checkpoint fills the disk.
    (folder / "checkpoint.safetensors").unlink(missing_ok=True)
    if not evaluation.is_file():
        command = [str(args.offtrack), "evaluate", "--benchmark", str(examined), "--split", "validation"]
        command += [
            "--policy",
            str(folder / "policy.safetensors"),
            "--episodes",
            str(EPISODES),
            "--json",
            str(evaluation),
        ]
        if failure := finished(command, core):
            return {"seed": seed, "failed": failure}
    trained, found = json.loads(report.read_text()), json.loads(evaluation.read_text())
    classes = found["classes"]
    high = [one for one in classes if one["load"] == "laden_high"]
    total = sum(one["episodes"] for one in high)
    mean = lambda key: sum((one[key] or 0.0) * one["episodes"] for one in high) / total
    return {
        "seed": seed,
        "env_steps": trained["env_steps"],
        "seconds": round(trained["seconds"], 1),
        "arrived": found["arrived"],
        "episodes": found["episodes"],
        "rolled_over": sum(one["rolled_over"] for one in classes),
        "laden_high": {
            "arrived": sum(one["arrived"] for one in high),
            "episodes": total,
            "rolled_over": sum(one["rolled_over"] for one in high),
            "load_transfer_ratio_p99": mean("load_transfer_ratio_p99"),
            "time_over_feasible_mean": mean("time_over_feasible_mean"),
            "lateral_acceleration_p95": mean("lateral_acceleration_p95"),
        },
        "jerk_p95": statistics.mean(one["jerk_p95"] for one in classes),
        "machine": trained["machine"],
        "commit": trained["commit"],
    }


def table(rows):
    """The rows as a Markdown table."""
    heads = [
        "choice",
        "arrived, each seed",
        "mean",
        "rolled over",
        "of laden_high: arrived",
        "LTR p99",
        "time",
        "lateral p95 [g]",
    ]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for row in rows:
        good = [one for one in row["runs"] if "failed" not in one]
        if not good:
            lines.append(f"| {row['choice']} | no run ended |" + " |" * (len(heads) - 2))
            continue
        rates = [100 * one["arrived"] / one["episodes"] for one in good]
        high = [one["laden_high"] for one in good]
        mean = lambda key: statistics.mean(one[key] for one in high)
        cells = [
            row["choice"],
            ", ".join(f"{rate:.1f}" for rate in rates),
            f"{statistics.mean(rates):.1f} %",
            ", ".join(str(one["rolled_over"]) for one in good),
            f"{statistics.mean(100 * one['arrived'] / one['episodes'] for one in high):.1f} %",
            f"{mean('load_transfer_ratio_p99'):.2f}",
            f"{mean('time_over_feasible_mean'):.2f}",
            f"{mean('lateral_acceleration_p95'):.2f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--offtrack", type=Path, default=Path("target/release/offtrack"))
    parser.add_argument("--seeds", default="0,1,2", help="seeds of each choice")
    parser.add_argument("--choice", action="append", help="only this choice; may be given several times")
    parser.add_argument("--cores", default=None, help="cores to run on, as in 0,1; default: all")
    parser.add_argument("--runs", type=Path, default=Path("runs/ablations-laden"))
    parser.add_argument("--json", type=Path, required=True)
    args = parser.parse_args()
    names = [name for name, _ in CHOICES]
    if unknown := [name for name in args.choice or [] if name not in names]:
        parser.error(f"--choice: {unknown[0]!r}; must be one of {names}")
    available = [int(core) for core in args.cores.split(",")] if args.cores else sorted(os.sched_getaffinity(0))
    cores = Queue()
    for core in available:
        cores.put(core)
    args.offtrack, args.runs = args.offtrack.resolve(), args.runs.resolve()
    wanted = [choice for choice in CHOICES if args.choice is None or choice[0] in args.choice]

    def job(choice, changes, seed):
        core = cores.get()
        try:
            return run(core, args, choice, changes, seed)
        finally:
            cores.put(core)

    with ThreadPoolExecutor(len(available)) as pool:
        # One seed of every choice before the next seed: an interrupted series has as many of each.
        seeds = [int(seed) for seed in args.seeds.split(",")]
        jobs = {(name, seed): pool.submit(job, name, changes, seed) for seed in seeds for name, changes in wanted}
        rows = {name: {"choice": name, "changes": changes, "runs": []} for name, changes in wanted}
        for (name, seed), running in jobs.items():
            result = running.result()
            rows[name]["runs"].append(result)
            print(name, json.dumps(result), file=sys.stderr, flush=True)
            whole = {"cores_per_run": 1, "steps": STEPS, "episodes_per_route": EPISODES, "choices": list(rows.values())}
            temporary = args.json.with_suffix(".tmp")
            temporary.write_text(json.dumps(whole, indent=1) + "\n")
            temporary.replace(args.json)
    print(table(rows.values()))


if __name__ == "__main__":
    main()
