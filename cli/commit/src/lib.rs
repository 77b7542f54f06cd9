//! The commit that a program is built from, for its results.
//!
//! A macro and not a build script: a new commit recompiles the crate that uses the macro, where a build script would
//! recompile the whole package, the learner with it.

use std::path::Path;
use std::process::Command;

use proc_macro::TokenStream;

/// The commit that the sources of the calling crate are at, as a string, with `-dirty` if they differ from it. Without
/// git it is the variable `OFFTRACK_COMMIT` of the build's environment, else `unknown`.
#[proc_macro]
pub fn commit(_: TokenStream) -> TokenStream {
    let stated = || std::env::var("OFFTRACK_COMMIT").ok().filter(|commit| !commit.is_empty());
    let commit = git(&["describe", "--always", "--dirty", "--abbrev=12"])
        .or_else(stated)
        .unwrap_or_else(|| "unknown".to_owned());
    // The compiler notes files and variables that a crate includes: a change of one makes it compile the crate again.
    let mut watched = "const _: Option<&str> = option_env!(\"OFFTRACK_COMMIT\");".to_owned();
    let branch = git(&["symbolic-ref", "--quiet", "HEAD"]);
    for name in ["HEAD", "logs/HEAD"].into_iter().chain(branch.as_deref()) {
        let file = git(&["rev-parse", "--path-format=absolute", "--git-path", name]);
        if let Some(file) = file.filter(|file| Path::new(file).is_file()) {
            watched += &format!("const _: &[u8] = include_bytes!({file:?});");
        }
    }
    format!("{{ {watched} {commit:?} }}").parse().expect("strings with escapes are Rust")
}

/// What git prints in the folder of the calling crate.
fn git(arguments: &[&str]) -> Option<String> {
    let folder = std::env::var_os("CARGO_MANIFEST_DIR")?;
    let output = Command::new("git")
        .arg("-C")
        .arg(folder)
        .args(arguments)
        .output()
        .ok()
        .filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_owned()).filter(|text| !text.is_empty())
}
