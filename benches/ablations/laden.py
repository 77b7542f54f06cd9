#!/usr/bin/env python3
"""Trains on random roads with loads, one choice changed at a time, and prints how it drives on the validation roads.

No test route and no measured roundabout is looked at. Each run gets the same env steps and is pinned to one core; its
policy is evaluated once, at the end, with four episodes on each validation route. With --full it is a run of
learner/configs/laden.toml as that file is, which keeps the best policy in its validations, and it is evaluated with 20
episodes. A run that has a report is not repeated, so an interrupted series can go on. Standard library only.

    python3 benches/ablations/laden.py --offtrack target/release/offtrack --json ablations-laden.json
"""

import argparse
import json
import re
import statistics

import series

# Env steps of a run, and episodes on each validation route, without --full and with it.
STEPS, FULL_STEPS = 1_600_000, 12_800_000
EPISODES, FULL_EPISODES = 4, 20

# What all choices have in common on top of learner/configs/laden.toml without --full, so that the table stays what it
# is when that file changes.
COMMON = [
    "reward=",
    "level_replay=",
    "learning.layer_norm=false",
    "learning.actor_ema_rate=0.005",
    "learning.final_learning_rate_fraction=0.1",
    "learning.arrival=",
]
# Name, and what is changed in the benchmarks: TABLE.KEY and its value. Endings are those that it trains with; it is
# evaluated with those of laden2026.
CHOICES = [
    ("as laden2026-training: rolled over from 0.75 on", {}),
    ("rolled over from 0.85 on", {"ending.rollover_ratio": 0.85}),
    ("rolled over from 1 on", {"ending.rollover_ratio": 1.0}),
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
    return series.with_paths(text)


def write_benchmarks(folder, name, changes):
    """The two benchmarks of a choice: to train on, and to be evaluated on."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for base in ["training", "random"]:
        own = {path: value for path, value in changes.items() if base == "training" or not path.startswith("ending.")}
        file = folder / f"{name}-{base}.toml"
        file.write_text(changed((series.SCENARIOS / f"laden2026-{base}.toml").read_text(), own))
        files.append(file)
    return files


def run(core, args, choice, changes, seed):
    """One run and its evaluation; returns its row of the result."""
    name = series.folder_name(choice)
    training, evaluated = write_benchmarks(args.runs / "scenarios", name, changes)
    folder = args.runs / f"{name}-{seed}"
    evaluation = args.runs / f"{name}-{seed}.json"
    settings = [f"benchmark={training}", f"training_benchmark={training}", "also_evaluate="]
    settings += [f"validation.benchmark={evaluated}"] if args.full else ["validation=", *COMMON]
    if failure := series.trained(core, args, folder, "laden", seed, args.steps, settings):
        return {"seed": seed, "failed": failure}
    if not evaluation.is_file():
        command = [str(args.offtrack), "evaluate", "--benchmark", str(evaluated), "--split", "validation"]
        command += [
            "--policy",
            str(folder / "policy.safetensors"),
            "--episodes",
            str(args.episodes),
            "--json",
            str(evaluation),
        ]
        if failure := series.finished(command, core):
            return {"seed": seed, "failed": failure}
    trained, found = json.loads((folder / "report.json").read_text()), json.loads(evaluation.read_text())
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
    full = argparse.ArgumentParser(add_help=False)
    full.add_argument("--full", action="store_true", help="runs of laden.toml as it is")
    args = series.arguments(__doc__, "runs/ablations-laden", [name for name, _ in CHOICES], full)
    args.steps, args.episodes = (FULL_STEPS, FULL_EPISODES) if args.full else (STEPS, EPISODES)
    choices = {name: changes for name, changes in CHOICES if args.choice is None or name in args.choice}
    wanted = {name: {"choice": name, "changes": changes, "runs": []} for name, changes in choices.items()}
    one = lambda core, name, seed: run(core, args, name, choices[name], seed)
    series.run_all(args, wanted, one, {"steps": args.steps, "episodes_per_route": args.episodes}, table)


if __name__ == "__main__":
    main()
