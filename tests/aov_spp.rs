//! `--aov-spp`: surfaces are looked at for some samples only, and nothing else changes.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod desk;

use desk::{Desk, SCENE};
use exr::prelude::read_first_flat_layer_from_file;
use std::collections::BTreeMap;

/// How far two means of the same few numbers may be apart, relatively: each is rounded to the film's fixed point, in f64, and to
/// f32 at last, of which a spacing is 2⁻²³.
const ROUNDING: f32 = f32::EPSILON;

/// Every channel of a render to `name`.
fn channels(desk: &Desk, name: &str, options: &[&str]) -> BTreeMap<String, Vec<f32>> {
    let render = ["render", SCENE, "-Dres=16", "-q", "--reuse=off", "--light-samples=1", "-o", name];
    desk.succeeds(&[&render[..], options].concat());
    read(desk, name)
}

fn read(desk: &Desk, name: &str) -> BTreeMap<String, Vec<f32>> {
    let image = read_first_flat_layer_from_file(desk.path(name)).unwrap();
    let list = image.layer_data.channel_data.list;
    list.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}

fn is_of_the_surface(channel: &str) -> bool {
    ["albedo.", "N.", "Z"].iter().any(|start| channel.starts_with(start))
}

#[test]
fn the_first_samples_of_a_pixel_are_looked_at() {
    const AOVS: [&str; 2] = ["--aov", "albedo,normal,depth,shape,samples,error"];
    let desk = Desk::new();
    let with =
        |name: &str, spp: &str, more: &[&str]| channels(&desk, name, &[&AOVS[..], &["--spp", spp], more].concat());
    let (few, all) = (with("few.exr", "2", &[]), with("all.exr", "8", &[]));
    let some = with("some.exr", "8", &["--aov-spp", "2"]);
    assert_eq!(some.keys().collect::<Vec<_>>(), all.keys().collect::<Vec<_>>(), "no channel more");
    let mut differ = 0;
    for (name, values) in &some {
        if !is_of_the_surface(name) {
            assert!(values == &all[name], "{name} is what it was");
            continue;
        }
        for (x, expected) in values.iter().zip(&few[name]) {
            assert!((x - expected).abs() <= ROUNDING * expected.abs(), "{name}: {x}, not {expected}");
        }
        differ += usize::from(values != &all[name]);
    }
    assert!(differ > 0, "with fewer samples something is another mean");
    // As many as there are, or more, are all.
    for count in ["8", "9"] {
        assert!(with("as-many.exr", "8", &["--aov-spp", count]) == all, "{count}");
    }
}

#[test]
fn parts_of_such_a_render_add_up_to_it() {
    let desk = Desk::new();
    let options = ["--aov", "normal,depth,albedo", "--spp", "8", "--aov-spp", "3"];
    let whole = channels(&desk, "whole.exr", &options);
    // The second has no sample that is looked at.
    for shard in ["1/2", "2/2"] {
        let name = format!("part-{}.exr", &shard[..1]);
        let part = channels(&desk, &name, &[&options[..], &["--shard", shard]].concat());
        assert_eq!(part["Z"].iter().all(|z| *z == 0.0), shard == "2/2");
    }
    desk.succeeds(&["merge", "part-1.exr", "part-2.exr", "-o", "merged.exr", "-q"]);
    assert!(read(&desk, "merged.exr") == whole);
    // What a checkpoint was begun with, it goes on with.
    let keep = ["--checkpoint", "kept.exr"];
    channels(&desk, "kept-picture.exr", &[&options[..], &keep].concat());
    let render = ["render", SCENE, "-Dres=16", "-q", "--reuse=off", "--light-samples=1", "-o", "again.exr", "--resume"];
    let other = ["--aov", "normal,depth,albedo", "--spp", "8", "--aov-spp", "4"];
    desk.refuses(&[&render[..], &keep, &other].concat(), &["aov-spp: "]);
}

#[test]
fn no_sample_at_all_is_refused() {
    let desk = Desk::new();
    let output = desk.snell(&["render", SCENE, "--aov", "depth", "-o", "p.exr", "--aov-spp", "0"]);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.contains("invalid value '0' for '--aov-spp <N>'"), "{error}");
    assert!(desk.files().is_empty());
}
