//! What is printed of a run that has ended.

use offtrack::files::reader::shown_path;
use offtrack_evaluation::report::Report;
use offtrack_learner::run::folder::Folder;
use offtrack_learner::run::route_counts::WorstRoutes;
use offtrack_learner::train::{AlsoReport, Outcome};

use crate::commands::terminal;

/// Training routes named at the end.
const N_WORST: usize = 5;

/// What a run came to. One of several seeds has a line for each evaluation in place of a table of its routes.
pub(super) fn text(folder: &Folder, outcome: &Outcome, is_one_of_several: bool) -> String {
    let path = shown_path(folder.path());
    if outcome.interrupted {
        return format!("stopped: policy and metrics are in {path}; not evaluated; train --resume {path} continues\n");
    }
    let mut said = String::new();
    if let Some(report) = outcome.evaluation.as_ref().filter(|_| !is_one_of_several) {
        said += &report.table(terminal::width());
    }
    if is_one_of_several || !outcome.also.is_empty() {
        said += &lines(outcome.evaluation.as_ref(), &outcome.also);
    }
    said += &outcome.training_routes.as_ref().map(worst).unwrap_or_default();
    format!("{said}written: {path}\n{}", checkpoint(folder))
}

/// A line about the checkpoint of a run that has finished.
fn checkpoint(folder: &Folder) -> String {
    let file = folder.checkpoint();
    let Ok(size) = std::fs::metadata(&file).map(|metadata| metadata.len()) else { return String::new() };
    let megabytes = size.div_ceil(1_000_000);
    format!(
        "{} ({megabytes} MB) is for train --resume with more --steps or --minutes alone; it may be deleted\n",
        shown_path(&file)
    )
}

/// A line about the training routes with least success.
fn worst(WorstRoutes { routes, window, worst }: &WorstRoutes) -> String {
    let shown: Vec<String> = worst
        .iter()
        .take(N_WORST)
        .map(|route| format!("{} {:.0} %", route.route, 100.0 * route.recent_success))
        .collect();
    if shown.is_empty() {
        return String::new();
    }
    format!("least success of {routes} training routes, latest {window} episodes of each: {}\n", shown.join(", "))
}

/// Whether a policy knows the routes it was evaluated on.
fn familiarity(trained_on: usize, n_routes: usize) -> String {
    match trained_on {
        0 => "zero-shot".to_owned(),
        all if all == n_routes => "trained on".to_owned(),
        some => format!("{some} of {n_routes} routes trained on"),
    }
}

/// The interval over routes, after Wilson's; nothing where it has no width.
fn over_routes(ends: Option<(f64, f64)>) -> String {
    match ends {
        Some((low, high)) if low < high => format!("; over routes {:.1} to {:.1} %", 100.0 * low, 100.0 * high),
        _ => String::new(),
    }
}

/// A line for each evaluation, that on `benchmark` first.
fn lines(evaluation: Option<&Report>, also: &[AlsoReport]) -> String {
    // No test route is trained on.
    let all =
        evaluation.map(|report| (0, report)).into_iter().chain(also.iter().map(|also| (also.trained_on, &also.report)));
    let named: Vec<(String, usize, &Report)> = all
        .map(|(trained_on, report)| (format!("{} {}", report.benchmark, report.split), trained_on, report))
        .collect();
    let width = named.iter().map(|(name, ..)| name.len()).max().unwrap_or(0);
    let line = |(name, trained_on, report): &(String, usize, &Report)| {
        let summary = &report.summary;
        let lane = summary.lane_distance_mean_arrived.map_or_else(|| "-".to_owned(), |mean| format!("{mean:.2} m"));
        let arrived = format!("{}/{}", summary.arrived, summary.episodes);
        let [success, low, high] =
            [summary.success, summary.success_low, summary.success_high].map(|fraction| 100.0 * fraction);
        let over_routes = over_routes(summary.success_low_over_routes.zip(summary.success_high_over_routes));
        format!(
            "{name:width$}  {arrived:>11} arrived, {success:5.1} % ({low:.1} to {high:.1} %{over_routes}), lane \
             distance {lane} ({})\n",
            familiarity(*trained_on, report.routes.len())
        )
    };
    let lines: String = named.iter().map(line).collect();
    format!(
        "{lines}lane distance: to the lane's centre, mean over the episodes that arrived; in brackets 95 % intervals\n"
    )
}

#[cfg(test)]
mod tests {
    use super::{familiarity, over_routes};

    #[test]
    fn an_evaluation_is_zero_shot_where_no_route_was_trained_on() {
        assert_eq!(familiarity(0, 5), "zero-shot");
        assert_eq!(familiarity(5, 5), "trained on");
        assert_eq!(familiarity(2, 5), "2 of 5 routes trained on");
    }

    #[test]
    fn an_interval_over_routes_is_told_where_routes_differ() {
        assert_eq!(over_routes(Some((0.567, 0.861))), "; over routes 56.7 to 86.1 %");
        assert_eq!([over_routes(Some((1.0, 1.0))), over_routes(None)], [String::new(), String::new()]);
    }
}
