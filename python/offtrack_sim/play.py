"""Drive a truck by keys: ``python -m offtrack_sim.play``, with pygame (``pip install offtrack_sim[play]``).

Left and right steer, up and down change the speed where a benchmark lets one choose, space hands over to the policy
that comes with the package and back, R begins again, N takes the next route, P pauses, Escape ends.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _offtrack
from .arguments import names_of
from .batch import Batch
from .layout import Ended
from .observer import Observer
from .policy import Policy
from .scenarios import Scenario

#: Side of the window [pixels].
SIDE = 720


class Game:
    """One truck, a driver of flesh and blood or the policy, and what is said of it.

    Args:
        scenario, split, seed: As for :class:`offtrack_sim.Batch`.
        routes: Names of routes or roundabouts to drive in turn; None for those of the split.
        policy: Who drives while the player does not; None for one that comes with the package and can, if there is.

    Raises:
        ValueError: As :class:`offtrack_sim.Batch` says; and for a policy that cannot drive there.
    """

    def __init__(
        self,
        scenario: Scenario = "attard2023",
        *,
        split: str = "test",
        routes: Iterable[str] | None = None,
        seed: int = 0,
        policy: Policy | None = None,
    ) -> None:
        names = None if routes is None else names_of(routes)
        self.batch = Batch(scenario, 1, split=split, routes=names, seed=seed, autoreset="disabled")
        self.mirrored = _mirrored(self.batch, scenario, names or [])
        self.policy = _shipped(self.batch) if policy is None else policy
        if self.policy is not None:
            self.policy.check(self.batch)
        # Of continuous actions some are chosen from: fractions of their ranges.
        table = self.batch.action_table if self.batch.n_commands == 0 else np.linspace([-1, -1], [1, 1], 17)
        self.levels = np.unique(table[:, 0])
        self.speeds = np.unique(table[:, 1])
        self.route = 0
        self.is_player = True
        self.begin()

    def begin(self, route_after: int = 0) -> None:
        """Begins an episode on the same route, or on one that stands so many places after it."""
        names = self.batch.split_routes
        self.route = (self.route + route_after) % len(names)
        self.batch.begin([0], routes=[names[self.route]])
        # Where traffic keeps to the left, the truck drives in the mirror image of what the window shows.
        self.side = -1 if names[self.route].rpartition("/")[0] in self.mirrored else 1
        self.level = int(np.abs(self.levels).argmin())
        self.speed = len(self.speeds) - 1
        self.driver = None if self.policy is None else self.policy.driver(1)
        self.ended = Ended.RUNNING

    def hand_over(self) -> None:
        """Lets the policy drive, or the player again; without a policy the player stays."""
        self.is_player = self.driver is None or not self.is_player

    def turn(self, levels: int) -> None:
        """Steers by so many levels more, left on the road positive."""
        self.level = int(np.clip(self.level + self.side * levels, 0, len(self.levels) - 1))

    def straighten(self) -> None:
        """Steers one level nearer to straight ahead."""
        self.level += int(np.sign(int(np.abs(self.levels).argmin()) - self.level))

    def accelerate(self, levels: int) -> None:
        """Chooses a higher or lower target speed, or change of it."""
        self.speed = int(np.clip(self.speed + levels, 0, len(self.speeds) - 1))

    def actions(self) -> npt.NDArray[Any]:
        """What the player or the policy chooses, as :meth:`offtrack_sim.Batch.step` takes it."""
        chosen = None if self.driver is None else self.driver.act(self.batch.observation())
        if chosen is not None and not self.is_player:
            return chosen
        wanted = np.array([self.levels[self.level], self.speeds[self.speed]], np.float32)
        if self.batch.n_commands:
            return wanted[None, : self.batch.n_commands]
        return np.flatnonzero((self.batch.action_table == wanted).all(axis=1))[:1]

    def step(self) -> None:
        """A step of the truck, unless its episode has ended."""
        if self.ended is Ended.RUNNING:
            self.batch.step(self.actions())
            ended = self.batch.ended()
            self.ended = Ended.RUNNING if ended is None else Ended(int(ended.codes[0]))

    def says(self) -> list[str]:
        """What stands in the window, line by line."""
        columns = self.batch.columns("truck", "clearance", "terms")
        truck, clearance = columns["truck"][0], columns["clearance"][0]
        nearest = min(float(value) for value in clearance.tolist())
        angle = self.side * round(float(np.degrees(truck["steering"])))
        driver = "you drive" if self.is_player else "the policy drives"
        lines = [
            f"{self.batch.split_routes[self.route]}: {driver}",
            f"{3.6 * truck['speed']:.0f} km/h, steer angle {angle:+d} deg, {max(nearest, 0.0):.2f} m to the kerb",
        ]
        if self.ended is not Ended.RUNNING:
            lines.append(f"{self.ended.name.lower().replace('_', ' ')}: R again, N next route")
        return lines


def _mirrored(batch: Batch, scenario: Scenario, routes: list[str]) -> set[str]:
    """Names of the batch's roads with left-hand traffic."""
    # The batch names the road of a file by the stem; another one's observer knows it by its path.
    paths = [path for name in routes for path in (name, name.rpartition("/")[0]) if path.endswith(".toml")]
    files = {Path(path).stem.removesuffix(".outline"): path for path in paths}
    one_each = {route.rpartition("/")[0]: route for route in batch.split_routes}
    # Random roads have right-hand traffic; those of a benchmark take long to draw.
    names = {
        road: files.get(road, road) + route.removeprefix(road)
        for road, route in one_each.items()
        if not re.fullmatch(r".+/\d+/\d+", road)
    }
    if not names:
        return set()
    observer = Observer(scenario, list(names.values()))
    return {road for road, name in names.items() if observer.frame(name).mirrored}


def _shipped(batch: Batch) -> Policy | None:
    """The policy that comes with the package for the batch's benchmark, or else one that can drive there, if any."""
    names = _offtrack.policy_names()
    for name in [batch.scenario] if batch.scenario in names else names:
        policy = Policy.shipped(name)
        try:
            policy.check(batch)
        except ValueError:
            continue
        return policy
    return None


def play(game: Game, *, side: int = SIDE) -> None:
    """Opens a window and drives until it is closed.

    Raises:
        ImportError: Without pygame.
    """
    try:
        import pygame
    except ImportError:
        raise ImportError("play: pygame is needed; pip install offtrack_sim[play]") from None
    pygame.init()
    try:
        screen = pygame.display.set_mode((side, side))
        pygame.display.set_caption("offtrack")
        font, clock = pygame.font.Font(None, 26), pygame.time.Clock()
        is_paused = False
        while True:
            for event in pygame.event.get():
                if event.type == pygame.QUIT or (event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE):
                    return
                if event.type != pygame.KEYDOWN:
                    continue
                if event.key == pygame.K_SPACE:
                    game.hand_over()
                elif event.key == pygame.K_p:
                    is_paused = not is_paused
                elif event.key in (pygame.K_r, pygame.K_n):
                    game.begin(int(event.key == pygame.K_n))
                elif event.key in (pygame.K_UP, pygame.K_DOWN):
                    game.accelerate(1 if event.key == pygame.K_UP else -1)
            held = pygame.key.get_pressed()
            if held[pygame.K_LEFT] != held[pygame.K_RIGHT]:
                game.turn(1 if held[pygame.K_LEFT] else -1)
            elif game.is_player:
                game.straighten()
            if not is_paused:
                game.step()
            picture = game.batch.render(0, side)
            screen.blit(pygame.surfarray.make_surface(picture.swapaxes(0, 1)), (0, 0))
            for index, line in enumerate(game.says()):
                screen.blit(font.render(line, True, (20, 20, 20), (255, 255, 255)), (12, 12 + 28 * index))
            pygame.display.flip()
            clock.tick(1 / game.batch.step_seconds)
    finally:
        pygame.quit()


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m offtrack_sim.play", description=__doc__)
    parser.add_argument("--benchmark", default="attard2023", help="a benchmark's name, or the path of its file")
    parser.add_argument("--split", default="test", choices=["train", "validation", "test"])
    parser.add_argument("--route", action="append", help="a route, 20m/N-left-4, or a road, wide/7/12; repeatable")
    parser.add_argument("--policy", help="a policy file, which drives after the space key")
    parser.add_argument("--seed", type=int, default=0, help="seed of the starts")
    given = parser.parse_args()
    try:
        policy = None if given.policy is None else Policy.load(given.policy)
        play(Game(given.benchmark, split=given.split, routes=given.route, seed=given.seed, policy=policy))
    except (ImportError, ValueError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
