#!/usr/bin/env python3
"""Examines the shipped policies, at home and on trucks that are not the simulator's, and writes one JSON file.

Each drives the 23 routes of its benchmark that the study did not train on, and the same routes on the `transfer2026`
benchmark with its actions, 30 episodes each. Standard library only.

    python3 benches/elsewhere.py --json docs/results/elsewhere.json
"""

import argparse
import datetime
from pathlib import Path

from ablations.series import evaluation, write_json

ROOT = Path(__file__).resolve().parents[1]
# Shipped policy, its benchmark, and the one of trucks elsewhere with its actions.
POLICIES = [
    ("attard2023", "attard2023", "transfer2026-30kmh"),
    ("attard2023-lane", "attard2023", "transfer2026-30kmh"),
    ("attard2023-as-run", "attard2023-as-run", "transfer2026-8kmh"),
    ("laden2026", "laden2026", "transfer2026"),
    ("laden2026-50", "laden2026-50", "transfer2026-50kmh"),
    ("transfer2026", "transfer2026-attard2023", "transfer2026"),
]
KEPT = ["episodes", "arrived", "success", "success_low", "success_high", "lane_distance_mean_arrived"]


def examined(offtrack, policy, benchmark):
    """The figures of a policy on the test routes of a benchmark, and the commit of the program."""
    report = evaluation(offtrack, "--policy", policy, "--benchmark", benchmark)
    return {key: report[key] for key in KEPT if key in report}, report["commit"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--offtrack", default=str(ROOT / "target/release/offtrack"), help="the program")
    parser.add_argument("--json", type=Path, required=True, help="file to write")
    args = parser.parse_args()
    rows, commit = {}, ""
    for policy, home, elsewhere in POLICIES:
        row = {}
        for place, benchmark in [("home", home), ("elsewhere", elsewhere)]:
            figures, commit = examined(args.offtrack, policy, benchmark)
            row[place] = {"benchmark": benchmark, **figures}
        rows[policy] = row
        print(policy, *(f"{place} {100 * row[place]['success']:.1f} %" for place in row))
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    command = "python3 benches/elsewhere.py --json docs/results/elsewhere.json"
    write_json(args.json, {"date": date, "commit": commit, "command": command, "policies": rows})


if __name__ == "__main__":
    main()
