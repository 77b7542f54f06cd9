"""The sketch of a node drives: with the few classes of tests/ros in place of ROS."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import offtrack_sim

if TYPE_CHECKING:
    from ros2_node import Driver

ROUTE = "20m/N-left-2"
WHEELBASE = 3.543


@pytest.fixture
def driver(monkeypatch: pytest.MonkeyPatch) -> Driver:
    monkeypatch.syspath_prepend(Path(__file__).parent / "ros")
    from rclpy.node import Node

    monkeypatch.setattr(Node, "parameters", {"route": ROUTE})
    from ros2_node import Driver

    return Driver()


def hear(driver: Driver, speed: float) -> None:
    """Odometry and steer angle."""
    from ackermann_msgs.msg import AckermannDriveStamped
    from nav_msgs.msg import Odometry

    odometry = Odometry()
    odometry.twist.twist.linear.x = speed
    driver.hear_odometry(odometry)
    driver.hear_steering(AckermannDriveStamped())


def stand(driver: Driver, along: float, seconds: float, rolled: float = 0.0) -> None:
    """Puts the truck on the line of the route's first waypoint, the trailer rolled to the right, and the clock to a
    time."""
    from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
    from rclpy.time import Time
    from std_msgs.msg import Header

    x, y, heading = driver.observer.waypoints(ROUTE)[0].tolist()
    x, y = x + (along - WHEELBASE / 2) * math.cos(heading), y + (along - WHEELBASE / 2) * math.sin(heading)
    turned = Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))
    # First about its own x, which is ahead.
    sin, cos = math.sin(rolled / 2), math.cos(rolled / 2)
    leaning = Quaternion(x=turned.w * sin, y=turned.z * sin, z=turned.z * cos, w=turned.w * cos)
    driver.clock.time = Time(round(seconds * 1e9))
    for frame, rotation in {"base_link": turned, "trailer_link": leaning}.items():
        stamp = Header(driver.clock.time.to_msg(), "map")
        driver.transforms.found[frame] = TransformStamped(stamp, Transform(Vector3(x, y), rotation))


def test_it_publishes_what_the_policy_does(driver: Driver) -> None:
    for step in range(3):
        stand(driver, 0.8 * step, 0.1 * step)
        hear(driver, 8.0)
        driver.step()
    speeds = [message.drive.speed for message in driver.commands.published]
    assert len(speeds) == 3 and all(2.0 < speed < 9.0 for speed in speeds)
    assert all(abs(message.drive.steering_angle) < 0.3 for message in driver.commands.published)
    assert not driver.logger.lines


def test_it_brakes_without_a_pose_with_an_old_one_and_at_the_end_of_an_episode(driver: Driver) -> None:
    from rclpy.time import Time

    driver.step()
    assert "base_link: unknown" in driver.logger.lines[-1]
    hear(driver, 0.0)
    stand(driver, 0.0, 5.0)
    driver.clock.time = Time(round(5.5 * 1e9))
    driver.step()
    assert "0.50 s old; 0.2 s at most" in driver.logger.lines[-1]
    stand(driver, 0.0, 6.0)
    driver.step()
    assert "odom: 6.00 s old; 0.2 s at most" in driver.logger.lines[-1]
    hear(driver, 0.0)
    driver.step()
    stand(driver, -500.0, 6.1)
    driver.step()
    assert "the episode has ended" in driver.logger.lines[-1]
    braked = [message.drive.acceleration < 0 for message in driver.commands.published]
    assert braked == [True, True, True, False, True]


def test_it_brakes_before_odometry_and_steer_angle_have_come(driver: Driver) -> None:
    stand(driver, 0.0, 1.0)
    driver.step()
    assert "odom: nothing has come" in driver.logger.lines[-1]
    assert driver.commands.published[-1].drive.acceleration < 0


def test_it_tells_the_policy_how_the_trailer_rolls(driver: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[dict[str, Any]] = []
    observe = driver.observer.observe

    def listened(*pose: Any, **knows: Any) -> offtrack_sim.observer.Seen:
        told.append(knows)
        return observe(*pose, **knows)

    monkeypatch.setattr(driver.observer, "observe", listened)
    for step, rolled in enumerate([0.0, 0.02, 0.05]):
        stand(driver, 0.8 * step, 0.1 * step, rolled)
        hear(driver, 8.0)
        driver.step()
    assert [knows["trailer_roll"][0] for knows in told] == pytest.approx([0.02, 0.05])
    assert [knows["trailer_roll_rate"][0] for knows in told] == pytest.approx([0.2, 0.3])
    assert [knows["lateral_acceleration"][0] for knows in told] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_after_it_braked_it_tells_the_policy_what_it_asked_for(driver: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    from rclpy.time import Time

    told: list[dict[str, Any]] = []
    observe = driver.observer.observe

    def listened(*pose: Any, **knows: Any) -> offtrack_sim.observer.Seen:
        told.append({name: float(np.ravel(value)[0]) for name, value in knows.items()})
        return observe(*pose, **knows)

    monkeypatch.setattr(driver.observer, "observe", listened)
    stand(driver, 0.0, 0.0)
    hear(driver, 8.0)
    driver.step()
    assert driver.target[0] > 2.0
    # The poses stand still for a while, in which the truck brakes.
    for tenth in range(1, 11):
        driver.clock.time = Time(round(0.1 * tenth * 1e9))
        hear(driver, 8.0 - 0.25 * tenth)
        driver.step()
    stand(driver, 6.0, 1.1)
    hear(driver, 5.25)
    driver.step()
    assert told[-1]["target_speed"] == 0.0
    assert told[-1]["acceleration"] == pytest.approx(-2.5)


@pytest.mark.parametrize(
    ("benchmark", "route", "load", "expected"),
    [
        ("maps2026", "town03/E-left-1", "empty", ("", "empty")),
        ("laden2026", ROUTE, "half", ("daf_xf", "half")),
    ],
)
def test_a_benchmark_of_one_vehicle_does_not_name_it(
    driver: Driver, benchmark: str, route: str, load: str, expected: tuple[str, str]
) -> None:
    from ros2_node import vehicle_of

    named = vehicle_of(benchmark, route, "daf_xf", load)
    assert named == expected
    offtrack_sim.Observer(benchmark, routes=[route], vehicles=[named])


def test_a_quaternions_yaw_is_its_heading(driver: Driver) -> None:
    from geometry_msgs.msg import Quaternion
    from ros2_node import yaw

    assert yaw(Quaternion(z=math.sin(1.0), w=math.cos(1.0))) == pytest.approx(2.0)
    assert offtrack_sim.Policy.shipped("laden2026").extras == driver.policy.extras
