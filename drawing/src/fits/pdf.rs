//! An SVG of paths as a PDF of one page, as large as the SVG says.
//!
//! The pictures of this crate are paths alone: letters are outlines, and there are neither gradients nor images. So the
//! tree that `usvg` makes of them is written as it is, but for what it repeats: a glyph, or the road of every panel, is
//! a form that is written once.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::{Date, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use resvg::usvg;

use super::page::{Page, form, name};
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
    // A page's y points up.
    let page = Page::of(tree.root(), [POINT, 0.0, 0.0, -POINT, 0.0, height]);
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
    let mut forms = resources.x_objects();
    for (reference, (index, _)) in (FIRST_FORM..).map(Ref::new).zip(page.forms()) {
        forms.pair(Name(form(index).as_bytes()), reference);
    }
    forms.finish();
    resources.finish();
    written.finish();
    pdf.stream(content, &packed(&page.written())).filter(Filter::FlateDecode);
    for (reference, (_, painted)) in (FIRST_FORM..).map(Ref::new).zip(page.forms()) {
        let content = packed(&painted.ops);
        let mut form = pdf.form_xobject(reference, &content);
        form.bbox(painted.bounds).filter(Filter::FlateDecode);
    }
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

/// The object of the first form; those before it are the document's.
const FIRST_FORM: i32 = 6;

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    // Writing to memory cannot fail.
    let _ = packed.write_all(bytes);
    packed.finish().unwrap_or_default()
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
        let content = streams(&bytes).remove(0);
        for expected in ["W*\nn", "1 0 0 rg", "/o102 gs", "0 1 0 RG", "[3 1] 0 d", " c\n", "S\n"] {
            assert!(content.contains(expected), "{expected}: {content}");
        }
        assert!(pdf("no SVG", "", "").is_err());
    }

    /// The streams of a PDF, unpacked.
    fn streams(bytes: &[u8]) -> Vec<String> {
        let starts = bytes.windows(8).enumerate().filter(|(_, at)| *at == b"\nstream\n").map(|(at, _)| at + 8);
        let unpacked = |start: usize| {
            let mut content = String::new();
            flate2::read::ZlibDecoder::new(&bytes[start..]).read_to_string(&mut content).unwrap();
            content
        };
        starts.map(unpacked).collect()
    }

    #[test]
    fn a_path_that_a_page_repeats_is_written_once_in_any_colour_and_at_any_place() {
        let star = "M0 0L10 1L20 0L19 10L20 20L10 19L0 20L1 10Z";
        let other = "M0 0L10 1L20 0L19 10L20 20L10 19L0 20L1 11Z";
        let svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"100\" height=\"100\">\
             <defs><path id=\"star\" d=\"{star}\"/></defs>\
             <g fill=\"#ff0000\"><use href=\"#star\"/></g><g fill=\"#0000ff\"><use href=\"#star\" x=\"30\"/></g>\
             <path d=\"{other}\"/><path d=\"M0 0L1 1\" stroke=\"#000\"/><path d=\"M0 0L1 1\" stroke=\"#000\"/></svg>"
        );
        let bytes = pdf(&svg, "t", "").unwrap();
        let streams = streams(&bytes);
        assert_eq!(streams.len(), 2, "{streams:?}");
        assert_eq!(streams[0].matches("/f0 Do").count(), 2, "{}", streams[0]);
        assert!(streams[0].contains("1 0 0 rg") && streams[0].contains("0 0 1 rg"), "{}", streams[0]);
        assert!(streams[0].contains("1 11 l") && streams[1].contains("1 10 l\nh\nf"), "{streams:?}");
        assert!(String::from_utf8_lossy(&bytes).contains("/f0 6 0 R"));
    }
}
