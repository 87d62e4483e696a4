//! Keeps a decoder of pictures that panics from ending the program.
//!
//! Pictures come from strangers, and the crates that decode them are not free of panics (found by fuzzing: docs/hostile-input.md).

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// Whether this thread decodes, and who waits for it tells what went wrong.
    static SILENT: Cell<bool> = const { Cell::new(false) };
}

/// What a decoder makes of a file; where it panics, an error that says so, and nothing is printed. Nothing it worked on is used then.
pub(super) fn guarded<T>(decode: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let other = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !SILENT.get() {
                other(info);
            }
        }));
    });
    let before = SILENT.replace(true);
    let result = catch_unwind(AssertUnwindSafe(decode));
    SILENT.set(before);
    result.unwrap_or_else(|_| Err("the file is damaged, so that its decoder gives up".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error() {
        assert_eq!(guarded(|| Ok(7)), Ok(7));
        let told = guarded(|| -> Result<(), String> { panic!("out of range") });
        assert_eq!(told, Err("the file is damaged, so that its decoder gives up".into()));
    }
}
