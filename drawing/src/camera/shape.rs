//! What changes from picture to picture: both units of a truck, and its distance sensors.

use glam::{DVec2, Vec2};
use offtrack::layout::{Body, Ended, N_RAYS, N_TRAILER_RAYS, Ray, Rig};
use offtrack::vehicle::swept::corners;
use offtrack::world::World;
use offtrack_evaluation::recording::Vehicle;

use super::Shown;
use super::canvas::{Canvas, Ink};
use crate::episode::vehicles::{brake_lights, kind};
use crate::episode::{GAUGE, WHEEL};
use crate::view::{View, colour};

/// The windscreen's edges behind the front end (m).
const SCREEN_FRONT: f32 = 0.25;
const SCREEN_REAR: f32 = 0.8;

/// Dimensions of the trucks of a world.
pub struct Shape {
    /// Rigs and rays as the world numbers vehicles and chassis.
    rigs: Vec<Rig>,
    rays: Vec<[Ray; N_RAYS]>,
    sensor_range: f32,
}

impl Shape {
    pub fn of(world: &World) -> Shape {
        Shape { rigs: world.rigs.clone(), rays: world.rays.clone(), sensor_range: world.params.sensor_range }
    }

    /// A truck on a map. A line of width 1 is `pen` wide (px).
    pub fn draw(&self, map: &mut Canvas, view: &View, pen: f64, shown: &Shown) {
        self.rays(map, view, pen, shown);
        shown.vehicles.iter().for_each(|vehicle| draw_vehicle(map, view, pen, vehicle));
        self.units(map, view, pen, shown);
    }

    /// The distance sensors, with a dot where one meets a kerb.
    fn rays(&self, map: &mut Canvas, view: &View, pen: f64, Shown { truck, ranges, .. }: &Shown) {
        let rig = &self.rigs[truck.vehicle as usize];
        let tractor = (point(truck.position), f64::from(truck.heading));
        let trailer = (point(truck.trailer_position(rig)), f64::from(truck.trailer_heading));
        let (mut met, mut free, mut dots) = (Vec::new(), Vec::new(), Vec::new());
        for (n, (ray, &range)) in self.rays[rig.chassis as usize].iter().zip(*ranges).enumerate() {
            let (position, heading) = if n < N_TRAILER_RAYS { trailer } else { tractor };
            let ahead = DVec2::from_angle(heading);
            let from = position + ahead.rotate(point(ray.origin));
            let to = from + f64::from(range.clamp(0.0, self.sensor_range)) * ahead.rotate(point(ray.direction));
            let line = [from, to].map(|p| view.point(p));
            if range < self.sensor_range {
                met.push(line);
                dots.push(line[1]);
            } else {
                free.push(line);
            }
        }
        map.lines(&free, false, Ink(colour::RAY, 0.22), pen);
        map.lines(&met, false, Ink(colour::RAY, 0.5), pen);
        map.dots(&dots, 1.7 * pen, Ink(colour::RAY, 1.0));
    }

    /// Both units, the trailer above the tractor, with windscreen, steered front wheels and hitch.
    fn units(&self, map: &mut Canvas, view: &View, pen: f64, Shown { truck, ended, .. }: &Shown) {
        let rig = &self.rigs[truck.vehicle as usize];
        let (position, heading) = (point(truck.position), f64::from(truck.heading));
        let ahead = DVec2::from_angle(heading);
        let on_page =
            |body: &Body, position: DVec2, heading: f64| corners(body, position, heading).map(|p| view.point(p));
        // A kerb is touched by one unit; other failures are of the whole truck.
        let fill = |colour, of_the_other| {
            Ink(if ended.failed() && *ended != of_the_other { colour::OVERLAP } else { colour }, 1.0)
        };

        let body = on_page(&rig.tractor_body, position, heading);
        map.polygon(&body, fill(colour::TRACTOR, Ended::TrailerCollided), Ink(colour::DRIVE_AXLE, 1.0), 1.2 * pen);
        let front = rig.tractor_body.front;
        let windscreen = Body {
            front: front - SCREEN_FRONT,
            rear: front - SCREEN_REAR,
            half_width: 0.82 * rig.tractor_body.half_width,
        };
        map.areas(&[on_page(&windscreen, position, heading)], Ink(colour::ROAD, 0.9));
        let axle = position + f64::from(rig.wheelbase) * ahead;
        let half = 0.5 * WHEEL * DVec2::from_angle(heading + f64::from(truck.steering));
        let wheel = |side: f64| axle + 0.5 * side * GAUGE * ahead.perp();
        let wheels = [1.0, -1.0].map(|side| [wheel(side) - half, wheel(side) + half].map(|p| view.point(p)));
        map.lines(&wheels, false, Ink(colour::INK, 1.0), (0.32 * view.scale).max(1.2 * pen));

        let body = on_page(&rig.trailer_body, point(truck.trailer_position(rig)), truck.trailer_heading.into());
        map.polygon(&body, fill(colour::TRAILER, Ended::TractorCollided), Ink(colour::TRAILER_AXLES, 1.0), 1.2 * pen);
        let hitch = view.point(position + f64::from(rig.fifth_wheel) * ahead);
        map.dots(&[hitch], (0.35 * view.scale).max(1.3 * pen), Ink(colour::INK, 1.0));
    }
}

/// Another vehicle, with its brake lights if they are lit.
fn draw_vehicle(map: &mut Canvas, view: &View, pen: f64, vehicle: &Vehicle) {
    let on_page = |corners: [[f32; 2]; 4]| corners.map(|corner| view.point(point(corner.into())));
    let (edge, width) = if vehicle.is_rude { (colour::RUDE, 2.4) } else { (colour::INK, 1.0) };
    map.polygon(&on_page(vehicle.corners()), Ink(kind(vehicle), 1.0), Ink(edge, 1.0), width * pen);
    let lights: Vec<[DVec2; 4]> = brake_lights(vehicle).map(on_page).collect();
    map.areas(&lights, Ink(colour::BRAKES, 1.0));
}

fn point(p: Vec2) -> DVec2 {
    p.as_dvec2()
}
