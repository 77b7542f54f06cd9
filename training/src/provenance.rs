//! Where a result comes from: the machine that made it and the commit of the program.

use std::process::Command;

use crate::files;

/// The processor's name and number of cores.
pub fn machine() -> String {
    let name = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|(_, name)| name.trim().to_owned()))
    });
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{}, {cores} cores", name.unwrap_or_else(|| std::env::consts::ARCH.to_owned()))
}

/// The commit that the program's sources are at, with `-dirty` when they differ from it. On a machine without them the variable
/// `OFFTRACK_COMMIT` of the environment says it.
pub fn commit() -> String {
    let output = Command::new("git").arg("-C").arg(files::repository()).args(["describe", "--always", "--dirty", "--abbrev=12"]).output();
    match output {
        Ok(output) if output.status.success() => String::from_utf8_lossy(&output.stdout).trim().to_owned(),
        _ => std::env::var("OFFTRACK_COMMIT").unwrap_or_else(|_| "unknown".to_owned()),
    }
}
