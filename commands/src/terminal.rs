//! The width that a table may have.

/// Widths that a table is made for.
const LEAST: usize = 40;
const MOST: usize = 200;
/// Where standard output is no terminal.
const ELSEWHERE: usize = 100;

/// Columns of the terminal: the variable `COLUMNS` where it is set, else the size of the terminal, else 100.
pub fn width() -> usize {
    let stated = std::env::var("COLUMNS").ok().and_then(|columns| columns.trim().parse().ok());
    let terminal = || console::Term::stdout().size_checked().map(|(_, columns)| usize::from(columns));
    stated.or_else(terminal).map_or(ELSEWHERE, |columns: usize| columns.clamp(LEAST, MOST))
}
