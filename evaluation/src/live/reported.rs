//! What is reported of the policies that come with the program, to be shown beside what is seen live.

use serde::Serialize;

/// An evaluation's result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) struct Reported {
    /// The benchmark.
    benchmark: &'static str,
    /// Which of its routes.
    split: &'static str,
    /// Episodes.
    episodes: u32,
    /// Those of them that arrived.
    arrived: u32,
}

/// Policies by name, each with its results.
const REPORTED: [(&str, &[Reported]); 8] = [
    (
        "attard2023 (shipped)",
        &[
            reported("attard2023", "test", 690, 690),
            reported("attard2023-full", "train", 1800, 1797),
            reported("random2026", "test", 1870, 1867),
        ],
    ),
    ("attard2023-lane (shipped)", &[reported("random2026", "validation", 3100, 3093)]),
    (
        "attard2023-as-run (shipped)",
        &[reported("attard2023-as-run", "test", 690, 680), reported("attard2023-as-run", "train", 1560, 1474)],
    ),
    (
        "laden2026 (shipped)",
        &[
            reported("laden2026", "test", 690, 690),
            reported("laden2026", "train", 1560, 1551),
            reported("laden2026-random", "test", 1870, 1860),
        ],
    ),
    (
        "laden2026-50 (shipped)",
        &[reported("laden2026-50", "test", 690, 689), reported("laden2026-50", "train", 1560, 1552)],
    ),
    (
        "transfer2026 (shipped)",
        &[
            reported("transfer2026", "test", 690, 690),
            reported("transfer2026", "train", 1560, 1555),
            reported("transfer2026-random", "test", 1870, 1852),
        ],
    ),
    ("traffic2026 (shipped)", &[reported("traffic2026-random", "validation", 3100, 3000)]),
    (
        "traffic2026-laden (shipped)",
        &[
            reported("traffic2026", "test", 690, 680),
            reported("traffic2026-laden", "test", 690, 679),
            reported("traffic2026-random", "test", 1870, 1820),
        ],
    ),
];

const fn reported(benchmark: &'static str, split: &'static str, episodes: u32, arrived: u32) -> Reported {
    Reported { benchmark, split, episodes, arrived }
}

/// What is reported of the policy with this name; nothing of one that does not come with the program.
pub(super) fn of(policy: &str) -> &'static [Reported] {
    REPORTED.iter().find(|(name, _)| *name == policy).map_or(&[], |(_, reported)| reported)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use offtrack_policy::Policy;
    use serde_json::Value;

    use super::*;

    #[test]
    fn what_is_reported_of_each_shipped_policy_is_what_its_report_has() {
        for name in Policy::shipped_names() {
            let policy = Policy::shipped(name).unwrap().name;
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../policy/shipped/{name}/report.json"));
            let report: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
            let also = report["also"].as_array().cloned().unwrap_or_default();
            let all: Vec<&Value> = std::iter::once(&report["evaluation"]).chain(&also).collect();
            assert!(!of(&policy).is_empty(), "{policy}");
            for reported in of(&policy) {
                let found = all.iter().find(|evaluation| {
                    evaluation["benchmark"] == reported.benchmark && evaluation["split"] == reported.split
                });
                let found = found.unwrap_or_else(|| panic!("{policy}: {reported:?} is not in its report"));
                let figures = ["episodes", "arrived"].map(|key| found[key].as_u64().unwrap());
                assert_eq!(figures, [reported.episodes, reported.arrived].map(u64::from), "{policy}: {reported:?}");
            }
        }
    }
}
