"""The command ``offtrack``: everything but training by the project's own learner."""

from __future__ import annotations

import sys

from . import _offtrack


def main() -> None:
    """Runs the command line with the process's arguments, and ends the process with its exit code."""
    sys.exit(_offtrack.command(["offtrack", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
