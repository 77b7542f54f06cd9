//! A truck as it is now, as RGB pixels: for showing an environment while it is stepped.
//!
//! The camera stands still above a route: what does not change is painted once, and each picture begins as a copy of
//! it.

mod backdrop;
mod canvas;
mod shape;
#[cfg(test)]
mod tests;

use std::ops::RangeInclusive;
use std::sync::Arc;

use offtrack::layout::{Ended, N_RAYS, Truck};
use offtrack::scenario::Scenario;
use offtrack::world::World;
use offtrack_evaluation::recording::Vehicle;

use crate::Error;
use crate::lettering::{Align, Lettering};
use crate::view::colour;
use backdrop::{Backdrop, Format};
use canvas::{Canvas, Ink};
use shape::Shape;

/// Sides that a picture can have (pixels).
pub const SIDES: RangeInclusive<u32> = 64..=4096;
/// Most backgrounds that are kept.
const N_KEPT: usize = 64;
/// Most memory that they take (bytes): fewer are kept of large pictures.
const KEPT_BYTES: usize = 256 << 20;

/// What a picture shows: a truck, and what its last step was. All of them describe the same state.
#[derive(Debug, Clone, Copy)]
pub struct Shown<'a> {
    /// The truck. It chooses the route whose background is drawn.
    pub truck: &'a Truck,
    /// Distance along each ray to the kerb, the trailer's first (m).
    pub ranges: &'a [f32; N_RAYS],
    /// Why its episode ended.
    pub ended: Ended,
    /// The other vehicles around it, as the road is driven.
    pub vehicles: &'a [Vehicle],
}

/// Draws trucks on the routes of a scenario, in square pictures from above, north up.
///
/// A picture shows the whole ring and the route with a truck's length at both ends, below a line with the route's name,
/// the speed and the end in words.
pub struct Camera {
    scenario: Arc<Scenario>,
    shape: Shape,
    lettering: Lettering,
    format: Format,
    /// The backdrops last used, the latest one last.
    backdrops: Vec<Backdrop>,
    /// RGBA, `[side, side, 4]`.
    canvas: Vec<u8>,
    /// RGB, `[side, side, 3]`.
    picture: Vec<u8>,
}

impl Camera {
    /// A camera for the trucks of `world`, which was baked from `scenario`. Pictures are `side` pixels wide and high.
    ///
    /// # Errors
    ///
    /// [`Error::Side`] for a side outside [`SIDES`], [`Error::Typeface`].
    pub fn new(scenario: Arc<Scenario>, world: &World, side: u32) -> Result<Camera, Error> {
        if !SIDES.contains(&side) {
            return Err(Error::Side(side));
        }
        let n_pixels = (side * side) as usize;
        Ok(Camera {
            scenario,
            shape: Shape::of(world),
            lettering: Lettering::new()?,
            format: Format::new(side),
            backdrops: Vec::new(),
            canvas: vec![0; 4 * n_pixels],
            picture: vec![0; 3 * n_pixels],
        })
    }

    /// Width and height of a picture (pixels).
    pub fn side(&self) -> u32 {
        self.format.side
    }

    /// The picture of a state: RGB, `[side, side, 3]`, rows from the top, each from the left.
    ///
    /// Equal states give equal bytes. A truck outside the picture is not seen; on a route that the scenario does not
    /// have it is drawn on bare ground. The first picture of a route takes several times as long as the next ones.
    pub fn draw(&mut self, shown: &Shown) -> &[u8] {
        self.use_backdrop(shown.truck.route);
        // The backdrop in use is the last one.
        if let Some(backdrop) = self.backdrops.last() {
            self.canvas.copy_from_slice(&backdrop.pixels);
            let (above, below) = self.canvas.split_at_mut(4 * (self.format.caption * self.format.side) as usize);
            if let Some(mut caption) = Canvas::on(above, self.format.side) {
                draw_caption(&mut caption, backdrop, &self.lettering, shown);
            }
            if let Some(mut map) = Canvas::on(below, self.format.side) {
                self.shape.draw(&mut map, &backdrop.view, self.format.pen, shown);
            }
        }
        for (rgb, rgba) in self.picture.chunks_exact_mut(3).zip(self.canvas.chunks_exact(4)) {
            rgb.copy_from_slice(&rgba[..3]);
        }
        &self.picture
    }

    /// Makes the backdrop of a route the last one, and forgets the one that was not used for longest if there are too
    /// many.
    fn use_backdrop(&mut self, route: u32) {
        match self.backdrops.iter().position(|backdrop| backdrop.route == route) {
            Some(index) => self.backdrops[index..].rotate_left(1),
            None => {
                if n_kept(self.format.side) <= self.backdrops.len() {
                    self.backdrops.remove(0);
                }
                self.backdrops.push(Backdrop::new(&self.scenario, route, self.format, &self.lettering));
            }
        }
    }
}

/// The speed, and the end in words.
fn draw_caption(caption: &mut Canvas, backdrop: &Backdrop, lettering: &Lettering, Shown { truck, ended, .. }: &Shown) {
    // A speed rounded to zero has no sign.
    let speed = (36.0 * f64::from(truck.speed)).round() / 10.0 + 0.0;
    caption.words(
        lettering,
        &format!("{speed:.1} km/h"),
        backdrop.speed_at,
        backdrop.text,
        Align::Left,
        Ink(colour::INK, 1.0),
    );
    if *ended != Ended::Running {
        let ink = if ended.failed() { colour::OVERLAP } else { colour::ROUTE };
        caption.words(
            lettering,
            &ended.name().replace('_', " "),
            backdrop.ended_at,
            backdrop.text,
            Align::Right,
            Ink(ink, 1.0),
        );
    }
}

/// Backgrounds that are kept of pictures with this side (pixels).
fn n_kept(side: u32) -> usize {
    (KEPT_BYTES / (4 * (side * side) as usize)).clamp(1, N_KEPT)
}
