"""Thousands of tractor-trailers drive through roundabouts at once.

- :func:`make_vec` makes a vector environment of Gymnasium: many trucks, stepped together by the simulator.
- :class:`Roundabout` is one truck, ``gymnasium.make("offtrack_sim:offtrack/Roundabout-v0")``.
- :class:`Batch` is the simulator itself, without spaces and infos.
- :func:`benchmark` reads a benchmark; :class:`Benchmark` is one in memory, changed or your own.
- :class:`Policy` drives: the policy that comes with the package, or a trained one. :func:`evaluate` counts its success.
  A :class:`Driver` is one that remembers.
- :class:`Observer` is what a policy observes of trucks that something else drives.
- :mod:`offtrack_sim.sb3`, :mod:`offtrack_sim.puffer`: the same trucks for Stable-Baselines3 and PufferLib.
- :mod:`offtrack_sim.export` writes a network of PyTorch, or of an ONNX graph, as a policy file.

An observation is 69 values of float32 in ``[-1, 1]``, see :data:`OBSERVATION`, and behind them the extras that a
benchmark may observe, see :data:`EXTRAS`; an action is an index into ``Batch.action_table`` or, where a
benchmark's actions are continuous, one or two numbers in ``[-1, 1]``. A step is 0.1 s.
"""

from __future__ import annotations

import gymnasium

from ._offtrack import ScenarioError, __version__, scenario_names
from .batch import Batch
from .episodes import Ends, Start
from .evaluation import Evaluation, evaluate
from .geometry import Road
from .layout import COLUMN_DOCS, COLUMNS, EXTRAS, OBSERVATION, VEHICLES, Ended, Values
from .observer import Frame, Observer, Seen, speed_control
from .policy import Driver, Policy
from .scenarios import Benchmark, benchmark, write_scenarios
from .single import Roundabout
from .vector import RoundaboutVector, make_vec

__all__ = [
    "COLUMNS",
    "COLUMN_DOCS",
    "EXTRAS",
    "OBSERVATION",
    "VEHICLES",
    "Batch",
    "Benchmark",
    "Driver",
    "Ended",
    "Ends",
    "Evaluation",
    "Frame",
    "Observer",
    "Policy",
    "Road",
    "Roundabout",
    "RoundaboutVector",
    "ScenarioError",
    "Seen",
    "Start",
    "Values",
    "__version__",
    "benchmark",
    "evaluate",
    "make_vec",
    "scenario_names",
    "speed_control",
    "write_scenarios",
]

gymnasium.register(
    id="offtrack/Roundabout-v0",
    entry_point="offtrack_sim.single:Roundabout",
    vector_entry_point="offtrack_sim.vector:make_vec",
)
