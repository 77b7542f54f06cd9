//! `train --seeds`: several seeds of one training file, compared.

use std::path::Path;

use offtrack::files::reader::shown_path;
use offtrack_evaluation::files;
use offtrack_learner::error::Error;
use offtrack_learner::train::{Caller, Event, SeedsOutcome};

use super::display::Display;
use super::{Args, read, runs, stop_on_signals};

/// Most seeds of a command.
const MOST: usize = 1000;

/// Trains the seeds that `text` names.
pub(super) fn run(args: &Args, file: &Path, text: &str) -> Result<(), Error> {
    let seeds = parsed(text)?;
    let display = Display::new(true);
    let watcher = |event: Event| display.tell(event);
    let caller = Caller { watcher: &watcher, stop: display.stop() };
    let training = read(args, file, seeds.len(), &display, caller)?;
    stop_on_signals(&display);
    let trained = training.run_seeds(&seeds, &runs(args), args.name.as_deref(), file, caller);
    // What ended the runs comes before a display that cannot be closed.
    let closed = display.close();
    let SeedsOutcome { folder, n_finished, seeds: compared } = trained?;
    closed?;
    let table = if n_finished == 0 { String::new() } else { compared.table() + "\n" };
    let (path, all) = (shown_path(&folder), seeds.len());
    Ok(files::print(&match n_finished == all {
        true => format!("{table}written: {path}\n"),
        false => format!(
            "{table}stopped: {n_finished} of {all} seeds have finished; the same command with --name {} continues\n",
            folder.file_name().unwrap_or_default().to_string_lossy()
        ),
    })?)
}

/// The seeds that `20..24` (both included) or `3,7,9` names.
fn parsed(text: &str) -> Result<Vec<u32>, Error> {
    let wrong = |expected: String| Error::setting("--seeds", text, expected);
    let form = || {
        wrong("a range as in 20..24, both included, or numbers separated by commas, as in 3,7,9, are needed".to_owned())
    };
    let seed = |word: &str| word.trim().parse::<u32>().map_err(|_| form());
    let many = || wrong(format!("at most {MOST} seeds are trained by one command"));
    let mut seeds: Vec<u32> = Vec::new();
    for part in text.split(',') {
        let (first, last) = match part.split_once("..") {
            Some((first, last)) => (seed(first)?, seed(last)?),
            None => (seed(part)?, seed(part)?),
        };
        if last < first {
            return Err(form());
        }
        if MOST as u64 <= u64::from(last - first) + seeds.len() as u64 {
            return Err(many());
        }
        seeds.extend(first..=last);
    }
    match seeds.iter().enumerate().find(|(index, seed)| seeds[..*index].contains(seed)) {
        Some((_, twice)) => Err(wrong(format!("seed {twice} stands there twice: name it once"))),
        None => Ok(seeds),
    }
}

#[cfg(test)]
mod tests {
    use super::parsed;

    #[test]
    fn seeds_are_ranges_with_both_ends_and_lists() {
        let seeds = |text: &str| parsed(text).map_err(|error| error.to_string());
        assert_eq!(seeds("20..24"), Ok(vec![20, 21, 22, 23, 24]));
        assert_eq!(seeds("3, 7,9..10,4294967295"), Ok(vec![3, 7, 9, 10, 4_294_967_295]));
        assert_eq!(seeds("5..5"), Ok(vec![5]));
        for wrong in ["", "24..20", "1..", "..3", "1...3", "-1", "4294967296", "1,,2", "a"] {
            let message = seeds(wrong).unwrap_err();
            assert!(message.contains(&format!("--seeds: {wrong}; a range as in 20..24")), "{message}");
        }
        assert!(seeds("1..3,2").unwrap_err().contains("seed 2 stands there twice"));
        assert!(seeds("0..1000").unwrap_err().contains("at most 1000 seeds") && seeds("0..999").is_ok());
        assert!(seeds("0..4294967295").unwrap_err().contains("at most 1000 seeds"));
    }
}
