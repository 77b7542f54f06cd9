#!/usr/bin/env python3
"""Joins what `benches/on-a-gpu.sh` measured into one file, FOLDER/on-a-gpu.json, each kernel beside its model.

    python3 benches/on_a_gpu.py FOLDER

Standard library only.
"""

import json
import re
import sys
from pathlib import Path

import model

# What is kept of a training run's report, and of each of its evaluations.
RUN = ("seed", "seconds", "env_steps", "updates", "device", "validation")
SET = ("benchmark", "split", "episodes", "arrived", "success", "success_low", "success_high")
PARTS = ("random", "random-one-a-submission", "networks", "many-roads")


def main():
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        sys.exit("the folder that benches/on-a-gpu.sh wrote is needed: python3 benches/on_a_gpu.py FOLDER")
    folder = Path(sys.argv[1])
    scales = {part: json.loads(path.read_text()) for part in PARTS if (path := folder / f"{part}.json").is_file()}
    if "random" not in scales:
        sys.exit(f"{folder}/random.json: missing; it is what `offtrack scale` writes first")
    first = scales["random"]
    kept = ("device", "machine", "threads", "commit", "date", "step")
    joined = {key: first[key] for key in kept} | {
        "command": "benches/on-a-gpu.sh",
        "devices": lines(folder / "devices.txt"),
        "memory": memory(folder / "nvidia-smi.csv"),
        "tests": tests(folder / "tests.txt"),
        "speeds": [row for part, scale in scales.items() for row in speeds(part, scale)],
        "kernels": kernels(first),
        "training": training(folder / "training"),
    }
    path = folder / "on-a-gpu.json"
    path.write_text(json.dumps(joined, indent=1) + "\n")
    print(path)


def speeds(part, scale):
    """A row for each number of trucks and mode of a part: env steps/s, or why there is none."""
    for run in scale["runs"]:
        row = {"part": part, "benchmark": scale["benchmark"], "roundabouts": scale["roundabouts"]}
        row |= {"world_bytes": scale["world_bytes"], "mode": run["mode"], "envs": run["envs"]}
        if run["mode"] == "random":
            row["steps_a_submission"] = scale["submission"]
        keys = ("env_steps_per_second", "slowest_window", "fastest_window", "bytes_per_truck", "error")
        yield row | {key: run[key] for key in keys if key in run}


def kernels(scale):
    """Each kernel's time at each number of trucks, and the model's on cards (ns a truck)."""
    runs = {str(run["envs"]): run["kernels"] for run in scale["runs"] if "kernels" in run}
    result = json.loads(model.RESULT.read_text())
    found = {card: model.modelled(result, card) for card in model.CARDS}
    modelled = {
        card: {name: [round(ns, 3) for ns in kernel["ns"]] for name, kernel in kernels.items()}
        for card, kernels in found.items()
    }
    return {"measured": runs, "modelled_low_middle_high": modelled}


def tests(path):
    """How many tests passed and failed, and the names of those that failed."""
    text = path.read_text(errors="replace") if path.is_file() else ""
    found = re.search(r"test result: \w+\. (\d+) passed; (\d+) failed", text)
    passed, failed = (int(count) for count in found.groups()) if found else (0, 0)
    return {"passed": passed, "failed": failed, "failures": re.findall(r"^test (\S+) \.\.\. FAILED", text, re.M)}


def training(folder):
    """What the training run came to, of its report."""
    path = folder / "report.json"
    if not path.is_file():
        return None
    report = json.loads(path.read_text())
    sets = [{key: row[key] for key in SET} for row in (report["evaluation"], *report.get("also", ())) if row]
    return {key: report[key] for key in RUN if key in report} | {"evaluations": sets}


def memory(path):
    """The most memory that was used on an NVIDIA card, as its own tool says; none elsewhere."""
    used = re.findall(r"(\d+) MiB", path.read_text()) if path.is_file() else []
    return {"used_most_mib": max(map(int, used))} if used else None


def lines(path):
    return path.read_text().splitlines() if path.is_file() else []


if __name__ == "__main__":
    main()
