//! An SVG of paths as a PDF of one page, as large as the SVG says.
//!
//! The pictures of this crate are paths alone: letters are outlines, and there are neither gradients nor images. So the
//! tree that `usvg` makes of them is written as it is.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Date, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use resvg::tiny_skia::{PathSegment, Point, Transform};
use resvg::usvg::{self, FillRule, LineCap, LineJoin, Node, Paint};

use crate::Error;

/// Points in a pixel: 72 and 96 in an inch (pt/px).
const POINT: f32 = 0.75;

/// The PDF of an SVG text of paths, with a title and the date on which it was made, `2026-11-26T12:00:00Z`.
///
/// # Errors
///
/// [`Error::Svg`] for a text that is not an SVG.
pub fn pdf(svg: &str, title: &str, date: &str) -> Result<Vec<u8>, Error> {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default())?;
    let (width, height) = (POINT * tree.size().width(), POINT * tree.size().height());
    let mut page = Page { content: Content::new(), opacities: Vec::new() };
    // A page's y points up.
    page.content.transform([POINT, 0.0, 0.0, -POINT, 0.0, height]);
    page.group(tree.root());
    let [catalog, pages, only, content, info] = [1, 2, 3, 4, 5].map(Ref::new);
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([only]).count(1);
    let mut written = pdf.page(only);
    written.parent(pages).media_box(Rect::new(0.0, 0.0, width, height)).contents(content);
    let mut resources = written.resources();
    let mut states = resources.ext_g_states();
    for opacity in &page.opacities {
        let opacity_of = f32::from(*opacity) / 255.0;
        let mut state = states.insert(Name(name(*opacity).as_bytes())).start::<pdf_writer::writers::ExtGraphicsState>();
        state.non_stroking_alpha(opacity_of).stroking_alpha(opacity_of);
    }
    states.finish();
    resources.finish();
    written.finish();
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
    // Writing to memory cannot fail.
    let _ = packed.write_all(page.content.finish().as_slice());
    pdf.stream(content, &packed.finish().unwrap_or_default()).filter(Filter::FlateDecode);
    let mut about = pdf.document_info(info);
    about.title(TextStr(title)).producer(TextStr("offtrack"));
    if let Some(date) = day(date) {
        about.creation_date(date);
    }
    about.finish();
    Ok(pdf.finish())
}

/// The day of a date as RFC 3339 has it.
fn day(date: &str) -> Option<Date> {
    let mut parts = date.get(..10)?.splitn(3, '-');
    let mut next = || parts.next()?.parse::<u16>().ok();
    let (year, month, day) = (next()?, next()?, next()?);
    Some(Date::new(year).month(month as u8).day(day as u8))
}

/// Name of the state with this opacity, in parts of 255.
fn name(opacity: u8) -> String {
    format!("o{opacity}")
}

struct Page {
    content: Content,
    /// Opacities that the page uses, in parts of 255.
    opacities: Vec<u8>,
}

impl Page {
    fn group(&mut self, group: &usvg::Group) {
        self.content.save_state();
        self.content.transform(matrix(group.transform()));
        if let Some(clip) = group.clip_path() {
            let mut rule = FillRule::NonZero;
            self.clip(clip.root(), clip.transform(), &mut rule);
            match rule {
                FillRule::NonZero => self.content.clip_nonzero(),
                FillRule::EvenOdd => self.content.clip_even_odd(),
            };
            self.content.end_path();
        }
        for node in group.children() {
            match node {
                Node::Group(group) => self.group(group),
                Node::Path(path) if path.is_visible() => self.path(path),
                _ => {}
            }
        }
        self.content.restore_state();
    }

    /// The outlines that a group clips to. A clip is in the frame of what it clips.
    fn clip(&mut self, group: &usvg::Group, transform: Transform, rule: &mut FillRule) {
        let transform = transform.pre_concat(group.transform());
        for node in group.children() {
            match node {
                Node::Group(group) => self.clip(group, transform, rule),
                Node::Path(path) => {
                    *rule = path.fill().map_or(*rule, |fill| fill.rule());
                    self.outline(path, transform);
                }
                _ => {}
            }
        }
    }

    fn path(&mut self, path: &usvg::Path) {
        if let Some(fill) = path.fill()
            && let Paint::Color(colour) = fill.paint()
        {
            self.opaque(fill.opacity().to_u8());
            let [r, g, b] = [colour.red, colour.green, colour.blue].map(|channel| f32::from(channel) / 255.0);
            self.content.set_fill_rgb(r, g, b);
            self.outline(path, Transform::identity());
            match fill.rule() {
                FillRule::NonZero => self.content.fill_nonzero(),
                FillRule::EvenOdd => self.content.fill_even_odd(),
            };
        }
        if let Some(stroke) = path.stroke()
            && let Paint::Color(colour) = stroke.paint()
        {
            self.opaque(stroke.opacity().to_u8());
            let [r, g, b] = [colour.red, colour.green, colour.blue].map(|channel| f32::from(channel) / 255.0);
            self.content.set_stroke_rgb(r, g, b).set_line_width(stroke.width().get());
            self.content.set_line_cap(match stroke.linecap() {
                LineCap::Butt => LineCapStyle::ButtCap,
                LineCap::Round => LineCapStyle::RoundCap,
                LineCap::Square => LineCapStyle::ProjectingSquareCap,
            });
            self.content.set_line_join(match stroke.linejoin() {
                LineJoin::Miter | LineJoin::MiterClip => LineJoinStyle::MiterJoin,
                LineJoin::Round => LineJoinStyle::RoundJoin,
                LineJoin::Bevel => LineJoinStyle::BevelJoin,
            });
            self.content.set_miter_limit(stroke.miterlimit().get());
            let dashes = stroke.dasharray().unwrap_or_default();
            self.content.set_dash_pattern(dashes.iter().copied(), stroke.dashoffset());
            self.outline(path, Transform::identity());
            self.content.stroke();
        }
    }

    fn opaque(&mut self, opacity: u8) {
        if !self.opacities.contains(&opacity) {
            self.opacities.push(opacity);
        }
        self.content.set_parameters(Name(name(opacity).as_bytes()));
    }

    fn outline(&mut self, path: &usvg::Path, transform: Transform) {
        let at = |mut p: Point| {
            transform.map_point(&mut p);
            p
        };
        let mut last = Point::zero();
        for segment in path.data().segments() {
            match segment {
                PathSegment::MoveTo(to) => {
                    last = at(to);
                    self.content.move_to(last.x, last.y);
                }
                PathSegment::LineTo(to) => {
                    last = at(to);
                    self.content.line_to(last.x, last.y);
                }
                PathSegment::QuadTo(one, to) => {
                    let (one, to) = (at(one), at(to));
                    let third =
                        |from: Point| Point::from_xy(one.x + (from.x - one.x) / 3.0, one.y + (from.y - one.y) / 3.0);
                    self.cubic(third(last), third(to), to);
                    last = to;
                }
                PathSegment::CubicTo(one, other, to) => {
                    last = at(to);
                    self.cubic(at(one), at(other), last);
                }
                PathSegment::Close => {
                    self.content.close_path();
                }
            }
        }
    }

    fn cubic(&mut self, one: Point, other: Point, to: Point) {
        self.content.cubic_to(one.x, one.y, other.x, other.y, to.x, to.y);
    }
}

fn matrix(t: Transform) -> [f32; 6] {
    [t.sx, t.ky, t.kx, t.sy, t.tx, t.ty]
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    #[test]
    fn a_page_is_as_large_as_the_svg_and_has_its_paths_clips_and_opacities() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"420mm\" height=\"297mm\" viewBox=\"0 0 420 297\">\
             <clipPath id=\"c\"><path d=\"M0 0H9V9H0ZM2 2H7V7H2Z\" clip-rule=\"evenodd\"/></clipPath>\
             <g clip-path=\"url(#c)\"><path d=\"M0 0H10V10Z\" fill=\"#ff0000\" fill-opacity=\"0.4\"/></g>\
             <path d=\"M1 1Q2 2 3 1\" fill=\"none\" stroke=\"#00ff00\" stroke-dasharray=\"3 1\"/></svg>";
        let bytes = pdf(svg, "A title", "2026-11-26T01:02:03Z").unwrap();
        let text = String::from_utf8_lossy(&bytes);
        // 420 mm are 1190.55 points, 297 mm 841.89.
        assert!(text.contains("/MediaBox [0 0 1190.5") && text.contains(" 841.8"), "{text}");
        assert!(text.contains("A title") && text.contains("D:20261126") && text.contains("/o102"), "{text}");
        let start = bytes.windows(7).position(|at| at == b"stream\n").unwrap() + 7;
        let mut content = String::new();
        flate2::read::ZlibDecoder::new(&bytes[start..]).read_to_string(&mut content).unwrap();
        for expected in ["W*\nn", "1 0 0 rg", "/o102 gs", "0 1 0 RG", "[3 1] 0 d", " c\n", "S\n"] {
            assert!(content.contains(expected), "{expected}: {content}");
        }
        assert!(pdf("no SVG", "", "").is_err());
    }
}
