//! A roundabout file as one would write it where traffic keeps left.

/// A roundabout file's text with left-hand traffic, as one would write it: other signs of bearings and offsets, and the
/// lanes' names exchanged.
pub fn left_hand(text: &str) -> String {
    let negated = |line: &str, key: &str| match line.split_once(&format!("{key} = ")) {
        Some((before, after)) => match after.strip_prefix('-') {
            Some(after) => format!("{before}{key} = {after}"),
            None => format!("{before}{key} = -{after}"),
        },
        None => line.to_owned(),
    };
    let line = |line: &str| {
        let line = negated(&negated(line, "bearing_deg"), "offset");
        match line.strip_suffix(".right]") {
            Some(table) => format!("{table}.left]\n"),
            None => {
                line.strip_suffix(".left]").map_or_else(|| format!("{line}\n"), |table| format!("{table}.right]\n"))
            }
        }
    };
    format!("hand = \"left\"\n{}", text.lines().map(line).collect::<String>())
}
