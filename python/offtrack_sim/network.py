"""A network as a policy file holds it."""

from __future__ import annotations

from dataclasses import dataclass, field

from .episodes import Floats

#: Weights ``[inputs, outputs]`` and biases ``[outputs]`` of a layer.
Layer = tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class Network:
    """Layers, and what stands before, between and behind them; see docs/policies.md."""

    layers: list[Layer]
    """The linear layers, from the observation on."""
    activation: str = "relu"
    """What stands after each layer but the last: ``"relu"`` or ``"tanh"``."""
    squash: str | None = None
    """How outputs become commands, ``"tanh"`` or ``"clip"``; ``None`` where they are values of actions."""
    values: list[str] | None = None
    """Names of the values that it reads; ``None`` for all, and the benchmark's extras."""
    frames: int = 1
    """Number of steps' values that it sees side by side, oldest first."""
    padding: str = "zero"
    """What stands before an episode's first frame: ``"zero"`` or ``"reset"``."""
    gates: str | None = None
    """What the recurrent layers are, ``"gru"`` or ``"lstm"``; ``None`` without any."""
    after: int = 0
    """Number of the linear layers before the recurrent ones."""
    cells: list[tuple[Layer, Layer]] = field(default_factory=list)
    """Of each recurrent layer the linear layers from what comes in and from the hidden values, to its gates."""
    normalisation: tuple[Floats, Floats] | None = None
    """Mean and factor of each value, or of each value of each frame; ``None`` without."""
