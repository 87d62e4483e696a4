//! Replays what fuzzing kept: the corpus of each target, and what once was found (`fuzz/`, docs/hostile-input.md).

#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, reason = "test code")]

#[allow(unreachable_pub, reason = "as another crate has it")]
mod fuzz_seeds;
mod gltf_file;
#[allow(dead_code, unreachable_pub, reason = "as another crate has it")]
#[path = "../fuzz/targets.rs"]
mod targets;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use targets::TARGETS;

fn fuzz() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz")
}

/// The files of a folder, in the order of their names; none where it is not there.
fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// One test for all, so that no other takes time beside that of what is measured.
#[test]
fn what_fuzzing_kept_does_no_harm() {
    let mut failed = Vec::new();
    for (name, target) in TARGETS {
        let corpus = files(&fuzz().join("corpus").join(name));
        assert!(!corpus.is_empty(), "no corpus for {name}");
        let found = files(&fuzz().join("found").join(name));
        // Tables that are made once are no part of what the first file takes.
        let _ = target(&fs::read(&corpus[0]).unwrap());
        for path in corpus.into_iter().chain(found) {
            let bytes = fs::read(&path).unwrap();
            let is_seed = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("seed-"));
            match catch_unwind(AssertUnwindSafe(|| target(&bytes))) {
                Ok(Err(told)) if is_seed => failed.push(format!("{}: {told}", path.display())),
                Ok(_) => {}
                Err(_) => failed.push(format!("{}: a panic", path.display())),
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// `cargo test --test fuzz_corpus -- --ignored` writes the seeds again, from which corpora grow.
#[test]
#[ignore = "writes into the source tree"]
fn write_seeds() {
    for (name, _) in TARGETS {
        let folder = fuzz().join("corpus").join(name);
        fs::create_dir_all(&folder).unwrap();
        for (i, bytes) in fuzz_seeds::of(name).iter().enumerate() {
            fs::write(folder.join(format!("seed-{i:02}")), bytes).unwrap();
        }
    }
}
