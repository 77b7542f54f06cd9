//! The rows of `scenarios/README.md`: each key with its unit, its range and its default.

/// The head of every table of keys.
const HEAD: [&str; 5] = ["key", "unit", "range", "default", "meaning"];

/// Both ends of a range; none where an end is no number.
pub type Ends = [Option<f64>; 2];

/// What the file says of one key.
#[derive(Debug, Clone)]
pub struct Row {
    pub key: String,
    pub unit: String,
    /// The range as written, for all keys of the row.
    pub range: String,
    pub ends: Option<Ends>,
    pub default: String,
}

impl Row {
    pub fn is_required(&self) -> bool {
        self.default.is_empty() || self.default.starts_with("required")
    }

    /// The words that a value may be, where the range lists words alone.
    pub fn words(&self) -> Vec<&str> {
        let listed: Vec<Option<&str>> =
            self.range.split(", ").map(|word| word.strip_prefix('`')?.strip_suffix('`')).collect();
        listed
            .into_iter()
            .map(|word| word.map(|word| word.trim_matches('"')))
            .collect::<Option<_>>()
            .unwrap_or_default()
    }

    /// How many values a list may have, where the range says so: `1 to 64 values`.
    pub fn count(&self) -> Option<Ends> {
        let part = self.range.split(", ").find_map(|part| part.strip_suffix(" values"))?;
        let (least, most) = part.split_once(" to ")?;
        Some([number(least), number(most)])
    }
}

/// The keys of the section under `title`, which goes to the next title of its level.
pub fn rows_of(text: &str, title: &str) -> Vec<Row> {
    let section = text.split("\n## ").find(|section| section.starts_with(title));
    let section = section.unwrap_or_else(|| panic!("no section {title}"));
    let mut rows = Vec::new();
    let mut is_of_keys = false;
    for line in section.lines() {
        let Some(line) = line.strip_prefix("| ").and_then(|line| line.strip_suffix(" |")) else {
            is_of_keys &= line.starts_with('|');
            continue;
        };
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        if cells[0] == "key" {
            assert_eq!(cells, HEAD, "every table of keys has these columns");
            is_of_keys = true;
        } else if is_of_keys {
            assert_eq!(cells.len(), HEAD.len(), "{line}");
            rows.extend(keys_of(&cells));
        }
    }
    rows
}

/// The keys of one row; unit and range are one for all or one for each.
fn keys_of(cells: &[&str]) -> Vec<Row> {
    let keys: Vec<&str> = cells[0].split(", ").map(|key| key.trim_matches('`')).collect();
    let ranges: Vec<Ends> = cells[2].split(", ").filter_map(ends).collect();
    let units: Vec<&str> = cells[1].split(", ").collect();
    let row = |(index, key): (usize, &&str)| Row {
        key: (*key).to_owned(),
        unit: (*units.get(index).or(units.first()).unwrap_or(&"")).to_owned(),
        range: cells[2].to_owned(),
        ends: ranges.get(index).or(ranges.first()).copied(),
        default: cells[3].to_owned(),
    };
    keys.iter().enumerate().map(row).collect()
}

/// Both ends of `a..b`, with words behind it.
pub fn ends(text: &str) -> Option<Ends> {
    let (least, most) = text.split_once("..")?;
    let least = least.rsplit(" of ").next().unwrap_or(least);
    let mut words = most.split_whitespace();
    let mut most = words.next().unwrap_or_default().to_owned();
    // 30 000 is one number.
    most.extend(words.take_while(|word| word.len() == 3 && word.bytes().all(|digit| digit.is_ascii_digit())));
    Some([number(least), number(&most)])
}

fn number(text: &str) -> Option<f64> {
    text.split_whitespace().collect::<String>().parse().ok()
}
