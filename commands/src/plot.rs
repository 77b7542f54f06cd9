//! Plots: pictures in the format that the name of their file asks for.

use std::path::Path;

use offtrack_drawing::rasterised;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

/// An error that names the flag, unless the file of a plot ends in .svg or .png.
pub fn check(flag: &'static str, file: &Path) -> Result<(), Error> {
    if is_png(file) || file.extension().is_some_and(|extension| extension == "svg") {
        return Ok(());
    }
    Err(Error::Setting { name: flag, value: file.display().to_string(), expected: "must end in .svg or .png".into() })
}

/// The bytes of a picture; of a PNG so many pixels wide.
pub fn bytes(file: &Path, svg: Result<String, offtrack_drawing::Error>, width: u32) -> Result<Vec<u8>, Error> {
    let drawn = svg.and_then(|svg| if is_png(file) { rasterised(&svg, width) } else { Ok(svg.into_bytes()) });
    drawn.map_err(|error| Error::write(file)(std::io::Error::other(error)))
}

/// Writes a picture, whole; a PNG so many pixels wide.
pub fn write(file: &Path, svg: Result<String, offtrack_drawing::Error>, width: u32) -> Result<(), Error> {
    files::write_whole(file, &bytes(file, svg, width)?)
}

fn is_png(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension == "png")
}
