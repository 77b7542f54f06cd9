//! What a file may be, and how its faults are reported.

use std::collections::BTreeMap;

use super::*;

/// A file with these contents, in a folder of its own.
fn file(contents: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file.toml");
    std::fs::write(&file, contents).unwrap();
    (folder, file)
}

/// The message for a TOML text that is not a table of numbers by name.
fn refusal(text: &str) -> String {
    Reader::parse::<BTreeMap<String, BTreeMap<String, f64>>>(Path::new("numbers.toml"), text)
        .map(|_| ())
        .unwrap_err()
        .to_string()
}

#[test]
fn a_file_of_the_largest_size_is_read_and_one_of_a_byte_more_is_refused() {
    let (_folder, path) = file(&[b' '; 64]);
    assert_eq!(read_bytes(&path, 64).unwrap().len(), 64);
    assert!(matches!(read_bytes(&path, 63), Err(Error::TooLarge { limit: 63, .. })));
}

#[test]
fn a_folder_a_device_and_a_pipe_are_refused_before_they_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in [folder.path(), Path::new("/dev/zero"), &pipe] {
        assert!(matches!(read_text(path, TEXT_LIMIT), Err(Error::NotAFile { .. })), "{}", path.display());
    }
}

#[test]
fn a_fault_is_reported_with_its_line_its_column_and_its_table() {
    assert_eq!(
        refusal("[a]\nb = 1\n[c]\n  d = true # a remark\n"),
        "numbers.toml: line 4, column 7: c: invalid type: boolean `true`, expected a number; the line is: d = true \
         # a remark"
    );
}

#[test]
fn another_type_where_a_word_is_wanted_is_said_so() {
    #[derive(Debug, serde::Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Word {
        Yes,
    }
    let read = |text: &str| Reader::parse::<BTreeMap<String, Word>>(Path::new("x"), text);
    assert!(read("a = \"yes\"").is_ok());
    let error = read("a = 3").unwrap_err().to_string();
    assert_eq!(error, "x: line 1, column 5: invalid type, expected a string; the line is: a = 3");
}

#[test]
fn tables_of_an_array_are_counted() {
    #[derive(Debug, serde::Deserialize)]
    #[expect(dead_code, reason = "only parsed")]
    struct Arm {
        entry: BTreeMap<String, f64>,
        #[serde(default)]
        corner: Vec<BTreeMap<String, f64>>,
    }
    let refusal =
        |text: &str| Reader::parse::<BTreeMap<String, Vec<Arm>>>(Path::new("x"), text).unwrap_err().to_string();
    let arms = "[[arm]]\n[arm.entry]\na = 1\n[[arm.corner]]\n[[arm.corner]]\n[[arm]]\n";
    assert!(refusal(&format!("{arms}[arm.entry]\nb = \"x\"")).contains("line 8, column 5: arm[1].entry: invalid type"));
    assert!(
        refusal(&format!("{arms}[arm.entry]\n[[arm.corner]]\nb = \"x\""))
            .contains("column 5: arm[1].corner[0]: invalid type")
    );
    assert!(refusal(arms).contains("arm[1]: missing field `entry`"));
}

#[test]
fn a_missing_key_of_no_table_is_said_to_be_missing_at_the_top_level() {
    #[derive(Debug, serde::Deserialize)]
    struct File {
        #[expect(dead_code, reason = "only parsed")]
        vehicle: String,
    }
    let error = Reader::parse::<File>(Path::new("x"), "# A remark.\n").unwrap_err();
    assert_eq!(error.to_string(), "x: missing field `vehicle` at the top level");
}

#[test]
fn a_missing_key_is_that_of_the_file_or_of_its_first_table_where_the_file_begins_with_one() {
    #[derive(Debug, serde::Deserialize)]
    #[expect(dead_code, reason = "only parsed")]
    struct Unit {
        wheelbase: f64,
    }
    #[derive(Debug, serde::Deserialize)]
    #[expect(dead_code, reason = "only parsed")]
    struct File {
        #[serde(default)]
        tractor: Option<Unit>,
        #[serde(default)]
        vehicle: Vec<Unit>,
        loads: Vec<f64>,
    }
    for (text, expected) in [
        ("[tractor]\nwheelbase = 1.0\n", "x: missing field `loads` at the top level"),
        ("[[vehicle]]\nwheelbase = 1.0\n[[vehicle]]\nwheelbase = 2.0", "x: missing field `loads` at the top level"),
        ("[tractor]", "x: line 1, column 1: tractor: missing field `wheelbase`; the line is: [tractor]"),
        ("[[vehicle]]\n", "x: line 1, column 1: vehicle[0]: missing field `wheelbase`; the line is: [[vehicle]]"),
    ] {
        assert_eq!(Reader::parse::<File>(Path::new("x"), text).unwrap_err().to_string(), expected);
    }
}

#[test]
fn a_line_of_a_mebibyte_is_repeated_around_the_fault_only() {
    let long = "x".repeat(1 << 20);
    for text in [
        format!("[a]\nb = 1 {long}"),
        format!("[a]\nb = \"{long}\""),
        format!("{long} = 1"),
        format!("[a]\n{long}{long}"),
    ] {
        let message = refusal(&text);
        assert!(message.len() < 1000, "{} characters: {message:.1000}", message.len());
        assert!(message.contains("…"), "{message}");
    }
    // Characters of more than a byte are cut between them.
    assert!(refusal(&format!("[a]\nb = \"{}\"", "é".repeat(1 << 18))).chars().count() < 1000);
}

#[test]
fn a_long_key_or_value_is_cut_and_both_its_ends_are_shown() {
    let error = Reader::of(Path::new("x"))
        .invalid("k".repeat(5000), format!("<{}>", "v".repeat(5000)), "e".repeat(5000))
        .to_string();
    assert!(
        error.len() < 1000 && error.contains("x: kkk") && error.contains(": <vvv") && error.contains("vvv>; eee"),
        "{error}"
    );
}

#[test]
fn characters_that_a_terminal_obeys_are_escaped_in_every_part_of_a_message() {
    let odd = "\u{1b}[2J\u{7}\u{9b}1m\n\r\u{202e}\u{2066}\u{200b}\u{feff}\u{e0041}x";
    let shown = "\\u{1b}[2J\\u{7}\\u{9b}1m\\n\\r\\u{202e}\\u{2066}\\u{200b}\\u{feff}\\u{e0041}x";
    assert_eq!(printable(odd), shown);
    assert_eq!(printable(shown), shown, "what is escaped stays as it is");
    assert_eq!(printable("Größe 3 µm², кольцо, דרך"), "Größe 3 µm², кольцо, דרך");
    let (file, source) = (PathBuf::from(odd), || std::io::Error::from(std::io::ErrorKind::NotFound));
    let [key, value, expected] = [odd; 3].map(str::to_owned);
    let errors = [
        Error::Unreadable { file: file.clone(), source: source() },
        Error::NotAFile { file: file.clone() },
        Error::TooLarge { file: file.clone(), limit: 1 << 20 },
        Error::UnknownName { what: "vehicle", name: odd.to_owned(), known: vec!["daf_xf"] },
        Error::Malformed { file: file.clone(), message: odd.to_owned() },
        Error::Invalid { file, key, value, expected },
    ];
    for (error, times) in errors.iter().zip([1, 1, 1, 1, 2, 4]) {
        let text = error.to_string();
        assert_eq!(printable(&text), text);
        assert_eq!(text.matches(shown).count(), times, "{text}");
    }
    // What the parser repeats of a file.
    for text in [
        "[a]\nb = \"\u{1b}[2J\u{202e}\"",
        "[a]\nb = true # \u{202e}",
        "\u{202e}",
        "[\"\\u001b\"]\n\"\\u001b[2J\" = true",
    ] {
        let text = refusal(text);
        assert_eq!(printable(&text), text);
    }
}

#[test]
fn a_long_path_is_cut() {
    let error = Error::NotAFile { file: "x".repeat(5000).into() }.to_string();
    assert!(error.len() < 600, "{error}");
}

#[test]
fn large_and_small_numbers_are_shown_with_an_exponent() {
    let shown: Vec<String> = [0.0, -4.5, 1e6, 1e308, -2.5e-9, f64::INFINITY].into_iter().map(shown).collect();
    assert_eq!(shown, ["0", "-4.5", "1000000", "1e308", "-2.5e-9", "inf"]);
    let error = Reader::of(Path::new("x")).within("ring.gutter", 1e308, 0.0..=3.0, "m").unwrap_err();
    assert_eq!(error.to_string(), "x: ring.gutter: 1e308 m; must lie in 0..3 m");
}

#[test]
fn a_value_near_its_limit_is_shown_with_the_digits_that_differ() {
    assert_eq!(differing(1.234_567, 1.3), "1.23");
    assert_eq!(differing(1.299_6, 1.3), "1.2996");
    assert_eq!(differing(1.299_999_99, 1.3), "1.29999999");
    assert_eq!(differing(-1e-7, 0.0), "-0.0000001");
    assert_eq!(differing(1e300, 1.3), "1e300");
}

#[test]
fn arrays_nested_to_the_size_limit_are_refused_without_overflowing_the_stack() {
    for (open, close) in [("[", "]"), ("{a=", "}")] {
        let depth = (TEXT_LIMIT as usize - 16) / (open.len() + close.len());
        let text = format!("a = {}{}", open.repeat(depth), close.repeat(depth));
        assert!(refusal(&text).len() < 1000);
        assert!(refusal(&text[..text.len() / 2]).len() < 1000);
    }
    let dotted = format!("{}a = 1", "a.".repeat(TEXT_LIMIT as usize / 2 - 16));
    assert!(refusal(&dotted).len() < 1000);
}
