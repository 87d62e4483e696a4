//! The command as a user meets it: exit codes, messages, files.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/scene.xml");

/// An empty folder, and the command run in it.
struct Desk(TempDir);

impl Desk {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn snell(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_snell")).args(arguments).current_dir(self.0.path()).output().unwrap()
    }

    fn files(&self) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(self.0.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// The command must fail with exit code 2 and one line that contains all of `expected`, and leave no file.
    fn refuses(&self, arguments: &[&str], expected: &[&str]) {
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

fn scene_text(shape: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
    <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
    {shape}
</scene>"#
    )
}

#[test]
fn render_writes_every_output_and_nothing_else() {
    let desk = Desk::new();
    let output = desk
        .snell(&["render", SCENE, "-Dres=16", "--spp", "2", "-o", "a.exr", "-o", "b.png", "--stats", "s.json", "-q"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stdout.is_empty() && output.stderr.is_empty(), "quiet means quiet");
    assert_eq!(desk.files(), ["a.exr", "b.png", "s.json"]);
    assert!(fs::read(desk.path("a.exr")).unwrap().starts_with(&[0x76, 0x2f, 0x31, 0x01]), "EXR magic number");
    assert!(fs::read(desk.path("b.png")).unwrap().starts_with(b"\x89PNG"), "PNG magic number");
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap();
    assert_eq!(stats["samples"], 16 * 16 * 2);
    assert_eq!(stats["rays"]["camera"], 16 * 16 * 2);
    assert_eq!(stats["non_finite_samples"], 0);
    assert_eq!(stats["complete"], true);
}

#[test]
fn the_default_output_is_named_after_the_scene() {
    let desk = Desk::new();
    assert!(desk.snell(&["render", SCENE, "-Dres=8", "--spp", "1", "-q"]).status.success());
    assert_eq!(desk.files(), ["scene.exr"]);
}

#[test]
fn info_and_replay_print_and_write_nothing() {
    let desk = Desk::new();
    let info = desk.snell(&["info", SCENE, "-Dres=16"]);
    let text = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(info.status.success() && text.contains("16x16 pixels") && text.contains("triangles"), "{text}");
    let replay = desk.snell(&["render", SCENE, "-Dres=16", "--replay", "8,8,3"]);
    let text = String::from_utf8_lossy(&replay.stdout).into_owned();
    assert!(replay.status.success() && text.contains("vertex 1") && text.contains("ends"), "{text}");
    assert!(desk.files().is_empty());
}

#[test]
fn what_cannot_be_written_is_noticed_before_rendering() {
    let desk = Desk::new();
    // So many samples that a render would never end.
    let endless = ["render", SCENE, "--spp", "4000000000"];
    let with = |extra: &[&'static str]| [&endless[..], extra].concat();
    desk.refuses(&with(&["-o", "nowhere/a.exr"]), &["nowhere/a.exr", "does not exist"]);
    desk.refuses(&with(&["-o", "a.tga"]), &["a.tga", ".exr or .png"]);
    desk.refuses(&with(&["-o", "a.exr", "-o", "nowhere/b.png"]), &["nowhere/b.png"]);
    desk.refuses(&with(&["-o", "a.exr", "--stats", "nowhere/s.json"]), &["nowhere"]);
    fs::create_dir(desk.path("folder.exr")).unwrap();
    desk.refuses(&with(&["-o", "folder.exr"]), &["folder.exr", "folder"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_read_only_folder_is_noticed_before_rendering() {
    // Also for the superuser, whom no mode of a folder stops.
    Desk::new()
        .refuses(&["render", SCENE, "--spp", "4000000000", "-o", "/proc/a.exr"], &["/proc/a.exr", "cannot write"]);
}

#[test]
fn bad_input_gets_one_line_with_its_place() {
    let desk = Desk::new();
    let cases: &[(&str, String, &[&str])] = &[
        (
            "missing-obj.xml",
            scene_text(r#"<shape type="obj"><string name="filename" value="no.obj"/></shape>"#),
            &["no.obj"],
        ),
        ("broken.xml", scene_text("<shape type=\"sphere\">"), &["broken.xml:"]),
        ("plugin.xml", scene_text(r#"<shape type="spheer"/>"#), &["plugin.xml:3:", "spheer", "sphere"]),
        ("later.xml", scene_text(r#"<shape type="cube"/>"#), &["later.xml:3:", "cube", "not supported yet"]),
        (
            "parameter.xml",
            scene_text(r#"<shape type="sphere"><float name="raduis" value="1"/></shape>"#),
            &["parameter.xml:3:", "raduis", "radius"],
        ),
        (
            "nan.xml",
            scene_text(r#"<shape type="obj"><string name="filename" value="nan.obj"/></shape>"#),
            &["nan.obj:2"],
        ),
        (
            "index.xml",
            scene_text(r#"<shape type="obj"><string name="filename" value="index.obj"/></shape>"#),
            &["index.obj:4"],
        ),
        (
            "bomb.xml",
            format!("<!DOCTYPE x [<!ENTITY a \"{}\"><!ENTITY b \"&a;&a;&a;\">]>{}", "x".repeat(50), scene_text("&b;")),
            &["bomb.xml:"],
        ),
        ("cycle.xml", scene_text(r#"<include filename="cycle.xml"/>"#), &["cycle.xml:3:"]),
        (
            "wide.xml",
            scene_text("").replace(r#""width" value="8""#, r#""width" value="1000000000""#),
            &["wide.xml:2:", "1000000000"],
        ),
    ];
    fs::write(desk.path("nan.obj"), "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::write(desk.path("index.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n").unwrap();
    for (name, text, _) in cases {
        fs::write(desk.path(name), text).unwrap();
    }
    for (name, _, expected) in cases {
        desk.refuses(&["render", name, "-o", "out.exr"], expected);
    }
    desk.refuses(&["render", "absent.xml", "-o", "out.exr"], &["absent.xml"]);
}

#[test]
fn bad_arguments_are_refused() {
    let desk = Desk::new();
    desk.refuses(&["render", SCENE, "--crop", "0,0,9999,1"], &["--crop", "outside"]);
    desk.refuses(&["render", SCENE, "--camera", "3"], &["camera 3"]);
    desk.refuses(&["render", SCENE, "--replay", "9999,0,0"], &["--replay", "outside"]);
    desk.refuses(&["render", SCENE, "-Dnonsense=1"], &["nonsense"]);
    desk.refuses(&["render", SCENE, "-o", "a.exr", "-o", "a.exr"], &["a.exr", "twice"]);
    desk.refuses(&["render", SCENE, "-o", "a.exr", "--stats", "a.exr"], &["a.exr", "twice"]);
    for wrong in [
        &["render"][..],
        &["render", SCENE, "--spp", "0"],
        &["render", SCENE, "--size", "0x9"],
        &["rander"],
        &["render", SCENE, "--threads", "100000"],
    ] {
        assert_eq!(desk.snell(wrong).status.code(), Some(2), "{wrong:?}");
    }
    assert!(desk.files().is_empty());
}

#[test]
fn help_and_version_succeed() {
    let desk = Desk::new();
    for arguments in [&["--help"][..], &["--version"], &["render", "--help"]] {
        let output = desk.snell(arguments);
        assert!(output.status.success() && !output.stdout.is_empty(), "{arguments:?}");
    }
}

/// Interrupts the command once it renders, and returns what came of it.
#[cfg(unix)]
fn interrupted(desk: &Desk, times: u32) -> std::process::ExitStatus {
    let mut child = Command::new(env!("CARGO_BIN_EXE_snell"))
        .args(["render", SCENE, "-Dres=64", "--spp", "100000000", "-o", "out.exr", "-q"])
        .current_dir(desk.0.path())
        .spawn()
        .unwrap();
    let reserved = |names: Vec<String>| names.iter().any(|n| n.ends_with(".tmp"));
    while !reserved(desk.files()) {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    // Long enough to have begun rendering; if it has not, it stops before the first sample and writes nothing.
    std::thread::sleep(std::time::Duration::from_millis(1500));
    for _ in 0..times {
        let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        assert!(killed.success(), "the render was still running");
    }
    child.wait().unwrap()
}

#[cfg(unix)]
#[test]
fn an_interrupt_writes_the_picture_so_far() {
    let desk = Desk::new();
    assert_eq!(interrupted(&desk, 1).code(), Some(130));
    assert_eq!(desk.files(), ["out.exr"]);
    assert!(Path::new(&desk.path("out.exr")).metadata().unwrap().len() > 1000);
}
