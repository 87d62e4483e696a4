//! The architecture, checked against the source: layers, where `unsafe` may stand, no unnamed tolerances, file length.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

use std::fs;
use std::path::{Path, PathBuf};

/// The rows of ARCHITECTURE.md: a module may use lower rows only, and itself.
const ROWS: [&[&str]; 11] = [
    &["error", "facts", "files", "math", "spectrum"],
    &["sampling"],
    &["sampler", "image", "parameter"],
    &["description"],
    &["loader", "bsdf", "camera", "film", "shape", "texture"],
    &["light", "accel", "material", "error_estimate"],
    &["scene"],
    &["integrator"],
    &["render"],
    &["bench", "check"],
    &["cli", "main", "lib"],
];

/// What a row allows but the table forbids.
const FORBIDDEN: [(&str, &[&str]); 12] = [
    ("bsdf", &["description"]),
    ("camera", &["description"]),
    ("film", &["description"]),
    ("shape", &["description"]),
    ("texture", &["description"]),
    ("light", &["description"]),
    ("material", &["description", "shape"]),
    ("accel", &["description"]),
    ("scene", &["film", "loader"]),
    ("integrator", &["loader", "description"]),
    ("bench", &["loader", "description"]),
    ("check", &["loader"]),
];

/// What laws are tested with: numbers at the ends of ranges, which are no tolerances.
const TABLES: [&str; 2] = ["check/laws/table.rs", "check/laws/gltf.rs"];

/// Longest source file. Tables of data are files of their own and may be longer.
const MAX_LINES: usize = 600;

fn sources() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                found.push((path, text));
            }
        }
    }
    assert!(found.len() > 30, "the sources were found");
    found
}

/// Name of the top-level module that a file belongs to.
fn module(path: &Path) -> String {
    let inside = path.strip_prefix(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).unwrap();
    inside.components().next().unwrap().as_os_str().to_string_lossy().trim_end_matches(".rs").to_owned()
}

fn row(module: &str) -> usize {
    ROWS.iter().position(|r| r.contains(&module)).unwrap_or_else(|| panic!("module '{module}' has no row"))
}

/// The code of a file: comments out, and the tests at its end.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let end = text.find("#[cfg(test)]\nmod tests").unwrap_or(text.len());
    text[..end].lines().enumerate().map(|(i, l)| (i + 1, l)).filter(|(_, l)| !l.trim_start().starts_with("//"))
}

fn is_test_file(path: &Path) -> bool {
    path.file_name().is_some_and(|n| n == "tests.rs") || path.components().any(|c| c.as_os_str() == "tests")
}

#[test]
fn modules_use_lower_rows_only() {
    let mut wrong = Vec::new();
    for (path, text) in sources() {
        let from = module(&path);
        if is_test_file(&path) {
            continue;
        }
        for (line, code) in code(&text) {
            if code.contains("crate::{") {
                wrong.push(format!(
                    "{}:{line}: one `use` for each module, so that this test can see them",
                    path.display()
                ));
            }
            for rest in code.split("crate::").skip(1) {
                let to: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if to == from || !ROWS.concat().contains(&to.as_str()) {
                    continue;
                }
                let forbidden = FORBIDDEN.iter().any(|(f, list)| *f == from && list.contains(&to.as_str()));
                if row(&to) >= row(&from) || forbidden {
                    wrong.push(format!("{}:{line}: {from} uses {to}", path.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn unsafe_stands_at_the_foreign_border_and_in_one_kernel_only() {
    for (path, text) in sources() {
        let name = path.to_string_lossy().replace('\\', "/");
        // In `facts` it is for builds that measure only.
        let may = ["accel/native/interleaved.rs", "src/facts.rs"].iter().any(|file| name.ends_with(file));
        if name.contains("accel/embree") || may {
            continue;
        }
        for (line, code) in code(&text) {
            let code = code.split("//").next().unwrap();
            let uses = code.contains("unsafe {") || code.contains("unsafe fn") || code.contains("unsafe impl");
            assert!(!uses, "{}:{line}: {code}", path.display());
        }
    }
}

#[test]
fn tolerances_have_names() {
    let mut wrong = Vec::new();
    for (path, text) in sources() {
        if is_test_file(&path) || TABLES.iter().any(|table| path.ends_with(table)) {
            continue;
        }
        for (line, code) in code(&text) {
            let small = code.split("//").next().unwrap().split("e-").collect::<Vec<_>>();
            let literal = small.windows(2).any(|w| {
                w[0].ends_with(|c: char| c.is_ascii_digit() || c == '.')
                    && w[1].starts_with(|c: char| c.is_ascii_digit())
            });
            if literal && !code.contains("const ") {
                wrong.push(format!("{}:{line}: {}", path.display(), code.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "numbers that look like tolerances, outside of constants:\n{}", wrong.join("\n"));
}

#[test]
fn files_are_short_and_say_what_they_are_for() {
    for (path, text) in sources() {
        let lines = text.lines().count();
        assert!(lines <= MAX_LINES, "{}: {lines} lines", path.display());
        assert!(text.starts_with("//!"), "{}: the first line is not its doc comment", path.display());
    }
}
