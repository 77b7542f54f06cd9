//! What a tree of paths paints, as the content of a PDF's page: paths that it repeats are kept apart, as forms.

use std::collections::HashMap;

use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Name, Rect};
use resvg::tiny_skia::{PathSegment, Point, Transform};
use resvg::usvg::{self, FillRule, LineCap, LineJoin, Node, Paint};

/// Least bytes of a path that becomes a form where it is repeated.
const LEAST_FORM: usize = 40;

/// A path as it is painted; colour, line and place are those of the page there.
pub(super) struct Painted {
    /// Its outline and how it is painted.
    pub(super) ops: Vec<u8>,
    /// How often the page has it.
    n: usize,
    /// What it covers.
    pub(super) bounds: Rect,
}

impl Painted {
    fn is_form(&self) -> bool {
        1 < self.n && LEAST_FORM <= self.ops.len()
    }
}

/// A part of a page's content.
enum Part {
    Ops(Vec<u8>),
    /// Index of what is painted.
    Painted(usize),
}

/// The content of a page.
#[derive(Default)]
pub(super) struct Page {
    parts: Vec<Part>,
    painted: Vec<Painted>,
    /// Indices of what is painted, by its bytes.
    known: HashMap<Vec<u8>, usize>,
    /// How the page paints where its content ends.
    style: Vec<u8>,
    /// Opacities that the page uses, in parts of 255.
    pub(super) opacities: Vec<u8>,
}

impl Page {
    /// The page that a tree paints in this frame.
    pub(super) fn of(root: &usvg::Group, frame: [f32; 6]) -> Page {
        let mut page = Page::default();
        page.ops(|content| {
            content.transform(frame);
        });
        page.group(root, Transform::identity(), 1.0);
        page
    }

    fn ops(&mut self, write: impl FnOnce(&mut Content)) {
        let mut content = Content::new();
        write(&mut content);
        self.parts.push(Part::Ops(content.finish().into_vec()));
    }

    fn paint(&mut self, path: &usvg::Path, at: Transform, write: impl FnOnce(&mut Content)) {
        let mut content = Content::new();
        outline(&mut content, path, Transform::identity());
        write(&mut content);
        let ops = content.finish().into_vec();
        let covered = path.stroke_bounding_box();
        // A mitre reaches farther than a stroke's width.
        let beyond = 8.0 * path.stroke().map_or(0.0, |stroke| stroke.width().get());
        let [left, top, right, bottom] =
            [covered.left() - beyond, covered.top() - beyond, covered.right() + beyond, covered.bottom() + beyond];
        let index = *self.known.entry(ops).or_insert_with_key(|ops| {
            self.painted.push(Painted { ops: ops.clone(), n: 0, bounds: Rect::new(left, top, right, bottom) });
            self.painted.len() - 1
        });
        let painted = &mut self.painted[index];
        let Rect { x1, y1, x2, y2 } = painted.bounds;
        (painted.n, painted.bounds) =
            (painted.n + 1, Rect::new(x1.min(left), y1.min(top), x2.max(right), y2.max(bottom)));
        if at.is_identity() {
            self.parts.push(Part::Painted(index));
            return;
        }
        self.ops(|content| {
            content.save_state().transform(matrix(at));
        });
        self.parts.push(Part::Painted(index));
        self.ops(|content| {
            content.restore_state();
        });
    }

    /// What is repeated, with its index.
    pub(super) fn forms(&self) -> impl Iterator<Item = (usize, &Painted)> {
        self.painted.iter().enumerate().filter(|(_, painted)| painted.is_form())
    }

    /// The page's content.
    pub(super) fn written(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for part in &self.parts {
            match part {
                Part::Ops(ops) => bytes.extend(ops),
                Part::Painted(index) if self.painted[*index].is_form() => {
                    bytes.extend(format!("/{} Do", form(*index)).as_bytes());
                }
                Part::Painted(index) => bytes.extend(&self.painted[*index].ops),
            }
            bytes.push(b'\n');
        }
        bytes
    }

    /// A group within others of this opacity, whose frame lies in that of the page by `at`.
    fn group(&mut self, group: &usvg::Group, at: Transform, opacity: f32) {
        let opacity = opacity * group.opacity().get();
        let at = at.pre_concat(group.transform());
        let Some(clip) = group.clip_path() else {
            self.children(group, at, opacity);
            return;
        };
        self.ops(|content| {
            content.save_state().transform(matrix(at));
            let mut rule = FillRule::NonZero;
            clip_to(content, clip.root(), clip.transform(), &mut rule);
            match rule {
                FillRule::NonZero => content.clip_nonzero(),
                FillRule::EvenOdd => content.clip_even_odd(),
            };
            content.end_path();
        });
        let style = self.style.clone();
        self.children(group, Transform::identity(), opacity);
        self.style = style;
        self.ops(|content| {
            content.restore_state();
        });
    }

    fn children(&mut self, group: &usvg::Group, at: Transform, opacity: f32) {
        for node in group.children() {
            match node {
                Node::Group(group) => self.group(group, at, opacity),
                Node::Path(path) if path.is_visible() => self.path(path, at, opacity),
                _ => {}
            }
        }
    }

    fn path(&mut self, path: &usvg::Path, at: Transform, opacity: f32) {
        let fill = path.fill().and_then(|fill| match fill.paint() {
            Paint::Color(colour) => Some((fill, *colour)),
            _ => None,
        });
        let stroke = path.stroke().and_then(|stroke| match stroke.paint() {
            Paint::Color(colour) => Some((stroke, *colour)),
            _ => None,
        });
        if let Some((fill, colour)) = fill {
            let both = stroke.filter(|(stroke, _)| stroke.opacity() == fill.opacity());
            let opacity = self.opaque(fill.opacity().get() * opacity);
            self.style(|content| {
                content.set_parameters(Name(name(opacity).as_bytes()));
                let [r, g, b] = parts(colour);
                content.set_fill_rgb(r, g, b);
                if let Some((stroke, colour)) = both {
                    lines(content, stroke, colour);
                }
            });
            let is_even_odd = fill.rule() == FillRule::EvenOdd;
            self.paint(path, at, |content| {
                match (is_even_odd, both.is_some()) {
                    (false, false) => content.fill_nonzero(),
                    (false, true) => content.fill_nonzero_and_stroke(),
                    (true, false) => content.fill_even_odd(),
                    (true, true) => content.fill_even_odd_and_stroke(),
                };
            });
            if both.is_some() {
                return;
            }
        }
        if let Some((stroke, colour)) = stroke {
            let opacity = self.opaque(stroke.opacity().get() * opacity);
            self.style(|content| {
                content.set_parameters(Name(name(opacity).as_bytes()));
                lines(content, stroke, colour);
            });
            self.paint(path, at, |content| {
                content.stroke();
            });
        }
    }

    /// How is painted from here on; nothing where it is so already.
    fn style(&mut self, write: impl FnOnce(&mut Content)) {
        let mut content = Content::new();
        write(&mut content);
        let style = content.finish().into_vec();
        if self.style != style {
            self.parts.push(Part::Ops(style.clone()));
            self.style = style;
        }
    }

    /// An opacity in 0..1 as one of the page's, in parts of 255.
    fn opaque(&mut self, opacity: f32) -> u8 {
        let opacity = (255.0 * opacity).round() as u8;
        if !self.opacities.contains(&opacity) {
            self.opacities.push(opacity);
        }
        opacity
    }
}

/// How lines are drawn from here on.
fn lines(content: &mut Content, stroke: &usvg::Stroke, colour: usvg::Color) {
    let [r, g, b] = parts(colour);
    content.set_stroke_rgb(r, g, b).set_line_width(stroke.width().get());
    content.set_line_cap(match stroke.linecap() {
        LineCap::Butt => LineCapStyle::ButtCap,
        LineCap::Round => LineCapStyle::RoundCap,
        LineCap::Square => LineCapStyle::ProjectingSquareCap,
    });
    content.set_line_join(match stroke.linejoin() {
        LineJoin::Miter | LineJoin::MiterClip => LineJoinStyle::MiterJoin,
        LineJoin::Round => LineJoinStyle::RoundJoin,
        LineJoin::Bevel => LineJoinStyle::BevelJoin,
    });
    content.set_miter_limit(stroke.miterlimit().get());
    let dashes = stroke.dasharray().unwrap_or_default();
    content.set_dash_pattern(dashes.iter().copied(), stroke.dashoffset());
}

/// The outlines that a group clips to. A clip is in the frame of what it clips.
fn clip_to(content: &mut Content, group: &usvg::Group, transform: Transform, rule: &mut FillRule) {
    let transform = transform.pre_concat(group.transform());
    for node in group.children() {
        match node {
            Node::Group(group) => clip_to(content, group, transform, rule),
            Node::Path(path) => {
                *rule = path.fill().map_or(*rule, |fill| fill.rule());
                outline(content, path, transform);
            }
            _ => {}
        }
    }
}

fn outline(content: &mut Content, path: &usvg::Path, transform: Transform) {
    // Hundredths of a pixel, as the pictures have them.
    let at = |mut p: Point| {
        transform.map_point(&mut p);
        Point::from_xy(rounded(p.x, 100.0), rounded(p.y, 100.0))
    };
    let cubic = |content: &mut Content, one: Point, other: Point, to: Point| {
        content.cubic_to(one.x, one.y, other.x, other.y, to.x, to.y);
    };
    let mut last = Point::zero();
    for segment in path.data().segments() {
        match segment {
            PathSegment::MoveTo(to) => {
                last = at(to);
                content.move_to(last.x, last.y);
            }
            PathSegment::LineTo(to) => {
                last = at(to);
                content.line_to(last.x, last.y);
            }
            PathSegment::QuadTo(one, to) => {
                let (one, to) = (at(one), at(to));
                let third = |from: Point| {
                    let [x, y] = [one.x + (from.x - one.x) / 3.0, one.y + (from.y - one.y) / 3.0];
                    Point::from_xy(rounded(x, 100.0), rounded(y, 100.0))
                };
                cubic(content, third(last), third(to), to);
                last = to;
            }
            PathSegment::CubicTo(one, other, to) => {
                last = at(to);
                cubic(content, at(one), at(other), last);
            }
            PathSegment::Close => {
                content.close_path();
            }
        }
    }
}

/// Red, green and blue in 0..1.
fn parts(colour: usvg::Color) -> [f32; 3] {
    [colour.red, colour.green, colour.blue].map(|channel| f32::from(channel) / 255.0)
}

fn matrix(t: Transform) -> [f32; 6] {
    let [sx, ky, kx, sy] = [t.sx, t.ky, t.kx, t.sy].map(|value| rounded(value, 1e6));
    [sx, ky, kx, sy, rounded(t.tx, 100.0), rounded(t.ty, 100.0)]
}

/// A value in whole parts of 1.
fn rounded(value: f32, parts: f32) -> f32 {
    (parts * value).round() / parts
}

/// Name of the state with this opacity, in parts of 255.
pub(super) fn name(opacity: u8) -> String {
    format!("o{opacity}")
}

/// Name of a form.
pub(super) fn form(index: usize) -> String {
    format!("f{index}")
}
