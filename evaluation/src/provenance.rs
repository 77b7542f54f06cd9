//! Where a result comes from: the machine that made it and the commit that the program was built from.

use std::sync::OnceLock;

/// The commit of a program that was built without git.
const UNKNOWN: &str = "unknown";

static COMMIT: OnceLock<&'static str> = OnceLock::new();

/// The processor's name and number of cores.
pub fn machine() -> String {
    let name = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        text.lines()
            .find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|(_, name)| name.trim().to_owned()))
    });
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    described(&name.unwrap_or_else(|| std::env::consts::ARCH.to_owned()), cores)
}

fn described(name: &str, cores: usize) -> String {
    format!("{name}, {cores} {}", if cores == 1 { "core" } else { "cores" })
}

/// States the commit that the program was built from, once and before anything is written. The binary does, so that a
/// new commit recompiles the binary and not this library.
pub fn set_commit(commit: &'static str) {
    // A second call changes nothing: results of one process have one commit.
    let _ = COMMIT.set(commit);
}

/// The commit that the program was built from, with `-dirty` if its sources differed from it. Where the build did not
/// know, it is the variable `OFFTRACK_COMMIT` of the environment, else `unknown`.
pub fn commit() -> String {
    let stated = COMMIT.get().copied().filter(|&commit| commit != UNKNOWN).map(str::to_owned);
    stated.or_else(|| std::env::var("OFFTRACK_COMMIT").ok()).unwrap_or_else(|| UNKNOWN.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_core_is_not_plural() {
        assert_eq!(described("x", 1), "x, 1 core");
        assert_eq!(described("x", 2), "x, 2 cores");
    }
}
