//! The progress bar of a command, on standard error; nothing is drawn where that is no terminal.

use indicatif::{ProgressBar, ProgressStyle};
use offtrack::files::reader::printable;

/// A bar over `length` things called `unit`, after what is done with them.
pub struct Bar(ProgressBar);

impl Bar {
    /// `evaluating`, `episodes`, and how many.
    pub fn new(action: &str, unit: &str, length: usize) -> Bar {
        let template = format!("{action} {{bar:24}} {{pos}}/{{len}} {unit}, {{elapsed}} {{wide_msg}}");
        let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
        Bar(ProgressBar::new(length as u64).with_style(style))
    }

    /// `done` of `length` things are done.
    pub fn set(&self, done: usize, length: usize) {
        self.0.set_length(length as u64);
        self.0.set_position(done as u64);
    }

    /// One more thing is done.
    pub fn advance(&self) {
        self.0.inc(1);
    }

    /// Words after the numbers.
    pub fn say(&self, words: &str) {
        self.0.set_message(printable(words).into_owned());
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
