//! Finds messages that no test expects, by reading the sources.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

use std::fs;
use std::path::{Path, PathBuf};

/// Messages that need what a test cannot have.
const UNTESTED: [(&str, &str); 16] = [
    ("none to choose from", "the processor must have no vector instructions to choose"),
    ("; {embree} wrong ones of embree", "the page of all checks takes a minute"),
    ("warning: {} samples were negative and were counted as they are", "no known scene has such samples"),
    ("cannot find this command itself: {e}", "the system must have lost it"),
    ("cannot run this command itself: {e}", "as above"),
    ("cannot start {count}: {e}", "the system must have run out of threads"),
    ("a thread for every core", "as above"),
    ("{} samples/s, {} rays/s", "needs a terminal"),
    ("{bar:30} {percent:>3} %  {msg}  {elapsed} gone, {eta} left", "needs a terminal"),
    ("the mesh has too many vertices", "the file must be larger than 12 GB"),
    ("a coordinate is not a finite number", "a fault has a line; this is for what the parser may yet find"),
    ("cannot read it again for the checkpoint: {e}", "the file must vanish between two looks at it"),
    ("the type of its samples is not known", "what decodes pictures has no other types so far"),
    ("this cannot be a part of a bsdf", "every kind that is no combination of others is a part"),
    ("the scene itself", "an area light that is a child of the scene is there to be referred to"),
    ("expected an object, not <{tag}>", "the root is checked before; only an object has elements"),
];

/// The literals of a source file that a user may come to read: those of three words and more.
fn literals(code: &str) -> Vec<String> {
    let code: String =
        code.lines().filter(|l| !l.trim_start().starts_with(['/', '#'])).map(|l| format!("{l}\n")).collect();
    let (mut found, mut rest) = (Vec::new(), code.as_str());
    while let Some(start) = rest.find('"') {
        let mut literal = String::new();
        let mut characters = rest[start + 1..].char_indices();
        let mut end = rest.len();
        while let Some((i, c)) = characters.next() {
            match c {
                '"' => {
                    end = start + 1 + i + 1;
                    break;
                }
                '\\' => match characters.next() {
                    Some((_, '\n' | 'n')) => literal.push(' '),
                    Some((_, escaped)) => literal.push(escaped),
                    None => {}
                },
                _ => literal.push(c),
            }
        }
        let words = literal.split_whitespace().collect::<Vec<_>>().join(" ");
        if words.matches(' ').count() >= 2 && words.contains(|c: char| c.is_ascii_lowercase()) {
            found.push(words);
        }
        rest = &rest[end..];
    }
    found
}

fn files_under(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files_under(&path, into) } else { into.push(path) }
    }
}

/// Not tests, and not what `snell info` reports, which is no message.
fn is_checked(path: &Path) -> bool {
    !path.ends_with("tests.rs") && !path.ends_with("cli/info.rs")
}

/// Whether `tests` contain four words in a row of the longest fixed piece of a message, or all of one that is shorter.
fn is_expected(message: &str, tests: &str) -> bool {
    let fixed = |piece: &'_ str| piece.split_once('}').map_or(piece, |(_, after)| after).to_owned();
    let pieces = message.split('{').map(fixed);
    let longest = pieces.max_by_key(|piece| piece.len()).unwrap_or_default();
    let words: Vec<&str> = longest.trim_matches(|c: char| !c.is_alphanumeric()).split(' ').collect();
    words.windows(words.len().min(4)).any(|part| tests.contains(&part.join(" ")))
}

#[test]
fn every_message_is_in_a_test() {
    const UNIT_TESTS: &str = "#[cfg(test)]\nmod tests {";
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut sources = Vec::new();
    for folder in ["cli", "loader", "image", "scene"] {
        files_under(&root.join("src").join(folder), &mut sources);
    }
    let mut files = Vec::new();
    files_under(&root.join("tests"), &mut files);
    let read = |path: &PathBuf| fs::read_to_string(path).unwrap_or_default();
    // This file is no test of what it names.
    let mut tests: String = files.iter().filter(|path| !path.ends_with(file!())).map(read).collect();
    let texts: Vec<String> = sources.iter().map(read).collect();
    let split = |text: &str| text.find(UNIT_TESTS).unwrap_or(text.len());
    texts.iter().for_each(|text| tests.push_str(&text[split(text)..]));
    let tests = tests.replace("\\\"", "\"").replace("\\\n", " ").split_whitespace().collect::<Vec<_>>().join(" ");
    let mut missing = Vec::new();
    for (path, text) in sources.iter().zip(&texts).filter(|(path, _)| is_checked(path)) {
        let untested = |message: &String| UNTESTED.iter().any(|(m, _)| m.split_whitespace().eq(message.split(' ')));
        let unexpected = literals(&text[..split(text)]).into_iter().filter(|m| !untested(m) && !is_expected(m, &tests));
        missing.extend(unexpected.map(|m| format!("{}: {m}", path.display())));
    }
    assert!(missing.is_empty(), "no test expects\n{}", missing.join("\n"));
}
