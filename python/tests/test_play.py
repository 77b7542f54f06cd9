"""The game: a truck driven by keys."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import offtrack_sim
from offtrack_sim import play
from offtrack_sim.play import Game


def driven(game: Game) -> str:
    """Why the episode ended."""
    while game.ended == 0:
        game.step()
    return game.ended.name


def test_the_player_steers_by_levels_chooses_speeds_and_hands_over_to_the_policy() -> None:
    game = Game("laden2026", routes=["20m/N-left-4"])
    assert game.batch.action_table[game.actions()[0]][0] == 0
    before = game.speed
    for _ in range(3):
        game.turn(1)
    game.accelerate(-1)
    assert game.batch.action_table[game.actions()[0]].tolist() == [game.levels[game.level], game.speeds[before - 1]]
    assert game.levels[game.level] > 0
    game.turn(99)
    assert game.levels[game.level] == game.levels.max()
    for _ in range(99):
        game.straighten()
    assert game.levels[game.level] == 0
    # Straight on a U-turn ends on a kerb; the policy arrives.
    assert driven(game) != "ARRIVED" and "R again" in game.says()[-1]
    game.begin()
    game.hand_over()
    assert driven(game) == "ARRIVED"
    game.begin(1)
    assert game.says()[0] == "20m/N-left-4: the policy drives"


def test_continuous_actions_are_driven_without_a_policy_too() -> None:
    game = Game("laden2026-continuous", routes=["20m/N-left-4"])
    game.hand_over()
    assert game.is_player and game.policy is None
    game.turn(4)
    np.testing.assert_array_equal(game.actions(), np.array([[0.5, 1.0]], np.float32))
    for _ in range(8):
        game.step()
    assert game.batch.columns("truck")["truck"]["steering"][0] > 0


def test_the_window_drives_by_keys_and_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    game = Game(routes=["20m/N-left-4", "20m/E-left-2"])
    steps: list[float] = []
    frames: list[np.ndarray] = []

    class Clock:
        """No waiting; keys by the number of the step."""

        def tick(self, rate: float) -> None:
            assert rate == 10
            steps.append(float(game.batch.columns("truck")["truck"]["steering"][0]))
            frames.append(pygame.surfarray.array3d(pygame.display.get_surface()).copy())
            keys = {3: pygame.K_SPACE, 6: pygame.K_p, 8: pygame.K_n, 10: pygame.K_ESCAPE}
            if len(steps) in keys:
                pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=keys[len(steps)]))

    class Held(dict[int, bool]):
        def __missing__(self, key: int) -> bool:
            return key == pygame.K_LEFT and len(steps) < 3

    monkeypatch.setattr(pygame.time, "Clock", Clock)
    monkeypatch.setattr(pygame.key, "get_pressed", Held)
    play.play(game, side=240)
    assert len(steps) == 10 and steps[2] > steps[0] > 0
    assert not game.is_player and game.route == 1
    assert (frames[0] != frames[2]).any() and frames[0].std() > 10


def test_without_pygame_or_with_a_wrong_route_the_game_says_what_is_needed() -> None:
    def ran(*arguments: str, **environment: str) -> Any:
        command = [sys.executable, "-m", "offtrack_sim.play", *arguments]
        return subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment})

    wrong = ran("--route", "nowhere")
    assert wrong.returncode == 1 and 'routes: "nowhere"; attard2023 has' in wrong.stderr
    without = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys; sys.modules['pygame'] = None; from offtrack_sim import play; play.play(play.Game())",
        ],
        capture_output=True,
        text=True,
    )
    assert "play: pygame is needed; pip install offtrack_sim[play]" in without.stderr


def left_hand(text: str) -> str:
    """A roundabout file's text with left-hand traffic: other signs, and lanes' names exchanged."""
    text = re.sub(r"(bearing_deg|offset) = (-?)", lambda key: f"{key[1]} = {'' if key[2] else '-'}", text)
    lanes = {"left": "right", "right": "left"}
    return 'hand = "left"\n' + re.sub(r"\.(left|right)\]", lambda lane: f".{lanes[lane[1]]}]", text)


@pytest.mark.parametrize(
    ("scenario", "angle"), [("attard2023", "+6"), ("laden2026-continuous", "+4"), ("traffic2026", "+6")]
)
def test_on_a_left_hand_road_the_left_key_turns_left_on_the_road_and_the_angle_is_shown_so(
    scenario: str, angle: str, tmp_path: Path
) -> None:
    offtrack_sim.write_scenarios(tmp_path / "all")
    file = tmp_path / "left.toml"
    file.write_text(left_hand((tmp_path / "all/roundabouts/20m.toml").read_text()))
    observer = offtrack_sim.Observer(scenario, [f"{file}/N-right-4"])
    for routes, side in (([f"{file}/N-right-4"], -1), ([str(file)], -1), (["20m/N-left-4"], 1)):
        game = Game(scenario, routes=routes)
        for _ in range(3):
            game.turn(1)
            game.step()
        truck = game.batch.columns("truck")["truck"][0]
        # The batch has the mirror image of a left-hand road.
        assert np.sign(truck["steering"]) == side and f"steer angle {angle} deg" in game.says()[1], game.says()
        if game.batch.n_commands == 0:
            on_the_road = (observer if side < 0 else offtrack_sim.Observer(scenario, routes)).command(game.actions())[0]
            assert on_the_road[0] > 0
        for _ in range(3):
            game.straighten()
        assert game.levels[game.level] == 0


def test_a_left_hand_road_is_known_beside_others_and_among_the_benchmarks_own(tmp_path: Path) -> None:
    offtrack_sim.write_scenarios(tmp_path / "all")
    file = tmp_path / "left.toml"
    file.write_text(left_hand((tmp_path / "all/roundabouts/20m.toml").read_text()))
    game = Game("attard2023", routes=["wide/7/12", str(file), "16m/N-left-3"])
    sides = {}
    for _ in game.batch.split_routes:
        game.begin(1)
        sides[game.says()[0].rpartition("/")[0]] = game.side
    assert sides == {"wide/7/12": 1, "left": -1, "16m": 1}
    own = offtrack_sim.benchmark("attard2023").changed({"roundabout[3].file": str(file), "roundabout[3].test": "all"})
    assert Game(own, routes=["left"]).side == -1
