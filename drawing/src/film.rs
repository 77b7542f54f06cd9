//! An episode as an animated GIF. One palette serves the whole film, and a page holds what changed since the one before and nothing else.

use std::collections::BTreeMap;

use gif::{DisposalMethod, Encoder, Repeat};
use resvg::{tiny_skia::Pixmap, usvg};

use crate::episode::Scene;
use crate::{COLOUR_STEP, Failure, painted, stepped};

/// Time between two pages as it was driven [s].
const DRIVEN: f64 = 0.2;
/// Time that a page is shown, half of that: the film runs at twice the truck's speed [hundredths of a second].
const SHOWN: u16 = 10;
/// Time that the last page is shown [hundredths of a second].
const LAST_SHOWN: u16 = 250;
/// Steps of a colour's channel: 0, 15, ... 255.
const N_LEVELS: usize = 255 / COLOUR_STEP as usize + 1;
/// Index of the colour that leaves a pixel as it was; the colours come before it.
const UNCHANGED: u8 = 255;

/// The recorded frames that the pages of a film show, `step` seconds apart: the first, the last, and those between at even distances.
pub fn pages(n_frames: usize, step: f64) -> Vec<usize> {
    let stride = (DRIVEN / step).round().max(1.0) as usize;
    let last = n_frames - 1;
    (0..last).step_by(stride).chain([last]).collect()
}

/// The film of `pages` as a GIF's bytes, `width` pixels wide; `drawn` is called after each page.
pub fn gif(scene: &Scene, pages: &[usize], width: u32, mut drawn: impl FnMut()) -> Result<Vec<u8>, Failure> {
    let options = usvg::Options::default();
    let ground = painted(&usvg::Tree::from_str(&scene.film_ground(), &options)?, width, None)?;
    let page = |index: usize| painted(&usvg::Tree::from_str(&scene.film_page(index), &options)?, width, Some(&ground));
    // The last page has the longest paths and its end in words; one half way has the truck in the ring.
    let samples = [page(pages[pages.len() / 2])?, page(pages[pages.len() - 1])?];
    let palette = Palette::of(&samples);
    let [wide, high] = [ground.width(), ground.height()].map(u16::try_from);
    let (wide, high) = (wide?, high?);
    let mut encoder = Encoder::new(Vec::new(), wide, high, &palette.colours)?;
    encoder.set_repeat(Repeat::Infinite)?;
    let mut before = Vec::new();
    for (place, &index) in pages.iter().enumerate() {
        let indices = palette.indices(&page(index)?);
        let mut frame = changed(&before, &indices, wide.into());
        frame.delay = if place + 1 == pages.len() { LAST_SHOWN } else { SHOWN };
        encoder.write_frame(&frame)?;
        before = indices;
        drawn();
    }
    Ok(encoder.into_inner()?)
}

/// The least rectangle that holds every pixel that differs, in a page `width` pixels wide; all of it when there was none before.
fn changed(before: &[u8], now: &[u8], width: usize) -> gif::Frame<'static> {
    let differs = |at: usize| before.get(at) != Some(&now[at]);
    let (mut left, mut right, mut top, mut bottom) = (width, 0, usize::MAX, 0);
    for at in (0..now.len()).filter(|&at| differs(at)) {
        let (x, y) = (at % width, at / width);
        (left, right, top, bottom) = (left.min(x), right.max(x + 1), top.min(y), bottom.max(y + 1));
    }
    if right == 0 {
        // A page must have a pixel.
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
    /// The most frequent colours of some pages.
    fn of(pages: &[Pixmap]) -> Palette {
        let mut counts: BTreeMap<[u8; 3], usize> = BTreeMap::new();
        for pixel in pages.iter().flat_map(|page| page.data().chunks_exact(4)) {
            *counts.entry(colour(pixel)).or_default() += 1;
        }
        let mut frequent: Vec<([u8; 3], usize)> = counts.into_iter().collect();
        // The sort is stable, so that equally frequent colours stay in their own order.
        frequent.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        let chosen: Vec<[u8; 3]> = frequent.into_iter().map(|(colour, _)| colour).take(usize::from(UNCHANGED)).collect();
        let level = |index: usize, place: u32| (index / N_LEVELS.pow(place) % N_LEVELS) as i32 * i32::from(COLOUR_STEP);
        let nearest = (0..N_LEVELS.pow(3)).map(|index| {
            let wanted = [level(index, 2), level(index, 1), level(index, 0)];
            let off = |colour: &[u8; 3]| wanted.iter().zip(colour).map(|(a, &b)| (a - i32::from(b)).pow(2)).sum::<i32>();
            (0..chosen.len()).min_by_key(|&n| off(&chosen[n])).unwrap_or(0) as u8
        });
        let nearest = nearest.collect();
        // The table is full, so that no encoder takes the transparent colour for one beyond its end.
        let mut colours = chosen.concat();
        colours.resize(3 * (usize::from(UNCHANGED) + 1), 0);
        Palette { colours, nearest }
    }

    /// A page as indices of colours.
    fn indices(&self, page: &Pixmap) -> Vec<u8> {
        let level = |channel: u8| usize::from(channel / COLOUR_STEP);
        let place = |[red, green, blue]: [u8; 3]| (level(red) * N_LEVELS + level(green)) * N_LEVELS + level(blue);
        page.data().chunks_exact(4).map(|pixel| self.nearest[place(colour(pixel))]).collect()
    }
}

fn colour(pixel: &[u8]) -> [u8; 3] {
    [0, 1, 2].map(|channel| stepped(pixel[channel]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_begins_with_the_first_frame_and_ends_with_the_last_each_once() {
        assert_eq!(pages(6, 0.1), [0, 2, 4, 5]);
        assert_eq!(pages(5, 0.1), [0, 2, 4]);
        assert_eq!(pages(3, 0.5), [0, 1, 2]);
        assert_eq!(pages(1, 0.1), [0]);
    }

    #[test]
    fn a_page_holds_the_rectangle_that_changed_and_marks_what_did_not() {
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
