"""Draws four pictures of ``render_mode="rgb_array"`` side by side: ``python frames.py -o frames.png``; needs pillow.

Three of the shipped policy on roundabouts that it has never seen, and one of a truck that holds its steer angle.
"""

from __future__ import annotations

import argparse

import numpy as np
from PIL import Image

import offtrack_sim

DRIVEN = [
    ("attard2023-full", ["20m/N-left-4"], 95),
    ("attard2023-full", ["50m/W-right-2"], 110),
    ("random2026", None, 90),
]


def main(file: str) -> None:
    policy = offtrack_sim.Policy.shipped()
    pictures = []
    for scenario, routes, steps in DRIVEN:
        batch = offtrack_sim.Batch(scenario, 1, split="test", routes=routes, seed=5)
        for _ in range(steps):
            batch.step(policy.act(batch.observation()))
        pictures.append(batch.render())
    batch = offtrack_sim.Batch(routes=["16m/N-left-3"], autoreset="disabled")
    while batch.ended() is None:
        batch.step(np.array([5]))
    pictures.append(batch.render())
    rows = [np.concatenate(pictures[row : row + 2], axis=1) for row in (0, 2)]
    Image.fromarray(np.concatenate(rows)).quantize(64).save(file, optimize=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Draws four pictures side by side")
    parser.add_argument("-o", "--output", required=True, metavar="FILE", help="a picture, as frames.png")
    main(parser.parse_args().output)
