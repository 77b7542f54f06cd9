//! The result as a picture: speed against the number of trucks, and where a step's time goes.

use glam::DVec2;

use super::measure::STAGE_NAMES;
use super::mode::Mode;
use super::{Measured, Scale};
use offtrack_drawing::chart::{Chart, Kind, LINES, Line, Panel, Scales};

/// Width of a PNG (px).
pub(super) const PNG_WIDTH: u32 = 1600;

/// The picture as SVG text; `device` is the name of what stepped the trucks.
pub(super) fn drawn(scale: &Scale, device: &str) -> Result<String, offtrack_drawing::Error> {
    let mut modes: Vec<Mode> = Vec::new();
    for run in &scale.runs {
        if !modes.contains(&run.mode) {
            modes.push(run.mode);
        }
    }
    let mut speeds = Vec::new();
    for (&mode, colour) in modes.iter().zip(LINES) {
        let runs = scale.measured(mode);
        let points = runs.iter().map(|(envs, run)| DVec2::new(*envs as f64, run.env_steps_per_second));
        let points: Vec<DVec2> = points.collect();
        let spread = runs.iter().map(|(_, run)| (run.slowest_window, run.fastest_window)).collect();
        if let (Some(first), Some(last)) = (points.first(), points.last()) {
            let best = points.iter().map(|p| p.y).fold(0.0, f64::max);
            let name = speeds.is_empty().then_some("time in proportion to the trucks");
            let points = vec![DVec2::new(first.x, best), DVec2::new(last.x, best)];
            speeds.push(Line { name, colour, kind: Kind::Reference, points });
        }
        speeds.push(Line { name: Some(words(mode)), colour, kind: Kind::Measured(spread), points });
    }
    let stages = stage_lines(&scale.measured(Mode::Random));
    let mut panels = vec![Panel {
        title: "Speed: median, slowest and fastest window",
        x: "trucks",
        y: "env steps / s",
        scales: Scales::Logarithmic,
        lines: speeds,
    }];
    if !stages.is_empty() {
        panels.push(Panel {
            title: "Time of each stage, random actions",
            x: "trucks",
            y: "time a truck and step [ns]",
            scales: Scales::Logarithmic,
            lines: stages,
        });
    }
    let step = &scale.step;
    let subtitles = vec![
        format!("{}; benchmark {}; commit {}, {}", device, scale.benchmark, scale.commit, scale.date),
        format!(
            "An env step is {} s of one truck: {} sub-steps, {} rays, {} values, reward, a new episode where one \
            ended.",
            step.dt, step.substeps, step.rays, step.values
        ),
    ];
    Chart { title: "Env steps per second against the number of trucks".to_owned(), subtitles, panels }.drawn()
}

/// What drives, in the legend.
fn words(mode: Mode) -> &'static str {
    match mode {
        Mode::Random => "random actions",
        Mode::Policy => "policy in the loop, 256, 256",
        Mode::LargePolicy => "policy in the loop, 512, 512, 1024",
        Mode::Training => "training",
    }
}

// Each stage has a colour of its own.
const _: () = assert!(STAGE_NAMES.len() <= LINES.len());

/// A line for each stage.
fn stage_lines(runs: &[(usize, &Measured)]) -> Vec<Line> {
    let stage = |(index, (name, colour)): (usize, (&'static str, &'static str))| {
        let points = runs.iter().filter_map(|(envs, run)| {
            let (_, time) = run.stages.get(index)?;
            // A clock that ticks too slowly for a stage reads 0, which has no place on a logarithmic axis.
            (0.0 < *time).then(|| DVec2::new(*envs as f64, *time))
        });
        Line { name: Some(name), colour, kind: Kind::Measured(Vec::new()), points: points.collect() }
    };
    let lines = STAGE_NAMES.into_iter().zip(LINES).enumerate().map(stage);
    lines.filter(|line| !line.points.is_empty()).collect()
}
