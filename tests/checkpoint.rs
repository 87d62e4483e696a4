//! Renders that are stopped and go on, and renders in parts: the same bits as in one go, and nothing else is accepted.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod desk;

use desk::*;
use exr::prelude::{AttributeValue, FlatSamples, Text, WritableImage, read_all_flat_layers_from_file};
use snell::image::{Metadata, Plane, PlaneValues, sums_file};
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::time::Duration;

/// A room with indirect light, so that pixels share paths, an odd number of samples, and everything beside the picture.
const RICH: [&str; 7] =
    ["render", SCENE, "-Dres=20", "--spp=37", "-q", "--reuse=on", "--aov=albedo,normal,depth,primitive,samples,error"];

/// The bits of all channels but those of sums, by name.
fn bits(desk: &Desk, name: &str) -> Vec<(String, Vec<u32>)> {
    let image = read_all_flat_layers_from_file(desk.path(name)).unwrap();
    let channels = &image.layer_data[0].channel_data.list;
    let bits = |samples: &FlatSamples| match samples {
        FlatSamples::F16(v) => v.iter().map(|v| u32::from(v.to_bits())).collect(),
        FlatSamples::F32(v) => v.iter().map(|v| v.to_bits()).collect(),
        FlatSamples::U32(v) => v.clone(),
    };
    let named = channels.iter().map(|c| (c.name.to_string(), bits(&c.sample_data)));
    named.filter(|(name, _)| !name.starts_with("snell.")).collect()
}

/// All shards of a render, as `NAME-I.exr`.
fn shards(desk: &Desk, common: &[&str], name: &str, count: u32) -> Vec<String> {
    (1..=count)
        .map(|i| {
            let file = format!("{name}-{i}.exr");
            desk.succeeds(&[common, &["--shard", &format!("{i}/{count}"), "-o", &file]].concat());
            file
        })
        .collect()
}

#[test]
fn shards_merge_to_the_bits_of_one_render() {
    let desk = Desk::new();
    let gaussian = scene_text(
        r#"<shape type="sphere"><float name="radius" value="9"/><boolean name="flip_normals" value="true"/>
        <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#,
    )
    .replace(r#"type="box""#, r#"type="gaussian""#);
    fs::write(desk.path("gaussian.xml"), gaussian).unwrap();
    let ordered = ["render", SCENE, "-Dres=16", "--spp=32", "-q", "--sampler=zsobol", "--crop=3,2,9,11"];
    let filtered = ["render", "gaussian.xml", "--spp=5", "-q"];
    for (common, count) in [(&RICH[..], 4), (&ordered[..], 3), (&filtered[..], 5)] {
        desk.succeeds(&[common, &["-o", "whole.exr"]].concat());
        let mut parts = shards(&desk, common, "part", count);
        parts.reverse();
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        desk.succeeds(&[&["merge", "-q", "-o", "merged.exr", "-o", "merged.png"], &parts[..]].concat());
        let whole = bits(&desk, "whole.exr");
        assert!(whole.len() >= 3 && whole == bits(&desk, "merged.exr"), "{common:?}");
        assert!(desk.path("merged.png").exists());
    }
}

/// What lets a render survive.
const KEPT: [&str; 5] = ["--checkpoint=c.snell", "--checkpoint-interval=1ms", "--resume", "-o", "resumed.exr"];

/// Runs a render that is killed as soon as it has kept something; returns whether it met one that ran.
fn killed(desk: &Desk, render: &[&str]) -> bool {
    let modified = || desk.path("c.snell").metadata().and_then(|m| m.modified()).ok();
    let before = modified();
    let mut running = desk.command().args(render).args(KEPT).stderr(Stdio::null()).spawn().unwrap();
    while running.try_wait().unwrap().is_none() && modified() == before {
        std::thread::sleep(Duration::from_millis(1));
    }
    let met = running.try_wait().unwrap().is_none();
    running.kill().unwrap();
    running.wait().unwrap();
    met
}

/// Killed again and again, whenever it has kept something.
#[test]
fn a_killed_render_goes_on_to_the_same_bits() {
    let desk = Desk::new();
    desk.succeeds(&[&RICH[..], &["-o", "whole.exr"]].concat());
    let kept = KEPT;
    for _ in 0..3 {
        killed(&desk, &RICH);
    }
    assert!(desk.path("c.snell").exists());
    let resumed = desk.succeeds(&[&RICH[..4], &["--reuse=on", RICH[6]], &kept].concat());
    assert!(String::from_utf8_lossy(&resumed.stderr).contains("resuming c.snell after "));
    assert_eq!(bits(&desk, "whole.exr"), bits(&desk, "resumed.exr"));
    // It stays, and nothing is left to do.
    desk.succeeds(&[&RICH[..], &kept].concat());
    assert_eq!(bits(&desk, "whole.exr"), bits(&desk, "resumed.exr"));
    assert_eq!(desk.files(), ["c.snell", "resumed.exr", "whole.exr"]);
}

/// A room under a wide filter, so that blocks have borders, with samples around the picture.
fn filtered(desk: &Desk) {
    let room = scene_text(
        r#"<shape type="sphere"><float name="radius" value="9"/><boolean name="flip_normals" value="true"/>
        <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape><shape type="sphere"/>"#,
    );
    let film = r#"<boolean name="sample_border" value="true"/><rfilter type="gaussian"/>"#;
    let room = room.replace(r#"<rfilter type="box"/>"#, film);
    assert!(room.contains(film));
    fs::write(desk.path("filtered.xml"), room).unwrap();
}

/// Whatever decides where samples go is kept, too: in the first pass, within later ones, and between them.
#[test]
fn a_killed_adaptive_render_goes_on_to_the_same_bits() {
    let everything = "--aov=albedo,normal,depth,primitive,samples,error";
    let plain = ["render", SCENE, "-Dres=30", "--spp=100", "-q", "--adaptive", "--reuse=off", "--max-depth=4"];
    let wide = ["render", "filtered.xml", "--size=21x26", "--spp=90", "-q", "--adaptive", everything];
    let shared = ["render", SCENE, "-Dres=30", "-q", "--target-error=6%", "--reuse=on", everything];
    // The ball in even light is not worth two sequences.
    for (common, minimum, adaptive) in [(&plain[..], 3, true), (&wide, 9, false), (&shared, 9, true)] {
        let desk = Desk::new();
        filtered(&desk);
        desk.succeeds(&[common, &["-o", "whole.exr", "--stats=s.json"]].concat());
        let stats: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap();
        assert_eq!(stats["adaptive"], adaptive, "{common:?}");
        let taken = || -> String {
            let record = sums_file::read(&desk.path("c.snell")).unwrap().record;
            record.split_once(r#""taken":"#).unwrap().1.split(',').next().unwrap().into()
        };
        let mut stages = Vec::new();
        for _ in 0..3 {
            if killed(&desk, common) {
                stages.push(taken());
            }
            // And stopped by a signal, which keeps what is done up to then, with the interval by default.
            let seldom = [common, &["--checkpoint=c.snell", "--resume", "-o", "resumed.exr"]].concat();
            let mut running = desk.command().args(seldom).spawn().unwrap();
            std::thread::sleep(Duration::from_millis(60));
            // The shell's own `kill`: the program of that name is not everywhere.
            Command::new("sh").args(["-c", "kill -TERM \"$0\"", &running.id().to_string()]).status().unwrap();
            running.wait().unwrap();
        }
        desk.succeeds(&[common, &KEPT].concat());
        let whole = bits(&desk, "whole.exr");
        assert!(whole.len() >= minimum && whole == bits(&desk, "resumed.exr"), "{common:?} {stages:?}");
        // It stays, and nothing is left to do.
        fs::remove_file(desk.path("resumed.exr")).unwrap();
        desk.succeeds(&[common, &KEPT].concat());
        assert_eq!(whole, bits(&desk, "resumed.exr"));
        println!("{common:?}: {stages:?}");
    }
}

/// A render of one sequence that time ended goes on to what it would have been, whatever numbers its passes had.
#[test]
fn an_even_render_goes_on_where_time_ended_it() {
    let everything = "--aov=albedo,normal,depth,primitive,samples,error";
    let common =
        ["render", "filtered.xml", "--size=21x26", "--spp=3000", "-q", "--adaptive", everything, "--stats=s.json"];
    let desk = Desk::new();
    filtered(&desk);
    let stats = || -> serde_json::Value { serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap() };
    desk.succeeds(&[&common[..], &["-o", "whole.exr"]].concat());
    let all = stats()["samples"].as_u64().unwrap();
    let kept = [&common[..], &["--checkpoint=c.snell", "--resume", "-o", "resumed.exr"]].concat();
    let mut taken = Vec::new();
    for time in ["--time=0.02", "--time=0.05", "--time=0.1"] {
        desk.succeeds(&[&kept[..], &[time]].concat());
        let stats = stats();
        assert_eq!((&stats["adaptive"], stats["complete"].as_bool()), (&false.into(), Some(true)), "{stats}");
        taken.push(stats["samples"].as_u64().unwrap());
    }
    assert!(taken.is_sorted() && taken[0] > 0 && taken[0] < all, "{taken:?} of {all}");
    desk.succeeds(&kept);
    assert_eq!((stats()["samples"].as_u64(), &stats()["ended_by"]), (Some(all), &"samples".into()));
    let whole = bits(&desk, "whole.exr");
    assert!(whole.len() >= 9 && whole == bits(&desk, "resumed.exr"), "{taken:?}");
}

#[test]
fn an_adaptive_checkpoint_goes_on_to_a_lower_target_and_serves_no_other_render() {
    let desk = Desk::new();
    let common = ["render", SCENE, "-Dres=24", "--stats=s.json", "--checkpoint=c.exr", "--resume", "-oa.exr"];
    let with = |more: &[&'static str]| [&common, more].concat();
    let samples = || {
        let stats: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap();
        assert_eq!(stats["ended_by"], "error");
        stats["samples"].as_u64().unwrap()
    };
    desk.succeeds(&with(&["--target-error=20%"]));
    let first = samples();
    let output = desk.succeeds(&with(&["--target-error=8%", "--confidence=90%", "--time=1h"]));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains(&format!("resuming c.exr after {first} samples")), "{said}");
    assert!(said.contains("the target error is reached"), "{said}");
    let second = samples();
    assert!(second > first);
    // A higher one is reached already.
    desk.succeeds(&with(&["--target-error=10%"]));
    assert_eq!(samples(), second);
    let refuses = |more: &[&'static str], expected: &str| {
        desk.refuses(&with(more), &["c.exr: this checkpoint is of another render: ", expected]);
    };
    refuses(&["--target-error=1%", "--seed=9"], "seed: 0, not 9");
    refuses(&["--target-error=1%", "--spp=64"], "spp: no limit, not 64");
    refuses(&["--spp=64"], "it is of --adaptive or --target-error, and goes on with these only");
    desk.refuses(
        &["merge", "c.exr", "-o", "m.exr"],
        &["c.exr: this is no part of a picture: it is of a render with --adaptive or --target-error"],
    );
    // Whatever is claimed is checked.
    falsify(&desk, "c.exr", r#""taken":"#, r#""taken":9"#);
    let contradiction = "c.exr: cannot read the sums of a render: the record contradicts itself or the file";
    desk.refuses(&with(&["--target-error=1%"]), &[contradiction]);
    fs::remove_file(desk.path("c.exr")).unwrap();
    // One sequence of samples does not tell well enough when a target is reached.
    filtered(&desk);
    let even = ["render", "filtered.xml", "--size=9x9", "--spp=8", "--checkpoint=c.exr", "--resume", "-oa.exr"];
    desk.succeeds(&[&even[..], &["--adaptive"]].concat());
    let alone = ["c.exr: it has one sequence of samples", "it goes on with --adaptive only"];
    desk.refuses(&[&even[..], &["--target-error=1%"]].concat(), &alone);
    fs::remove_file(desk.path("c.exr")).unwrap();
    desk.succeeds(&with(&["--spp=2"]));
    let equal = "it has as many samples in every pixel: it cannot go on with --adaptive or --target-error";
    refuses(&["--spp=4", "--adaptive"], equal);
}

#[test]
fn a_checkpoint_serves_its_own_render_only() {
    let desk = Desk::new();
    let scene = |radius: &str| {
        scene_text(&format!(
            r#"<default name="n" value="1"/><shape type="sphere"><float name="radius" value="{radius}"/></shape>"#
        ))
    };
    fs::write(desk.path("s.xml"), scene("1")).unwrap();
    fs::write(desk.path("other.xml"), scene("1")).unwrap();
    let kept = ["--checkpoint", "c.snell", "--resume", "-o", "a.exr"];
    let first = desk.succeeds(&[&["render", "s.xml", "--spp=4"][..], &kept].concat());
    assert!(String::from_utf8_lossy(&first.stderr).contains("there is no c.snell yet: beginning afresh"));
    let refuses = |arguments: &[&str], expected: &[&str]| {
        let expected = [&["c.snell: this checkpoint is of another render: "], expected].concat();
        desk.refuses(&[&["render"], arguments, &kept].concat(), &expected);
    };
    refuses(&["s.xml", "--spp=4", "--time=1h"], &["ends by time: false, not true"]);
    refuses(&["s.xml", "--spp=8"], &["samples of each pixel: 0 to 3, not 0 to 7; spp: 4, not 8"]);
    refuses(&["s.xml", "--spp=4", "--seed=9", "--max-depth=3"], &["max-depth: no limit, not 3; seed: 0, not 9"]);
    refuses(&["other.xml", "--spp=4"], &["scene: s.xml, not other.xml; s.xml is not read; other.xml is read, too"]);
    refuses(&["s.xml", "--spp=4", "--shard=1/2"], &["samples of each pixel: 0 to 3, not 0 to 1"]);
    refuses(
        &["s.xml", "--spp=5", "--seed=9", "--max-depth=3", "--crop=0,0,2,2", "--sampler=stratified", "--size=9x9"],
        &["crop: 0,0,8,8, not 0,0,2,2; ", "; and 2 more"],
    );
    fs::write(desk.path("s.xml"), scene("2")).unwrap();
    refuses(&["s.xml", "--spp=4"], &["s.xml has changed"]);
}

#[test]
fn no_checkpoint_is_lost_or_taken_for_what_it_is_not() {
    let desk = Desk::new();
    fs::write(desk.path("s.xml"), scene_text("")).unwrap();
    let render = |more: &[&'static str]| [&["render", "s.xml", "--spp=2", "-q", "-o", "a.exr"], more].concat();
    let kept = ["--checkpoint", "c.exr"];
    desk.succeeds(&render(&kept));
    fs::remove_file(desk.path("a.exr")).unwrap();
    desk.refuses(
        &render(&kept),
        &["c.exr: there is a checkpoint already: add --resume to go on from it, or delete it"],
    );
    desk.refuses(
        &render(&["--checkpoint", "none/c.exr"]),
        &["cannot write the checkpoint: the folder none does not exist"],
    );
    desk.refuses(&render(&["--checkpoint", "a.exr"]), &["a.exr: the checkpoint needs a file of its own"]);
    desk.refuses(&render(&["--checkpoint", "s.xml", "--resume"]), &["s.xml: the checkpoint needs a file of its own"]);
    let whole = fs::read(desk.path("c.exr")).unwrap();
    let resume = [&kept[..], &["--resume"]].concat();
    for (bytes, expected) in [
        (&whole[..whole.len() - 1], "cannot read the sums of a render: the file is damaged"),
        (b"words", "this is not a file that a render left with --checkpoint or --shard"),
    ] {
        fs::write(desk.path("c.exr"), bytes).unwrap();
        desk.refuses(&render(&resume), &["c.exr: ", expected]);
    }
    for (arguments, expected) in [
        (&["--resume"][..], "--checkpoint <FILE>"),
        (&["--shard", "3/2"], "expected I/N with I from 1 to N, for example 1/4"),
        (&["--shard", "1/3"], "--shard: 2 samples a pixel cannot be cut into 3 parts"),
    ] {
        let output = desk.snell(&render(arguments));
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains(expected), "{arguments:?}");
    }
    desk.refuses(
        &["render", "s.xml", "--spp=2", "--shard=1/2", "-o", "a.png"],
        &["a.png: a shard needs an output whose name ends in .exr: no other can hold its sums"],
    );
}

/// Changes what a file of sums says of itself, and makes it look unharmed.
fn falsify(desk: &Desk, name: &str, from: &str, to: &str) {
    let mut image = read_all_flat_layers_from_file(desk.path(name)).unwrap();
    let layer = &mut image.layer_data[0];
    let planes: Vec<Plane> = layer
        .channel_data
        .list
        .iter()
        .filter_map(|channel| match &channel.sample_data {
            FlatSamples::U32(v) => {
                Some(Plane { name: channel.name.to_string(), values: PlaneValues::Whole(v.clone()) })
            }
            _ => None,
        })
        .collect();
    let attributes = &mut layer.attributes.other;
    let Some(AttributeValue::Text(record)) = attributes.get(&Text::from("snell.record")) else { panic!("no record") };
    let changed = record.to_string().replacen(from, to, 1);
    assert_ne!(changed, record.to_string());
    let mut metadata = Metadata::default();
    sums_file::seal(&mut metadata, &changed, &planes);
    let texts = metadata.texts.iter();
    attributes.extend(texts.map(|(n, v)| (Text::from(n.as_str()), AttributeValue::Text(Text::from(v.as_str())))));
    image.write().to_file(desk.path(name)).unwrap();
}

#[test]
fn what_a_file_says_of_itself_is_checked() {
    let desk = Desk::new();
    fs::write(desk.path("s.xml"), scene_text("")).unwrap();
    let kept = ["render", "s.xml", "--spp=2", "-q", "-o", "a.exr", "--checkpoint", "c.exr", "--resume"];
    desk.succeeds(&kept);
    falsify(&desk, "c.exr", r#""missing":[]"#, r#""missing":[7]"#);
    desk.refuses(&kept, &["c.exr: the checkpoint contradicts itself"]);
    desk.succeeds(&["render", "s.xml", "--spp=2", "-q", "--shard=1/1", "-o", "p.exr"]);
    falsify(&desk, "p.exr", r#""complete":true"#, r#""complete":false"#);
    desk.refuses(
        &["merge", "p.exr", "-o", "m.exr"],
        &["p.exr: this part is not finished: resume it, or render it again"],
    );
}

/// Where a checkpoint cannot be written the render goes on, and ends well if only the last one can.
#[test]
#[cfg(target_os = "linux")]
fn a_checkpoint_that_cannot_be_written_is_no_end() {
    let desk = Desk::new();
    fs::create_dir(desk.path("kept")).unwrap();
    let long = ["render", SCENE, "-Dres=64", "--spp=600", "--max-depth=2", "-v", "-oout.exr", "--checkpoint=kept/c"];
    let mut command = desk.command();
    command.args(long).arg("--checkpoint-interval=100ms").stderr(Stdio::piped());
    let mut running = command.spawn().unwrap();
    let mut lines = BufReader::new(running.stderr.take().unwrap());
    let mut told = String::new();
    while !told.contains("loaded in") {
        assert!(lines.read_line(&mut told).unwrap() > 0, "{told}");
    }
    fs::rename(desk.path("kept"), desk.path("away")).unwrap();
    lines.read_to_string(&mut told).unwrap();
    // The last one is lost, and that is said; the picture is there.
    assert_eq!(running.wait().unwrap().code(), Some(2), "{told}");
    assert!(told.contains("error: kept/c: cannot write the checkpoint: the folder kept does not exist"), "{told}");
    assert!(told.contains("; it will be tried again"), "{told}");
    assert_eq!(desk.files(), ["away", "out.exr"]);
}

#[test]
fn what_is_not_all_of_one_render_is_not_merged() {
    let desk = Desk::new();
    fs::write(desk.path("s.xml"), scene_text("")).unwrap();
    let common = ["render", "s.xml", "--spp=8", "-q"];
    shards(&desk, &common, "p", 4);
    shards(&desk, &[&common[..], &["--seed=7"]].concat(), "other", 4);
    shards(&desk, &common, "half", 2);
    desk.succeeds(&[&common[..], &["-o", "plain.exr"]].concat());
    for (parts, expected) in [
        ("p-1 p-2 p-4", "p-4.exr: samples 4 to 5 of each pixel are in none of the parts"),
        ("p-2 p-3 p-4", "p-2.exr: samples 0 to 1 of each pixel are in none of the parts"),
        ("p-1 p-2", "p-2.exr: samples 4 to 7 of each pixel are in none of the parts"),
        ("p-1 p-2 p-3 p-4 p-3", "p-3.exr: samples 4 to 5 are in p-3.exr, too"),
        ("half-1 p-2 p-3 p-4", "p-2.exr: samples 2 to 3 are in half-1.exr, too"),
        ("p-1 p-2 p-3 other-4", "other-4.exr: this is of another render than p-1.exr: seed: 0, not 7"),
        ("plain", "plain.exr: cannot read the sums of a render: this is not a file that a render left with"),
        ("none", "none.exr: cannot read the sums of a render: No such file"),
    ] {
        let parts: Vec<String> = parts.split(' ').map(|p| format!("{p}.exr")).collect();
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        desk.refuses(&[&["merge", "-o", "merged.exr"], &parts[..]].concat(), &[expected]);
    }
    desk.refuses(
        &["merge", "p-1.exr", "-o", "p-1.exr"],
        &["p-1.exr: cannot write the picture: this is one of the shards"],
    );
    desk.refuses(&["merge", "p-1.exr", "-o", "a.exr", "-o", "a.exr"], &["a.exr is to be written twice"]);
    // Coarser and finer cuts go together where they fit.
    desk.succeeds(&["merge", "-q", "-o", "merged.exr", "half-1.exr", "p-3.exr", "p-4.exr"]);
    assert_eq!(bits(&desk, "merged.exr"), bits(&desk, "plain.exr"));
}
