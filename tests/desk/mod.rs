//! The command as its tests run it: in an empty folder.

#![allow(dead_code, reason = "each test file uses its own part of this")]
#![allow(missing_docs, unreachable_pub, clippy::unwrap_used, reason = "test code")]

use std::ffi::OsStr;
use std::fs;
use std::process::{Command, Output};
use tempfile::TempDir;

pub const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/scene.xml");

/// An empty folder, and the command run in it.
pub struct Desk(TempDir);

impl Desk {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    pub fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_snell"));
        command.current_dir(self.0.path());
        command
    }

    pub fn snell(&self, arguments: &[impl AsRef<OsStr>]) -> Output {
        self.command().args(arguments).output().unwrap()
    }

    /// The command must succeed.
    pub fn succeeds(&self, arguments: &[impl AsRef<OsStr>]) -> Output {
        let output = self.snell(arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        output
    }

    pub fn files(&self) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(self.0.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// The command must fail with exit code 2 and one line that contains all of `expected`, and leave no file.
    pub fn refuses(&self, arguments: &[&str], expected: &[&str]) {
        let before = self.files();
        let output = self.snell(arguments);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        let told = format!("snell {}\n{error}", arguments.join(" "));
        assert_eq!(output.status.code(), Some(2), "{told}");
        for text in expected {
            assert!(error.contains(text), "expected '{text}' in\n{told}");
        }
        assert_eq!(error.trim_end().lines().count(), 1, "one line expected:\n{told}");
        assert!(output.stdout.is_empty(), "{told}");
        assert_eq!(self.files(), before, "files were left behind by\n{told}");
    }
}

/// A scene of 8×8 pixels with something in it.
pub fn scene_text(shape: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
    <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
    {shape}
</scene>"#
    )
}
