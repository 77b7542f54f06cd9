//! Panics while a device works: a library may panic where its device fails.
//!
//! Only a panic of a library becomes an error. One of our own code is a fault of the program: it is reported with its
//! place and goes on, whatever hook the process has.

use std::any::Any;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, panic_any, resume_unwind, set_hook, take_hook};
use std::sync::{Mutex, Once, PoisonError};
use std::thread::ThreadId;

use crate::error::Error;

/// Folders of the project's repository.
const OWN: [&str; 10] =
    ["src/", "cli/", "commands/", "drawing/", "evaluation/", "learner/", "policy/", "python/", "reference/", "web/"];

/// Panics since work began that may panic, and how many such works are under way.
static WATCHED: Mutex<Watched> = Mutex::new(Watched { n_works: 0, panics: Vec::new() });
/// The hook is chained once.
static CHAINED: Once = Once::new();

struct Watched {
    n_works: usize,
    panics: Vec<Seen>,
}

/// A panic that the hook was told of.
#[derive(Clone)]
struct Seen {
    thread: ThreadId,
    /// `file:line`.
    place: String,
    is_own: bool,
}

/// The payload of a panic for values that could not be read from a device: the device's failure, whoever panics.
struct Unreadable(String);

/// Ends the work on a device whose values cannot be read: [`caught`] makes an error of it.
pub fn unreadable(error: &impl Display) -> ! {
    panic_any(Unreadable(error.to_string()))
}

/// The outcome of `work` on a device, or an error if a library panicked, with the panic's place. A panic of our own
/// code goes on, unless `failed` says that the device has failed, which is then the error.
pub fn caught<T>(work: impl FnOnce() -> Result<T, Error>, failed: impl FnOnce() -> Option<Error>) -> Result<T, Error> {
    CHAINED.call_once(|| {
        let previous = take_hook();
        set_hook(Box::new(move |panic| {
            if !is_silenced(panic) {
                previous(panic);
            }
        }));
    });
    with_watched(|watched| watched.n_works += 1);
    let outcome = catch_unwind(AssertUnwindSafe(work));
    let seen = with_watched(end_work);
    let panic = match outcome {
        Ok(result) => return result,
        Err(panic) => panic,
    };
    if let Some(Unreadable(message)) = panic.downcast_ref() {
        return Err(Error::Device(message.clone()));
    }
    match seen {
        Some(Seen { is_own: false, place, .. }) => {
            Err(Error::Device(format!("{} (at {place})", message(panic.as_ref()))))
        }
        _ => Err(failed().unwrap_or_else(|| resume_unwind(panic))),
    }
}

/// Notes a panic while work is under way. Those of libraries are not reported: they become errors.
fn is_silenced(panic: &PanicHookInfo) -> bool {
    let Some(location) = panic.location() else { return false };
    let (is_own, place) = (is_own(location.file()), format!("{}:{}", location.file(), location.line()));
    with_watched(|watched| {
        let is_watched = 0 < watched.n_works;
        if is_watched {
            watched.panics.push(Seen { thread: std::thread::current().id(), place, is_own });
        }
        is_watched && (!is_own || panic.payload().is::<Unreadable>())
    })
}

/// The panic that ended this thread's work: its own or, where it was handed on from another thread, the first of all.
fn end_work(watched: &mut Watched) -> Option<Seen> {
    let this = std::thread::current().id();
    let own = watched.panics.iter().rfind(|seen| seen.thread == this);
    let seen = own.or(watched.panics.first()).cloned();
    watched.n_works -= 1;
    match watched.n_works {
        0 => watched.panics.clear(),
        _ => watched.panics.retain(|seen| seen.thread != this),
    }
    seen
}

fn with_watched<T>(work: impl FnOnce(&mut Watched) -> T) -> T {
    work(&mut WATCHED.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Whether a source file is one of the project's.
fn is_own(file: &str) -> bool {
    is_beside(file, file!())
}

/// Whether a source file is one of the project's as this one is named `this`: below the repository's folders or, of a
/// package that stands among others by its name and version, in one of the project's packages.
fn is_beside(file: &str, this: &str) -> bool {
    let (file, this) = (file.replace('\\', "/"), this.replace('\\', "/"));
    if let Some(repository) = this.strip_suffix("learner/src/panics.rs")
        && !repository.ends_with('-')
    {
        return file.strip_prefix(repository).is_some_and(|file| OWN.iter().any(|folder| file.starts_with(folder)));
    }
    let packages = this.strip_suffix("/src/panics.rs").and_then(|package| package.rsplit_once('/'));
    let rest = packages.and_then(|(folder, _)| file.strip_prefix(folder)?.strip_prefix("/offtrack"));
    rest.is_some_and(|rest| rest.starts_with(['-', '/']))
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("it failed").to_owned()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn files_of_the_project_are_told_from_those_of_libraries() {
        for own in [file!(), "src/simulator.rs", "learner\\src\\sac.rs", "policy/src/policy.rs"] {
            assert!(is_own(own), "{own}");
        }
        for library in [
            "/.cargo/registry/src/index/burn-tensor-0.22.0/src/tensor.rs",
            "/rustc/0123456789/library/core/src/option.rs",
            "C:\\Users\\user\\.cargo\\registry\\src\\index\\wgpu-30.0.0\\src\\lib.rs",
        ] {
            assert!(!is_own(library), "{library}");
        }
    }

    #[test]
    fn packages_of_the_project_are_told_from_those_beside_them() {
        let packages = "/packages/of-an-index";
        let this = format!("{packages}/offtrack-learner-0.2.0/src/panics.rs");
        for own in ["offtrack-0.2.0/src/simulator.rs", "offtrack-learner-0.2.0/src/sac.rs"] {
            assert!(is_beside(&format!("{packages}/{own}"), &this), "{own}");
        }
        for library in ["wgpu-30.0.0/src/lib.rs", "burn-tensor-0.22.0/src/offtrack-/tensor.rs"] {
            assert!(!is_beside(&format!("{packages}/{library}"), &this), "{library}");
        }
        assert!(!is_beside("src/main.rs", &this), "a program that uses the library");
        // Vendored packages have no versions in their names.
        let vendored = "vendor/offtrack-learner/src/panics.rs";
        for (file, is_own) in
            [("offtrack-policy/src/policy.rs", true), ("offtrack/src/world.rs", true), ("wgpu/src/lib.rs", false)]
        {
            assert_eq!(is_beside(&format!("vendor/{file}"), vendored), is_own, "{file}");
        }
    }

    #[test]
    fn every_crate_of_the_workspace_is_the_projects() {
        let manifest: toml::Table = include_str!("../../Cargo.toml").parse().unwrap();
        let members = manifest["workspace"]["members"].as_array().unwrap();
        assert!(5 < members.len());
        for member in members {
            let folder = match member.as_str().unwrap() {
                "." => String::new(),
                member => format!("{member}/"),
            };
            let file = format!("{}{folder}src/lib.rs", file!().strip_suffix("learner/src/panics.rs").unwrap());
            assert!(is_own(&file), "{file}");
        }
    }

    #[test]
    fn a_fault_of_our_own_on_a_device_is_reported_and_goes_on_and_a_librarys_is_an_error_with_its_place() {
        static REPORTED: AtomicUsize = AtomicUsize::new(0);
        // Another test may be the first to chain the hook, so this one is put beneath it by hand.
        let before = take_hook();
        set_hook(Box::new(move |panic| {
            if panic.payload().downcast_ref::<&str>() == Some(&"our own fault") {
                REPORTED.fetch_add(1, Ordering::Relaxed);
            } else {
                before(panic);
            }
        }));
        let own = || -> Result<(), Error> { panic!("our own fault") };
        let panic = catch_unwind(AssertUnwindSafe(|| caught(own, || None))).unwrap_err();
        assert_eq!(message(panic.as_ref()), "our own fault");
        assert_eq!(REPORTED.load(Ordering::Relaxed), 1, "the process's own hook was told of it");
        // Where the device has failed, that is why.
        let error = caught(own, || Some(Error::Device("is lost".to_owned()))).unwrap_err();
        assert!(matches!(error, Error::Device(message) if message == "is lost"));
        // A thread's fault is that of the work that waits for it.
        let handed_on = || -> Result<(), Error> {
            resume_unwind(std::thread::spawn(|| panic!("our own fault")).join().unwrap_err())
        };
        assert!(catch_unwind(AssertUnwindSafe(|| caught(handed_on, || None))).is_err());
        let none: &[f32] = &[];
        let error = caught(|| Ok(glam::Vec2::from_slice(none)), || None).unwrap_err();
        assert!(
            matches!(&error, Error::Device(message) if message.contains("(at ") && message.contains("vec2.rs:")),
            "{error}"
        );
        assert!(caught(|| Ok(3), || None).is_ok_and(|value| value == 3));
    }
}
