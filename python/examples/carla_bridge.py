"""Lets a policy drive a tractor-semitrailer in CARLA.

    python carla_bridge.py --benchmark town.toml --route town03/E-left-1 --truck vehicle.daf.dafxf \\
        --trailer vehicle.trailer.trailer

**The drive loop has not run against a CARLA server.** The names that it uses were checked against the client 0.9.16 of
PyPI; conversions, frames and starts are tested, on Town03 with ``carla.Map``, which needs no server. CARLA has no
articulated truck of its own: the blueprints must come from a map or fork that has a tractor and a trailer that hitches
to it. A benchmark for a road of the map is made from ``world.get_map().to_opendrive()`` by ``offtrack import``.

CARLA's frame is the map's mirrored: y points to the right, yaw is clockwise and in degrees, and steering is positive to
the right. ``offtrack_sim.Observer`` takes the map's frame and knows where in it the road lies and on which side it is
driven.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

PERIOD = 0.1
"""Time between two actions, the simulator's step [s]."""
STEER_RATE = 0.35
"""Rate at which the front wheels turn [rad/s]: 20 deg/s, as in the vehicle files."""
CENTIMETRES = 0.01
"""Of the positions of wheels in a physics control [m]."""


@dataclass(frozen=True)
class Place:
    """Where an actor is in CARLA's frame: x and y [m], yaw [deg]."""

    x: float
    y: float
    yaw: float

    @staticmethod
    def of(transform: Any) -> Place:
        """That of a ``carla.Transform``."""
        return Place(transform.location.x, transform.location.y, transform.rotation.yaw)

    def ahead(self, distance: float) -> Place:
        """The place so far ahead of it, behind where the distance is negative [m]."""
        yaw = math.radians(self.yaw)
        return Place(self.x + distance * math.cos(yaw), self.y + distance * math.sin(yaw), self.yaw)

    def distance_ahead(self, x: float, y: float) -> float:
        """How far ahead of it a point lies [m]."""
        yaw = math.radians(self.yaw)
        return (x - self.x) * math.cos(yaw) + (y - self.y) * math.sin(yaw)


def to_carla(position: Array, heading: float) -> Place:
    """A position [m] and heading [rad] of the map in CARLA's frame."""
    return Place(float(position[0]), -float(position[1]), -math.degrees(heading))


def from_carla(place: Place) -> tuple[Array, float]:
    """A place in CARLA's frame as position [m] and heading [rad] of the map."""
    return np.array([place.x, -place.y]), -math.radians(place.yaw)


def start(position: Array, heading: float, wheelbase: float) -> Place:
    """Where the drive axle stands when the middle of the wheelbase [m] is on a waypoint of the map, as in an episode's
    start."""
    return to_carla(position, heading).ahead(-0.5 * wheelbase)


def speed_along(velocity_x: float, velocity_y: float, yaw: float) -> float:
    """Speed along a yaw [deg] of a velocity in CARLA's frame [m/s]."""
    return velocity_x * math.cos(math.radians(yaw)) + velocity_y * math.sin(math.radians(yaw))


def steer_to_carla(angle: float) -> float:
    """A steer angle of ``VehicleAckermannControl``, positive to the right, for one positive to the left [rad]."""
    return -angle


def steer_from_wheels(left: float, right: float) -> float:
    """Steer angle of the front axle, positive to the left [rad], from those of its wheels, positive to the right [deg].

    Of wheels that turn about one centre the mean of the cotangents is the axle's; of wheels with toe, which all but
    straight ones turn to different sides by, that of the angles.
    """
    tangents = math.tan(math.radians(left)), math.tan(math.radians(right))
    if tangents[0] * tangents[1] <= 0.0:
        return -math.radians(0.5 * (left + right))
    return -math.atan(2 / (1 / tangents[0] + 1 / tangents[1]))


class Truck:
    """A tractor and its trailer in a CARLA world, which ticks once a step."""

    def __init__(self, carla: Any, world: Any, tractor: Any, trailer: Any) -> None:
        self._carla, self._world, self._tractor, self._trailer = carla, world, tractor, trailer
        place, wheels = Place.of(tractor.get_transform()), tractor.get_physics_control().wheels
        at = [(CENTIMETRES * wheel.position.x, CENTIMETRES * wheel.position.y) for wheel in wheels]
        ahead = sorted(place.distance_ahead(x, y) for x, y in at)
        self.drive_axle = 0.5 * (ahead[0] + ahead[1])
        """Drive axle ahead of the actor's origin, negative where it is behind [m]."""
        self._roll: float = trailer.get_transform().rotation.roll

    def pose(self) -> dict[str, Any]:
        """What ``Observer.begin`` takes, of one truck."""
        place = Place.of(self._tractor.get_transform())
        position, heading = from_carla(place.ahead(self.drive_axle))
        _, trailer_heading = from_carla(Place.of(self._trailer.get_transform()))
        # Along the heading all points of a body are equally fast but for those beside its middle line.
        velocity = self._tractor.get_velocity()
        return {
            "position": position[None],
            "heading": np.array([heading]),
            "trailer_heading": np.array([trailer_heading]),
            "speed": np.array([speed_along(velocity.x, velocity.y, place.yaw)]),
        }

    def telemetry(self) -> dict[str, Any]:
        """What ``Observer.observe`` takes besides, but for the target speed."""
        wheel = self._carla.VehicleWheelLocation
        left, right = (self._tractor.get_wheel_steer_angle(at) for at in (wheel.FL_Wheel, wheel.FR_Wheel))
        transform, acceleration = self._tractor.get_transform(), self._tractor.get_acceleration()
        trailer = self._trailer.get_transform()
        velocity, yaw_rate = self._trailer.get_velocity(), -math.radians(self._trailer.get_angular_velocity().z)
        speed = speed_along(velocity.x, velocity.y, trailer.rotation.yaw)
        # By its change, so that both have one sign.
        roll_rate, self._roll = (trailer.rotation.roll - self._roll) / PERIOD, trailer.rotation.roll
        return {
            "steering": np.array([steer_from_wheels(left, right)]),
            "acceleration": np.array([speed_along(acceleration.x, acceleration.y, transform.rotation.yaw)]),
            "lateral_acceleration": np.array([speed * yaw_rate]),
            # Clockwise seen from behind in CARLA, which is to the right.
            "trailer_roll": np.array([math.radians(trailer.rotation.roll)]),
            "trailer_roll_rate": np.array([math.radians(roll_rate)]),
        }

    def command(self, steering: float, speed: float) -> None:
        """Asks for a steer angle [rad] and a speed [m/s], and lets the world go on by a step."""
        control = self._carla.VehicleAckermannControl(
            steer=steer_to_carla(steering), steer_speed=STEER_RATE, speed=speed
        )
        self._tractor.apply_ackermann_control(control)
        self._world.tick()


def synchronous(world: Any) -> None:
    """Lets the world wait for a tick, in which a step passes."""
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, PERIOD
    settings.substepping, settings.max_substep_delta_time, settings.max_substeps = True, 0.01, 10
    world.apply_settings(settings)


def spawn(carla: Any, world: Any, args: argparse.Namespace, axle: Place) -> Iterator[Any]:
    """A tractor whose drive axle is about there, and a trailer in line behind it: one after the other, so that the
    caller has the first where there is no room for the second."""
    library = world.get_blueprint_library()

    def made(blueprint: str, place: Place) -> Any:
        location = carla.Location(x=place.x, y=place.y, z=args.height)
        return world.spawn_actor(library.find(blueprint), carla.Transform(location, carla.Rotation(yaw=place.yaw)))

    yield made(args.truck, axle.ahead(args.tractor_ahead))
    yield made(args.trailer, axle.ahead(args.trailer_ahead))


def drive(args: argparse.Namespace) -> str:
    """One episode; returns why it ended."""
    import carla  # The client, which no conversion needs.

    import offtrack_sim

    policy = offtrack_sim.Policy.shipped(args.policy)
    # A benchmark with one vehicle does not name it.
    has_one = ("", args.load) in offtrack_sim.Observer(args.benchmark, routes=[args.route]).classes
    vehicle = ("" if has_one else args.vehicle, args.load)
    observer = offtrack_sim.Observer(args.benchmark, routes=[args.route], vehicles=[vehicle])
    policy.check(observer)
    client = carla.Client(args.host, args.port)
    client.set_timeout(20.0)
    world = client.get_world()
    before = world.get_settings()
    actors: list[Any] = []
    try:
        synchronous(world)
        x, y, heading = observer.waypoints(args.route)[0]
        for actor in spawn(carla, world, args, start(np.array([x, y]), heading, args.wheelbase)):
            actors.append(actor)
        for _ in range(20):
            world.tick()  # The truck settles in its springs, and hitches.
        truck = Truck(carla, world, *actors)
        seen = observer.begin(**truck.pose())
        target = np.zeros(1, dtype=np.float32)
        while not seen.ended[0]:
            steering, target = observer.command(policy.act(seen.values), target)
            truck.command(float(steering[0]), float(target[0]))
            seen = observer.observe(**truck.pose(), **truck.telemetry(), target_speed=target)
        return offtrack_sim.Ended(int(seen.ended[0])).name.lower()
    finally:
        for actor in reversed(actors):
            actor.destroy()
        world.apply_settings(before)


def main() -> None:
    parser = argparse.ArgumentParser(
        description="A policy in CARLA", formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("--host", default="localhost")
    parser.add_argument("--port", type=int, default=2000)
    parser.add_argument("--policy", default="laden2026", help="a shipped policy's name")
    parser.add_argument("--benchmark", required=True, help="benchmark file with a road of the server's map")
    parser.add_argument("--route", required=True, help="name of a route of it")
    parser.add_argument("--vehicle", default="daf_xf", help="vehicle of the benchmark that is nearest to the truck")
    parser.add_argument("--load", default="empty")
    parser.add_argument("--truck", required=True, help="blueprint of the tractor")
    parser.add_argument("--trailer", required=True, help="blueprint of the trailer")
    parser.add_argument("--wheelbase", type=float, default=3.543, help="of the tractor [m]")
    parser.add_argument(
        "--tractor-ahead", type=float, default=1.8, help="the tractor's origin ahead of its drive axle [m]"
    )
    parser.add_argument("--trailer-ahead", type=float, default=-4.5, help="the trailer's origin ahead of it [m]")
    parser.add_argument("--height", type=float, default=0.5, help="at which both are spawned [m]")
    print(drive(parser.parse_args()))


if __name__ == "__main__":
    main()
