//! Signals that ask a process to stop.

/// Calls `act` on a thread of its own at each Ctrl-C, SIGTERM and SIGHUP; the last is left ignored where the caller had
/// it so, and what `nohup` began goes on when its terminal closes. Without a handler, which a system may refuse, a
/// signal ends the process at once.
#[cfg(unix)]
pub fn on_signals(mut act: impl FnMut() + Send + 'static) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let heeded = [SIGINT, SIGTERM].into_iter().chain((!ignores(SIGHUP)).then_some(SIGHUP));
    let (ready, listening) = std::sync::mpsc::channel::<()>();
    let listen = move || {
        let Ok(mut signals) = signal_hook::iterator::Signals::new(heeded) else { return };
        drop(ready);
        signals.forever().for_each(|_| act());
    };
    if std::thread::Builder::new().spawn(listen).is_ok() {
        // Ends once signals are heard, or cannot be.
        let _ = listening.recv();
    }
}

/// The same for Ctrl-C and what else a console sends.
#[cfg(not(unix))]
pub fn on_signals(act: impl FnMut() + Send + 'static) {
    let _ = ctrlc::set_handler(act);
}

/// Whether this process ignores a signal; taken for false where the system does not say.
#[cfg(unix)]
fn ignores(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored
        .and_then(|ignored| u64::from_str_radix(ignored.trim(), 16).ok())
        .is_some_and(|all| all >> (signal - 1) & 1 == 1)
}
