//! Which paper at which scale holds all panels of a sheet.

use glam::DVec2;

/// Pixels in a millimetre of paper: 96 in an inch, as SVG has it (px/mm).
pub(super) const PX: f64 = 96.0 / 25.4;
/// Margin of the paper, width of the title block, distance between panels, height of a panel's caption (mm).
pub(super) const MARGIN: f64 = 10.0;
pub(super) const BLOCK: f64 = 88.0;
pub(super) const GAP: f64 = 4.0;
pub(super) const CAPTION: f64 = 11.0;
/// Landscape papers, the smallest first (mm).
const PAPERS: [(&str, f64, f64); 4] =
    [("A3", 420.0, 297.0), ("A2", 594.0, 420.0), ("A1", 841.0, 594.0), ("A0", 1189.0, 841.0)];
/// Scales of drawings, the largest first, and those that are taken where no paper holds all panels at one of these.
const SCALES: [f64; 3] = [250.0, 500.0, 1000.0];
const SMALL: [f64; 3] = [1250.0, 2000.0, 5000.0];

/// A paper, its scale, and the panels on it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Paper {
    /// `A3`, or the height of a roll.
    pub(super) name: String,
    /// Width and height (mm).
    pub(super) size: DVec2,
    /// Metres of the road in a metre of paper.
    pub(super) scale: f64,
    /// Panels in a row.
    pub(super) columns: usize,
    /// Side of a panel (mm).
    pub(super) side: f64,
}

impl Paper {
    /// The smallest paper that holds so many panels of `side` metres at a usual scale, at the largest that fits; else a
    /// roll as wide as A0.
    pub(super) fn holding(n_panels: usize, side: f64) -> Paper {
        let usual = PAPERS.into_iter().flat_map(|paper| SCALES.map(|scale| (paper, scale)));
        let small = SMALL.map(|scale| (PAPERS[3], scale));
        let papers = usual.chain(small).map(|((name, width, height), scale)| {
            let side = 1000.0 * side / scale;
            let (columns, rows) = (fitting(width - BLOCK, side, 0.0), fitting(height, side, CAPTION));
            (Paper { name: name.into(), size: DVec2::new(width, height), scale, columns, side }, columns * rows)
        });
        let held = papers.into_iter().find(|(_, room)| n_panels <= *room).map(|(paper, _)| paper);
        held.unwrap_or_else(|| Paper::roll(n_panels, side))
    }

    fn roll(n_panels: usize, side: f64) -> Paper {
        let (width, scale) = (PAPERS[3].1, SMALL[0]);
        let side = 1000.0 * side / scale;
        let columns = fitting(width - BLOCK, side, 0.0).max(1);
        let height = 2.0 * MARGIN + n_panels.div_ceil(columns) as f64 * (side + CAPTION + GAP);
        Paper { name: format!("a roll of {width:.0} mm"), size: DVec2::new(width, height), scale, columns, side }
    }

    /// Upper left corner of a panel (mm).
    pub(super) fn corner(&self, panel: usize) -> DVec2 {
        let cell = DVec2::new(self.side + GAP, self.side + CAPTION + GAP);
        DVec2::splat(MARGIN) + DVec2::new((panel % self.columns) as f64, (panel / self.columns) as f64) * cell
    }
}

/// How many panels fit beside each other on so much paper (mm).
fn fitting(length: f64, side: f64, caption: f64) -> usize {
    ((length - 2.0 * MARGIN) / (side + caption + GAP)).floor() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_panels_stand_on_a_small_paper_at_a_large_scale_and_none_lies_beyond_the_edge() {
        let of = |n, side| {
            let paper = Paper::holding(n, side);
            for panel in 0..n {
                let end = paper.corner(panel) + DVec2::new(paper.side, paper.side + CAPTION);
                let room = paper.size - DVec2::new(BLOCK, 0.0) - MARGIN;
                assert!(end.cmple(room + 1e-9).all(), "{n} {side}: {panel} ends at {end}");
            }
            (paper.name, paper.scale)
        };
        assert_eq!(of(1, 60.0), ("A3".into(), 250.0));
        assert_eq!(of(4, 60.0), ("A3".into(), 500.0));
        assert_eq!(of(15, 86.0), ("A2".into(), 1000.0));
        assert_eq!(of(20, 86.0), ("A1".into(), 1000.0));
        assert_eq!(of(100, 86.0), ("A0".into(), 1250.0));
        assert_eq!(of(2000, 86.0), ("a roll of 1189 mm".into(), 1250.0));
    }
}
