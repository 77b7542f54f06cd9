"""Success of a policy on a benchmark's routes, and results as JSON: what the examples share."""

from __future__ import annotations

import json
import math
import os
import platform
import tempfile
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

import offtrack_sim
from offtrack_sim import Batch, Ended

Act = Callable[[np.ndarray], np.ndarray]
"""Observations, float32 ``[n, 69]``, to indices of actions, integers ``[n]``."""


def evaluate(
    act: Act, scenario: str = "attard2023", split: str = "test", episodes: int = 30, seed: int = 0
) -> dict[str, Any]:
    """Drives every route of a split, from the start poses that ``offtrack evaluate`` draws with the same seed.

    Each truck drives a single episode; those that have ended are left to themselves.
    """
    names = Batch(scenario, 1, split=split).route_names
    routes = [name for name in names for _ in range(episodes)]
    batch = Batch(scenario, len(routes), split=split, seed=seed)
    batch.begin(routes=routes, streams=[(seed, env) for env in range(len(routes))])
    codes = np.zeros(len(routes), np.int64)
    observation = batch.observation()
    while (codes == Ended.RUNNING).any():
        observation = batch.step(act(observation))[0]
        if (ends := batch.ended()) is not None:
            is_first = codes[ends.envs] == Ended.RUNNING
            codes[ends.envs[is_first]] = ends.codes[is_first]
    arrived = codes == Ended.ARRIVED
    low, high = wilson(int(arrived.sum()), len(codes))
    return {
        "benchmark": scenario,
        "split": split,
        "seed": seed,
        "episodes": len(codes),
        "arrived": int(arrived.sum()),
        "success": float(arrived.mean()),
        "success_low": low,
        "success_high": high,
        "ends": {code.name.lower(): int((codes == code).sum()) for code in Ended if code != Ended.RUNNING},
        "routes": {name: float(arrived[row * episodes :][:episodes].mean()) for row, name in enumerate(names)},
    }


def wilson(arrived: int, episodes: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a fraction."""
    z, p = 1.959964, arrived / episodes
    middle, half = p + z * z / (2 * episodes), z * math.sqrt(p * (1 - p) / episodes + z * z / (4 * episodes**2))
    return (middle - half) / (1 + z * z / episodes), (middle + half) / (1 + z * z / episodes)


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


def write_json(file: str | os.PathLike[str], content: Any) -> None:
    """Writes a file, whole or not at all."""
    file = Path(file)
    with tempfile.NamedTemporaryFile("w", dir=file.parent, delete=False) as part:
        json.dump(content, part, indent=2)
        part.write("\n")
    os.replace(part.name, file)
