#!/usr/bin/env python3
"""Prints the results of several seeds of one training file as a Markdown table.

The last three rows are the mean over the seeds, the worst seed, and the 95 % interval of the mean.

A run with seed S has two files in the folder of results:

    STEM-S.json         report.json of the run, with the evaluation on the test routes
    STEM-S-train.json   offtrack evaluate --policy runs/NAME/policy.safetensors --split train --json FILE; optional

The interval is Student's t interval over the seeds' success rates: it says how well so few seeds determine the mean.
Standard library only.

    python3 benches/seeds.py                            # docs/benchmarks/seeds/default-11.json to default-20.json
    python3 benches/seeds.py --seeds 0,1,2 --stem as-run
"""

import argparse
import json
import statistics
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
# Quantile 0.975 of Student's t distribution with n - 1 degrees of freedom, by the number of seeds n.
STUDENT_T = {
    2: 12.706, 3: 4.303, 4: 3.182, 5: 2.776, 6: 2.571, 7: 2.447, 8: 2.365, 9: 2.306, 10: 2.262, 11: 2.228,
    12: 2.201, 13: 2.179, 14: 2.160, 15: 2.145, 16: 2.131, 17: 2.120, 18: 2.110, 19: 2.101, 20: 2.093,
}  # fmt: skip

# The table's cells, in order.
CELLS = ["seed", "test", "training", "lane", "own", "time", "updates"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=REPOSITORY / "docs/benchmarks/seeds", help="folder of the files")
    parser.add_argument("--stem", default="default", help="first part of the files' names")
    parser.add_argument("--seeds", default="11..20", help="seeds, as in 11..20 (both included) or 0,1,2")
    parser.add_argument("--links", default="seeds/", help="prefix of the links, relative to the page that shows the table")
    args = parser.parse_args()
    rows = [row(args, seed) for seed in seeds(args.seeds)]
    print("| seed | test routes | training routes | lane distance, test routes | where the own lane suffices | time | updates |")
    print("|---|---|---|---|---|---|---|")
    for each in rows:
        print("| " + " | ".join(str(each[key]) for key in CELLS) + " |")
    columns = [[each["test_success"] for each in rows], [each["training_success"] for each in rows]]
    for name, value in (("mean", mean), ("worst", worst), ("95 % interval of the mean", interval)):
        cells = [value(column) if None not in column else "" for column in columns]
        print(f"| **{name}** | {cells[0]} | {cells[1]} | | | | |")
    print()
    for key in ("machine", "commit"):
        print(f"{key}: {', '.join(sorted({each[key] for each in rows}))}")


def seeds(text):
    """The seeds that `11..20` or `0,1,2` names."""
    try:
        first, dots, last = text.partition("..")
        named = list(range(int(first), int(last) + 1)) if dots else [int(seed) for seed in text.split(",")]
    except ValueError:
        sys.exit(f"--seeds: {text}; must be a range as in 11..20, or numbers separated by commas")
    if len(named) not in STUDENT_T or len(set(named)) != len(named):
        sys.exit(f"--seeds: {text}; {min(STUDENT_T)} to {max(STUDENT_T)} different seeds are needed")
    return named


def row(args, seed):
    """What one seed came to; its training routes are left empty where they were not evaluated."""
    name = f"{args.stem}-{seed}.json"
    run = read(args.folder / name)
    test = evaluation(args.folder / name, run)
    train_name = f"{args.stem}-{seed}-train.json"
    train_file = args.folder / train_name
    training = evaluation(train_file, read(train_file)) if train_file.is_file() else None
    if run.get("seed") != seed:
        sys.exit(f"{args.folder / name}: seed: {run.get('seed')}; must be {seed}, as the file's name says")
    own = test.get("own_lane_suffices")
    return {
        "seed": seed,
        "test": link(args, test, name),
        "test_success": success(test),
        "training": link(args, training, train_name) if training else "",
        "training_success": success(training) if training else None,
        "lane": f"{test['lane_distance_mean']:.2f} m",
        "own": f"{own['lane_distance_mean']:.2f} m" if own else "",
        "time": f"{run['seconds']:.0f} s",
        "updates": f"{run['updates']:,}",
        "machine": run["machine"],
        "commit": run["commit"],
    }


def read(file):
    try:
        return json.loads(file.read_text())
    except OSError as error:
        sys.exit(f"{file}: cannot be read: {error.strerror}")
    except ValueError as error:
        sys.exit(f"{file}: not JSON: {error}")


def evaluation(file, report):
    """The evaluation in a run's report, or the report of `offtrack evaluate` itself."""
    found = report.get("evaluation", report)
    if not found or "arrived" not in found:
        sys.exit(f"{file}: has no evaluation; a run that ended by itself and `offtrack evaluate --json` write one")
    return found


def success(report):
    """Arrived episodes [%]."""
    return 100 * report["arrived"] / report["episodes"]


def link(args, report, name):
    return f"[{success(report):.1f} % ({report['arrived']}/{report['episodes']})]({args.links}{name})"


def mean(values):
    return f"{statistics.mean(values):.1f} %"


def worst(values):
    return f"{min(values):.1f} %"


def interval(values):
    """Student's t interval, cut at 0 and 100 %."""
    centre = statistics.mean(values)
    half = STUDENT_T[len(values)] * statistics.stdev(values) / len(values) ** 0.5
    return f"{max(centre - half, 0):.1f} to {min(centre + half, 100):.1f} %"


if __name__ == "__main__":
    main()
