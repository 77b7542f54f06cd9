//! Rows of cells as text: Markdown, LaTeX, HTML and CSV. The first row is the head.

use std::fmt::Write;

use offtrack::files::reader::printable;

/// Rows of equally many cells as a Markdown table with aligned columns.
pub(crate) fn markdown(rows: &[Vec<String>]) -> String {
    // What escapes a bar would be escaped by a backslash before it.
    let cell = |cell: &String| printable(cell).replace("\\|", "\\\\|").replace('|', "\\|");
    let rows: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(cell).collect()).collect();
    let n_columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..n_columns).map(width).collect();
    let mut text = String::new();
    for (index, row) in rows.iter().enumerate() {
        for (cell, width) in row.iter().zip(&widths) {
            let _ = write!(text, "| {cell:width$} ");
        }
        text += "|\n";
        if index == 0 {
            text.extend(widths.iter().map(|width| format!("|{}", "-".repeat(width + 2))));
            text += "|\n";
        }
    }
    text
}

/// The same as a `tabular` of LaTeX with the rules of the package `booktabs`: the first column to the left, the others
/// to the right.
pub(crate) fn latex(rows: &[Vec<String>]) -> String {
    let n_columns = rows.first().map_or(0, Vec::len);
    let mut text = format!("\\begin{{tabular}}{{l{}}}\n\\toprule\n", "r".repeat(n_columns.saturating_sub(1)));
    for (index, row) in rows.iter().enumerate() {
        let cells: Vec<String> = row.iter().map(|cell| escaped(&printable(cell))).collect();
        text += &format!("{} \\\\\n", cells.join(" & "));
        if index == 0 {
            text += "\\midrule\n";
        }
    }
    text + "\\bottomrule\n\\end{tabular}\n"
}

/// Text with the characters that LaTeX obeys as LaTeX prints them. A minus sign is one.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    let mut before = ' ';
    for letter in text.chars() {
        match letter {
            '\\' => escaped += "\\textbackslash{}",
            '~' => escaped += "\\textasciitilde{}",
            '^' => escaped += "\\textasciicircum{}",
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => escaped.extend(['\\', letter]),
            // Of a number; within a name it is a hyphen.
            '-' if !before.is_alphanumeric() => escaped += "$-$",
            _ => escaped.push(letter),
        }
        before = letter;
    }
    escaped
}

/// The same as an HTML table.
pub(crate) fn html(rows: &[Vec<String>]) -> String {
    let row = |(index, row): (usize, &Vec<String>)| {
        let tag = if index == 0 { "th scope=\"col\"" } else { "td" };
        let cells = row.iter().map(|cell| format!("<{tag}>{}</{}>", html_text(cell), &tag[..2]));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    format!("<table>\n{}</table>\n", rows.iter().enumerate().map(row).collect::<String>())
}

/// Text that can stand in HTML.
pub(crate) fn html_text(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The same as CSV (RFC 4180).
pub(crate) fn csv(rows: &[Vec<String>]) -> String {
    let line = |row: &Vec<String>| row.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\n";
    rows.iter().map(line).collect()
}

/// A cell of CSV.
pub fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_characters_that_latex_obeys_are_printed_as_they_are() {
        assert_eq!(escaped("100 % of a_b & {c} $d #1"), "100 \\% of a\\_b \\& \\{c\\} \\$d \\#1");
        assert_eq!(escaped("~\\^"), "\\textasciitilde{}\\textbackslash{}\\textasciicircum{}");
        assert_eq!(escaped("attard2023-lane -0.5 [-1, -]"), "attard2023-lane $-$0.5 [$-$1, $-$]");
        let rows = [vec!["side".into(), "%".into()], vec!["a_b".into(), "-1".into()]];
        let expected = "\\begin{tabular}{lr}\n\\toprule\nside & \\% \\\\\n\\midrule\na\\_b & $-$1 \\\\\n\\bottomrule\n\
                        \\end{tabular}\n";
        assert_eq!(latex(&rows), expected);
    }

    #[test]
    fn a_cell_of_markdown_does_not_end_at_a_bar_and_columns_are_aligned() {
        let rows = [vec!["a|b".into(), "c".into()], vec!["µ".into(), "de".into()]];
        assert_eq!(markdown(&rows), "| a\\|b | c  |\n|------|----|\n| µ    | de |\n");
        let rows = [vec!["a\nb".into()], vec!["c\\|d\\".into()]];
        assert_eq!(markdown(&rows), "| a\\nb    |\n|---------|\n| c\\\\\\|d\\ |\n");
    }

    #[test]
    fn a_name_in_a_cell_of_html_is_no_markup() {
        let rows = [vec!["<b>".into()], vec!["a & b".into()]];
        let expected = "<table>\n<tr><th scope=\"col\">&lt;b&gt;</th></tr>\n<tr><td>a &amp; b</td></tr>\n</table>\n";
        assert_eq!(html(&rows), expected);
    }

    #[test]
    fn cells_of_csv_are_read_back() {
        assert_eq!(csv(&[vec!["a,\"b\"".into(), "c d".into()]]), "\"a,\"\"b\"\"\",c d\n");
    }
}
