"""The command ``offtrack`` of the wheel."""

import json
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

import offtrack_sim


def ran(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "offtrack_sim.command", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_the_wheel_has_the_command_and_it_counts_what_python_counts(tmp_path: Path) -> None:
    scripts = metadata.entry_points(group="console_scripts", name="offtrack")
    assert [script.value for script in scripts] == ["offtrack_sim.command:main"]
    report = tmp_path / "report.json"
    page = tmp_path / "report.html"
    done = ran("evaluate", "--episodes", "2", "--json", str(report), "--html", str(page))
    assert done.returncode == 0, done.stderr
    written = json.loads(report.read_text())
    python = offtrack_sim.evaluate(offtrack_sim.Policy.shipped(), episodes=2)
    assert (written["arrived"], written["success"]) == (python.counts["arrived"], python.success)
    assert written["commit"] != "unknown" or not (Path(__file__).parents[2] / ".git").exists()
    assert page.read_text().startswith("<!")


def test_intervals_over_routes_are_those_of_the_command_line_to_the_last_bit(tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    done = ran(
        "evaluate", "--benchmark", "maps2026", "--policy", "attard2023", "--episodes", "2", "--json", str(report)
    )
    assert done.returncode == 0, done.stderr
    written = json.loads(report.read_text())
    python = offtrack_sim.evaluate(offtrack_sim.Policy.shipped(), "maps2026", episodes=2)
    low, high = written["success_low_over_routes"], written["success_high_over_routes"]
    assert python.success_interval_over_routes == (low, high) and low < python.success < high
    assert (
        python.as_dict().items()
        <= {**written, "routes": python.success_by_route, "episodes": len(python.table)}.items()
    )
    # Episodes of one route end alike: as samples of their own they would promise more.
    assert high - low > written["success_high"] - written["success_low"]
    distance = python.interval_over_routes(python.table["lane_distance_mean"])
    assert distance is not None and distance[0] < written["lane_distance_mean"] < distance[1]
    one = offtrack_sim.evaluate(offtrack_sim.Policy.shipped(), routes=["16m/N-left-3"], episodes=3)
    assert one.success_interval_over_routes is None and "success_low_over_routes" not in one.as_dict()
    for wrong, error in (([1.0], ValueError), ([float("nan")] * 3, ValueError), (["far"] * 3, TypeError)):
        with pytest.raises(error, match="^values: "):
            one.interval_over_routes(wrong)


def test_it_draws_films_generates_certifies_and_says_which_trucks_fit(tmp_path: Path) -> None:
    for arguments, file in (
        (["draw", "20m", "--route", "N-left-4", "-o", "road.svg"], "road.svg"),
        (["record", "--route", "20m/N-right-1", "-o", "film.gif"], "film.gif"),
        (["generate", "--distribution", "wide", "--seed", "7", "--count", "2", "-o", "roads"], "roads"),
        (["vehicles"], None),
    ):
        command = [sys.executable, "-m", "offtrack_sim.command", *arguments]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, (arguments, done.stderr)
        assert file is None or (tmp_path / file).exists()


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["train"], 2, "train: this program has no learner; the one that is built from source has"),
        (["evaluate", "--benchmark", "nowhere"], 2, "benchmark: nowhere; must be"),
        (["no-such-command"], 2, "unrecognized subcommand"),
        ([], 2, "Usage: offtrack <COMMAND>"),
        (["--help"], 0, "built from source"),
        (["--version"], 0, f"offtrack {offtrack_sim.__version__}"),
    ],
)
def test_its_exit_codes_are_the_programs(arguments: list[str], code: int, said: str) -> None:
    done = ran(*arguments)
    assert (done.returncode, said in done.stdout + done.stderr) == (code, True), done
