"""Roads from OpenDRIVE maps are driven like any other."""

from pathlib import Path

import numpy as np

import offtrack_sim

ROOT = Path(__file__).parents[2]


def test_a_benchmark_may_name_a_map(tmp_path: Path) -> None:
    head = (ROOT / "scenarios/maps2026.toml").read_text().split("[[roundabout]]")[0]
    head = head.replace('"vehicles/daf_xf.toml"', '"daf_xf"')
    file = tmp_path / "mine.toml"
    ring = f'[[roundabout]]\nfile = "{ROOT}/scenarios/maps/sumo_ring22.xodr"\ntest = "all"\n'
    file.write_text(head + ring)
    envs = offtrack_sim.make_vec(str(file), num_envs=16, split="test", autoreset_mode="same_step")
    shipped = offtrack_sim.make_vec("maps2026", num_envs=16, split="test", autoreset_mode="same_step")
    for batch in (envs, shipped):
        observations, _ = batch.reset(seed=0)
        assert observations.shape == (16, 69)
        actions = np.full(16, 4)
        observations, rewards, *_ = batch.step(actions)
        assert np.isfinite(observations).all() and np.isfinite(rewards).all()
        batch.close()
