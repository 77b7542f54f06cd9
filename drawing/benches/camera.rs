//! `camera [BENCHMARK [FOLDER]]`: median time of a camera's pictures while a truck follows routes of a benchmark.
//!
//! With a folder, pictures at the start, on the way and at the end of each route are written there as PNGs. Why an
//! episode ended is made up, to show both kinds.

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use offtrack::layout::{Ended, Truck};
use offtrack::physics;
use offtrack::scenario::Scenario;
use offtrack::vehicle::swept::swept_path;
use offtrack::world::World;
use offtrack_drawing::camera::{Camera, Shown};

/// Sides of the pictures (pixels).
const SIDES: [u32; 3] = [240, 480, 960];
/// Routes that are driven.
const N_ROUTES: usize = 12;
/// Distance between two pictures (m).
const SPACING: f64 = 1.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let benchmark = arguments.next().unwrap_or_else(|| "attard2023".to_owned());
    let folder = arguments.next();
    let scenario = Arc::new(Scenario::find(&benchmark)?);
    let world = World::bake(&scenario)?;
    let n_routes = world.routes.len();
    let chosen: Vec<u32> = (0..n_routes as u32).step_by(n_routes.div_ceil(N_ROUTES).max(1)).collect();
    for side in SIDES {
        let mut camera = Camera::new(scenario.clone(), &world, side)?;
        let (mut first, mut next) = (Vec::new(), Vec::new());
        for &route in &chosen {
            let trucks = driven(&scenario, &world, route);
            for (n, truck) in trucks.iter().enumerate() {
                let ranges = physics::ranges(
                    world.route_field(route),
                    &world.rigs[0],
                    &world.rays[0],
                    truck,
                    world.params.sensor_range,
                );
                let ended = match (n + 1 < trucks.len(), route % 2) {
                    (true, _) => Ended::Running,
                    (false, 0) => Ended::TrailerCollided,
                    (false, _) => Ended::Arrived,
                };
                let begun = Instant::now();
                let picture = camera.draw(&Shown { truck, ranges: &ranges, ended, vehicles: &[] });
                (if n == 0 { &mut first } else { &mut next }).push(begun.elapsed().as_secs_f64() * 1e3);
                if let Some(folder) = &folder
                    && [0, trucks.len() * 9 / 20, trucks.len() - 1].contains(&n)
                {
                    let name = world.route_names[route as usize].replace('/', "-");
                    write(&Path::new(folder).join(format!("{name}-{side}-{n}.png")), side, picture)?;
                }
            }
        }
        println!(
            "{side} pixels: {:.3} ms a picture, {:.1} ms the first of a route",
            median(&mut next),
            median(&mut first)
        );
    }
    Ok(())
}

/// A truck along a route at the cruising speed, its front axle on the centre line.
fn driven(scenario: &Scenario, world: &World, route: u32) -> Vec<Truck> {
    let Some((_, line)) = scenario.routes().nth(route as usize) else { return Vec::new() };
    let path = swept_path(&world.rigs[0], &line.centre_line, scenario.cruising_speed(), SPACING);
    let truck = |(n, pose): (usize, offtrack::vehicle::swept::Pose)| Truck {
        position: pose.position.as_vec2(),
        heading: pose.heading as f32,
        trailer_heading: pose.trailer_heading as f32,
        speed: scenario.cruising_speed() as f32,
        steering: offtrack::geometry::wrapped(line.centre_line.heading_at(n as f64 * SPACING) - pose.heading) as f32,
        route,
        ..Truck::default()
    };
    path.into_iter().enumerate().map(truck).collect()
}

fn write(path: &Path, side: u32, rgb: &[u8]) -> Result<(), Box<dyn Error>> {
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), side, side);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(rgb)?;
    Ok(())
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
