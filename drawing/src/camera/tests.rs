use std::sync::LazyLock;

use glam::{DVec2, Vec2};
use offtrack::geometry::Curve;
use offtrack::map::{Gutter, Road};
use offtrack::physics;
use offtrack::scenario::APPROACH;
use offtrack::vehicle::swept::{Pose, corners, swept_path};

use super::*;

static DRIVEN: LazyLock<(Arc<Scenario>, World)> = LazyLock::new(|| {
    let scenario = Arc::new(Scenario::named("attard2023").unwrap());
    let world = World::bake(&scenario).unwrap();
    (scenario, world)
});

fn camera(side: u32) -> Camera {
    Camera::new(DRIVEN.0.clone(), &DRIVEN.1, side).unwrap()
}

/// A truck whose front axle is on the centre line of a route, `s` metres from its beginning, at least 1.
fn truck(route: u32, s: f64) -> Truck {
    let (_, line) = DRIVEN.0.routes().nth(route as usize).unwrap();
    let Pose { position, heading, trailer_heading, .. } =
        *swept_path(&DRIVEN.1.rigs[0], &line.centre_line.part(0.0, s), 8.0, 1.0).last().unwrap();
    let (position, heading, trailer_heading) = (position.as_vec2(), heading as f32, trailer_heading as f32);
    Truck { position, heading, trailer_heading, speed: 8.0, route, ..Truck::default() }
}

fn ranges(truck: &Truck) -> [f32; N_RAYS] {
    let world = &DRIVEN.1;
    physics::ranges(world.route_field(truck.route), &world.rigs[0], &world.rays[0], truck, world.params.sensor_range)
}

fn drawn(camera: &mut Camera, truck: &Truck, ended: Ended) -> Vec<u8> {
    camera.draw(&Shown { truck, ranges: &ranges(truck), ended, vehicles: &[] }).to_vec()
}

/// Column and row of a point of the world, for the route drawn last (pixels).
fn pixel_of(camera: &Camera, p: DVec2) -> DVec2 {
    camera.backdrops.last().unwrap().view.point(p) + DVec2::new(0.0, camera.format.caption.into())
}

/// The pixel of a picture at a point of the world.
fn seen(camera: &Camera, picture: &[u8], p: DVec2) -> [u8; 3] {
    let at = pixel_of(camera, p).floor();
    let first = 3 * (at.y as usize * camera.side() as usize + at.x as usize);
    picture[first..first + 3].try_into().unwrap()
}

fn is(colour: &'static str) -> [u8; 3] {
    Ink(colour, 1.0).channels()
}

/// Points of a truck that no detail covers: between the front wheels, and in the middle of the trailer.
fn middles(truck: &Truck) -> [DVec2; 2] {
    let rig = &DRIVEN.1.rigs[0];
    let [ahead, trailer_ahead] =
        [truck.heading, truck.trailer_heading].map(|heading| DVec2::from_angle(heading.into()));
    let body = &rig.trailer_body;
    let front_axle = truck.position.as_dvec2() + f64::from(rig.wheelbase) * ahead;
    [front_axle, truck.trailer_position(rig).as_dvec2() + 0.5 * f64::from(body.front + body.rear) * trailer_ahead]
}

#[test]
fn a_picture_has_three_bytes_for_each_pixel() {
    for side in [64, 241, 480] {
        assert_eq!(drawn(&mut camera(side), &truck(0, 20.0), Ended::Running).len(), 3 * (side * side) as usize);
    }
}

#[test]
fn a_side_out_of_range_is_refused() {
    for side in [0, 1, 63, 4097, u32::MAX] {
        let refused = Camera::new(DRIVEN.0.clone(), &DRIVEN.1, side).err();
        assert!(matches!(refused, Some(Error::Side(found)) if found == side), "{side}");
    }
    let said = Error::Side(63).to_string();
    assert_eq!(said, "a picture of 63 x 63 pixels cannot be drawn; its side must lie in 64..=4096 pixels");
}

#[test]
fn ground_road_kerbs_route_and_both_units_have_their_colours() {
    for route in [0, 20, 40, 60] {
        let mut camera = camera(960);
        let truck = truck(route, 30.0);
        let picture = drawn(&mut camera, &truck, Ended::Running);
        let at = |p: DVec2| seen(&camera, &picture, p);
        let [tractor, trailer] = middles(&truck);
        assert_eq!((at(tractor), at(trailer)), (is(colour::TRACTOR), is(colour::TRAILER)));

        let (place, line) = DRIVEN.0.routes().nth(route as usize).unwrap();
        let roundabout = &DRIVEN.0.places[place].roundabout;
        assert_eq!(at(DVec2::ZERO), is(colour::SOLID), "the island's middle");
        // The island's kerb on the side that is away from the truck.
        let away = -truck.position.as_dvec2().normalize();
        let kerb = at(roundabout.island_radius() * away);
        assert!(kerb.iter().all(|&channel| channel < 160), "{kerb:?}");
        // Points of the road that no line is near.
        let solid = roundabout.kerbs(Gutter::Solid);
        let lines: Vec<_> = roundabout.lanes().into_iter().chain([line.centre_line.clone()]).collect();
        let far = |p: DVec2| 15.0 < p.distance(tractor) && 1.0 < solid.signed_distance(p);
        let bare = |p: &DVec2| {
            far(*p) && lines.iter().all(|line| 1.0 < line.distance(*p)) && 3.0 < line.centre_line.distance(*p)
        };
        let radius = roundabout.outer_radius();
        let grid = (0..60).flat_map(|x| (0..60).map(move |y| (DVec2::new(x.into(), y.into()) / 30.0 - 1.0) * radius));
        let road: Vec<[u8; 3]> = grid.filter(bare).map(at).collect();
        let n_white = road.iter().filter(|&&pixel| pixel == is(colour::ROAD)).count();
        // Some are under a ray.
        assert!(5 < road.len() && 0.9 * (road.len() as f64) < n_white as f64, "{n_white} of {}", road.len());
        // The route ahead of the truck, halfway through, is greener than red or blue.
        let [red, green, blue] = at(line.centre_line.point_at(line.centre_line.length() - 10.0));
        assert!(red < green && blue < green && red < 200, "{red} {green} {blue}");
    }
}

#[test]
fn the_whole_truck_is_in_the_picture_at_the_start_and_at_the_end_of_every_route() {
    let (scenario, world) = &*DRIVEN;
    let rig = &world.rigs[0];
    let mut camera = camera(64);
    for route in 0..world.routes.len() as u32 {
        let waypoints = world.route_waypoints(route);
        drawn(&mut camera, &truck(route, APPROACH), Ended::Running);
        for waypoint in [waypoints[0], waypoints[waypoints.len() - 1]] {
            // Straight on the route, the middle of its wheelbase at the waypoint, as trucks begin.
            let heading = f64::from(waypoint.direction.to_angle());
            let along = waypoint.direction.as_dvec2();
            let position = waypoint.position.as_dvec2() - 0.5 * f64::from(rig.wheelbase) * along;
            let trailer_position = position + f64::from(rig.fifth_wheel - rig.trailer_wheelbase) * along;
            let both =
                [corners(&rig.tractor_body, position, heading), corners(&rig.trailer_body, trailer_position, heading)];
            for corner in both.as_flattened() {
                let at = pixel_of(&camera, *corner);
                let low = DVec2::new(0.0, camera.format.caption.into());
                assert!(
                    low.cmple(at).all() && at.cmplt(DVec2::splat(64.0)).all(),
                    "{}: {at}",
                    world.route_names[route as usize]
                );
            }
        }
    }
    assert_eq!(scenario.routes().count(), world.routes.len());
}

#[test]
fn equal_states_give_equal_bytes_whatever_was_drawn_between() {
    let mut camera = camera(240);
    let one = truck(3, 30.0);
    let first = drawn(&mut camera, &one, Ended::Running);
    let second = drawn(&mut camera, &truck(50, 40.0), Ended::TrailerCollided);
    assert_ne!(first, second);
    assert_eq!(drawn(&mut camera, &one, Ended::Running), first);
    assert_eq!(drawn(&mut self::camera(240), &one, Ended::Running), first);
}

#[test]
fn a_moved_truck_changes_pixels_near_it_and_its_rays_alone() {
    let mut camera = camera(480);
    let before = truck(5, 30.0);
    let after = truck(5, 33.0);
    let pictures = [before, after].map(|truck| {
        camera.draw(&Shown { truck: &truck, ranges: &[4.0; N_RAYS], ended: Ended::Running, vehicles: &[] }).to_vec()
    });
    let side = camera.side() as usize;
    let changed: Vec<usize> =
        (0..side * side).filter(|n| pictures[0][3 * n..][..3] != pictures[1][3 * n..][..3]).collect();
    assert!(200 < changed.len(), "{}", changed.len());
    // A trailer's far end is less than 9 m from its middle, the tractor's front less than 4 m from its front axle; rays
    // of 4 m begin at their outlines.
    let near = [before, after].map(|truck| middles(&truck));
    let scale = camera.backdrops.last().unwrap().view.scale;
    for n in changed {
        let at = DVec2::new((n % side) as f64, (n / side) as f64) + 0.5;
        let within = near.as_flattened().iter().any(|&middle| pixel_of(&camera, middle).distance(at) < 10.0 * scale);
        assert!(within, "{at}");
    }
}

#[test]
fn the_unit_that_failed_has_the_warning_colour_and_an_end_is_told_in_words() {
    let mut camera = camera(480);
    let truck = truck(8, 30.0);
    let running = drawn(&mut camera, &truck, Ended::Running);
    let caption = 3 * (camera.format.caption * camera.side()) as usize;
    for ended in Ended::ALL {
        let picture = drawn(&mut camera, &truck, ended);
        let warned = middles(&truck).map(|p| seen(&camera, &picture, p) == is(colour::OVERLAP));
        let expected = match ended {
            // Where another drove into the truck, the truck did not fail.
            Ended::Running | Ended::Arrived | Ended::TimedOut | Ended::WasMet => [false, false],
            Ended::TractorCollided => [true, false],
            Ended::TrailerCollided => [false, true],
            Ended::RolledOver | Ended::Jackknifed | Ended::Strayed | Ended::MetVehicle => [true, true],
        };
        assert_eq!(warned, expected, "{ended:?}");
        assert_eq!(picture[..caption] == running[..caption], ended == Ended::Running, "{ended:?}");
    }
}

#[test]
fn backgrounds_are_kept_up_to_a_bound_and_those_last_used_stay() {
    let mut camera = camera(64);
    let n_routes = DRIVEN.1.routes.len() as u32;
    assert!((N_KEPT as u32) < n_routes);
    for route in 0..n_routes {
        drawn(&mut camera, &truck(0, 20.0), Ended::Running);
        drawn(&mut camera, &truck(route, 20.0), Ended::Running);
        assert!(camera.backdrops.len() <= N_KEPT);
    }
    assert_eq!(camera.backdrops.len(), N_KEPT);
    let kept: Vec<u32> = camera.backdrops.iter().map(|backdrop| backdrop.route).collect();
    let last: Vec<u32> = (n_routes - N_KEPT as u32 + 1..n_routes - 1).chain([0, n_routes - 1]).collect();
    assert_eq!(kept, last);
    for side in [64, 480, 1000, 1024, 2048, 4096] {
        assert!(
            (1..=N_KEPT).contains(&n_kept(side)) && n_kept(side) * 4 * (side * side) as usize <= KEPT_BYTES,
            "{side}"
        );
    }
}

#[test]
fn no_state_is_too_far_off_to_be_drawn() {
    let mut camera = camera(96);
    let there = truck(2, 30.0);
    drawn(&mut camera, &there, Ended::Running);
    let empty = camera.backdrops.last().unwrap().pixels.clone();
    for far in [1e2, 1e3, 3e4, 1e9, f32::MAX, f32::INFINITY, f32::NAN] {
        let truck = Truck { position: Vec2::new(far, -far), ..there };
        for range in [0.0, -1.0, 1e30, f32::INFINITY, f32::NAN] {
            let picture =
                camera.draw(&Shown { truck: &truck, ranges: &[range; N_RAYS], ended: Ended::Strayed, vehicles: &[] });
            let below = 96 * 20;
            let map = picture[3 * below..].chunks_exact(3).zip(empty[4 * below..].chunks_exact(4));
            assert!(far < 1e3 || map.into_iter().all(|(rgb, rgba)| rgb == &rgba[..3]), "{far}");
        }
    }
    for value in [1e30, f32::INFINITY, f32::NAN] {
        let truck = Truck { heading: value, trailer_heading: -value, steering: value, speed: -value, ..there };
        camera.draw(&Shown { truck: &truck, ranges: &[value; N_RAYS], ended: Ended::Running, vehicles: &[] });
    }
    // No scenario has this route.
    let truck = Truck { route: u32::MAX, ..there };
    camera.draw(&Shown { truck: &truck, ranges: &[5.0; N_RAYS], ended: Ended::Running, vehicles: &[] });
}

#[test]
fn a_left_hand_road_is_drawn_as_it_lies_and_not_as_it_is_driven() {
    let mut scenario = (*DRIVEN.0).clone();
    for place in &mut scenario.places {
        let ground = offtrack::map::ground::Ground { mirrored: true, ..place.roundabout.ground().clone() };
        place.roundabout = Road::on(place.roundabout.name.clone(), ground);
    }
    let (mut right, mut left) = (camera(240), Camera::new(Arc::new(scenario), &DRIVEN.1, 240).unwrap());
    let truck = truck(0, 30.0);
    let [one, other] = [&mut right, &mut left].map(|camera| drawn(camera, &truck, Ended::Running));
    // Below the caption the rows of one are those of the other in opposite order, but for the rounding of edges.
    let (side, caption) = (right.side() as usize, right.format.caption as usize);
    let row = |picture: &[u8], row: usize| picture[3 * side * row..][..3 * side].to_vec();
    let difference = |flipped: bool| {
        let rows =
            (caption..side).map(|n| (row(&one, n), row(&other, if flipped { side - 1 - (n - caption) } else { n })));
        let all: Vec<f64> = rows
            .flat_map(|(a, b)| a.into_iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(b))).collect::<Vec<_>>())
            .collect();
        all.iter().sum::<f64>() / all.len() as f64
    };
    assert!(difference(true) < 1.0, "{}", difference(true));
    assert!(5.0 < difference(false), "{}", difference(false));
    // The truck stands on its lane.
    for middle in middles(&truck) {
        assert_eq!(seen(&left, &other, middle), seen(&right, &one, middle));
    }
}

#[test]
fn another_vehicle_is_where_it_is_with_the_colour_of_its_kind_and_lit_brakes() {
    let mut camera = camera(512);
    let truck = truck(0, 20.0);
    let car = Vehicle {
        slot: 0,
        position: [0.0, 20.0],
        heading: 0.5,
        length: 4.5,
        width: 1.8,
        speed: 5.0,
        acceleration: 0.0,
        is_rude: false,
    };
    let van = Vehicle { length: 7.0, width: 2.1, ..car };
    let braking = Vehicle { acceleration: -2.0, ..car };
    let [plain, _, lit] = [(car, colour::CAR), (van, colour::VAN), (braking, colour::CAR)].map(|(vehicle, kind)| {
        let vehicles = [vehicle];
        let shown = Shown { truck: &truck, ranges: &ranges(&truck), ended: Ended::Running, vehicles: &vehicles };
        let picture = camera.draw(&shown).to_vec();
        let [x, y] = vehicle.position.map(f64::from);
        assert_eq!(seen(&camera, &picture, DVec2::new(x, y)), is(kind));
        picture
    });
    // Brake lights are smaller than pixels: these turn red.
    let changed = plain.chunks_exact(3).zip(lit.chunks_exact(3)).filter(|(plain, lit)| plain != lit);
    let (n, n_redder) = changed.fold((0, 0), |(n, n_redder), (plain, lit)| {
        let redness = |pixel: &[u8]| i32::from(pixel[0]) - i32::from(pixel[1]);
        (n + 1, n_redder + usize::from(redness(plain) < redness(lit)))
    });
    assert!(0 < n && n == n_redder, "{n_redder} of {n}");
    assert_ne!(drawn(&mut camera, &truck, Ended::Running), {
        let shown = Shown { truck: &truck, ranges: &ranges(&truck), ended: Ended::Running, vehicles: &[car] };
        camera.draw(&shown).to_vec()
    });
}

#[test]
fn an_apron_has_a_colour_of_its_own_up_to_its_inner_edge() {
    let roundabout = &DRIVEN.0.places[0].roundabout;
    let radius = roundabout.island_radius();
    let aprons = vec![Curve::circle(DVec2::ZERO, radius - 2.5)];
    let ground = offtrack::map::ground::Ground { aprons, ..roundabout.ground().clone() };
    let scenario = Arc::new(DRIVEN.0.on(Road::on("apron".into(), ground)).unwrap());
    let mut camera = Camera::new(scenario.clone(), &World::bake(&scenario).unwrap(), 960).unwrap();
    let truck = Truck { route: 0, ..truck(0, 20.0) };
    let shown = Shown { truck: &truck, ranges: &[0.0; N_RAYS], ended: Ended::Running, vehicles: &[] };
    let picture = camera.draw(&shown).to_vec();
    let away = -truck.position.as_dvec2().normalize();
    let at = |inwards: f64| seen(&camera, &picture, (radius - inwards) * away);
    assert_eq!((at(1.25), at(3.75)), (is(colour::APRON), is(colour::SOLID)));
    let inner_edge = at(2.5);
    assert!(inner_edge.iter().all(|&channel| channel < 160), "{inner_edge:?}");
}
