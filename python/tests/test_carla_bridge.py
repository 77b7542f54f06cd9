"""What goes to CARLA and comes from it means the same there: frames, signs, starts."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from carla_bridge import Place, Truck, from_carla, speed_along, start, steer_from_wheels, steer_to_carla, to_carla

import offtrack_sim

MAP = Path(__file__).parents[2] / "scenarios" / "maps" / "Town03.xodr"
# Centre of the lane at which a route begins: x, y [m] and yaw [deg], from carla.Map of the client 0.9.16.
CENTRES = {"town03/E-left-1": (64.047523, -4.023860, -179.144196)}


def test_a_pose_goes_to_carla_and_back_within_a_nanometre() -> None:
    for position, heading in [((64.0, 4.0), 3.1), ((-3.5, -70.25), -1.2)]:
        there = to_carla(np.array(position), heading)
        assert there == Place(position[0], -position[1], -math.degrees(heading))
        back, turned = from_carla(there)
        np.testing.assert_allclose(back, position, atol=1e-9)
        assert turned == pytest.approx(heading, abs=1e-12)


def test_left_of_the_map_is_left_in_carla_where_angles_are_clockwise() -> None:
    # North of the map is CARLA's -y, and ahead of a truck that heads there.
    north = to_carla(np.zeros(2), math.pi / 2)
    assert north.ahead(2.0).x == pytest.approx(0.0) and north.ahead(2.0).y == pytest.approx(-2.0)
    assert north.distance_ahead(1.0, -5.0) == pytest.approx(5.0)
    assert speed_along(3.0, -7.0, north.yaw) == pytest.approx(7.0)
    assert steer_to_carla(0.3) == -0.3


def test_the_axles_steer_angle_is_between_those_of_its_wheels() -> None:
    wheelbase, track, angle = 3.543, 1.95, 0.4
    middle = wheelbase / math.tan(angle)
    left, right = (-math.degrees(math.atan(wheelbase / (middle + side * track / 2))) for side in (-1, 1))
    assert steer_from_wheels(left, right) == pytest.approx(angle)
    assert steer_from_wheels(-right, -left) == pytest.approx(-angle)
    assert steer_from_wheels(0.0, 0.0) == 0.0
    for toe in (0.01, 0.2):
        assert steer_from_wheels(toe, -toe) == 0.0
        assert abs(steer_from_wheels(toe, -1.001 * toe)) < math.radians(0.001)


def test_a_truck_is_where_its_drive_axle_is_and_as_fast_as_along_its_heading() -> None:
    def vector(x: float, y: float) -> SimpleNamespace:
        return SimpleNamespace(x=x, y=y, z=0.0)

    def transform(x: float, y: float, yaw: float) -> SimpleNamespace:
        return SimpleNamespace(location=vector(x, y), rotation=SimpleNamespace(yaw=yaw, roll=0.0))

    # It heads to the map's south-west, its axles 1.6 m ahead of its origin and 2 m behind; positions in centimetres.
    place = Place(10.0, 20.0, 135.0)
    wheels = [place.ahead(distance) for distance in (1.6, 1.6, -2.0, -2.0)]
    tractor = SimpleNamespace(
        get_transform=lambda: transform(10.0, 20.0, 135.0),
        get_velocity=lambda: vector(-5.0, 5.0),
        get_physics_control=lambda: SimpleNamespace(
            wheels=[SimpleNamespace(position=vector(100 * wheel.x, 100 * wheel.y)) for wheel in wheels]
        ),
    )
    trailer = SimpleNamespace(get_transform=lambda: transform(14.0, 16.0, 120.0))
    truck = Truck(None, None, tractor, trailer)
    assert truck.drive_axle == pytest.approx(-2.0)
    pose = truck.pose()
    np.testing.assert_allclose(pose["position"], [[10 + math.sqrt(2), -20 + math.sqrt(2)]])
    assert pose["heading"][0] == pytest.approx(-math.radians(135))
    assert pose["trailer_heading"][0] == pytest.approx(-math.radians(120))
    assert pose["speed"][0] == pytest.approx(math.hypot(5, 5))


@pytest.mark.parametrize("route", list(CENTRES))
def test_a_route_begins_where_carla_has_the_middle_of_a_lane(route: str) -> None:
    observer = offtrack_sim.Observer("maps2026", routes=[route])
    x, y, heading = observer.waypoints(route)[0]
    position = np.array([x, y])
    there, centre = to_carla(position, heading), Place(*CENTRES[route])
    assert abs(centre.distance_ahead(there.x, there.y)) < 0.05
    assert math.dist((there.x, there.y), (centre.x, centre.y)) < 0.05
    assert math.remainder(there.yaw - centre.yaw, 360.0) == pytest.approx(0.0, abs=0.1)
    # The drive axle is behind it by half the wheelbase.
    axle = start(position, heading, 3.5)
    assert there.distance_ahead(axle.x, axle.y) == pytest.approx(-1.75)


def test_every_route_of_town03_begins_in_the_middle_of_a_lane_of_the_clients_map() -> None:
    carla = pytest.importorskip("carla")
    lanes = carla.Map("Town03", MAP.read_text())
    names = [name for name in offtrack_sim.Batch("maps2026", split="test").route_names if name.startswith("town03/")]
    observer = offtrack_sim.Observer("maps2026", routes=names)
    assert len(names) == 28
    for name in names:
        x, y, heading = observer.waypoints(name)[0]
        there = to_carla(np.array([x, y]), heading)
        centre = Place.of(lanes.get_waypoint(carla.Location(x=there.x, y=there.y)).transform)
        assert math.dist((there.x, there.y), (centre.x, centre.y)) < 0.01, name
        assert math.remainder(there.yaw - centre.yaw, 360.0) == pytest.approx(0.0, abs=0.1), name
