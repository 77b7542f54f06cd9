//! A film of episodes as an animated GIF. All pictures share one palette, and each holds only the pixels that
//! changed.

use std::collections::BTreeMap;

use gif::{DisposalMethod, Encoder, Repeat};
use resvg::{tiny_skia::Pixmap, usvg};

use crate::episode::Scene;
use crate::{COLOUR_STEP, Error, painted, stepped};

/// Simulated time between two pictures (s).
const DRIVEN: f64 = 0.2;
/// How many times as fast as the episode the film runs.
const FASTER: f64 = 2.0;
/// Time that the last picture is shown [hundredths of a second].
const LAST_SHOWN: u16 = 250;
/// Quantised values of a colour channel: 0, 15, ... 255.
const N_LEVELS: usize = 255 / COLOUR_STEP as usize + 1;
/// Index of the transparent colour, after all others.
const UNCHANGED: u8 = 255;

/// Indices of the frames of a recording that a film shows: the first, the last, and those between at even distances.
/// `step` is the time between two frames (s).
pub fn frames(n_frames: usize, step: f64) -> Vec<usize> {
    let stride = stride(step);
    let last = n_frames - 1;
    (0..last).step_by(stride).chain([last]).collect()
}

/// Frames from one picture to the next.
fn stride(step: f64) -> usize {
    (DRIVEN / step).round().max(1.0) as usize
}

/// Time that the picture of this number is shown, before another one [hundredths of a second].
fn delay(number: usize, step: f64) -> u16 {
    let at = |number: usize| (100.0 * (number * stride(step)) as f64 * step / FASTER).round();
    (at(number + 1) - at(number)) as u16
}

/// An episode of a film.
pub struct Take<'a> {
    /// The episode.
    pub scene: Scene<'a>,
    /// Indices of the frames that are shown.
    pub frames: Vec<usize>,
}

/// The film of these episodes, one after another, as a GIF's bytes, `width` pixels wide; `drawn` is called after each
/// picture.
///
/// # Errors
///
/// [`Error::Size`] for a picture with a side of 0 or more than 65535 pixels, [`Error::Gif`] if it cannot be encoded.
///
/// # Panics
///
/// If there is no take, or if one has no frames or an index beyond its recording.
pub fn gif(takes: &[Take], width: u32, mut drawn: impl FnMut()) -> Result<Vec<u8>, Error> {
    let options = usvg::Options::default();
    let backgrounds =
        takes.iter().map(|take| painted(&usvg::Tree::from_str(&take.scene.film_background(), &options)?, width, None));
    let backgrounds = backgrounds.collect::<Result<Vec<Pixmap>, Error>>()?;
    let picture = |take: usize, index: usize| {
        painted(
            &usvg::Tree::from_str(&takes[take].scene.film_picture(index), &options)?,
            width,
            Some(&backgrounds[take]),
        )
    };
    // The colours of the film: the last picture has the longest paths and the end in words, one half way has the truck
    // in the ring.
    let sampled = takes
        .iter()
        .enumerate()
        .flat_map(|(take, Take { frames, .. })| [frames.len() / 2, frames.len() - 1].map(|at| (take, frames[at])));
    let samples = sampled.map(|(take, index)| picture(take, index)).collect::<Result<Vec<Pixmap>, Error>>()?;
    let palette = Palette::of(&samples);
    // Legends may take another line.
    let (width, height) = (backgrounds[0].width(), backgrounds.iter().map(Pixmap::height).max().unwrap_or_default());
    let (Ok(wide), Ok(high)) = (u16::try_from(width), u16::try_from(height)) else {
        return Err(Error::Size { width, height });
    };
    let mut encoder = Encoder::new(Vec::new(), wide, high, &palette.colours)?;
    encoder.set_repeat(Repeat::Infinite)?;
    let white = palette.nearest[palette.nearest.len() - 1];
    let mut before = Vec::new();
    for (take, Take { scene, frames }) in takes.iter().enumerate() {
        for (n, &index) in frames.iter().enumerate() {
            let mut indices = palette.indices(&picture(take, index)?);
            indices.resize((width * height) as usize, white);
            let mut frame = changed(&before, &indices, wide.into());
            frame.delay = if n + 1 == frames.len() { LAST_SHOWN } else { delay(n, scene.recording.step) };
            encoder.write_frame(&frame)?;
            before = indices;
            drawn();
        }
    }
    Ok(encoder.into_inner()?)
}

/// The least rectangle with all pixels that differ, in a picture `width` pixels wide; the whole picture if `before` is
/// empty.
fn changed(before: &[u8], now: &[u8], width: usize) -> gif::Frame<'static> {
    let differs = |at: usize| before.get(at) != Some(&now[at]);
    let (mut left, mut right, mut top, mut bottom) = (width, 0, usize::MAX, 0);
    for at in (0..now.len()).filter(|&at| differs(at)) {
        let (x, y) = (at % width, at / width);
        (left, right, top, bottom) = (left.min(x), right.max(x + 1), top.min(y), bottom.max(y + 1));
    }
    if right == 0 {
        // A frame of a GIF has at least one pixel.
        (left, right, top, bottom) = (0, 1, 0, 1);
    }
    let rows = (top..bottom).flat_map(|y| (left..right).map(move |x| y * width + x));
    gif::Frame {
        left: left as u16,
        top: top as u16,
        width: (right - left) as u16,
        height: (bottom - top) as u16,
        transparent: Some(UNCHANGED),
        dispose: DisposalMethod::Keep,
        buffer: rows.map(|at| if differs(at) { now[at] } else { UNCHANGED }).collect::<Vec<u8>>().into(),
        ..gif::Frame::default()
    }
}

/// The colours of a film, and the nearest of them to any colour.
struct Palette {
    /// Red, green, blue of each.
    colours: Vec<u8>,
    nearest: Vec<u8>,
}

impl Palette {
    /// The most frequent colours of some pictures.
    fn of(pictures: &[Pixmap]) -> Palette {
        let mut counts: BTreeMap<[u8; 3], usize> = BTreeMap::new();
        for pixel in pictures.iter().flat_map(|picture| picture.data().chunks_exact(4)) {
            *counts.entry(colour(pixel)).or_default() += 1;
        }
        let mut frequent: Vec<([u8; 3], usize)> = counts.into_iter().collect();
        // The sort is stable: equally frequent colours keep their order.
        frequent.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        let chosen: Vec<[u8; 3]> =
            frequent.into_iter().map(|(colour, _)| colour).take(usize::from(UNCHANGED)).collect();
        let level = |index: usize, digit: u32| (index / N_LEVELS.pow(digit) % N_LEVELS) as i32 * i32::from(COLOUR_STEP);
        let nearest = (0..N_LEVELS.pow(3)).map(|index| {
            let wanted = [level(index, 2), level(index, 1), level(index, 0)];
            let off =
                |colour: &[u8; 3]| wanted.iter().zip(colour).map(|(a, &b)| (a - i32::from(b)).pow(2)).sum::<i32>();
            (0..chosen.len()).min_by_key(|&n| off(&chosen[n])).unwrap_or(0) as u8
        });
        let nearest = nearest.collect();
        // The table is full, so that the transparent index lies within it.
        let mut colours = chosen.concat();
        colours.resize(3 * (usize::from(UNCHANGED) + 1), 0);
        Palette { colours, nearest }
    }

    /// A picture as indices of colours.
    fn indices(&self, picture: &Pixmap) -> Vec<u8> {
        let level = |channel: u8| usize::from(channel / COLOUR_STEP);
        let index = |[red, green, blue]: [u8; 3]| (level(red) * N_LEVELS + level(green)) * N_LEVELS + level(blue);
        picture.data().chunks_exact(4).map(|pixel| self.nearest[index(colour(pixel))]).collect()
    }
}

fn colour(pixel: &[u8]) -> [u8; 3] {
    [0, 1, 2].map(|channel| stepped(pixel[channel]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_shows_the_first_and_the_last_frame_once() {
        assert_eq!(frames(6, 0.1), [0, 2, 4, 5]);
        assert_eq!(frames(5, 0.1), [0, 2, 4]);
        assert_eq!(frames(3, 0.5), [0, 1, 2]);
        assert_eq!(frames(1, 0.1), [0]);
    }

    #[test]
    fn a_film_runs_at_twice_the_speed_whatever_the_step_is() {
        assert!((0..100).all(|number| delay(number, 0.1) == 10));
        for step in [0.01, 0.03, 0.12, 0.15, 0.5, 1.0] {
            let shown: u32 = (0..100).map(|number| u32::from(delay(number, step))).sum();
            let driven = 100.0 * (100 * stride(step)) as f64 * step;
            assert!((2.0 * f64::from(shown) - driven).abs() <= 1.0, "{step}: {shown}");
        }
    }

    #[test]
    fn a_picture_holds_the_rectangle_that_changed_and_marks_unchanged_pixels() {
        let before = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1];
        let now = [1, 1, 1, 1, 1, 2, 1, 1, 1, 1, 3, 1];
        let frame = changed(&before, &now, 4);
        assert_eq!((frame.left, frame.top, frame.width, frame.height), (1, 1, 2, 2));
        assert_eq!(*frame.buffer, [2, UNCHANGED, UNCHANGED, 3]);
        let first = changed(&[], &now, 4);
        assert_eq!((first.width, first.height, &*first.buffer), (4, 3, &now[..]));
        let same = changed(&now, &now, 4);
        assert_eq!((same.width, same.height, &*same.buffer), (1, 1, &[UNCHANGED][..]));
    }
}
