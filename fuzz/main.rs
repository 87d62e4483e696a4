//! The targets for libFuzzer: one binary a format, all from this file, each known by its name.

#![no_main]

mod targets;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    // That something is refused is as it should be.
    let _ = targets::run(env!("CARGO_BIN_NAME"), data);
});
