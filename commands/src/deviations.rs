//! Compares a roundabout with a measured one and prints the distances between their kerbs and lanes.

use std::path::PathBuf;

use offtrack::files::reader::read_text;
use offtrack::map::Road;
use offtrack_reference::FILE_LIMIT;
use offtrack_reference::deviation::{Measured, NEAR, deviations};

use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

/// Compare a roundabout with a measured one: kerb faces, the edges of the lanes, and lane centre lines, within 45 m of
/// the centre.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A roundabout's name, or the path of its file.
    roundabout: String,
    /// The roundabout's measured counterpart as JSON: tests/data/measured/16m.json.
    measured: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let roundabout = Road::find(&args.roundabout)?;
    let text = read_text(&args.measured, FILE_LIMIT)?;
    let wrong = |message: String| Error::contents(&args.measured, message);
    let measured: Measured = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
    let rows = deviations(&roundabout, &measured).map_err(|error| wrong(error.to_string()))?;
    let mut table = format!(
        "{:<14} {:>21} {:>30} {:>33}\n",
        roundabout.name, "measured to model", "model to measured", "% within, both ways"
    );
    table += &format!(
        "{:<14} {:>8} {:>8} {:>8} {:>12} {:>8} {:>8}",
        "", "worst m", "mean m", "points", "worst m", "mean m", "points"
    );
    table += &NEAR.map(|limit| format!(" {:>8}", format!("{limit} m"))).concat();
    table.push('\n');
    for row in &rows {
        let (there, back) = (row.from_measured, row.from_model);
        table += &format!(
            "{:<14} {:>8.2} {:>8.2} {:>8} {:>12.2} {:>8.2} {:>8}",
            row.what, there.worst, there.mean, there.points, back.worst, back.mean, back.points
        );
        table += &row.near().map(|fraction| format!(" {:>8.1}", 100.0 * fraction)).concat();
        table.push('\n');
    }
    files::print(&table)
}
