"""Roads as arrays, for baselines and pictures of one's own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]


class Road(NamedTuple):
    """A route and what is around it, in the frame that it is driven in: a left-hand road is its mirror image there."""

    waypoints: Doubles
    """Position [m] of the route's waypoints on its lane's centre, and heading of the lane [rad], ``[n, 3]``."""
    widths: Doubles
    """Width of the lane at each waypoint [m], ``[n]``."""
    lanes: list[Doubles]
    """Centre lines of all lanes of the road, ``[m, 2]`` each [m]."""
    kerbs: list[Doubles]
    """Edges of what may be driven on, lines ``[m, 2]`` that end where they begin, with the road on their left [m]."""

    def edges(self) -> tuple[Doubles, Doubles]:
        """Left and right edge of the route's lane beside each waypoint, ``[n, 2]`` each [m]."""
        heading = self.waypoints[:, 2]
        left = 0.5 * self.widths[:, None] * np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        return self.waypoints[:, :2] + left, self.waypoints[:, :2] - left
