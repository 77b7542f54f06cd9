"""Results as JSON: what the examples share."""

from __future__ import annotations

import json
import os
import platform
import tempfile
import time
from importlib import metadata
from pathlib import Path
from typing import Any

import offtrack_sim


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
