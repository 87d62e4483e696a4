//! Ctrl-C and its like: the first asks the render to stop and write what it has; before there is a render to stop, and
//! the second time, it stops at once and leaves no file behind.

use super::EXIT_INTERRUPTED;
use crate::render::Progress;
use std::path::PathBuf;
use std::sync::Arc;

/// From now on, an interrupt cancels `progress`; before it is started, and the second time, it removes `temporaries`, files
/// and folders with nothing in them, and exits. A signal that was ignored when the program began (by `nohup`, or in a script's background) stays ignored.
pub(super) fn handle(progress: &Arc<Progress>, temporaries: Vec<PathBuf>) {
    let progress = Arc::clone(progress);
    on_signal(move || {
        if progress.is_cancelled() || !progress.is_started() {
            for path in &temporaries {
                let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir(path));
            }
            std::process::exit(i32::from(EXIT_INTERRUPTED));
        }
        progress.cancel();
    });
}

/// Calls `act` for every signal. Where no handler can be installed, an interrupt just ends the program, as ever.
#[cfg(unix)]
fn on_signal(act: impl Fn() + Send + 'static) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let ignored = ignored_signals();
    let heeded = [SIGHUP, SIGINT, SIGTERM].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    if let Ok(mut signals) = signal_hook::iterator::Signals::new(heeded) {
        std::thread::spawn(move || signals.forever().for_each(|_| act()));
    }
}

#[cfg(not(unix))]
fn on_signal(act: impl Fn() + Send + 'static) {
    let _ = ctrlc::set_handler(act);
}

/// The signals that this process ignores, signal n as bit n − 1, where the system tells (Linux); otherwise none.
#[cfg(unix)]
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
