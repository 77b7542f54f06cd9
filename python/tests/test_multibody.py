"""The multibody truck of the examples is the truck of its file, and moves as geometry and tilt tables say."""

from __future__ import annotations

import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

if sys.version_info < (3, 11):
    pytest.skip("the truck's files are read by Python 3.11 or later", allow_module_level=True)

import multibody_parts as parts

VEHICLES = Path(__file__).parents[2] / "scenarios" / "vehicles"


def truck(name: str, load: str) -> parts.Parts:
    return parts.read(VEHICLES / f"{name}.toml", load)


@pytest.mark.parametrize("name", list(parts.GROUPS))
@pytest.mark.parametrize("load", ["empty", "half", "laden", "laden_high", "laden_worst"])
def test_masses_heights_and_axle_loads_are_the_files(name: str, load: str) -> None:
    file, found = parts.written(VEHICLES / f"{name}.toml"), truck(name, load)
    mass = file["tractor"]["mass"] + file["loads"][load]["mass"]
    assert found.mass == pytest.approx(mass)
    assert sum(axle.load for axle in found.axles) == pytest.approx(mass * parts.GRAVITY)
    group = sum(axle.mass for axle in found.group)
    height = (found.trailer.mass * found.trailer.height + group * parts.WHEEL_RADIUS) / (found.trailer.mass + group)
    assert height == pytest.approx(file["loads"][load]["suspension"]["centre_of_gravity"])
    middle = sum(axle.ahead for axle in found.group) / len(found.group)
    assert -middle == pytest.approx(file["trailer"]["wheelbase"])


@pytest.mark.parametrize("load", ["empty", "laden"])
def test_tyres_at_rest_slip_as_the_file_says(load: str) -> None:
    found = truck("daf_xf", load)
    axle = found.group[0]
    force = axle.load / (2 * axle.n_tyres)
    coefficient = found.cornering / (1 + (force / axle.peak_load) ** 2)
    assert 1 / (parts.GRAVITY * coefficient) == pytest.approx(found.slip)


def test_a_vehicle_or_load_that_is_not_known_is_refused_with_those_that_are() -> None:
    with pytest.raises(ValueError, match="vehicle: 'van'; the axles of daf_xf, eu_4x2_13m6, us_wb62 are known"):
        truck("van", "empty")
    with pytest.raises(ValueError, match="load: 'full'; daf_xf has empty, half, laden"):
        truck("daf_xf", "full")


def test_the_model_has_every_body_of_every_truck() -> None:
    model = ElementTree.fromstring(parts.mjcf(truck("eu_4x2_13m6", "empty"), 2, 0.002, 3e6))
    # Tractor, trailer, front, drive and three trailer axles each.
    assert len(list(model.iter("body"))) == 2 * 7
    total = sum(float(inertial.attrib["mass"]) for inertial in model.iter("inertial"))
    assert total == pytest.approx(2 * (7800 + 6800))


def test_a_tyre_is_as_stiff_as_stated_and_holds_no_more_than_friction_gives() -> None:
    pytest.importorskip("mujoco")
    import numpy as np
    from multibody import brush

    stiffness, most = np.array(150e3), np.array(20e3)
    slips = np.array([-1e-6, 1e-6, -0.5, 0.39, 0.5])
    np.testing.assert_allclose(brush(slips, stiffness, most), [-0.15, 0.15, -20e3, 20e3, 20e3], rtol=1e-3)
    # All of the contact slides from 3 F / C on.
    assert brush(np.array(0.39), stiffness, most) < most <= brush(np.array(0.41), stiffness, most)


def test_a_truck_at_rest_stays_where_it_is_on_the_loads_of_the_file() -> None:
    pytest.importorskip("mujoco")
    import numpy as np
    from multibody import Trucks

    trucks = Trucks(truck("daf_xf", "laden"), 2)
    trucks.advance(np.zeros(2), np.zeros(2), 500)
    expected = [axle.load / 2 for axle in trucks.parts.axles]
    np.testing.assert_allclose(trucks.loads, np.stack([expected, expected], axis=1)[None].repeat(2, 0), rtol=0.01)
    assert np.abs(trucks.position).max() < 0.01 and np.abs(trucks.trailer_roll).max() < 1e-6


def test_trucks_beside_each_other_drive_as_one_alone_and_a_right_turn_mirrors_a_left_one() -> None:
    pytest.importorskip("mujoco")
    import numpy as np
    from multibody import Trucks

    def driven(steering: list[float]) -> tuple[np.ndarray, np.ndarray]:
        n = len(steering)
        trucks = Trucks(truck("daf_xf", "laden"), n)
        trucks.place(np.arange(n), np.zeros((n, 2)), np.zeros(n), np.zeros(n), np.full(n, 6.0))
        trucks.advance(np.array(steering), np.zeros(n), 1000)
        return trucks.trailer_position, trucks.load_transfer_ratio

    (left, right, straight), ratios = driven([0.2, -0.2, 0.0])
    np.testing.assert_allclose(left, [right[0], -right[1]], atol=1e-6)
    assert ratios[0] > 0.05 and ratios[0] == pytest.approx(-ratios[1], abs=1e-6)
    assert abs(straight[1]) < 1e-9
    (alone,), _ = driven([0.2])
    np.testing.assert_allclose(alone, left, atol=1e-6)


def test_the_design_vehicle_turns_inside_as_aashto_publishes() -> None:
    pytest.importorskip("mujoco")
    from multibody_checks import design_vehicle

    (row,) = design_vehicle(VEHICLES)
    # AASHTO rounds to a tenth of a foot.
    assert row.found == pytest.approx(row.expected, abs=0.05)


def test_off_tracking_at_walking_pace_is_the_sum_of_squares() -> None:
    pytest.importorskip("mujoco")
    import numpy as np
    from multibody_checks import CRAWL, circled, off_tracking, sum_of_squares

    one_axle = parts.read(VEHICLES / "eu_4x2_13m6.toml", "empty", one_axle=True)
    ((front,), (inside,)) = off_tracking(circled(one_axle, np.array([20.0]), np.array([CRAWL])))
    # Tyres slip a little at any speed.
    assert inside == pytest.approx(sum_of_squares(one_axle, front, one_axle.trailer_wheelbase), abs=0.005)


def test_a_laden_trailers_wheels_lift_between_a_fifth_wheel_free_in_roll_and_a_stiff_one() -> None:
    pytest.importorskip("mujoco")
    from multibody import HITCH_STIFFNESS
    from multibody_checks import lifted

    laden = truck("daf_xf", "laden")
    expected = parts.threshold(parts.written(VEHICLES / "daf_xf.toml")["loads"]["laden"]["suspension"])
    free, stiff = (lifted(laden, 0.75 * expected, stiffness) for stiffness in (0.0, HITCH_STIFFNESS))
    assert 0.8 * expected < free < expected < stiff < 1.2 * expected
