//! A contact sheet: many roundabouts at one scale, in rows, each above its name.

use glam::DVec2;
use offtrack::map::{Gutter, Road};
use svg::Document;
use svg::node::element::{ClipPath, Definitions, Group, Path, Rectangle, Title};

use crate::Error;
use crate::figure::scale_bar;
use crate::lettering::{Align, Lettering};
use crate::road::RoadLayers;
use crate::view::{Layout, Straights, View, colour, number};

/// Side of a map (px).
const MAP: f64 = 190.0;
/// Between maps (px).
const GAP: f64 = 10.0;
/// Height of the lines below a map (px).
const CAPTION: f64 = 40.0;
/// Margin around the sheet (px).
const MARGIN: f64 = 20.0;
/// Height of the title (px).
const TITLE: f64 = 52.0;
/// Length of the arms shown beyond the largest ring (m).
const ARMS: f64 = 16.0;
/// Least width of a sheet, for its title (px).
const NARROWEST: f64 = 480.0;
/// Maps in a row at most.
const COLUMNS: usize = 8;

/// The sheet as SVG text.
///
/// # Errors
///
/// [`Error::Typeface`].
pub fn drawn(title: &str, roundabouts: &[&Road]) -> Result<String, Error> {
    let lettering = Lettering::new()?;
    let columns = roundabouts.len().clamp(1, COLUMNS);
    let rows = roundabouts.len().div_ceil(columns).max(1);
    let cell = DVec2::new(MAP + GAP, MAP + GAP + CAPTION);
    let size = DVec2::new(columns as f64, rows as f64) * cell - GAP + 2.0 * MARGIN + DVec2::new(0.0, TITLE);
    let size = size.max(DVec2::new(NARROWEST, 0.0));
    let letters = lettering.fitting(title, 24.0, size.x - 2.0 * MARGIN);
    let reach = roundabouts.iter().map(|roundabout| roundabout.outer_radius()).fold(0.0, f64::max) + ARMS;
    let straights = Straights { approach: reach, departure: reach };
    let mut definitions = Definitions::new();
    let mut maps = Group::new();
    for (index, roundabout) in roundabouts.iter().enumerate() {
        let corner =
            DVec2::new(MARGIN, MARGIN + TITLE) + DVec2::new((index % columns) as f64, (index / columns) as f64) * cell;
        let layout = Layout { corner, width: MAP, margin: 0.0, ratio: 1.0 };
        let view = View::laid_out([DVec2::splat(-reach), DVec2::splat(reach)].into_iter(), &layout);
        let road = RoadLayers::new(&view, &lettering, roundabout, &[], straights, Gutter::Drivable);
        let clip = format!("map-{index}");
        definitions = definitions.add(ClipPath::new().set("id", clip.as_str()).add(Path::new().set("d", view.frame())));
        let mut map = Group::new().add(road.surface()).add(road.thin_lanes()).add(road.thin_kerbs());
        if index == 0 {
            map = map.add(scale_bar(&view, &lettering));
        }
        let below = corner + DVec2::new(0.0, MAP + 16.0);
        let facts = format!("{} arms, island {:.1} m", roundabout.arms().count(), roundabout.island_radius());
        maps = maps
            .add(map.set("clip-path", format!("url(#{clip})")))
            .add(
                Path::new()
                    .set("d", view.frame())
                    .set("fill", "none")
                    .set("stroke", colour::FAINT)
                    .set("stroke-width", 0.8),
            )
            .add(lettering.text(&roundabout.name, below, 13.5, Align::Left, colour::INK))
            .add(lettering.text(&facts, below + DVec2::new(0.0, 16.0), 12.5, Align::Left, colour::FAINT));
    }
    let document = Document::new()
        .set("viewBox", (0.0, 0.0, number(size.x), number(size.y)))
        .set("width", number(size.x))
        .set("height", number(size.y))
        .add(Title::new(title))
        .add(definitions)
        .add(Rectangle::new().set("width", size.x + 1.0).set("height", size.y + 1.0).set("fill", "white"))
        .add(lettering.text(title, DVec2::new(MARGIN, MARGIN + 24.0), letters, Align::Left, colour::INK))
        .add(maps);
    Ok(format!("{document}\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_roundabout_has_a_map_with_its_name_and_all_have_one_scale() {
        let roundabouts = ["16m", "50m", "20m"].map(|name| Road::named(name).unwrap());
        let svg = drawn("Three", &roundabouts.each_ref()).unwrap();
        for name in ["Three", "16m", "50m", "20m", &format!("4 arms, island {:.1} m", roundabouts[2].island_radius())] {
            assert!(svg.contains(&format!("aria-label=\"{name}\"")), "{name}");
        }
        assert_eq!(svg.matches("<clipPath").count(), 3);
        // The outer radius of 50m and the arms fill half a map; 16m's island is drawn at that scale.
        let reach = roundabouts[1].outer_radius() + ARMS;
        let radius = number(roundabouts[0].island_radius() * MAP / (2.0 * reach));
        assert!(svg.contains(&format!("A{radius} {radius} ")), "{radius}");
    }

    #[test]
    fn a_sheet_without_roundabouts_is_a_picture_too() {
        crate::rasterised(&drawn("None", &[]).unwrap(), 300).unwrap();
    }
}
