//! A sheet of a road at a stated scale: a panel for each route and vehicle, beside a title block.

use glam::DVec2;
use offtrack::map::{Gutter, Road};
use offtrack::vehicle::Vehicle;
use offtrack_evaluation::fits::table::{FOOT, Units};
use svg::Document;
use svg::node::element::{ClipPath, Definitions, Group, Path, Rectangle, Title};

use super::letters::Letters;
pub use super::panel::Shown;
use super::panel::said;
use super::paper::{BLOCK, GAP, MARGIN, PX, Paper};
use crate::Error;
use crate::figure::bar;
use crate::legend::{self, Entry, Swatch};
use crate::lettering::{Align, Lettering};
use crate::road::RoadLayers;
use crate::view::{Layout, Straights, View, colour, number};

/// Length of the arms shown beyond the ring (m).
const ARMS: f64 = 25.0;
/// Length shown beyond the place where a truck comes nearest to a kerb (m).
const BEYOND: f64 = 5.0;
/// Sizes of letters, and line spacing as a multiple of them (px).
const TITLE: f64 = 20.0;
const HEADING: f64 = 12.5;
const TEXT: f64 = 11.5;
const SPACING: f64 = 1.45;

/// What the title block says beside the figures of the panels.
pub struct Head<'a> {
    /// Names and dimensions.
    pub vehicles: &'a [(String, Vehicle)],
    /// What the figures assume, a sentence each.
    pub assumptions: &'a [String],
    /// Clearance asked for (m).
    pub clearance: f64,
    /// What lengths are said in.
    pub units: Units,
    /// Whether gutters may be driven on.
    pub gutter: Gutter,
    /// When the results were made, in UTC.
    pub date: &'a str,
    /// Version and commit of the program.
    pub version: &'a str,
}

/// The sheet of a road as it lies in the world, as SVG text. Its size is in millimetres.
///
/// # Errors
///
/// [`Error::Typeface`].
pub fn drawn(road: &Road, shown: &[Shown], head: &Head) -> Result<String, Error> {
    let lettering = Lettering::new()?;
    let letters = Letters::of(&lettering);
    // Every panel has the place that decides its answer.
    let nearest = |one: &Shown| {
        let (_, at) = one.row.shown().nearest();
        (DVec2::new(at.x, at.y) - road.ground().origin).abs().max_element() + BEYOND
    };
    let reach = shown.iter().map(nearest).fold(road.outer_radius() + ARMS, f64::max).ceil();
    let paper = Paper::holding(shown.len(), 2.0 * reach);
    let layout = Layout { corner: DVec2::ZERO, width: paper.side * PX, margin: 0.0, ratio: 1.0 };
    let view = View::laid_out([DVec2::splat(-reach), DVec2::splat(reach)].into_iter(), &layout);
    let straights = Straights { approach: reach, departure: reach };
    let layers = RoadLayers::new(&view, &lettering, road, &[], straights, head.gutter);
    let definitions =
        Definitions::new().add(ClipPath::new().set("id", "panel").add(Path::new().set("d", view.frame())));
    let definitions = layers
        .solids()
        .into_iter()
        .fold(definitions, Definitions::add)
        .add(Group::new().set("id", "road").add(layers.surface()).add(layers.thin_lanes()))
        .add(Group::new().set("id", "kerbs").add(layers.thin_kerbs()));
    let mut panels = Group::new();
    for (index, one) in shown.iter().enumerate() {
        let corner = paper.corner(index) * PX;
        let mut map = one.drawn(&view, &letters, &layers, road.ground().origin, head);
        if index == 0 {
            let (length, words) = match head.units {
                Units::Metric => (10.0, "10 m"),
                Units::Feet => (30.0 * FOOT, "30 ft"),
            };
            map = map.add(bar(&view, &lettering, length, words));
        }
        let frame = Path::new().set("d", view.frame()).set("fill", "none").set("stroke", colour::FAINT);
        let place = format!("translate({} {})", number(corner.x), number(corner.y));
        panels = panels.add(
            Group::new()
                .set("transform", place)
                .add(map.set("clip-path", "url(#panel)"))
                .add(frame.set("stroke-width", 0.8))
                .add(captions(one, &lettering, &letters, paper.side * PX, head.units)),
        );
    }
    let block = block(&lettering, &letters, &paper, &title(road), shown, head);
    let definitions = letters.defined(definitions);
    let size = paper.size * PX;
    let document = Document::new()
        .set("viewBox", (0.0, 0.0, number(size.x), number(size.y)))
        .set("width", format!("{}mm", paper.size.x))
        .set("height", format!("{}mm", number(paper.size.y)))
        .add(Title::new(title(road)))
        .add(definitions)
        .add(Rectangle::new().set("width", size.x + 1.0).set("height", size.y + 1.0).set("fill", "white"))
        .add(panels)
        .add(block);
    Ok(format!("{document}\n"))
}

/// The sheet's title.
pub fn title(road: &Road) -> String {
    format!("Swept paths: {}", road.name)
}

fn captions(one: &Shown, lettering: &Lettering, letters: &Letters, width: f64, units: Units) -> Group {
    let [verdict, figures] = one.caption(units);
    let colour = if one.row.fits { colour::INK } else { colour::OVERLAP };
    let line = |words: &str, base: f64, largest: f64, colour: &str| {
        let size = lettering.fitting(words, largest, width);
        letters.text(words, DVec2::new(0.0, width + base), size, Align::Left, colour)
    };
    Group::new().add(line(&verdict, 15.0, HEADING, colour)).add(line(&figures, 31.0, TEXT, colour::FAINT))
}

/// The title block along the right edge.
fn block(lettering: &Lettering, letters: &Letters, paper: &Paper, title: &str, shown: &[Shown], head: &Head) -> Group {
    let left = (paper.size.x - MARGIN - BLOCK + GAP) * PX;
    let (top, width, height) = (MARGIN * PX, (BLOCK - GAP) * PX, (paper.size.y - 2.0 * MARGIN) * PX);
    let edge = Rectangle::new().set("x", number(left)).set("y", number(top)).set("fill", "none");
    let edge = edge.set("width", number(width)).set("height", number(height)).set("stroke", colour::INK);
    let mut text = Text { lettering, letters, group: Group::new().add(edge), left: left + 10.0, base: top + 8.0 };
    let inner = width - 20.0;
    text.line(title, TITLE, inner, colour::INK);
    let fit = shown.iter().filter(|one| one.row.fits).count();
    let clearance = match head.units {
        Units::Metric => format!("{} m", head.clearance),
        Units::Feet => said(Units::Feet, head.clearance),
    };
    let verdict = format!("{fit} of {} fit with {clearance} clearance", shown.len());
    text.line(&verdict, 15.0, inner, if fit == shown.len() { colour::INK } else { colour::OVERLAP });
    text.line(&format!("Scale 1:{:.0} on {}; north is up", paper.scale, paper.name), HEADING, inner, colour::INK);
    text.heading("Vehicles", inner);
    for (name, vehicle) in head.vehicles {
        text.wrapped(&dimensions(name, vehicle, head.units), inner);
    }
    text.heading("Assumed", inner);
    for assumption in head.assumptions {
        text.wrapped(assumption, inner);
    }
    text.heading("Shown", inner);
    text.wrapped(
        "The front axle on the lane's centre line where the vehicle fits so or no other way was found, else the way \
         found. A ring: where it comes nearest to a kerb.",
        inner,
    );
    text.base += 6.0;
    let mut entries = vec![
        Entry::new(Swatch::Area(colour::SWEPT_BY_TRACTOR), "swept by the tractor"),
        Entry::new(Swatch::Area(colour::SWEPT_BY_TRAILER), "swept by the trailer alone"),
        Entry::new(Swatch::Area(colour::OVERLAP), "swept beyond a kerb"),
        Entry::new(Swatch::Area(colour::GUTTER), "gutter"),
        Entry::new(Swatch::Line(colour::INK, 1.2, ""), "front axle"),
        Entry::new(Swatch::Line(colour::DRIVE_AXLE, 1.2, "5 3"), "drive axle"),
        Entry::new(Swatch::Line(colour::TRAILER_AXLES, 1.2, ""), "trailer axles"),
    ];
    if shown.iter().any(|one| one.row.shown().apron_clearance.is_some()) {
        entries.insert(4, Entry::new(Swatch::Area(colour::APRON), "apron, for trailers alone"));
    }
    let corner = DVec2::new(text.left, text.base);
    let (legend, _) = legend::drawn_with(lettering, &entries, corner, inner, |words, at| {
        letters.text(words, at, legend::SIZE, Align::Left, colour::INK).into()
    });
    text.group = text.group.add(legend);
    text.base = top + height - 62.0;
    text.line("Designed: ______________________   Checked: ______________________", TEXT, inner, colour::INK);
    text.base += 6.0;
    text.line(&format!("offtrack {}", head.version), TEXT, inner, colour::FAINT);
    text.line(head.date, TEXT, inner, colour::FAINT);
    text.group
}

/// A vehicle's name and dimensions.
fn dimensions(name: &str, vehicle: &Vehicle, units: Units) -> String {
    let tractor = &vehicle.tractor;
    let [long, wide, wheelbase, trailer] =
        [vehicle.length(), tractor.width.max(vehicle.trailer.width), tractor.wheelbase, vehicle.trailer.wheelbase]
            .map(|length| said(units, length));
    format!(
        "{name}: {long} long, {wide} wide, wheelbase {wheelbase}, trailer {trailer} from kingpin to axles, lock \
         {:.1}\u{b0}, {:.0}\u{b0}/s",
        tractor.steer_max.to_degrees(),
        tractor.steer_rate.to_degrees()
    )
}

/// Lines of text below each other.
struct Text<'a> {
    lettering: &'a Lettering,
    letters: &'a Letters<'a>,
    group: Group,
    left: f64,
    /// Lower edge of the last line (px).
    base: f64,
}

impl Text<'_> {
    fn line(&mut self, words: &str, largest: f64, width: f64, colour: &str) {
        let size = self.lettering.fitting(words, largest, width);
        self.base += largest * SPACING;
        let at = DVec2::new(self.left, self.base);
        let line = self.letters.text(words, at, size, Align::Left, colour);
        self.group = std::mem::replace(&mut self.group, Group::new()).add(line);
    }

    fn heading(&mut self, words: &str, width: f64) {
        self.base += 8.0;
        self.line(words, HEADING + 1.0, width, colour::INK);
    }

    /// Words in as many lines as they need.
    fn wrapped(&mut self, words: &str, width: f64) {
        let mut line = String::new();
        for word in words.split_whitespace() {
            let longer = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
            if !line.is_empty() && width < self.lettering.width(&longer, TEXT) {
                self.line(&line, TEXT, width, colour::FAINT);
                line = word.to_owned();
            } else {
                line = longer;
            }
        }
        self.line(&line, TEXT, width, colour::FAINT);
        self.base += 3.0;
    }
}
