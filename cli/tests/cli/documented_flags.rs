//! `docs/cli.md` names every flag of every command in the command's section, with its default, and no other flag.

use std::collections::BTreeSet;

use crate::place::{offtrack, repository};

/// The description of the command line, in the repository.
const DESCRIPTION: &str = "docs/cli.md";
/// A flag of cargo that it names, and the one that every command has.
const OF_ALL: [&str; 2] = ["--features", "--help"];

/// A flag as `--help` lists it.
struct Flag {
    long: String,
    short: Option<String>,
    default: Option<String>,
}

fn flags(help: &str) -> Vec<Flag> {
    let mut flags: Vec<Flag> = Vec::new();
    for line in help.lines().filter(|line| line.starts_with("  ")) {
        // A value that may be left out stands in brackets.
        let words = line.split([' ', ',', '[']).filter(|word| !word.is_empty());
        let names: Vec<&str> = words.take_while(|word| word.starts_with('-')).collect();
        if let Some(long) = names.iter().find(|name| name.starts_with("--")) {
            let short = names.iter().find(|name| name.len() == 2).map(|name| (*name).to_owned());
            flags.push(Flag { long: (*long).to_owned(), short, default: None });
        }
        if let (Some(flag), Some((_, default))) = (flags.last_mut(), line.split_once("[default: ")) {
            flag.default = default.split_once(']').map(|(default, _)| default.to_owned());
        }
    }
    flags.retain(|flag| !OF_ALL.contains(&flag.long.as_str()));
    flags
}

/// Every `--flag` of a text.
fn spelled(text: &str) -> impl Iterator<Item = &str> {
    let starts = text.match_indices("--").map(|(at, _)| at).filter(|at| !text[..*at].ends_with(['-', '|']));
    let word = move |at: usize| {
        let length = text[at + 2..].find(|letter: char| !letter.is_ascii_lowercase() && letter != '-');
        text[at..length.map_or(text.len(), |length| at + 2 + length)].trim_end_matches('-')
    };
    starts.map(word).filter(|word| 2 < word.len())
}

/// The flags that a section names as the command's own: not those in code of another command or another program.
fn named<'a>(command: &str, section: &'a str) -> BTreeSet<&'a str> {
    let is_own = |code: &str| {
        let mut words = code.split_whitespace().skip_while(|word| *word == "offtrack");
        words.next().is_none_or(|first| first == command || first.starts_with('-'))
    };
    let parts = section.split('`').enumerate().filter(|(index, part)| index % 2 == 0 || is_own(part));
    parts.flat_map(|(_, part)| spelled(part)).collect()
}

/// Where a section and the help of its command differ, each with what would do.
fn faults(command: &str, section: &str, help: &str) -> Vec<String> {
    let flags = flags(help);
    let named = named(command, section);
    let mut faults = Vec::new();
    for Flag { long, short, .. } in &flags {
        let has_short = short.as_ref().is_some_and(|short| section.contains(&format!("{short} ")));
        if !named.contains(long.as_str()) && !has_short {
            faults.push(format!("{command}: {long} is not named in its section: add | `{long}` | default | meaning |"));
        }
    }
    let known = |name: &&str| flags.iter().any(|flag| flag.long == **name) || OF_ALL.contains(name);
    faults.extend(
        named.iter().filter(|name| !known(name)).map(|name| format!("{command}: has no flag {name}: take it out")),
    );
    let rows = section.lines().filter_map(|line| line.strip_prefix("| `--"));
    let rows = rows.map(|row| row.split('|').map(str::trim).collect::<Vec<_>>());
    // Rows without a default have a cell less.
    for cells in rows.filter(|cells| cells.len() == 4) {
        let first = format!("--{}", cells[0]);
        let of_row = flags.iter().filter(|flag| spelled(&first).any(|name| name == flag.long));
        for (long, default) in of_row.filter_map(|flag| Some((&flag.long, flag.default.as_ref()?))) {
            if !cells[1].contains(default.as_str()) {
                faults.push(format!("{command}: the default of {long} is {default}, and its row has {}", cells[1]));
            }
        }
    }
    faults
}

#[test]
fn every_flag_of_every_command_is_described_and_no_other() {
    let description = std::fs::read_to_string(repository().join(DESCRIPTION)).unwrap();
    let printed = |arguments: &[&str]| String::from_utf8(offtrack(arguments).stdout).unwrap();
    let help = printed(&["--help"]);
    let commands = help.split("Commands:\n").nth(1).unwrap().lines().map_while(|line| line.split_whitespace().next());
    let (mut n_commands, mut n_flags, mut faults) = (0, 0, Vec::new());
    for command in commands.filter(|command| *command != "help") {
        let section = description.split("\n## ").find_map(|section| section.strip_prefix(&format!("{command}\n")));
        let help = printed(&[command, "--help"]);
        match section {
            Some(section) => faults.extend(self::faults(command, section, &help)),
            None => faults.push(format!("{command}: add a section ## {command}, and its row to the table of commands")),
        }
        n_commands += 1;
        n_flags += flags(&help).len();
    }
    assert!(faults.is_empty(), "{DESCRIPTION}:\n{}", faults.join("\n"));
    assert!(12 <= n_commands && 85 <= n_flags, "{n_commands} commands, {n_flags} flags");
}

#[test]
fn a_missing_flag_an_unknown_one_and_a_wrong_default_are_found() {
    let help = "Options:\n      --seed <SEED>    Seed [default: 0]\n      --json <FILE>  Report\n  -o, --output <FILE>\n          A film\n  -h, --help\n";
    let section = "`offtrack record --seed 7 -o FILE`. As `evaluate --films`, see `offtrack draw --size`.\n\n\
        | flag | default | meaning |\n|---|---|---|\n| `--seed N` | 0 | seed |\n| `--json FILE` | | report |\n";
    assert_eq!(faults("record", section, help), Vec::<String>::new());
    let wrong = section.replace("--json", "--yaml").replace("| 0 |", "| 1 |").replace("-o FILE", "FILE");
    let expected = [
        "record: --json is not named in its section: add | `--json` | default | meaning |",
        "record: --output is not named in its section: add | `--output` | default | meaning |",
        "record: has no flag --yaml: take it out",
        "record: the default of --seed is 0, and its row has 1",
    ];
    assert_eq!(faults("record", &wrong, help), expected);
}
