//! Interrupts: what is written, what is removed, what is ignored. Mostly by SIGTERM, for whoever runs these tests in the
//! background may have SIGINT ignored.

#![cfg(unix)]
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod desk;

use desk::*;
use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::time::Duration;

/// Time in which a signal arrives even on a loaded machine. Where it does not, a test sees less, but does not fail.
const DELIVERY: Duration = Duration::from_millis(300);

/// A command that has said what was waited for. What else it says is left in the pipe, which must stay open.
struct Running {
    child: Child,
    _rest: BufReader<ChildStderr>,
}

impl Running {
    /// Waits until `command` prints a line that contains `sign`.
    fn until(command: &mut Command, sign: &str) -> Self {
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains(sign) {
            line.clear();
            assert!(lines.read_line(&mut line).unwrap() > 0, "the command ended without '{sign}'");
        }
        Self { child, _rest: lines }
    }

    fn signal(&self, name: &str) {
        // The command may be gone already: what came of it is asked later.
        // The shell's own `kill`: the program of that name is not everywhere.
        Command::new("sh").args(["-c", "kill -\"$0\" \"$1\"", name, &self.child.id().to_string()]).status().unwrap();
    }

    /// The exit code.
    fn end(mut self) -> Option<i32> {
        self.child.wait().unwrap().code()
    }
}

/// A tenth of it is soon done, and the rest then takes nine times as long.
const LONG: [&str; 6] = ["render", SCENE, "-Dres=64", "--spp=8000", "--max-depth=2", "-oout.exr"];

/// What is printed at a tenth.
const PROGRESS: &str = "samples/s";

#[test]
fn the_first_interrupt_writes_the_picture_so_far() {
    let desk = Desk::new();
    let running = Running::until(desk.command().args(LONG).args(["--stats", "s.json"]), PROGRESS);
    running.signal("TERM");
    assert_eq!(running.end(), Some(130));
    assert_eq!(desk.files(), ["out.exr", "s.json"]);
    assert!(desk.path("out.exr").metadata().unwrap().len() > 1000);
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap();
    assert_eq!(stats["complete"], false);
    assert!(stats["samples"].as_u64().unwrap() > 0);
}

/// What is kept at an interrupt is all that is in the picture, and the render goes on from there.
#[test]
fn an_interrupt_keeps_a_checkpoint() {
    let desk = Desk::new();
    let kept = ["--checkpoint", "c", "--resume", "--stats", "s.json"];
    let running = Running::until(desk.command().args(LONG).args(kept), PROGRESS);
    running.signal("TERM");
    assert_eq!(running.end(), Some(130));
    assert_eq!(desk.files(), ["c", "out.exr", "s.json"]);
    let samples = || {
        let stats: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap();
        stats["samples"].as_u64().unwrap()
    };
    let first = samples();
    let second = Running::until(desk.command().args(LONG).args(kept), &format!("resuming c after {first} samples"));
    second.signal("TERM");
    assert_eq!(second.end(), Some(130));
    assert!(samples() >= first);
}

#[test]
fn the_second_interrupt_leaves_no_file() {
    let desk = Desk::new();
    // No light ever leaves this sphere, and roulette ends no path: the first interrupt waits for ever.
    let sphere = r#"<shape type="sphere"><float name="radius" value="9"/><boolean name="flip_normals" value="true"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></shape>"#;
    fs::write(desk.path("endless.xml"), scene_text(sphere)).unwrap();
    let endless = ["render", "endless.xml", "--max-depth=-1", "--rr-depth=4294967295", "-v", "-oout.exr"];
    let running = Running::until(desk.command().args(endless), "loaded in");
    for _ in 0..2 {
        std::thread::sleep(DELIVERY);
        running.signal("TERM");
    }
    assert_eq!(running.end(), Some(130));
    assert_eq!(desk.files(), ["endless.xml"]);
}

#[test]
fn ignored_signals_stay_ignored() {
    let desk = Desk::new();
    let mut shell = Command::new("sh");
    shell.args(["-c", r#"trap "" HUP INT; exec "$@""#, "sh", env!("CARGO_BIN_EXE_snell")]);
    let mut running = Running::until(shell.current_dir(desk.path("")).args(LONG), PROGRESS);
    running.signal("HUP");
    running.signal("INT");
    std::thread::sleep(DELIVERY);
    assert!(running.child.try_wait().unwrap().is_none(), "it goes on");
    assert!(!desk.files().contains(&"out.exr".to_owned()), "it has written nothing yet");
    running.signal("TERM");
    assert_eq!(running.end(), Some(130));
    assert_eq!(desk.files(), ["out.exr"]);
}

#[test]
fn what_cannot_be_written_keeps_nothing_else_from_being_written() {
    let desk = Desk::new();
    fs::create_dir(desk.path("there")).unwrap();
    let outputs = ["-othere/b.png", "--stats", "s.json"];
    let running = Running::until(desk.command().args(LONG).args(outputs), PROGRESS);
    fs::create_dir(desk.path("out.exr")).unwrap();
    running.signal("TERM");
    assert_eq!(running.end(), Some(2));
    assert!(desk.path("there/b.png").is_file() && desk.path("s.json").is_file());
    let kept: Vec<String> = desk.files().into_iter().filter(|name| name.ends_with(".tmp")).collect();
    assert_eq!(kept.len(), 1, "the picture is kept under another name");
    assert!(fs::read(desk.path(&kept[0])).unwrap().starts_with(&[0x76, 0x2f, 0x31, 0x01]), "EXR magic number");
}
