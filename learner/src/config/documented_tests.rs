//! The shipped training files explain every key: a comment above it, with the range that the reader has.

use std::collections::BTreeSet;

use super::*;

/// The folder of the training files, in the repository.
const CONFIGS: &str = "learner/configs";
/// The files that explain keys: each those that the ones before it do not have.
const EXPLAINING: [&str; 3] = ["default", "paper", "lane"];
const UNKNOWN: &str = "no_such_key";

/// Both ends of a range; none where an end is another key.
type Ends = [Option<f64>; 2];

/// Comments in a row, and the keys that follow them at once.
#[derive(Debug, Default, Clone)]
struct Block {
    file: &'static str,
    table: String,
    text: String,
    keys: Vec<String>,
}

impl Block {
    fn has(&self, key: &str) -> bool {
        let (table, name) = key.rsplit_once('.').unwrap_or(("", key));
        // Weights of the reward are named alone: the benchmarks' own description has their ranges.
        let is_word =
            |word: &str| word.trim_matches(|letter: char| !letter.is_ascii_lowercase() && letter != '_') == name;
        self.table == table
            && (self.keys.iter().any(|key| key == name) || is_reward(key) && self.text.split_whitespace().any(is_word))
    }

    fn ranges(&self) -> Vec<Ends> {
        self.text.split_whitespace().filter_map(ends).collect()
    }
}

fn is_reward(key: &str) -> bool {
    key.starts_with("reward.")
}

/// The key of a line, also of one that is a comment: `# from = "random2026"`.
fn key_of(line: &str) -> Option<&str> {
    let key = line.split_once(" = ")?.0;
    is_key(key).then_some(key)
}

fn is_key(word: &str) -> bool {
    word.bytes().all(|letter| letter.is_ascii_lowercase() || letter == b'_')
}

fn blocks(file: &'static str, text: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut block = Block { file, ..Block::default() };
    let mut end = |block: &mut Block| {
        let next = Block { file, table: block.table.clone(), ..Block::default() };
        blocks.push(std::mem::replace(block, next));
    };
    for line in text.lines() {
        let comment = line.strip_prefix("# ");
        if let Some(table) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            // What stands above a table is about it.
            table.clone_into(&mut block.table);
            end(&mut block);
        } else if let Some(key) = key_of(comment.unwrap_or(line)) {
            block.keys.push(key.to_owned());
        } else if let Some(comment) = comment {
            if !block.keys.is_empty() {
                end(&mut block);
            }
            block.text += &format!("{comment} ");
        } else {
            end(&mut block);
        }
    }
    end(&mut block);
    // A key may stand in the text alone.
    for block in &mut blocks {
        let quoted = block.text.split('`').skip(1).step_by(2);
        block.keys.extend(quoted.filter(|word| is_key(word)).map(str::to_owned));
    }
    blocks.retain(|block| !block.text.is_empty());
    blocks
}

/// Both ends of `a..b`.
fn ends(word: &str) -> Option<Ends> {
    let (least, most) = word.trim_end_matches(['.', ',', ';', ':', ')']).split_once("..")?;
    Some([Some(least.parse().ok()?), most.parse().ok()])
}

fn same(stated: &Ends, of_reader: &Ends) -> bool {
    stated.iter().zip(of_reader).all(|(stated, of_reader)| stated.is_none_or(|stated| Some(stated) == *of_reader))
}

fn refused(file: &str, setting: String) -> String {
    Config::read_with(Path::new(file), &[setting])
        .map(drop)
        .map_err(|error| error.to_string())
        .err()
        .unwrap_or_default()
}

/// Every key that the reader takes, those of tables after the table's name.
fn keys(table: &str) -> Vec<String> {
    let message = refused("default", format!("{table}{UNKNOWN}=1"));
    let Some((_, listed)) = message.split_once(&format!("unknown field `{UNKNOWN}`, expected ")) else {
        return Vec::new();
    };
    // The parser names the table behind them.
    let names = listed
        .split(", in `")
        .next()
        .unwrap_or_default()
        .split('`')
        .skip(1)
        .step_by(2)
        .map(|name| format!("{table}{name}"));
    let of_name = |name: String| {
        let below = keys(&format!("{name}."));
        if below.is_empty() { vec![name] } else { below }
    };
    names.flat_map(of_name).collect()
}

/// The ranges that the reader has for a key, found by values far beyond them: of a list also that of its length.
fn ranges(file: &str, key: &str) -> Vec<Ends> {
    let beyond = i64::MAX;
    let values = [beyond.to_string(), format!("[{beyond}]"), format!("{:?}", [1; 100])];
    let range = |value: String| {
        let message = refused(file, format!("{key}={value}"));
        if message.contains("expected a whole number in 0..4294967295") {
            return Some([Some(0.0), Some(u32::MAX.into())]);
        }
        let (at, range) = message.split_once("; must lie in ")?;
        at.contains(&format!(": {key}")).then(|| ends(range.split_whitespace().next()?)).flatten()
    };
    values.into_iter().filter_map(range).collect()
}

/// Where the comments of `blocks` and the reader differ, each with what would do; and how many ranges were compared.
fn faults(keys: &[String], blocks: &[Block]) -> (BTreeSet<String>, usize) {
    let (mut faults, mut n_ranges) = (BTreeSet::new(), 0);
    for key in keys {
        let Some(first) = blocks.iter().find(|block| block.has(key)) else {
            faults
                .insert(format!("{key}: no file explains it: add a comment above it, with its range, to default.toml"));
            continue;
        };
        for range in ranges(first.file, key).iter().filter(|_| !is_reward(key)) {
            let stated =
                blocks.iter().filter(|block| block.has(key)).flat_map(Block::ranges).any(|stated| same(&stated, range));
            if !stated {
                let [least, most] = range.map(Option::unwrap_or_default);
                faults.insert(format!("{key}: lies in {least}..{most}: say so above it in {}.toml", first.file));
            }
            n_ranges += 1;
        }
    }
    for block in blocks {
        let of_block: Vec<Ends> =
            keys.iter().filter(|key| block.has(key)).flat_map(|key| ranges(block.file, key)).collect();
        for [least, most] in block.ranges().iter().filter(|stated| !of_block.iter().any(|range| same(stated, range))) {
            let place = format!("{}.toml, [{}] {}", block.file, block.table, block.keys.join(", "));
            faults.insert(format!("{place}: {least:?}..{most:?} is the range of none of these keys: {of_block:?}"));
        }
    }
    (faults, n_ranges)
}

fn text_of(file: &str) -> String {
    std::fs::read_to_string(crate::repository().join(CONFIGS).join(file).with_extension("toml")).unwrap()
}

#[test]
fn every_key_is_explained_with_its_range() {
    let blocks: Vec<Block> = EXPLAINING.into_iter().flat_map(|file| blocks(file, &text_of(file))).collect();
    let mut keys = keys("");
    // What a refinement may change in its reward are the keys of `[reward]`.
    keys.retain(|key| !key.starts_with("refinement.reward."));
    let (faults, n_ranges) = faults(&keys, &blocks);
    let faults: Vec<String> = faults.into_iter().collect();
    assert!(faults.is_empty(), "{CONFIGS}:\n{}", faults.join("\n"));
    assert!(65 <= keys.len() && 45 <= n_ranges, "{} keys, {n_ranges} ranges", keys.len());
}

#[test]
fn a_key_without_a_comment_and_a_wrong_range_are_found() {
    let text =
        text_of("default").replace("Discount factor; 0..1.", "Discount factor; 0..2.").replace("`adapter`", "adapter");
    let keys = ["learning.gamma", "learning.tau", "adapter"].map(str::to_owned);
    let (faults, _) = faults(&keys, &blocks("default", &text));
    let starts = [
        "adapter: no file explains it",
        "default.toml, [learning] gamma: Some(0.0)..Some(2.0)",
        "learning.gamma: lies in 0..1",
    ];
    assert!(starts.iter().all(|start| faults.iter().any(|fault| fault.starts_with(start))), "{faults:#?}");
}
