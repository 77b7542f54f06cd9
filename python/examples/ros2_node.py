"""A node of ROS 2 that drives a tractor-semitrailer by a policy. A sketch: no ROS has run it.

    python3 ros2_node.py --ros-args -p benchmark:=own.toml -p route:=site/E-left-2

REP 103 is the package's frame: x ahead, y left, angles counter-clockwise, steer angles positive to the left. What it
needs of the truck: transforms from ``map``, the frame of the road's map, to ``base_link``, the middle of the drive axle
(Autoware's convention), and to ``trailer_link``, the middle of the trailer's axle group; odometry; the steer angle.

Types are checked against tests/ros, which has what this file uses of ROS, and a test drives it with that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import rclpy
import tf2_ros
from ackermann_msgs.msg import AckermannDriveStamped
from geometry_msgs.msg import Quaternion, TransformStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.time import Time

import offtrack_sim

PERIOD = 0.1
"""Time between two actions, the simulator's step [s]."""
STALE = 0.2
"""Age of a pose or a message at which the truck brakes [s]: an old one is a delay, see docs/transfer.md."""
BRAKING = 2.5
"""Deceleration asked for where the truck must stop [m/s^2]."""
PARAMETERS = {"benchmark": "laden2026", "policy": "laden2026", "route": "", "vehicle": "daf_xf", "load": "laden"}


@dataclass(frozen=True)
class Trailer:
    """How the trailer stands and turns, by its transforms."""

    stamp: Time
    heading: float
    """In the map [rad]."""
    roll: float
    """To the right [rad]."""
    yaw_rate: float = 0.0
    roll_rate: float = 0.0

    @staticmethod
    def of(found: TransformStamped, before: Trailer | None) -> Trailer:
        """By a transform, and the rates [rad/s] since an earlier one."""
        turned = found.transform.rotation
        now = Trailer(Time.from_msg(found.header.stamp), yaw(turned), roll(turned))
        if before is None:
            return now
        seconds = (now.stamp - before.stamp).nanoseconds * 1e-9
        if seconds <= 0.0:
            return before
        rates = (math.remainder(now.heading - before.heading, math.tau), now.roll - before.roll)
        return replace(now, yaw_rate=rates[0] / seconds, roll_rate=rates[1] / seconds)


class Unknown(Exception):
    """A message or a pose that has not come, or is too old."""


class Driver(Node):
    """Observes ten times a second, and publishes a steer angle and a speed."""

    def __init__(self) -> None:
        super().__init__("offtrack_driver")
        given = {name: str(self.declare_parameter(name, default).value) for name, default in PARAMETERS.items()}
        self.policy = offtrack_sim.Policy.shipped(given["policy"])
        vehicle = vehicle_of(given["benchmark"], given["route"], given["vehicle"], given["load"])
        self.observer = offtrack_sim.Observer(given["benchmark"], routes=[given["route"]], vehicles=[vehicle])
        self.policy.check(self.observer)
        self.begun = False
        self.steering = self.speed = self.speed_before = 0.0
        self.heard: dict[str, Time] = {}
        """When a message of each topic came last."""
        self.trailer: Trailer | None = None
        self.target = np.zeros(1, dtype=np.float32)
        self.transforms = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.transforms, self)
        self.create_subscription(Odometry, "odom", self.hear_odometry, 10)
        self.create_subscription(AckermannDriveStamped, "steering_report", self.hear_steering, 10)
        self.commands = self.create_publisher(AckermannDriveStamped, "command", 10)
        self.timer = self.create_timer(PERIOD, self.step)

    def hear_odometry(self, message: Odometry) -> None:
        """Speed along the heading of ``base_link``."""
        self.speed, self.heard["odom"] = message.twist.twist.linear.x, self.get_clock().now()

    def hear_steering(self, message: AckermannDriveStamped) -> None:
        """Steer angle of the front axle."""
        self.steering, self.heard["steering_report"] = message.drive.steering_angle, self.get_clock().now()

    def pose(self, frame: str) -> TransformStamped:
        """Where a frame is in the map.

        Raises:
            tf2_ros.TransformException: For one that is not known.
            Unknown: For one that is not known any more.
        """
        found = self.transforms.lookup_transform("map", frame, Time())
        self.check(frame, Time.from_msg(found.header.stamp))
        return found

    def check(self, what: str, came: Time | None) -> None:
        """Raises Unknown for what has not come, or did so too long ago."""
        if came is None:
            raise Unknown(f"{what}: nothing has come")
        age = (self.get_clock().now() - came).nanoseconds * 1e-9
        if age > STALE:
            raise Unknown(f"{what}: {age:.2f} s old; {STALE} s at most")

    def step(self) -> None:
        """One observation and one command."""
        try:
            tractor, trailer = self.pose("base_link"), self.pose("trailer_link")
            for topic in ("odom", "steering_report"):
                self.check(topic, self.heard.get(topic))
        except (tf2_ros.TransformException, Unknown) as error:
            self.get_logger().warning(f"the truck brakes: {error}")
            self.brake()
            return
        place = tractor.transform.translation
        position = np.array([[place.x, place.y]])
        self.trailer = Trailer.of(trailer, self.trailer)
        heading, trailer_heading = np.array([yaw(tractor.transform.rotation)]), np.array([self.trailer.heading])
        speed = np.array([self.speed])
        if self.begun:
            seen = self.observer.observe(
                position,
                heading,
                trailer_heading,
                speed,
                steering=np.array([self.steering]),
                target_speed=self.target,
                acceleration=(speed - self.speed_before) / PERIOD,
                lateral_acceleration=speed * np.cos(heading - trailer_heading) * self.trailer.yaw_rate,
                trailer_roll=np.array([self.trailer.roll]),
                trailer_roll_rate=np.array([self.trailer.roll_rate]),
            )
        else:
            seen = self.observer.begin(position, heading, trailer_heading, speed)
            self.target, self.begun = speed.astype(np.float32), True
        self.speed_before = self.speed
        if seen.ended[0]:
            self.get_logger().info(f"the episode has ended: {offtrack_sim.Ended(int(seen.ended[0])).name.lower()}")
            self.brake()
            return
        steering, self.target = self.observer.command(self.policy.act(seen.values), self.target)
        self.publish(float(steering[0]), float(self.target[0]), 0.0)

    def brake(self) -> None:
        """Stops with the wheels as they are."""
        # The policy is told what was asked for, and how the truck slowed since the last step.
        self.target[:] = 0.0
        self.speed_before = self.speed
        self.publish(self.steering, 0.0, -BRAKING)

    def publish(self, steering: float, speed: float, acceleration: float) -> None:
        """A command: steer angle [rad], speed [m/s], and acceleration [m/s^2] or 0 for as quick as may be."""
        message = AckermannDriveStamped()
        message.header.stamp, message.header.frame_id = self.get_clock().now().to_msg(), "base_link"
        message.drive.steering_angle, message.drive.speed, message.drive.acceleration = steering, speed, acceleration
        self.commands.publish(message)


def vehicle_of(benchmark: str, route: str, vehicle: str, load: str) -> tuple[str, str]:
    """Vehicle and load as a benchmark names them: one with a single vehicle does not name it."""
    has_one = ("", load) in offtrack_sim.Observer(benchmark, routes=[route]).classes
    return "" if has_one else vehicle, load


def yaw(rotation: Quaternion) -> float:
    """Heading of a quaternion [rad]."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def roll(rotation: Quaternion) -> float:
    """Roll of a quaternion, to the right [rad]."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    return math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))


def main() -> None:
    rclpy.init()
    node = Driver()
    try:
        rclpy.spin(node)
    finally:
        node.destroy_node()
        rclpy.shutdown()


if __name__ == "__main__":
    main()
