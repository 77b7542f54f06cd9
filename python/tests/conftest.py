"""What several test files use."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# Run by tests/consumers/run.py, where the learning libraries are installed.
collect_ignore = ["consumers"]


@pytest.fixture
def short_benchmark(tmp_path: Path) -> str:
    """attard2023 with a second speed of 5 km/h and time for the first alone, as a file of the user's own."""
    scenarios = ROOT / "scenarios"
    text = (scenarios / "attard2023.toml").read_text()
    for folder in ("roundabouts", "vehicles"):
        text = text.replace(f'"{folder}/', f'"{scenarios / folder}/')
    text = text.replace("speeds_kmh = [30.0]", "speeds_kmh = [30.0, 5.0]") + "\n[ending]\ntime_limit = 1.0\n"
    file = tmp_path / "short.toml"
    file.write_text(text)
    return str(file)
