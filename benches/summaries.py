#!/usr/bin/env python3
"""Summarises the reports of a series of runs, which docs/data/ keeps in one archive each, into docs/results/.

    python3 benches/summaries.py            # writes docs/results/*.json
    python3 benches/summaries.py --check    # fails if one of them is not what this script writes

A figure over several seeds has the mean, the worst and Student's 95 % interval of the mean. Dates are those of the
members of the archives: the days on which the reports were committed. A result has the commit of the program or, where
no report names it, that with which the reports came.
"""

import argparse
import datetime
import json
import math
import sys
import tarfile
from pathlib import Path

from ablations.series import rounded

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "docs/data"
RESULTS = ROOT / "docs/results"
# Student's t for a 95 % interval, by the number of seeds.
STUDENT = {2: 12.706, 3: 4.303, 4: 3.182, 5: 2.776}
# Commits with which reports came that do not name the one of the program, by a member of the archive.
REPORTED = {
    "evaluate-pursuit": "c10db4f3ebc1",
    "evaluate-pursuit-planned": "39d3c330488a",
    "laden-high-100000": "b0d6e9d563ab",
}
LOADS = ["empty", "half", "laden", "laden_high"]


class Archive:
    """The JSON members of an archive, by name without ending."""

    def __init__(self, name):
        self.path = DATA / f"{name}.tar.xz"
        with tarfile.open(self.path) as archive:
            members = [member for member in archive if member.name.endswith(".json")]
            self.members = {member.name[:-5]: json.load(archive.extractfile(member)) for member in members}
            self.time = max(member.mtime for member in members)

    def __getitem__(self, name):
        return self.members[name]

    def head(self, commands, reports):
        date = datetime.datetime.fromtimestamp(self.time, datetime.timezone.utc).date().isoformat()
        found = {key: sorted({report[key] for report in reports if report.get(key)}) for key in ["machine", "commit"]}
        if not found["commit"]:
            del found["commit"]
            found["reported_in"] = sorted(REPORTED[name] for name in REPORTED if self.members.get(name) in reports)
        return {"commands": commands, "date": date, **found, "archive": self.path.relative_to(ROOT).as_posix()}


def brief(report):
    """What is kept of an evaluation."""
    short = {key: report[key] for key in ["benchmark", "split", "policy", "episodes", "arrived"] if key in report}
    if "/" in short.get("policy", ""):
        del short["policy"]  # a path of the machine that it was driven on
    short |= {key: rounded(report[key]) for key in ["success", "success_low", "success_high"] if key in report}
    if "ends" in report:
        short["failures"] = {end: n for end, n in report["ends"].items() if end != "arrived" and n}
    if report.get("lost_at_start"):
        short["lost_at_start"] = report["lost_at_start"]
    if "lane_distance_mean_arrived" in report:
        short["lane_distance"] = rounded(report["lane_distance_mean_arrived"])
    own = report.get("own_lane_suffices")
    if own:
        short["lane_distance_where_the_own_lane_suffices"] = rounded(own["lane_distance_mean_arrived"])
    if "possible" in report:
        keys = ["episodes", "arrived", "searched", "found"]
        short["possible"] = {key: report["possible"][key] for key in keys}
    for group, name in [("island_radius", "below 9 m"), ("lane", "right")]:
        for row in report.get("groups", {}).get(group, []):
            if row["name"] == name:
                short[f"{group} {name}"] = {"episodes": row["episodes"], "arrived": row["arrived"]}
    if "classes" in report:
        short["loads"] = loads(report["classes"])
    return short


def loads(classes):
    """Sums and extremes over the vehicles, for each load."""
    table = {}
    for load in LOADS:
        rows = [row for row in classes if row["load"] == load]
        if rows:
            table[load] = {
                "episodes": sum(row["episodes"] for row in rows),
                "arrived": sum(row["arrived"] for row in rows),
                "rolled_over": sum(row["rolled_over"] for row in rows),
                "load_transfer_ratio_p99": rounded(max(row["load_transfer_ratio_p99"] for row in rows)),
                "time_over_feasible": rounded(max(row["time_over_feasible_mean"] or 0.0 for row in rows)),
                "lateral_acceleration_p95": rounded(max(row["lateral_acceleration_p95"] for row in rows)),
            }
    return table


def over_seeds(values):
    mean = sum(values) / len(values)
    table = {"mean": rounded(mean), "worst": rounded(min(values))}
    if 1 < len(values):
        deviation = math.sqrt(sum((value - mean) ** 2 for value in values) / (len(values) - 1))
        half = STUDENT[len(values)] * deviation / math.sqrt(len(values))
        table |= {"low": rounded(max(0.0, mean - half)), "high": rounded(min(1.0, mean + half))}
    return table


def joined(runs):
    """Runs of seeds, each a list of evaluations in one order, joined by evaluation."""
    evaluations = []
    for reports in zip(*(reports for _, reports in runs)):
        shorts = [brief(report) for report in reports]
        table = {key: shorts[0][key] for key in ["benchmark", "split"] if key in shorts[0]}
        table |= over_seeds([short["arrived"] / short["episodes"] for short in shorts])
        possible = [short["possible"] for short in shorts if "possible" in short]
        if len(possible) == len(shorts):
            table["possible"] = over_seeds([row["arrived"] / row["episodes"] for row in possible])
        for (seed, _), short in zip(runs, shorts):
            for key in ["benchmark", "split", "policy"]:
                short.pop(key, None)
            short["seed"] = seed
        table["seeds"] = [{"seed": short.pop("seed"), **short} for short in shorts]
        evaluations.append(table)
    return evaluations


def series(archive, prefix, seeds, commands, further=lambda seed: []):
    """Runs of one training file: its evaluations of each seed, and further ones."""
    reports = [archive[f"{prefix}{seed}"] for seed in seeds]
    runs = [
        (seed, [report["evaluation"], *report.get("also", []), *further(seed)]) for seed, report in zip(seeds, reports)
    ]
    return {
        **archive.head(commands, reports),
        "seconds": {seed: round(report["seconds"]) for seed, report in zip(seeds, reports)},
        "env_steps": max(report["env_steps"] for report in reports),
        "evaluations": joined(runs),
    }


def rows(archive, commands, names):
    """Evaluations that stand side by side."""
    reports = [archive[name] for name in names]
    return {**archive.head(commands, reports), "rows": {name: brief(archive[name]) for name in names}}


def default_run():
    archive = Archive("default-run")
    first = series(archive, "zero-shot-", [0], ["offtrack train"])
    return series(archive, "zero-shot-", range(80, 85), ["offtrack train --seeds 80..84"]) | {"seed_0": first}


def long_run():
    archive = Archive("long-run")
    certified = archive["best-certified"]

    def further(seed):
        measured = [certified[str(seed)][f"attard2023-full-{split}"] for split in ["test", "train"]]
        return [*measured, certified[str(seed)]["validation"], archive[f"best-{seed}-random2026-1000"]]

    commands = [
        "offtrack train best --seeds 240..244",
        "offtrack evaluate --benchmark attard2023-full --policy FILE --certify, and with --split train",
        "offtrack evaluate --benchmark random2026 --split validation --policy FILE --episodes 20",
        "offtrack evaluate --benchmark random2026-1000 --policy FILE --episodes 1 --certify",
    ]
    return series(archive, "best-", range(240, 245), commands, further)


def shipped():
    commands = [
        "offtrack evaluate --benchmark random2026 --split train --episodes 4 --certify",
        "offtrack evaluate --benchmark random2026 --split validation --episodes 20 --certify",
    ]
    return rows(Archive("long-run"), commands, ["shipped-training-roads", "shipped-validation-roads"])


def refinement():
    archive = Archive("refinement")
    commands = [
        "offtrack train lane --from board/best-71.safetensors --seed 150, 151, 152",
        "offtrack evaluate --benchmark attard2023-full --policy FILE --certify, and with --split train",
        "offtrack evaluate --benchmark random2026 --policy FILE --episodes 1 --certify",
        "offtrack evaluate --benchmark random2026 --split validation --policy FILE --episodes 20",
    ]
    certified = archive["lane-certified"]
    summary = series(archive, "lane-", [150, 151, 152], commands)
    summary["possible"] = {
        name: over_seeds([row[name]["arrived"] / row[name]["episodes"] for row in certified.values()])
        | {"seeds": {seed: {key: row[name][key] for key in ["episodes", "arrived"]} for seed, row in certified.items()}}
        for name in certified["150"]
    }
    return summary


def one_policy():
    archive = Archive("one-policy")
    tables = archive["distilled-260-261-certified"] | archive["distilled-270-certified"]
    reports = [report for table in tables.values() for report in table.values()]
    teachers = "offtrack train best --seed 242 --name best-242"
    commands = [
        teachers,
        "offtrack train lane --seed 900 --steps 30000000 --from runs/best-242/policy.safetensors --name near-242",
        "offtrack train lane --seed 900 --steps 36000000 --from runs/near-242/policy.safetensors "
        "--set refinement.reward.lane_distance=-90 --name nearer-242",
        "python python/examples/distil.py NEAR BEST --seed 260, 261",
        "python python/examples/distil.py NEARER NEAR BEST --seed 270",
    ]
    head = archive.head(commands, reports)
    two = [(seed, list(tables[str(seed)].values())) for seed in [260, 261]]
    third = {name: brief(report) for name, report in tables["270"].items()}
    return {**head, "evaluations": joined(two), "seed_270, refined twice": third}


def study_routes():
    return series(Archive("study-routes"), "attard-", [86, 87, 88], ["offtrack train attard --seeds 86..88"])


def as_run():
    return series(Archive("as-run"), "as-run-", [20, 21, 22], ["offtrack train as-run --seeds 20..22"])


def driven(driver):
    """Loads of one driver on one set of routes, from one report a load."""
    return loads([row for report in driver for row in report["classes"]])


def loads_30():
    archive = Archive("loads")
    reports = [row["report"] for row in archive["laden"]]
    commands = [
        "offtrack train laden --seeds 220..224",
        "python3 benches/loads.py --policies runs/laden --baselines --json FILE",
        "offtrack evaluate --benchmark laden2026-random --split validation --policy FILE --episodes 20, "
        "and with --load laden_high --episodes 130 --seed 1",
    ]
    summary = archive.head(commands, reports) | {"drivers": {}, "validation": {}}
    for row in archive["laden"]:
        places = summary["drivers"].setdefault(row["driver"], {})
        places.setdefault(row["place"], []).append(row["report"])
    for places in summary["drivers"].values():
        for place in places:
            places[place] = driven(places[place])
    seeds = [places for driver, places in summary["drivers"].items() if driver.startswith("seed-")]
    summary["over_seeds"] = {
        place: {
            load: over_seeds([places[place][load]["arrived"] / places[place][load]["episodes"] for places in seeds])
            | {"rolled_over": sum(places[place][load]["rolled_over"] for places in seeds)}
            for load in LOADS
        }
        for place in seeds[0]
    }
    runs = [archive[f"laden-{seed}"] for seed in range(220, 225)]
    summary["lane_distance"] = {}
    for place in [["laden2026", "test"], ["laden2026", "train"], ["laden2026-random", "test"]]:
        reports = [report for run in runs for report in [run["evaluation"], *run["also"]]]
        found = [
            report["lane_distance_mean_arrived"]
            for report in reports
            if [report["benchmark"], report["split"]] == place
        ]
        distances = {
            "mean": rounded(sum(found) / len(found)),
            "of each seed": [rounded(distance) for distance in found],
        }
        summary["lane_distance"]["/".join(place)] = distances
    for row in archive["laden-validation"]:
        summary["validation"][row["seed"]] = {name: brief(row[name]) for name in ["every load", "laden_high"]}
    return summary


def loads_shipped():
    commands = [
        "offtrack evaluate --benchmark laden2026-random --load laden_high --episodes 54 --seed 1",
        "offtrack evaluate --benchmark laden2026-random --episodes 4 --certify",
    ]
    return rows(Archive("loads"), commands, ["laden-high-100000", "laden-certified"])


def loads_50():
    archive = Archive("loads-50")
    commands = [
        "offtrack train laden-50 --seeds 110..112",
        "offtrack evaluate --benchmark laden2026-50-random --episodes 1 --certify (the shipped one)",
    ]
    summary = series(archive, "laden-50-", [110, 111, 112], commands)
    return summary | {"shipped, certified": brief(archive["laden-50-certified"])}


def baselines():
    pursuit = "offtrack evaluate --policy pursuit"
    commands = [
        f"{pursuit}, and with --split train",
        f"{pursuit} --line certified-attard2023-full.json (of docs/data/certificates.tar.xz), and with --split train",
        "offtrack evaluate --policy random",
    ]
    archive = Archive("baselines")
    return rows(archive, commands, sorted(archive.members))


def certificates():
    archive = Archive("certificates")
    commands = [
        "offtrack certify --benchmark attard2023-full, attard2023-maps-full",
        "offtrack certify --benchmark attard2023-as-run, attard2023-maps-as-run --hold 5",
    ]
    summary = archive.head(commands, list(archive.members.values())) | {"rows": {}}
    for report in archive.members.values():
        found = [[start["ended"] == "arrived" for start in route["found"]] for route in report["routes"]]
        summary["rows"][report["benchmark"]] = {
            "routes": len(found),
            "starts": sum(map(len, found)),
            "starts_completed": sum(map(sum, found)),
            "routes_from_the_lane_centre": sum(starts[0] for starts in found),
            "routes_from_all_starts": sum(map(all, found)),
            "env_steps": report["env_steps"],
            "seconds": round(report["seconds"]),
        }
    return summary


def kerbs():
    archive = Archive("kerbs")
    return rows(archive, ["offtrack evaluate --benchmark B --split S --policy P"], sorted(archive.members))


def maps():
    archive = Archive("maps")
    commands = ["offtrack evaluate --benchmark maps2026 --certify, maps2026-crossing"]
    summary = rows(archive, commands, ["maps2026", "maps2026-crossing"])
    for name, row in summary["rows"].items():
        keys = ["name", "routes", "episodes", "arrived", "lost_at_start"]
        groups = archive[name]["groups"]["roundabout"]
        row["roads"] = [{key: group[key] for key in keys if key in group} for group in groups]
    return summary


SUMMARIES = {
    "default-run": default_run,
    "long-run": long_run,
    "shipped": shipped,
    "refinement": refinement,
    "one-policy": one_policy,
    "study-routes": study_routes,
    "as-run": as_run,
    "loads": loads_30,
    "loads-shipped": loads_shipped,
    "loads-50": loads_50,
    "baselines": baselines,
    "certificates": certificates,
    "kerbs": kerbs,
    "maps": maps,
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    differ = []
    for name, summarise in SUMMARIES.items():
        text = json.dumps(summarise(), indent=1) + "\n"
        file = RESULTS / f"{name}.json"
        if not args.check:
            file.write_text(text)
        elif not file.is_file() or file.read_text() != text:
            differ.append(file.name)
    print(f"{len(SUMMARIES)} summaries" + (f"; differ: {', '.join(differ)}" if differ else ""))
    sys.exit(bool(differ))


if __name__ == "__main__":
    main()
