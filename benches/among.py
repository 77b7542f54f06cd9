#!/usr/bin/env python3
"""Drives policies among other vehicles, on every benchmark of them, and writes one JSON file.

Standard library only.

    python3 benches/among.py --json docs/results/traffic.json

With --benchmarks or --policies those alone are driven, and what the file has of the others stays: rows have the commit
that they were driven at. Policies of one's own go into a file of their own:

    python3 benches/among.py --policies yields:runs/traffic-1/policy.safetensors \\
        --benchmarks traffic2026 traffic2026-random --json docs/results/traffic-seeds.json
"""

import argparse
import datetime
import json
import shlex
import tempfile
from pathlib import Path

from ablations.series import evaluation, rounded, write_json

ROOT = Path(__file__).resolve().parents[1]
POLICIES = ["yields:traffic2026", "traffic2026", "yields", "follows"]
# The episodes on each route.
BENCHMARKS = {
    "traffic2026": 120,
    "traffic2026-random": 2,
    "traffic2026-rude": 120,
    "traffic2026-aggressive": 30,
    "traffic2026-timid": 30,
    "traffic2026-distracted": 30,
    "traffic2026-laden": 120,
    "traffic2026-large": 120,
    "traffic2026-maps": 30,
}
# Where the starts of what did not arrive are searched on the empty road, and of which policies.
CERTIFIED = ["traffic2026", "traffic2026-random"]
SEARCHED = ["yields:traffic2026", "traffic2026"]
# Whether polite vehicles are ever at fault.
POLITE = ("traffic2026", ["yields", "follows"], 435)
# Without other vehicles: the same benchmark with another demand.
EMPTY = ("traffic2026", "demand = [300.0, 900.0, 1500.0, 2100.0]", "demand = [0.0]", 30)
FIGURES = [
    *["episodes", "arrived", "success", "success_low", "success_high", "ends", "time_mean", "lane_distance_mean"],
    *["success_low_over_routes", "success_high_over_routes", "among_vehicles"],
]


BY_DEMAND = ["episodes", "arrived", "success", "time_mean"]
POSSIBLE = ["searched", "found", "passes"]
AMONG_BY_DEMAND = ["standing_mean", "blocked", "braking_mean", "lane_classes"]


def kept(figures, keys):
    return {key: figures[key] for key in keys if key in figures}


def write(file, result):
    """Writes the file, a figure a line: there are many."""
    write_json(file, rounded(result), indent=0)


def driven(offtrack, policy, benchmark, episodes):
    """The report of a policy on the test routes of a benchmark."""
    certify = ["--certify", "--widths", "64"] if benchmark in CERTIFIED and policy in SEARCHED else []
    return evaluation(offtrack, "--policy", policy, "--benchmark", benchmark, "--episodes", episodes, *certify)


def row(name, benchmark, report):
    """What is kept of a report, printed as it comes."""
    by_demand = {
        group["name"]: kept(group, BY_DEMAND) | kept(group.get("among_vehicles") or {}, AMONG_BY_DEMAND)
        for group in report["groups"].get("demand", [])
    }
    levels = ", ".join(f"{demand} {100 * figures['success']:.1f} %" for demand, figures in by_demand.items())
    print(f"{name}, {benchmark}: {report['arrived']} of {report['episodes']}; {levels}", flush=True)
    causes = {cause["cause"]: cause["episodes"] for cause in report["failures"][:8]}
    found = {"commit": report["commit"], **kept(report, FIGURES), "by_demand": by_demand, "causes": causes}
    if "possible" in report:
        of_demands = {group["name"]: kept(group, BY_DEMAND) for group in report["possible"]["demand"]}
        found["possible"] = kept(report["possible"], [*POSSIBLE, *BY_DEMAND]) | {"by_demand": of_demands}
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--offtrack", default=str(ROOT / "target/release/offtrack"), help="the program")
    parser.add_argument("--json", type=Path, required=True, help="file to write")
    parser.add_argument("--benchmarks", nargs="+", choices=BENCHMARKS, help="these alone")
    parser.add_argument("--policies", nargs="+", help="these of the program's, or files in place of them")
    args = parser.parse_args()
    names = args.policies or POLICIES
    shipped = set(names) <= set(POLICIES)
    result = {
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "command": "python3 benches/among.py --json docs/results/traffic.json",
        "episodes_a_route": BENCHMARKS,
    }
    if not shipped:
        benchmarks = ["--benchmarks", *args.benchmarks] if args.benchmarks else []
        words = ["--policies", *names, *benchmarks, "--json", f"docs/results/{args.json.name}"]
        result["command"] = shlex.join(["python3", "benches/among.py", *words])
    elif args.policies or args.benchmarks:
        if not args.json.is_file():
            parser.error(f"--json: {args.json}; is not there to keep rows of: leave out --policies and --benchmarks")
        result = json.loads(args.json.read_text()) | result
    policies = {name: result.get(name, {}) for name in names}
    for benchmark in args.benchmarks or BENCHMARKS:
        for name, rows in policies.items():
            report = driven(args.offtrack, name, benchmark, BENCHMARKS[benchmark])
            rows[benchmark] = row(name, benchmark, report)
            result |= {"commit": report["commit"], "machine": report["machine"]}
            write(args.json, {**result, **policies})
    if args.benchmarks or not shipped:
        return
    benchmark, polite, episodes = POLITE
    for name in [name for name in polite if name in policies]:
        policies[name]["polite"] = row(name, f"{episodes} episodes", driven(args.offtrack, name, benchmark, episodes))
    base, demand, none, episodes = EMPTY
    scenarios = ROOT / "scenarios"
    text = (scenarios / f"{base}.toml").read_text()
    assert demand in text, f"{base} has another demand"
    # Beside the others, since it names roads and vehicles by where they lie.
    with tempfile.NamedTemporaryFile("w", dir=scenarios, prefix=".empty-", suffix=".toml") as file:
        file.write(text.replace(demand, none))
        file.flush()
        for name, rows in policies.items():
            rows["empty"] = row(name, "empty", driven(args.offtrack, name, file.name, episodes))
    write(args.json, {**result, **policies})


if __name__ == "__main__":
    main()
