#!/usr/bin/env python3
"""Examines policies by load on the benchmarks with loads, and prints how they drive as Markdown tables.

Each policy drives every load on its own: the routes of laden2026 (30 episodes each) and of laden2026-random (four
each), none of which a policy of learner/configs/laden.toml has seen. The baselines are pure pursuit by the feasible speed
profile, of the lane's centre and of paths that a search found, and a policy of attard2023, which knows neither loads
nor speeds, at 30 and at 20 km/h. What the JSON file already has is not evaluated again, so an interrupted series can
go on. Standard library only.

    python3 benches/loads.py --policies runs/laden --json laden.json
"""

import argparse
import json
import re
import struct
import sys
import tempfile
import zlib
from pathlib import Path

from ablations.series import SCENARIOS, evaluation, finish, with_paths, write_json

ROOT = Path(__file__).resolve().parents[1]
LOADS = ["empty", "half", "laden", "laden_high"]
# Benchmark, split, episodes on each route, and what the table calls it. With one episode on each of the 748 random
# routes it would be chance, of 0.3 %, whether a driver that arrives in 99.3 % reaches 99 %.
PLACES = [
    ("laden2026", "test", 30, "23 unseen routes"),
    ("laden2026", "train", 30, "52 training routes of the study"),
    ("laden2026-random", "test", 4, "100 random roads"),
]
ODD = ("laden2026-odd", "test", 30, "unseen routes, odd vehicles")
# Look-ahead distance of pure pursuit [m]: the best of 7, 9, 12 and 15 m on the training roads of laden2026-random.
LOOK_AHEAD = "12"
# The same for the paths that a search found, as wide as this: the best of 7, 8, 9, 10 and 12 m on five of those roads.
PLANNED_LOOK_AHEAD = "10"
PLANNED_WIDTHS = "64,512"
PLANNED = "pursuit of a planned line"


def evaluated(offtrack, benchmark, split, episodes, load, policy, more=()):
    """The report of a policy with a load, without its lists of routes."""
    flags = ["--benchmark", benchmark, "--split", split, "--load", load, "--episodes", episodes, "--policy", policy]
    return condensed(evaluation(offtrack, *flags, *more))


def condensed(report):
    keys = [
        "benchmark",
        "split",
        "seed",
        "episodes",
        "arrived",
        "lane_distance_mean",
        "machine",
        "device",
        "commit",
        "classes",
    ]
    return {key: report[key] for key in keys if key in report}


def line(offtrack, folder, benchmark, split, load):
    """A certificate with the paths that a search finds with a load: from the lane's centre and from four corners."""
    file = Path(folder) / f"{benchmark}-{split}-{load}.json"
    command = [str(offtrack), "certify", "--benchmark", benchmark, "--split", split, "--load", load]
    finish([*command, "--widths", PLANNED_WIDTHS, "--json", str(file)])
    return file


def at_one_speed(folder, base, kmh):
    """A benchmark with loads for one target speed, without extras: all that a policy of attard2023 knows."""
    text = (SCENARIOS / f"{base}.toml").read_text()
    text = re.sub(r"^speeds_kmh = .*$", f"speeds_kmh = [{kmh}.0]", text, flags=re.MULTILINE)
    text = re.sub(r"^speed_kmh = .*$", f"speed_kmh = {kmh}.0", text, flags=re.MULTILINE)
    text = text.replace('extras = "mass"', 'extras = "none"')
    file = Path(folder) / f"{base}-{kmh}.toml"
    file.write_text(with_paths(text))
    return file


def slower(folder, kmh):
    """A policy of attard2023, seed 71 of its long run, with another target speed in its action table."""
    whole = (ROOT / "board/best-71.safetensors").read_bytes()
    (length,) = struct.unpack("<Q", whole[:8])
    header = json.loads(whole[8 : 8 + length])
    description = json.loads(header["__metadata__"]["offtrack"])
    description["actions"] = [[steering, kmh / 3.6] for steering, _ in description["actions"]]
    # docs/policies.md: a CRC-32 of the description with the checksum 0, then of the tensors in this order.
    names = ["observation.mean", "observation.factor"]
    names += [f"actor.{layer}.{part}" for layer in range(description["layers"]) for part in ["weight", "bias"]]
    description["checksum"] = 0
    checksum = zlib.crc32(json.dumps(description).encode())
    for name in names:
        first, end = header[name]["data_offsets"]
        checksum = zlib.crc32(whole[8 + length + first : 8 + length + end], checksum)
    description["checksum"] = checksum
    header["__metadata__"]["offtrack"] = json.dumps(description)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    file = Path(folder) / f"attard2023-{kmh}.safetensors"
    file.write_bytes(struct.pack("<Q", len(text)) + text + whole[8 + length :])
    return file


def jobs(args, folder):
    """Name of the driver, name of the place, load, and the evaluation that belongs to them."""
    for policy in args.policies:
        for benchmark, split, episodes, place in [*PLACES, ODD]:
            for load in LOADS:
                yield policy.parent.name, place, load, (benchmark, split, episodes, load, policy)
    if args.baselines:
        for benchmark, split, episodes, place in PLACES:
            for load in LOADS:
                job = (benchmark, split, episodes, load, "pursuit", ("--look-ahead", LOOK_AHEAD))
                yield "pursuit", place, load, job
        # With so many actions a search takes minutes for these routes and would take hours for the others.
        benchmark, split, episodes, place = PLACES[0]
        for load in LOADS:
            yield PLANNED, place, load, (benchmark, split, episodes, load, "pursuit")
        for kmh in [30, 20]:
            policy = slower(folder, kmh)
            for base, split, episodes, place in PLACES:
                benchmark = at_one_speed(folder, base, kmh)
                for load in LOADS:
                    yield f"attard2023 at {kmh} km/h", place, load, (benchmark, split, episodes, load, policy)


def merged(classes):
    """The figures of both vehicles with a load: sums, and means weighted by episodes; of LTR p99 the larger one."""
    n = sum(one["episodes"] for one in classes)
    mean = lambda key, weight: (
        sum(one[key] * one[weight] for one in classes if one[weight]) / max(sum(one[weight] for one in classes), 1)
    )
    return {
        "episodes": n,
        "arrived": sum(one["arrived"] for one in classes),
        "rolled_over": sum(one["rolled_over"] for one in classes),
        "p99": max(one["load_transfer_ratio_p99"] for one in classes),
        "time": mean("time_over_feasible_mean", "arrived"),
        "speed": mean("speed_mean_kmh", "episodes"),
        "lateral": max(one["lateral_acceleration_p95"] for one in classes),
    }


def tables(results):
    """For each place a table with a row a driver: what arrives of each load, and the figures of all loads together."""
    lines = []
    heads = [
        "driver",
        *LOADS,
        "rolled over",
        "LTR p99, laden_high",
        "time, most of a load",
        "lateral p95, laden loads [g]",
    ]
    for place in dict.fromkeys(row["place"] for row in results):
        lines += [f"**{place}**", "", "| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
        at_place = [row for row in results if row["place"] == place]
        for driver in dict.fromkeys(row["driver"] for row in at_place):
            by_load = {row["load"]: merged(row["report"]["classes"]) for row in at_place if row["driver"] == driver}
            cells = [driver]
            for load in LOADS:
                one = by_load.get(load)
                cells.append(f"{100 * one['arrived'] / one['episodes']:.1f} %" if one else "")
            episodes = sum(one["episodes"] for one in by_load.values())
            cells.append(f"{sum(one['rolled_over'] for one in by_load.values()):,} of {episodes:,}")
            cells.append(f"{by_load['laden_high']['p99']:.2f}" if "laden_high" in by_load else "")
            cells.append(f"{max(one['time'] for one in by_load.values()):.2f}")
            laden = [one["lateral"] for load, one in by_load.items() if load.startswith("laden")]
            cells.append(f"{max(laden):.2f}" if laden else "")
            lines.append("| " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--offtrack", type=Path, default=Path("target/release/offtrack"))
    parser.add_argument("--policies", type=Path, help="folder with the runs of several seeds, or of one")
    parser.add_argument("--baselines", action="store_true", help="the baselines too")
    parser.add_argument("--json", type=Path, required=True)
    args = parser.parse_args()
    args.offtrack = args.offtrack.resolve()
    args.policies = (
        sorted(report.with_name("policy.safetensors") for report in args.policies.glob("**/report.json"))
        if args.policies
        else []
    )
    if not args.policies and not args.baselines:
        parser.error("nothing to do: --policies has no finished run, and there is no --baselines")
    results = json.loads(args.json.read_text()) if args.json.is_file() else []
    done = {(row["driver"], row["place"], row["load"]) for row in results}
    with tempfile.TemporaryDirectory() as folder:
        for driver, place, load, job in jobs(args, folder):
            if (driver, place, load) in done:
                continue
            if driver == PLANNED:
                benchmark, split, _, load, _ = job
                path = line(args.offtrack, folder, benchmark, split, load)
                job = (*job, ("--look-ahead", PLANNED_LOOK_AHEAD, "--line", str(path)))
            results.append({"driver": driver, "place": place, "load": load, "report": evaluated(args.offtrack, *job)})
            write_json(args.json, results)
            print(driver, place, load, file=sys.stderr, flush=True)
    print(tables(results))


if __name__ == "__main__":
    main()
