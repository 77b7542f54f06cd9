//! How far a training run is, on standard error.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use offtrack::files::reader::printable;
use offtrack_evaluation::files;
use offtrack_learner::run::progress::Status;

/// Time between two lines where there is no terminal for a bar.
const LINE_EVERY: Duration = Duration::from_secs(30);

/// How far a training run is: a bar on a terminal, a plain line now and then elsewhere. Training goes on when nobody
/// reads its lines.
pub struct TrainingDisplay {
    bar: ProgressBar,
    since_line: Instant,
    /// Which of several runs it is; begins each line.
    label: String,
}

impl TrainingDisplay {
    /// A bar at its beginning. `label`, which may be empty, begins each line.
    pub fn new(label: &str) -> TrainingDisplay {
        let style = ProgressStyle::with_template("{bar:24} {percent:>3} % {wide_msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        TrainingDisplay {
            bar: ProgressBar::new(1000).with_style(style),
            since_line: Instant::now(),
            label: label.to_owned(),
        }
    }

    /// How far the run is.
    pub fn show(&mut self, status: &Status) {
        let (fraction, line) = (status.fraction, printable(&format!("{}{status}", self.label)).into_owned());
        if std::io::stderr().is_terminal() {
            self.bar.set_position((1000.0 * fraction) as u64);
            self.bar.set_message(line);
        } else if LINE_EVERY <= self.since_line.elapsed() || fraction == 1.0 {
            let _ = writeln!(std::io::stderr(), "{:>3.0} % {line}", 100.0 * fraction);
            self.since_line = Instant::now();
        }
    }

    /// A line that is to stay, about something that went wrong.
    pub fn warn(&self, line: &str) {
        self.bar.suspend(|| files::say(line));
    }

    /// Leaves the last state where it is.
    pub fn close(self) {
        self.bar.abandon();
    }
}
