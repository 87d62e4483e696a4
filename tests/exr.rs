//! Pictures as others read them: what an EXR of ours says and holds.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod desk;

use desk::*;
use exr::prelude::{AttributeValue, FlatImage, FlatSamples, IntegerBounds, Text, Vec2, read_all_flat_layers_from_file};
use std::fs;

fn read(desk: &Desk, name: &str) -> FlatImage {
    read_all_flat_layers_from_file(desk.path(name)).unwrap()
}

/// The values of each channel, R, G, B.
fn values(image: &FlatImage) -> [Vec<f32>; 3] {
    ["R", "G", "B"].map(|name| {
        let channels = &image.layer_data[0].channel_data.list;
        let channel = channels.iter().find(|c| c.name.eq(name)).unwrap();
        channel.sample_data.values_as_f32().collect()
    })
}

/// A sphere around the camera that emits `radiance` and reflects half.
fn emitting_room(radiance: f32) -> String {
    let film = r#"type="hdrfilm""#;
    scene_text(&format!(
        r#"<shape type="sphere"><float name="radius" value="9"/><boolean name="flip_normals" value="true"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>"#
    ))
    .replace(film, &format!("{film}><string name=\"component_format\" value=\"float32\"/"))
}

#[test]
fn a_crop_keeps_its_place_and_its_bits() {
    let desk = Desk::new();
    let common = ["render", SCENE, "-Dres=16", "--spp=2", "--seed=9007199254740993", "-q"];
    desk.succeeds(&[&common[..], &["-o", "whole.exr"]].concat());
    desk.succeeds(&[&common[..], &["-o", "part.exr", "--crop", "3,5,6,4"]].concat());
    let (whole, part) = (read(&desk, "whole.exr"), read(&desk, "part.exr"));
    assert_eq!(part.attributes.display_window, IntegerBounds::new(Vec2(0, 0), Vec2(16, 16)));
    let layer = &part.layer_data[0];
    assert_eq!((layer.attributes.layer_position, layer.size), (Vec2(3, 5), Vec2(6, 4)));
    let whole = values(&whole);
    for (channel, part) in values(&part).iter().enumerate() {
        for (i, value) in part.iter().enumerate() {
            assert_eq!(value.to_bits(), whole[channel][(i / 6 + 5) * 16 + i % 6 + 3].to_bits());
        }
    }
    let says = |name: &str| layer.attributes.other.get(&Text::from(name)).cloned();
    assert_eq!(says("snell.samples"), Some(AttributeValue::F64(2.0)));
    assert_eq!(says("snell.seed"), Some(AttributeValue::Text("9007199254740993".into())));
    assert_eq!(says("snell.nonFiniteSamples"), Some(AttributeValue::F64(0.0)));
    assert_eq!(says("snell.complete"), Some(AttributeValue::Text("yes".into())));
    let Some(AttributeValue::Text(command)) = says("snell.command") else { panic!("no command") };
    let words = shlex::split(&command.to_string()).unwrap();
    assert_eq!(words[1..], [&common[..], &["-o", "part.exr", "--crop", "3,5,6,4"]].concat());
}

#[test]
fn half_floats_are_clamped_and_counted() {
    let desk = Desk::new();
    // Twice the largest half float, in 64 pixels of three channels.
    fs::write(desk.path("float.xml"), emitting_room(131_008.0)).unwrap();
    fs::write(desk.path("half.xml"), emitting_room(131_008.0).replace("float32", "float16")).unwrap();
    let render = |scene: &str, stats: &str| {
        let output = desk.succeeds(&["render", scene, "--spp=1", "--max-depth=1", "--stats", stats]);
        let figures: serde_json::Value = serde_json::from_slice(&fs::read(desk.path(stats)).unwrap()).unwrap();
        (String::from_utf8_lossy(&output.stderr).into_owned(), figures["clamped_values"].as_u64())
    };
    let (told, counted) = render("half.xml", "half.json");
    assert!(told.contains("192 values were too large") && counted == Some(192), "{told} {counted:?}");
    let (told, counted) = render("float.xml", "float.json");
    assert!(!told.contains("too large") && counted == Some(0), "{told} {counted:?}");
    let half = read(&desk, "half.exr");
    assert!(matches!(half.layer_data[0].channel_data.list[0].sample_data, FlatSamples::F16(_)));
    assert_eq!(values(&half).concat(), [65504.0; 192]);
    assert_eq!(values(&read(&desk, "float.exr")).concat(), [131_008.0; 192]);
}

/// One bounce of `bsdf` has no variance in this room. With radiance 1 the light itself shows 1, one bounce adds a half,
/// all bounces 1: the file's `direct` stays direct whoever estimates, and no depth at all is black.
#[test]
fn the_file_says_how_much_light_is_wanted() {
    let desk = Desk::new();
    let room = emitting_room(1.0);
    fs::write(desk.path("path.xml"), &room).unwrap();
    let direct = room.replace("<sensor", "<integrator type=\"direct\"/><sensor");
    fs::write(desk.path("direct.xml"), direct).unwrap();
    let cases: [(&str, &[&str], f32); 6] = [
        ("direct.xml", &["--integrator=bsdf"], 1.5),
        ("direct.xml", &["--integrator=bsdf", "--max-depth=3"], 1.75),
        ("path.xml", &["--integrator=bsdf", "--max-depth=1"], 1.0),
        ("path.xml", &["--integrator=bsdf", "--max-depth=0"], 0.0),
        ("path.xml", &["--max-depth=0"], 0.0),
        ("path.xml", &["--integrator=bsdf", "--max-depth=40", "--rr-depth=99"], 2.0),
    ];
    for (scene, options, expected) in cases {
        desk.succeeds(&[&["render", scene, "--spp=4", "-q", "-oout.exr"], options].concat());
        for v in values(&read(&desk, "out.exr")).concat() {
            // A few roundings, and 2⁻⁴⁰ of the series.
            assert!((v - expected).abs() <= 4.0 * f32::EPSILON, "{scene} {options:?}: {v}, expected {expected}");
        }
    }
}
