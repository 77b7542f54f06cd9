"""Results as JSON: what the examples share."""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import offtrack_sim
from offtrack_sim import Batch


def about(*packages: str) -> dict[str, Any]:
    """What a figure was measured with: date, processor, and versions of these packages."""
    return {
        "date": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "processor": f"{processor()}, {os.cpu_count()} cores",
        "python": platform.python_version(),
        "versions": {"offtrack_sim": offtrack_sim.__version__, **{name: metadata.version(name) for name in packages}},
        "step": {"seconds": 0.1, "substeps": 2, "rays": 29},
    }


def processor() -> str:
    """Its name, as Linux gives it."""
    cpuinfo = Path("/proc/cpuinfo")
    names = (
        [line.split(":")[1] for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        if cpuinfo.exists()
        else []
    )
    return names[0].strip() if names else platform.processor()


def prepare(args: argparse.Namespace) -> None:
    """Finds out before a training what would be in the way of its end: the folder of ``--out``, and a benchmark for the
    evaluation whose observations and actions are those of the one that is trained on. Ends the program with what is
    wrong."""
    for name in ("steps", "envs"):
        if getattr(args, name) < 1:
            raise SystemExit(f"--{name}: {getattr(args, name)}; must be at least 1")
    try:
        args.out.parent.mkdir(parents=True, exist_ok=True)
        trained, judged = Batch(args.scenario, 1), Batch(args.benchmark, 1, split=args.split)
    except (OSError, ValueError) as error:
        raise SystemExit(str(error)) from None
    if trained.n_values != judged.n_values or not np.array_equal(_actions(trained), _actions(judged)):
        raise SystemExit(f"--benchmark: {args.benchmark}; has other observations or actions than {args.scenario}")


def _actions(batch: Batch) -> npt.NDArray[Any]:
    """Its table of actions, or zeros for a command's numbers."""
    return np.zeros(batch.n_commands) if batch.n_commands else batch.action_table


def written(args: argparse.Namespace, ending: str) -> Path:
    """A file to write: ``--out`` and this ending."""
    return Path(f"{args.out}{ending}")


def write_json(file: str | os.PathLike[str], content: Any) -> None:
    """Writes a file, whole or not at all."""
    part = Path(f"{os.fspath(file)}.part")
    part.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    os.replace(part, file)
