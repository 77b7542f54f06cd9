//! Further evaluations at the end of a run, as `also_evaluate` names them: `BENCHMARK` or `BENCHMARK/SPLIT`.

use offtrack::files::reader::Reader;
use offtrack::scenario::Split;

use super::Config;
use crate::error::Error;

/// What would do as one of the key's texts.
const EXPECTED: &str =
    "must be a benchmark's name or a path ending in .toml; `/train`, `/validation` or `/test` may follow it";

/// A benchmark and one of its splits to evaluate the policy on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AlsoEvaluate {
    /// The benchmark: a name, or the path of a file.
    pub benchmark: String,
    /// Split whose routes are driven.
    pub split: Split,
}

impl AlsoEvaluate {
    /// What `text` names; none if it is neither a name nor a path with or without a split.
    fn of(text: &str) -> Option<AlsoEvaluate> {
        let named = text.rsplit_once('/').and_then(|(benchmark, word)| Some((benchmark, Split::named(word)?)));
        let (benchmark, split) = named.unwrap_or((text, Split::Test));
        let is_name = !benchmark.is_empty() && !benchmark.contains(['/', '\\']);
        (is_name || benchmark.ends_with(".toml")).then(|| AlsoEvaluate { benchmark: benchmark.to_owned(), split })
    }

    /// `attard2023-full/train` and the like.
    pub fn name(&self) -> String {
        format!("{}/{}", self.benchmark, self.split.name())
    }
}

impl Config {
    /// The further evaluations, in order.
    pub fn also_evaluated(&self) -> Vec<AlsoEvaluate> {
        self.also_evaluate.iter().filter_map(|text| AlsoEvaluate::of(text)).collect()
    }

    /// Each text names a benchmark and a split, and none is evaluated twice.
    pub(super) fn check_also_evaluate(&self, reader: &Reader) -> Result<(), Error> {
        let mut known = vec![AlsoEvaluate { benchmark: self.benchmark.clone(), split: Split::Test }];
        for (index, text) in self.also_evaluate.iter().enumerate() {
            let invalid =
                |expected: &str| reader.invalid(format!("also_evaluate[{index}]"), format!("{text:?}"), expected);
            let named = AlsoEvaluate::of(text).ok_or_else(|| invalid(EXPECTED))?;
            if known.contains(&named) {
                return Err(
                    invalid("is evaluated already, as `benchmark` or before it in this list: leave it out").into()
                );
            }
            known.push(named);
        }
        Ok(())
    }
}
