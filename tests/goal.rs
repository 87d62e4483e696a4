//! Renders that end by their error, their time or their samples, and say what they reached.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod desk;

use desk::*;
use exr::prelude::{AttributeValue, Text, read_all_flat_layers_from_file};
use serde_json::Value;
use std::fs;

fn stats(desk: &Desk) -> Value {
    serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap()
}

/// What the command says, and its exit code.
fn said(desk: &Desk, arguments: &[&str]) -> (String, i32) {
    let common = ["render", SCENE, "-Dres=32", "-oa.exr", "--stats=s.json"];
    let output = desk.snell(&[&common, arguments].concat());
    (String::from_utf8(output.stderr).unwrap(), output.status.code().unwrap())
}

#[test]
fn a_target_error_ends_the_render_and_the_files_say_so() {
    let desk = Desk::new();
    let (text, code) = said(&desk, &["--target-error=8%", "--aov=error,samples"]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("the target error is reached") && text.contains("with 95 % confidence"), "{text}");
    let stats = stats(&desk);
    let number = |name: &str| stats[name].as_f64().unwrap();
    assert_eq!(stats["ended_by"], "error");
    assert!(number("estimated_error_low") < number("estimated_error"));
    assert!(number("estimated_error") < number("estimated_error_high"));
    assert!(number("estimated_error_high") <= 0.08, "{stats}");
    let tiles = stats["estimated_error_of_tiles"].as_array().unwrap();
    assert_eq!((tiles.len(), &tiles[0][2]), (1, &Value::from(32)));
    let image = read_all_flat_layers_from_file(desk.path("a.exr")).unwrap();
    let layer = &image.layer_data[0];
    let attribute = |name: &str| layer.attributes.other.get(&Text::from(name)).unwrap().clone();
    assert_eq!(attribute("snell.endedBy"), AttributeValue::Text("error".into()));
    assert_eq!(attribute("snell.estimatedError"), AttributeValue::F64(number("estimated_error")));
    let samples = layer.channel_data.list.iter().find(|c| c.name.to_string() == "samples").unwrap();
    let counts: Vec<f32> = samples.sample_data.values_as_f32().collect();
    let sum: f64 = counts.iter().copied().map(f64::from).sum();
    assert_eq!(sum, number("samples"), "every sample is in one pixel");
    assert!(counts.iter().all(|count| *count >= 16.0), "no pixel has less than the first");
}

#[test]
fn samples_or_time_may_end_it_short_of_the_target() {
    let desk = Desk::new();
    let (text, code) = said(&desk, &["--target-error=0.01%", "--spp=24"]);
    assert_eq!((code, &stats(&desk)["ended_by"]), (1, &Value::from("samples")), "{text}");
    assert!(text.contains("all samples are taken; the target error is not reached"), "{text}");
    let per_pixel = stats(&desk)["samples_per_pixel"].as_f64().unwrap();
    assert!(per_pixel <= 24.0 && per_pixel > 23.0, "{per_pixel}");
    let (text, code) = said(&desk, &["--target-error=0.001%", "--time=0.3s", "--confidence=80%"]);
    assert_eq!((code, &stats(&desk)["ended_by"]), (1, &Value::from("time")), "{text}");
    assert!(text.contains("the time is up; the target error is not reached"), "{text}");
    assert!(text.contains("with 80 % confidence"), "{text}");
}

/// A picture of one block, of which a quarter more samples are fewer than it can get at a time.
#[test]
fn small_pictures_reach_their_targets() {
    let desk = Desk::new();
    for size in ["1x1", "8x8", "3x20"] {
        let arguments = ["render", SCENE, "-oa.exr", "--stats=s.json", "--target-error=4%", "-q", "--size", size];
        let output = desk.succeeds(&arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(stats(&desk)["ended_by"], "error", "{size}: {text}");
    }
}

/// What there is time for is a render of just so many samples.
#[test]
fn a_render_that_ends_by_time_is_a_prefix_of_a_longer_one() {
    let desk = Desk::new();
    let (text, code) = said(&desk, &["--time=0.4", "-q"]);
    assert_eq!((code, &stats(&desk)["ended_by"]), (0, &Value::from("time")), "{text}");
    let samples = stats(&desk)["samples_per_pixel"].as_f64().unwrap();
    assert!(samples >= 1.0 && samples.fract() == 0.0, "{samples}");
    desk.succeeds(&["render", SCENE, "-Dres=32", "-ob.exr", "-q", &format!("--spp={samples}")]);
    let pixels = |name: &str| {
        let image = read_all_flat_layers_from_file(desk.path(name)).unwrap();
        let channels = image.layer_data[0].channel_data.list.clone();
        channels.iter().flat_map(|c| c.sample_data.values_as_f32().collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    assert_eq!(pixels("a.exr"), pixels("b.exr"));
    // A number of samples still counts.
    let (text, _) = said(&desk, &["--time=1h", "--spp=2"]);
    assert_eq!(stats(&desk)["ended_by"], "samples", "{text}");
}

#[test]
fn a_plain_render_knows_its_error_from_its_halves() {
    let desk = Desk::new();
    let (text, _) = said(&desk, &["--spp=64"]);
    let (low, high) = (&stats(&desk)["estimated_error_low"], &stats(&desk)["estimated_error_high"]);
    assert!(low.as_f64().unwrap() > 0.0 && low.as_f64() < high.as_f64() && text.contains("estimated relative error"));
    let (text, _) = said(&desk, &["--spp=1"]);
    assert!(text.contains("too few to estimate the error"), "{text}");
    assert_eq!(stats(&desk)["estimated_error"], Value::Null);
}

#[test]
fn what_cannot_be_is_refused() {
    let desk = Desk::new();
    let render = ["render", SCENE, "-Dres=8", "-oa.exr"];
    for (arguments, expected) in [
        (&["--target-error=0"][..], "expected a relative error, more than 0, for example 2% or 0.02"),
        (&["--confidence=2"], "expected a probability from 50% to 99.99%"),
        (&["--time=soon"], "expected a time, more than 0, for example 30s, 5min or 2h"),
    ] {
        let output = desk.snell(&[&render, arguments].concat());
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && error.contains(expected), "{error}");
    }
    for (arguments, expected) in [
        (
            &["--target-error=1%", "--shard=1/2"][..],
            "--shard needs a number of samples that is known before: it cannot go with --target-error",
        ),
        (&["--time=1s", "--shard=1/2"], "it cannot go with --time"),
        (
            &["--target-error=1%", "--sampler=zsobol"],
            "--sampler zsobol is for a number of samples that is known before: with --target-error expected sobol or \
             independent",
        ),
        (
            &["--time=1s", "--sampler=stratified"],
            "--sampler stratified needs --spp beside --time: a number to be well spread for",
        ),
        (&["--adaptive", "--spp=3"], "--spp 3: with --adaptive expected at least 4, or nothing is known of the error"),
    ] {
        desk.refuses(&[&render, arguments].concat(), &[expected]);
    }
}

/// A small light that only few samples find: pixels are made by single samples, and that is said.
#[test]
fn heavy_tails_are_told() {
    let desk = Desk::new();
    let scene = scene_text(
        r#"<integrator type="path"/><shape type="sphere"><float name="radius" value="0.05"/>
        <transform name="to_world"><translate x="0" y="2" z="4"/></transform>
        <emitter type="area"><rgb name="radiance" value="1000000"/></emitter></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="9"/><rotate x="1" angle="-90"/><translate y="-1"/></transform>
        <bsdf type="diffuse"/></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="9"/><translate z="9"/><rotate y="1" angle="180"/><translate z="18"/></transform>
        <bsdf type="diffuse"/></shape>"#,
    );
    fs::write(desk.path("tail.xml"), scene).unwrap();
    let render = ["render", "tail.xml", "-oa.exr", "--stats=s.json", "--size=64x64", "--integrator=bsdf"];
    let output = desk.succeeds(&[&render[..], &["--adaptive", "--spp=64"]].concat());
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("rare bright samples make most of the error (tail index"), "{text}");
    assert!(text.contains("there may be more where none has been seen yet"), "{text}");
    assert_eq!(stats(&desk)["error_is_heavy_tailed"], true);
    // Nothing is found of a light that is smaller still.
    let text = fs::read_to_string(desk.path("tail.xml")).unwrap().replace(r#"value="0.05""#, r#"value="0.00001""#);
    fs::write(desk.path("tail.xml"), text).unwrap();
    let output = desk.succeeds(&[&render[..], &["--target-error=1%"]].concat());
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("no light was found at all, so nothing is known of the error"), "{text}");
}
