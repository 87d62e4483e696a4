//! `snell diff` as a user meets it.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod desk;

use desk::*;
use std::fs;
use std::path::Path;

/// The value of a pixel, by its number.
type Value = fn(usize) -> f32;

/// A small picture as EXR with these channels.
fn write_exr(path: &Path, size: (usize, usize), channels: &[(&str, Value)]) {
    use exr::prelude::*;
    let list = channels
        .iter()
        .map(|(name, value)| AnyChannel::new(*name, FlatSamples::F32((0..size.0 * size.1).map(value).collect())));
    let layer = Layer::new(size, LayerAttributes::default(), Encoding::UNCOMPRESSED, AnyChannels::sort(list.collect()));
    Image::from_layer(layer).write().to_file(path).unwrap();
}

#[test]
fn diff_tells_how_different_pictures_are() {
    let desk = Desk::new();
    for (seed, name) in [("1", "a.exr"), ("2", "b.exr")] {
        let png = name.replace("exr", "png");
        let render = ["render", SCENE, "-Dres=32", "--spp", "4", "-q", "--seed", seed, "-o", name, "-o", &png];
        assert!(desk.snell(&render).status.success());
    }
    let same = desk.snell(&["diff", "a.exr", "a.exr", "--fail", "mse=0", "--fail", "psnr=100", "--fail", "flip=0"]);
    assert_eq!(same.status.code(), Some(0), "{same:?}");
    let other = desk.snell(&["diff", "a.exr", "b.exr", "--json", "-", "--fail", "relmse=1e-9", "--fail", "flip=1"]);
    assert_eq!(other.status.code(), Some(1), "{other:?}");
    let figures: serde_json::Value = serde_json::from_slice(&other.stdout).unwrap();
    assert!(figures["mse"].as_f64().unwrap() > 0.0 && figures["hdr_flip"].as_f64().unwrap() > 0.0);
    assert_eq!(figures["failed"].as_array().unwrap().len(), 1, "{figures}");
    assert_eq!(figures["significance"], serde_json::Value::Null);
    let maps = desk.snell(&["diff", "a.png", "b.png", "--heat", "h.png", "--json", "f.json"]);
    assert!(maps.status.success() && String::from_utf8_lossy(&maps.stdout).contains("flip"), "{maps:?}");
    assert!(desk.snell(&["diff", "a.exr", "b.exr", "--heat", "h.exr"]).status.success());
    assert_eq!(desk.files(), ["a.exr", "a.png", "b.exr", "b.png", "f.json", "h.exr", "h.png"]);
    // The picture minus the reference, plus the reference, is the picture.
    let read = |name: &str| snell::image::read_picture(&desk.path(name)).unwrap().picture;
    let (a, b, h) = (read("a.exr"), read("b.exr"), read("h.exr"));
    assert_eq!(h.get(9, 20).0, a.get(9, 20).0 - b.get(9, 20).0);
}

#[test]
fn diff_tests_differences_against_variances() {
    let desk = Desk::new();
    let grey: Value = |i| 0.5 + 0.1 * if i % 2 == 0 { 1.0 } else { -1.0 };
    write_exr(&desk.path("a.exr"), (16, 8), &[("Y", grey)]);
    write_exr(&desk.path("b.exr"), (16, 8), &[("R", |_| 0.5), ("G", |_| 0.5), ("B", |_| 0.5)]);
    write_exr(&desk.path("b_var.exr"), (16, 8), &[("Y", |_| 0.01)]);
    // One variance alone says nothing, unless it is asked for.
    let figures = |extra: &[&str]| {
        let output = desk.snell(&[&["diff", "a.exr", "b.exr", "--json", "-"], extra].concat());
        (output.status.code(), serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap())
    };
    assert_eq!(figures(&[]).1["significance"], serde_json::Value::Null);
    let (code, f) = figures(&["--variance-b", "b_var.exr", "--fail", "p=0.5"]);
    // Every pixel is one standard error off, tiles and the whole agree exactly.
    let s = &f["significance"];
    assert!((s["pixels"]["worst_z"].as_f64().unwrap() - 1.0).abs() < 1e-6, "{f}");
    assert_eq!((s["pixels"]["tests"].as_u64(), s["tiles"]["tests"].as_u64()), (Some(384), Some(6)));
    assert_eq!((code, s["whole"]["p"].as_f64().unwrap() > 0.99), (Some(0), true), "{f}");
    let told = |extra: &[&str]| {
        let output = desk.succeeds(&[&["diff", "a.exr", "b.exr"], extra].concat());
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let text = told(&["--variance-b", "b_var.exr"]);
    for part in [
        "pixels       16x8\n",
        "mean         0.500000, of the reference 0.500000\n",
        "flip         0.",
        " exposures from ",
        "p-pixels     1.0000: largest |z| of 384 is 1.000\n",
        ": all of these\n",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    write_exr(&desk.path("none.exr"), (16, 8), &[("Y", |_| 0.0)]);
    assert!(told(&["--variance-b", "none.exr"]).contains("384 values differ, but have no variance"));
    // Found beside both pictures; now a tenth of the variance.
    write_exr(&desk.path("a_var.exr"), (16, 8), &[("Y", |_| 0.0)]);
    write_exr(&desk.path("b_var.exr"), (16, 8), &[("Y", |_| 0.0001)]);
    let (code, f) = figures(&["--fail", "p-pixels=0.01"]);
    assert_eq!(code, Some(1), "{f}");
}

#[test]
fn diff_refuses_what_cannot_be_compared() {
    let desk = Desk::new();
    write_exr(&desk.path("a.exr"), (8, 8), &[("Y", |_| 0.5)]);
    write_exr(&desk.path("small.exr"), (4, 8), &[("Y", |_| 0.5)]);
    write_exr(&desk.path("depth.exr"), (8, 8), &[("Z", |_| 0.5)]);
    write_exr(&desk.path("negative.exr"), (8, 8), &[("Y", |i| i as f32 - 3.0)]);
    fs::write(desk.path("text.exr"), "no picture").unwrap();
    let whole = fs::read(desk.path("a.exr")).unwrap();
    fs::write(desk.path("short.exr"), &whole[..whole.len() / 2]).unwrap();
    desk.refuses(
        &["diff", "a.exr", "small.exr"],
        &["only pictures of one size can be compared: a.exr has 8x8 pixels, small.exr 4x8 pixels"],
    );
    desk.refuses(&["diff", "a.exr", "depth.exr"], &["depth.exr", "neither channels R, G, B nor Y, but Z"]);
    desk.refuses(
        &["diff", "a.exr", "text.exr"],
        &["text.exr", "none of OpenEXR, Radiance HDR, PNG, JPEG, BMP and TGA"],
    );
    desk.refuses(&["diff", "a.exr", "short.exr"], &["short.exr", "cannot read the picture"]);
    desk.refuses(&["diff", "none.exr", "a.exr"], &["none.exr: cannot read the picture: "]);
    desk.refuses(&["diff", ".", "a.exr"], &["not a regular file"]);
    desk.refuses(
        &["diff", "a.exr", "a.exr", "--fail", "p=0.01"],
        &["--fail p needs variances: --variance-a FILE, --variance-b FILE"],
    );
    desk.refuses(
        &["diff", "a.exr", "a.exr", "--variance-a", "negative.exr"],
        &["negative.exr: a variance is below zero"],
    );
    desk.refuses(&["diff", "a.exr", "a.exr", "--variance-b", "small.exr"], &["one size"]);
    desk.refuses(&["diff", "a.exr", "a.exr", "--heat", "h.tga"], &["h.tga", ".exr or .png"]);
    desk.refuses(&["diff", "a.exr", "a.exr", "--json", "nowhere/f.json"], &["nowhere/f.json", "cannot write"]);
    // A header may claim what the file does not hold.
    let name = b"dataWindow\0box2i\0";
    let window = whole.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    let mut claims = whole.clone();
    claims[window + 8..window + 16].copy_from_slice(&[0xff, 0xff, 0x0f, 0, 0xff, 0xff, 0x0f, 0]);
    fs::write(desk.path("claims.exr"), claims).unwrap();
    desk.refuses(
        &["diff", "claims.exr", "a.exr"],
        &["1048576x1048576 pixels are too many; at most 268435456 can be read"],
    );
    // A picture that is not finite somewhere is told of, and fails every limit.
    write_exr(&desk.path("nan.exr"), (8, 8), &[("Y", |i| if i == 9 { f32::NAN } else { 0.5 })]);
    let output = desk.snell(&["diff", "nan.exr", "a.exr", "--fail", "mse=1"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.code() == Some(1) && text.contains("1 pixels, left out of all that follows"), "{text}");
    assert!(text.contains("mse: 1 pixels are not finite"), "{text}");
}
