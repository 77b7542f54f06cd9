"""Shared by the scripts beside it: runs of several choices and seeds, one at a time on each core, and their results."""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"


def arguments(doc, runs, names, *own):
    """The command line of a script whose choices have these names; `own`: parsers with flags of its own."""
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=doc, formatter_class=formatter, parents=own)
    parser.add_argument("--offtrack", type=Path, default=Path("target/release/offtrack"))
    parser.add_argument("--seeds", default="0,1,2", help="seeds of each choice")
    parser.add_argument("--choice", action="append", help="only this choice; may be given several times")
    parser.add_argument("--cores", default=None, help="cores to run on, as in 0,1; default: all")
    parser.add_argument("--runs", type=Path, default=Path(runs))
    parser.add_argument("--json", type=Path, required=True)
    args = parser.parse_args()
    if unknown := [name for name in args.choice or [] if name not in names]:
        parser.error(f"--choice: {unknown[0]!r}; must be one of {names}")
    args.offtrack, args.runs = args.offtrack.resolve(), args.runs.resolve()
    return args


def folder_name(choice):
    """The name of a choice as `offtrack train --name` accepts it."""
    return re.sub(r"[^A-Za-z0-9.]+", "-", choice)


def finished(command, core):
    """Runs a command on a core; the last line of its errors where it fails."""
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=lambda: os.sched_setaffinity(0, {core}))
    return None if done.returncode == 0 else done.stderr.strip().splitlines()[-1]


def is_finished(folder):
    """Whether a run has a report, and not that of an interruption."""
    report = folder / "report.json"
    return report.is_file() and not json.loads(report.read_text())["interrupted"]


def trained(core, args, folder, config, seed, steps, settings):
    """Trains in `folder`, unless a run there has ended; the last line of the errors where that fails."""
    if not is_finished(folder):
        if folder.exists():
            # It was interrupted before: a new run cannot use its folder.
            subprocess.run(["rm", "-r", str(folder)], check=True)
        command = [str(args.offtrack), "train", config, "--name", folder.name, "--out", str(args.runs)]
        command += ["--seed", str(seed), "--steps", str(steps)]
        command += [part for setting in settings for part in ("--set", setting)]
        if failure := finished(command, core):
            return failure
        if not is_finished(folder):
            return "interrupted"
    # Nothing resumes this run, and the replay buffer in its checkpoint fills the disk.
    (folder / "checkpoint.safetensors").unlink(missing_ok=True)
    return None


def with_paths(text):
    """A benchmark's text with paths that hold in any folder."""
    return re.sub(r'^(file|vehicle|distribution) = "(.*)"$', rf'\1 = "{SCENARIOS}/\2"', text, flags=re.MULTILINE)


def finish(command):
    """Runs a command; where it fails, ends with what it said last."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: {done.stderr.strip().splitlines()[-1]}")


def evaluation(offtrack, *flags):
    """The report of `offtrack evaluate` with these flags."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "report.json"
        finish([str(offtrack), "evaluate", *map(str, flags), "--json", str(file)])
        return json.loads(file.read_text())


def rounded(figures):
    """Figures to five decimals."""
    if isinstance(figures, dict):
        return {key: rounded(value) for key, value in figures.items()}
    if isinstance(figures, list):
        return [rounded(value) for value in figures]
    return round(figures, 5) if isinstance(figures, float) else figures


def write_json(file, whole, indent=1):
    """Writes a file, whole or not at all."""
    temporary = file.with_suffix(".tmp")
    temporary.write_text(json.dumps(whole, indent=indent) + "\n")
    temporary.replace(file)


def run_all(args, wanted, run, result, table):
    """Runs every choice of `wanted`, rows by name, with every seed, and prints the table of what it came to.

    `run(core, name, seed)` makes one run; `result` is what stands beside the choices in the JSON file.
    """
    available = [int(core) for core in args.cores.split(",")] if args.cores else sorted(os.sched_getaffinity(0))
    cores = Queue()
    for core in available:
        cores.put(core)

    def job(name, seed):
        core = cores.get()
        try:
            return run(core, name, seed)
        finally:
            cores.put(core)

    with ThreadPoolExecutor(len(available)) as pool:
        # One seed of every choice before the next seed: an interrupted series has as many of each.
        seeds = [int(seed) for seed in args.seeds.split(",")]
        jobs = {(name, seed): pool.submit(job, name, seed) for seed in seeds for name in wanted}
        for (name, seed), running in jobs.items():
            found = running.result()
            wanted[name]["runs"].append(found)
            print(name, json.dumps(found), file=sys.stderr, flush=True)
            write_json(args.json, {"cores_per_run": 1, **result, "choices": list(wanted.values())})
    print(table(wanted.values()))
