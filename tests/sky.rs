//! An environment of the user's in place of the scene's.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod common;

use common::*;
use snell::accel::Accelerator;
use snell::description::{LightKind, SceneDescription};
use snell::integrator::Estimator;
use snell::loader::{LoadOptions, Sky};
use std::fs;
use std::path::Path;

/// A picture of 8×4 pixels as flat RGBE: green in its middle, red on its left, blue on its right.
fn write_map(path: &Path) {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n".to_vec();
    for i in 0..32 {
        bytes.extend([[128, 0, 0, 129], [0, 128, 0, 129], [0, 0, 128, 129]][[0, 0, 0, 1, 1, 2, 2, 2][i % 8]]);
    }
    fs::write(path, bytes).unwrap();
}

const SCENE: &str = r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="10"/>
    <transform name="to_world"><lookat origin="0, 0, 0" target="1, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="2"/><integer name="height" value="2"/><rfilter type="box"/></film></sensor>
    <emitter type="constant"/><emitter type="point"/></scene>"#;

fn load(name: &str, text: &str, sky: impl Fn(&Path) -> Sky) -> Result<SceneDescription, String> {
    let folder = tempfile::tempdir().unwrap();
    write_map(&folder.path().join("map.hdr"));
    fs::write(folder.path().join(name), text).unwrap();
    let options = LoadOptions { sky: Some(sky(folder.path())), ..Default::default() };
    snell::loader::load(&folder.path().join(name), &options).map_err(|e| e.to_string())
}

#[test]
fn it_replaces_the_sky_and_turns_to_the_left() {
    let seen = |degrees| {
        let description = load("s.xml", SCENE, |folder| Sky { file: folder.join("map.hdr"), degrees }).unwrap();
        assert_eq!(description.lights.len(), 2, "the point is left, the constant is not");
        let scene = compiled(&description, Accelerator::Native);
        let colour = picture(&scene, &settings(Estimator::Path, 4)).get(0, 0).0;
        ["red", "green", "blue"][[colour.x, colour.y, colour.z].iter().position(|c| *c > 0.5).unwrap()]
    };
    // As Mitsuba has it, the picture's middle lies towards +z, and its left half towards +x, to the left of that.
    assert_eq!([0.0, 90.0, 180.0, -360.0].map(seen), ["red", "green", "blue", "red"]);
    assert_eq!([60.0, 120.0, -60.0, 240.0].map(seen), ["green", "green", "red", "blue"]);
}

#[test]
fn a_mesh_then_stands_in_it_alone() {
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let description = load("m.obj", mesh, |folder| Sky { file: folder.join("map.hdr"), degrees: 0.0 }).unwrap();
    assert_eq!(description.shapes.len(), 1);
    assert!(matches!(description.lights[..], [ref l] if matches!(l.kind, LightKind::Environment { .. })));
}

#[test]
fn one_that_cannot_be_read_is_an_error() {
    let error = load("s.xml", SCENE, |folder| Sky { file: folder.join("none.hdr"), degrees: 0.0 }).unwrap_err();
    assert!(error.starts_with("--env: cannot read '") && error.contains("none.hdr': "), "{error}");
}
