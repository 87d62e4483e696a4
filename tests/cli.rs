//! The command as a user meets it: exit codes, messages, files.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod desk;

use desk::*;
use std::fs;

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
    let told = desk.succeeds(&["render", SCENE, "-Dres=8", "--spp", "1", "-v"]).stderr;
    let told = String::from_utf8_lossy(&told).into_owned();
    for part in ["loaded in ", " s, ", " built in ", "\nrendered ", "samples/s, ", "rays/s\n", "wrote scene.exr\n"] {
        assert!(told.contains(part), "{part} in\n{told}");
    }
    assert_eq!(desk.files(), ["scene.exr"]);
}

#[test]
fn info_lists_textures_and_what_is_not_used() {
    let desk = Desk::new();
    let mut picture = image::RgbImage::new(4, 3);
    picture.put_pixel(1, 2, image::Rgb([255, 0, 0]));
    picture.save(desk.path("p.png")).unwrap();
    let bitmap = |name: &str, file: &str| {
        format!(r#"<texture {name} type="bitmap"><string name="filename" value="{file}"/></texture>"#)
    };
    let shape = |texture: &str| format!(r#"<shape type="rectangle"><bsdf type="diffuse">{texture}</bsdf></shape>"#);
    let text = scene_text(&format!(
        r#"{}{}<bsdf type="plastic" id="spare"><rgb name="diffuse_reflectance" value="0.1"/></bsdf>{}"#,
        shape(&bitmap(r#"name="reflectance""#, "p.png")),
        shape(r#"<texture name="reflectance" type="checkerboard"/>"#),
        bitmap(r#"id="unread""#, "there-is-no-such-file.png"),
    ));
    fs::write(desk.path("s.xml"), text).unwrap();
    let text = String::from_utf8(desk.succeeds(&["info", "s.xml"]).stdout).unwrap();
    for part in [
        "plugins      bsdf: 2 diffuse\n",
        "plugins      shape: 2 rectangle\n",
        "plugins      texture: 1 bitmap, 1 checkerboard\n",
        "texture      4x3 8-bit RGB, 0.0 MiB, ",
        "p.png\n",
        "texture      1 without a picture\n",
        "not used     bsdf 'plastic' 'spare' (s.xml:",
        "not used     texture 'bitmap' 'unread' (s.xml:",
        "), 'there-is-no-such-file.png' is not read\n",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
}

#[test]
fn info_and_replay_print_and_write_nothing() {
    let desk = Desk::new();
    let info = desk.snell(&["info", SCENE, "-Dres=16"]);
    let text = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(info.status.success() && text.contains("16x16 pixels") && text.contains("triangles"), "{text}");
    for part in ["plugins      bsdf: ", " diffuse", "memory       ", ": meshes 0.0 MiB, textures 0.0 MiB, accelerator "]
    {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    let replay = desk.snell(&["render", SCENE, "-Dres=16", "--replay", "8,8,3"]);
    let text = String::from_utf8_lossy(&replay.stdout).into_owned();
    assert!(replay.status.success() && text.contains("vertex 1: from (278, 273.0") && text.contains("ends"), "{text}");
    for part in [
        ") along (",
        ") to (",
        ") on shape ",
        "  light sampled: (",
        "  light sample visible",
        "  goes on with throughput (",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    assert!(desk.files().is_empty());
    fs::write(desk.path("sky.xml"), scene_text(r#"<emitter type="constant"/>"#)).unwrap();
    let replay = desk.snell(&["render", SCENE, "-Dres=16", "--replay", "8,8,3", "--reuse=on"]);
    assert!(String::from_utf8_lossy(&replay.stdout).contains("\nshared with neighbours\nradiance ("));
    for (reuse, what, light_samples, many) in [
        ("on", "share", "1", "1 light sample"),
        ("eights", "share, eight together,", "1", "1 light sample"),
        ("off", "keep", "4", "4 light samples"),
    ] {
        let options = ["--reuse", reuse, "--light-samples", light_samples];
        let render = ["render", SCENE, "-Dres=8", "--spp=1", "-v", "-o", "r.exr"];
        let told = desk.succeeds(&[&render[..], &options].concat()).stderr;
        fs::remove_file(desk.path("r.exr")).unwrap();
        let expected = format!("neighbouring pixels {what} what their paths find; {many} at the first hit\n");
        assert!(String::from_utf8_lossy(&told).contains(&expected), "{told:?}");
    }
    let replay = desk.snell(&["render", "sky.xml", "--replay", "1,2,0"]);
    let text = String::from_utf8_lossy(&replay.stdout).into_owned();
    assert!(text.contains(") nothing is met") && text.contains("  light found: (1, 1, 1) with weight 1\n"), "{text}");
}

/// A sphere around the camera that reflects more than it gets.
fn impossible_room(radiance: &str, reflectance: &str) -> String {
    scene_text(&format!(
        r#"<shape type="sphere"><float name="radius" value="9"/><boolean name="flip_normals" value="true"/>
        <bsdf type="diffuse"><float name="reflectance" value="{reflectance}"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>"#
    ))
}

#[test]
fn samples_that_are_left_out_are_counted_by_what_is_wrong_and_can_be_seen() {
    let desk = Desk::new();
    for (radiance, reflectance, key, message) in [
        ("3e38", "4", "non_finite_samples", "warning: 64 samples were not finite and were left out"),
        (
            "1",
            "1e12",
            "oversized_samples",
            "64 samples were more than 2^31 times as bright as the brightest light and were",
        ),
    ] {
        fs::write(desk.path("room.xml"), impossible_room(radiance, reflectance)).unwrap();
        let arguments = ["render", "room.xml", "--spp=1", "--max-depth=2", "--seed=7", "-oa.exr", "--stats=s.json"];
        let told = String::from_utf8_lossy(&desk.succeeds(&arguments).stderr).into_owned();
        assert!(told.contains(message) && told.contains("\nto see them:\n"), "{told}");
        let stats: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap();
        assert_eq!(
            (&stats[key], &stats["dropped_examples"][0]),
            (&64.into(), &serde_json::json!([0, 0, 0])),
            "{stats}"
        );
        // The line is a command as it stands.
        let line = told.lines().find(|line| line.contains("--replay 0,0,0")).unwrap();
        let output = desk.succeeds(&shlex::split(line).unwrap()[1..]);
        assert!(String::from_utf8_lossy(&output.stdout).contains("radiance ("), "{output:?}");
    }
}

#[test]
fn what_cannot_be_written_is_noticed_before_rendering() {
    let desk = Desk::new();
    // So many samples that a render would never end.
    let endless = ["render", SCENE, "--spp", "4000000000"];
    let with = |extra: &[&'static str]| [&endless[..], extra].concat();
    desk.refuses(&with(&["-o", "nowhere/a.exr"]), &["nowhere/a.exr", "does not exist"]);
    desk.refuses(
        &with(&["-o", "a.tga"]),
        &["a.tga: cannot tell the format from the name: expected a name ending in .exr or .png"],
    );
    desk.refuses(&with(&["-o", "a.exr", "-o", "nowhere/b.png"]), &["nowhere/b.png"]);
    desk.refuses(&with(&["-o", "a.exr", "--stats", "nowhere/s.json"]), &["nowhere"]);
    fs::create_dir(desk.path("folder.exr")).unwrap();
    desk.refuses(&with(&["-o", "folder.exr"]), &["folder.exr: cannot write the picture: this is a folder"]);
    desk.refuses(&with(&["-o", "a.exr", "--stats", "folder.exr"]), &["cannot write the statistics: this is a folder"]);
    fs::write(desk.path("own.xml"), scene_text("")).unwrap();
    desk.refuses(
        &["render", "own.xml", "--stats", "./own.xml"],
        &["own.xml: cannot write the statistics: this is the scene"],
    );
}

#[cfg(unix)]
#[test]
fn names_may_be_long_or_no_text_or_links() {
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::{PermissionsExt, symlink};
    let desk = Desk::new();
    let long = format!("{}.exr", "a".repeat(250));
    desk.succeeds(&["render", SCENE, "-Dres=8", "--spp=1", "-q", "-o", &long]);
    assert_eq!(desk.files(), [long]);
    fs::write(desk.path("target.png"), "old").unwrap();
    fs::set_permissions(desk.path("target.png"), fs::Permissions::from_mode(0o600)).unwrap();
    symlink("target.png", desk.path("link.png")).unwrap();
    desk.succeeds(&["render", SCENE, "-Dres=8", "--spp=1", "-q", "-o", "link.png"]);
    assert!(desk.path("link.png").is_symlink(), "a link stays a link");
    assert!(fs::read(desk.path("target.png")).unwrap().starts_with(b"\x89PNG"), "what it leads to is written");
    assert_eq!(desk.path("target.png").metadata().unwrap().permissions().mode() & 0o777, 0o600, "still private");
    let name = std::ffi::OsStr::from_bytes(b"no\xfftext.xml");
    fs::write(desk.path("").join(name), scene_text(r#"<shape type="sphere"/>"#)).unwrap();
    desk.succeeds(&["render".as_ref(), name, "--spp=1".as_ref(), "-o".as_ref(), "q.exr".as_ref()]);
    assert!(desk.path("q.exr").is_file());
}

#[cfg(target_os = "linux")]
#[test]
fn a_read_only_folder_is_noticed_before_rendering() {
    // Also for the superuser, whom no mode of a folder stops.
    Desk::new()
        .refuses(&["render", SCENE, "--spp", "4000000000", "-o", "/proc/a.exr"], &["/proc/a.exr", "cannot write"]);
}

/// Opening a pipe would wait for its other end.
#[cfg(unix)]
#[test]
fn a_pipe_is_no_scene_and_no_mesh() {
    let desk = Desk::new();
    assert!(std::process::Command::new("mkfifo").arg(desk.path("pipe.ply")).status().unwrap().success());
    desk.refuses(&["render", "pipe.ply"], &["pipe.ply", "not a regular file"]);
    desk.refuses(&["diff", "pipe.ply", "pipe.ply"], &["pipe.ply", "not a regular file"]);
    fs::write(
        desk.path("mesh.xml"),
        scene_text(r#"<shape type="ply"><string name="filename" value="pipe.ply"/></shape>"#),
    )
    .unwrap();
    desk.refuses(&["render", "mesh.xml"], &["mesh.xml:3:", "pipe.ply", "not a regular file"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_film_larger_than_memory_is_refused() {
    let desk = Desk::new();
    fs::write(desk.path("s.xml"), scene_text(r#"<shape type="sphere"/>"#)).unwrap();
    let line = format!("ulimit -v 4000000; exec {} render s.xml --size 16384x16384", env!("CARGO_BIN_EXE_snell"));
    let output = std::process::Command::new("sh").args(["-c", &line]).current_dir(desk.path("")).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && told.contains("no memory for so many pixels"), "{told}");
    assert_eq!(desk.files(), ["s.xml"]);
}

#[cfg(feature = "embree")]
#[test]
fn accelerators_are_compared_in_numbers() {
    let desk = Desk::new();
    // A trial of sharing would trace rays of its own, which are compared, too.
    let output = desk.succeeds(&[
        "render",
        SCENE,
        "-Dres=16",
        "--spp=2",
        "--accel=both",
        "--reuse=off",
        "--light-samples=1",
        "--stats=s.json",
    ]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap();
    let compared = &stats["accelerator_comparison"];
    let rays = stats["rays"].as_object().unwrap().values().map(|v| v.as_u64().unwrap()).sum::<u64>();
    assert_eq!(compared["rays"], rays, "{stats}");
    assert_eq!((&compared["native_false"], &compared["native_misses"]), (&0.into(), &0.into()), "{stats}");
    assert!(
        told.contains(&format!("compared {rays} rays: 0 ties, ")) && told.contains(" and 0 (native), false hits "),
        "{told}"
    );
    desk.succeeds(&["render", SCENE, "-Dres=16", "--spp=2", "--accel=native", "--stats=s.json", "-q"]);
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap();
    assert!(stats.get("accelerator_comparison").is_none() && stats.get("embree_false_hits").is_none(), "{stats}");
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
        ("later.xml", scene_text(r#"<shape type="sdfgrid"/>"#), &["later.xml:3:", "sdfgrid", "not supported yet"]),
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
    desk.refuses(&["render", SCENE, "--crop", "0,0,9999,1"], &["--crop reaches outside the picture, which is"]);
    desk.refuses(&["render", SCENE, "--camera", "3"], &["camera 3"]);
    desk.refuses(
        &["render", SCENE, "--replay", "9999,0,0"],
        &["--replay: pixel 9999,0 is outside the picture, which is"],
    );
    desk.refuses(&["render", SCENE, "-Dnonsense=1"], &["nonsense"]);
    desk.refuses(&["render", SCENE, "-o", "a.exr", "-o", "a.exr"], &["a.exr is to be written twice"]);
    desk.refuses(&["render", SCENE, "-o", "a.exr", "--stats", "a.exr"], &["a.exr", "twice"]);
    desk.refuses(
        &["render", SCENE, "-o", "a.png", "--aov=depth"],
        &["--aov needs an output whose name ends in .exr: no other can hold its channels"],
    );
    for count in ["48", "8388608"] {
        desk.refuses(
            &["render", SCENE, "--sampler=zsobol", "--spp", count],
            &[
                "--sampler zsobol needs a power of two up to 4194304 for the number of samples, which is",
                count,
                ": expected another --spp, or --sampler sobol",
            ],
        );
    }
    desk.refuses(&["render", SCENE, "--aov=depth,uv,depth"], &["two channels of the picture would be called 'Z'"]);
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

/// Of these the parser of arguments tells in several lines.
#[test]
fn values_of_arguments_say_what_they_should_be() {
    let desk = Desk::new();
    let rows: [(&[&str], &str); 12] = [
        (
            &["render", SCENE, "--aov=albedo,colour"],
            "expected some of albedo, normal, shading_normal, depth, position, uv, primitive, shape, material, samples, error, separated by commas",
        ),
        (&["render", SCENE, "--env-visible=maybe"], "invalid value 'maybe'"),
        (&["render", SCENE, "-Dres"], "expected NAME=VALUE"),
        (&["render", SCENE, "--size=0x9"], "expected WIDTHxHEIGHT in pixels, for example 640x480"),
        (&["render", SCENE, "--crop=1,2,3"], "expected X,Y,WIDTH,HEIGHT in pixels, for example 10,20,64,64"),
        (&["render", SCENE, "--replay=1,2"], "expected X,Y,SAMPLE, for example 10,20,0"),
        (&["render", SCENE, "--exposure=inf"], "expected a finite number"),
        (&["render", SCENE, "--accel=embre"], "a similar value exists: 'embree'"),
        (&["render", SCENE, "--light-samples=3"], "expected 'auto' or a power of two up to 16"),
        (&["render", SCENE, "--light-samples=32"], "expected 'auto' or a power of two up to 16"),
        (&["render", SCENE, "--max-depth=-2"], "-2 is not in -1..=4294967295"),
        (
            &["diff", "a.exr", "b.exr", "--fail=rmse=1"],
            "expected METRIC=VALUE with one of the metrics mse, relmse, psnr",
        ),
    ];
    for (arguments, expected) in rows {
        let output = desk.snell(arguments);
        let told = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(output.status.code() == Some(2) && told.contains(expected), "{arguments:?}: {told}");
    }
    desk.refuses(
        &["render", SCENE, "--size=2000000x1"],
        &["--size: 2000000 pixels a side are too many; at most 1000000"],
    );
    desk.refuses(&["render", SCENE, "--size=100000x100000"], &["--size: 10000000000 pixels are too many"]);
}

#[cfg(not(feature = "embree"))]
#[test]
fn embree_is_refused_where_it_is_not() {
    let expected = "this snell was built without Embree; use --accel native or auto";
    Desk::new().refuses(&["render", SCENE, "--accel=embree"], &[expected]);
    Desk::new().refuses(&["render", SCENE, "--accel=both"], &[expected]);
}

#[test]
fn help_and_version_succeed() {
    let desk = Desk::new();
    for arguments in [&["--help"][..], &["--version"], &["render", "--help"]] {
        let output = desk.snell(arguments);
        assert!(output.status.success() && !output.stdout.is_empty(), "{arguments:?}");
    }
}

#[test]
fn completions_are_scripts() {
    let desk = Desk::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = desk.snell(&["completions", shell]);
        let script = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && script.contains("render") && script.contains("spp"), "{shell}");
    }
    assert_eq!(desk.snell(&["completions", "tcsh"]).status.code(), Some(2));
}
