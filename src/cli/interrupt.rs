//! Ctrl-C: the first asks the render to stop and write what it has; before there is a render to stop, and the second
//! time, it stops at once and leaves no file behind.

use super::EXIT_INTERRUPTED;
use crate::render::Progress;
use std::path::PathBuf;
use std::sync::Arc;

/// From now on, an interrupt cancels `progress`; before it is started, and the second time, it removes `temporaries` and
/// exits.
pub(super) fn handle(progress: &Arc<Progress>, temporaries: Vec<PathBuf>) {
    let progress = Arc::clone(progress);
    // Where no handler can be installed, an interrupt just ends the program, as ever.
    let _ = ctrlc::set_handler(move || {
        if progress.is_cancelled() || !progress.is_started() {
            for path in &temporaries {
                let _ = std::fs::remove_file(path);
            }
            std::process::exit(i32::from(EXIT_INTERRUPTED));
        }
        progress.cancel();
    });
}
