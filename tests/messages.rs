//! Every message that a user can meet: what causes it, and that it says what it should.
//!
//! Whole files that are wrong lie in `tests/data/bad`; arguments are tested in `tests/cli.rs`. What remains is here, in
//! tables; `tests/every_message.rs` finds messages that are in none.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod common;

use common::{compiled, diffuse, enclosure};
use glam::{DAffine3, DMat3, DVec3};
use snell::accel::Accelerator;
use snell::description::*;
use snell::loader::{LoadOptions, load};
use snell::scene::compile::{CompileOptions, compile};
use snell::spectrum::Rgb;
use std::fs;

const FILM: &str = r#"<film type="hdrfilm"><rfilter type="box"/></film>"#;
const BALL: &str = r#"<shape type="sphere"/>"#;

fn scene_with(body: &str) -> String {
    format!(r#"<scene version="3.0.0"><sensor type="perspective">{FILM}</sensor>{body}</scene>"#)
}

fn scene_with_sensor(inside: &str) -> String {
    format!(r#"<scene version="3.0.0"><sensor type="perspective">{inside}</sensor>{BALL}</scene>"#)
}

fn ball(inside: &str) -> String {
    format!(r#"<shape type="sphere">{inside}</shape>"#)
}

/// Loads and compiles a scene among these files: its warnings, or what is wrong.
fn outcome(text: &str, files: &[(&str, &str)], lenient: bool) -> Result<Vec<String>, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let path = folder.path().join("scene.xml");
    fs::write(&path, text).unwrap();
    let options = LoadOptions { lenient, ..Default::default() };
    let description = load(&path, &options).map_err(|e| e.to_string())?;
    let mut warnings = description.warnings.clone();
    warnings.extend(compile_native(&description)?);
    Ok(warnings)
}

fn compile_native(description: &SceneDescription) -> Result<Vec<String>, String> {
    let options =
        CompileOptions { accelerator: Accelerator::Native, quality: None, threads: 1, camera: 0, samples: None };
    compile(description, &options).map(|compiled| compiled.warnings).map_err(|e| e.to_string())
}

/// Every row's text must be refused with its message.
fn all_refused(rows: &[(String, &str)], files: &[(&str, &str)]) {
    for (text, expected) in rows {
        let error = outcome(text, files, false).expect_err(expected);
        assert!(error.contains(expected), "{text}\n{error}\nexpected: {expected}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn too_many_channels_are_refused() {
    let nested = |depth: usize| {
        let (start, end) = (r#"<integrator type="aov"><string name="aovs" value=""/>"#.repeat(depth), "</integrator>");
        scene_with(&format!("{start}<integrator type=\"path\"/>{}{BALL}", end.repeat(depth)))
    };
    assert_eq!(outcome(&nested(4), &[], false), Ok(vec![]));
    let many: Vec<String> = (0..100).map(|i| format!("p{i}:position")).collect();
    let many = format!(r#"<integrator type="aov"><string name="aovs" value="{}"/></integrator>"#, many.join(","));
    let rows = [
        (nested(5), "integrators are nested more than 4 deep"),
        (scene_with(&(many + BALL)), "300 channels are too many; at most 256 can be written"),
    ];
    all_refused(&rows, &[]);
}

#[test]
fn wrong_parameters_are_refused() {
    let bsdf = |inside: &str| ball(&format!(r#"<bsdf type="roughconductor">{inside}</bsdf>"#));
    let ggx = r#"<string name="distribution" value="ggx"/>"#;
    let float = |name: &str, value: &str| format!(r#"<float name="{name}" value="{value}"/>"#);
    let two_sided = |inside: &str| ball(&format!(r#"<bsdf type="twosided">{inside}</bsdf>"#));
    let radiance = |value: &str| format!(r#"<emitter type="constant">{value}</emitter>"#);
    let reflectance = |value: &str| ball(&format!(r#"<bsdf type="diffuse">{value}</bsdf>"#));
    let rows = [
        (bsdf(&(ggx.to_owned() + &float("alpha_u", "0.1"))), "'alpha_u' needs 'alpha_v'"),
        (bsdf(&(ggx.to_owned() + &float("alpha_v", "0.1"))), "'alpha_v' needs 'alpha_u'"),
        (
            bsdf(&(ggx.to_owned() + &float("alpha", "0.1") + &float("alpha_v", "0.1"))),
            "'alpha' excludes 'alpha_u' and 'alpha_v'",
        ),
        (
            bsdf(&format!(r#"{ggx}<string name="material" value="Cu"/>{}"#, float("eta", "1"))),
            "'material' excludes 'eta' and 'k'",
        ),
        (two_sided(""), "twosided needs a bsdf inside"),
        (two_sided(&r#"<bsdf type="diffuse"/>"#.repeat(3)), "twosided takes at most two bsdfs"),
        (ball(&float("radius", "0")), "the radius of a sphere must be neither zero nor infinite"),
        (ball(r#"<film type="hdrfilm"/>"#), "shape 'sphere' has no use for a film 'hdrfilm'"),
        (radiance(r#"<rgb name="radiance" value="1e39"/>"#), "'radiance' is too large"),
        (radiance(r#"<string name="radiance" value="red"/>"#), "'radiance' must be a colour (<rgb>, <spectrum> or"),
        (radiance(r##"<rgb name="radiance" value="#12345"/>"##), "'#12345' is not of the form #rrggbb"),
        (radiance(r#"<rgb name="radiance" value="1 2"/>"#), "is neither one number nor three"),
        (radiance(r#"<spectrum name="radiance"/>"#), "<spectrum> needs either 'value' or 'filename'"),
        (radiance(r#"<spectrum name="radiance" value="400:1"/>"#), "a spectrum needs at least two wavelengths"),
        (radiance(r#"<spectrum name="radiance" value="400:1 500"/>"#), "'500' is not a wavelength:value pair"),
        (radiance(r#"<spectrum name="radiance" filename="bad.spd"/>"#), "bad.spd:2: expected a wavelength and a value"),
        (radiance(r#"<spectrum name="radiance" filename="."/>"#), "cannot read '"),
        (
            reflectance(r#"<texture name="reflectance" type="uniform"/>"#),
            "texture 'uniform' needs the parameter 'value' (a <float>)",
        ),
        (
            reflectance(r#"<texture name="reflectance" type="rawconstant"/>"#),
            "texture 'rawconstant' needs the parameter 'value' (a <float> or <vector>)",
        ),
        (
            reflectance(r#"<texture name="reflectance" type="srgb"/>"#),
            "texture 'srgb' needs the parameter 'color' (an <rgb>)",
        ),
        (
            r#"<emitter type="constant" id="a"/><ref id="a"/>"#.into(),
            "a second use of the same emitter is not supported yet; write it twice",
        ),
        (ball(r#"<point name="center" value="1 2 3" x="1"/>"#), "'value' and 'x', 'y', 'z' exclude each other"),
        (ball(r#"<point name="center" x="1" y="2"/>"#), "<point> needs the attribute 'z'"),
        (
            ball(r#"<transform name="to_world"><lookat origin="0 0 0" target="0 2 0" up="0 1 0"/></transform>"#),
            "the up vector of <lookat> must not be parallel to the viewing direction",
        ),
        (
            ball(r#"<transform name="to_world"><lookat origin="0 0" target="0 2 0"/></transform>"#),
            "'0 0' is not three numbers",
        ),
    ];
    all_refused(&rows.map(|(body, expected)| (scene_with(&body), expected)), &[("bad.spd", "400 1\n500\n")]);
}

/// A picture of 2×3 pixels in Radiance's format, whose pixels happen to be letters.
const MAP: &str = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 2\nabcdabcdabcdabcdabcdabcd";

#[test]
#[allow(clippy::too_many_lines, reason = "a table")]
fn wrong_lights_are_refused() {
    let light = |plugin: &str, inside: &str| format!(r#"{BALL}<emitter type="{plugin}">{inside}</emitter>"#);
    let named = |name: &str| format!(r#"<string name="filename" value="{name}"/>"#);
    let map = |inside: &str| light("envmap", &(named("m.hdr") + inside));
    let float = |name: &str, value: &str| format!(r#"<float name="{name}" value="{value}"/>"#);
    let to_world = |steps: &str| format!(r#"<transform name="to_world">{steps}</transform>"#);
    let both = to_world("") + r#"<vector name="direction" value="0 0 1"/>"#;
    let rows = [
        (light("envmap", ""), "emitter 'envmap' needs the parameter 'filename' (a <string>)"),
        (light("envmap", &named("none.hdr")), "there is no file 'none.hdr' (looked in "),
        (light("envmap", &named(".")), "is not a regular file"),
        (light("envmap", &named("text.hdr")), "it is none of OpenEXR, Radiance HDR, PNG, JPEG, BMP and TGA"),
        (light("envmap", &named("short.hdr")), "cannot read '"),
        (map(&float("scale", "-1")), "'scale' must not be negative"),
        (map(&float("scale", "1e39")), "'scale' is too large"),
        (map(&to_world(r#"<scale x="2"/>"#)), "the to_world of an envmap may only rotate"),
        (map(r#"<rgb name="radiance" value="1"/>"#), "emitter 'envmap' has no parameter 'radiance'"),
        (map("") + r#"<emitter type="constant"/>"#, "a scene can have only one environment emitter"),
        (format!(r#"<emitter type="constant"/>{}"#, map("")), "a scene can have only one environment emitter"),
        (ball(&map("").replace(BALL, "")), "emitter 'envmap' cannot belong to a shape"),
        (light("directional", &both), "a directional light has a direction or a to_world, not both"),
        (
            light("directional", r#"<vector name="direction" value="0 0 0"/>"#),
            "the direction of a light must be neither zero nor infinite",
        ),
        (light("directional", r#"<rgb name="irradiance" value="-1"/>"#), "'irradiance' must not be negative"),
        (
            light("spot", &to_world(r#"<scale z="2"/>"#)),
            "the to_world of a spot may only move, rotate and scale uniformly",
        ),
        (light("spot", &float("cutoff_angle", "0")), "'cutoff_angle' must be larger than 0 and at most 180 degrees"),
        (light("spot", &float("cutoff_angle", "181")), "'cutoff_angle' must be larger than 0 and at most 180 degrees"),
        (light("spot", &float("beam_width", "21")), "'beam_width' must be between 0 and 'cutoff_angle' (20 degrees)"),
        (light("spot", &float("beam_width", "-1")), "'beam_width' must be between 0 and 'cutoff_angle' (20 degrees)"),
        (light("spot", r#"<point name="position" value="0 0 1"/>"#), "emitter 'spot' has no parameter 'position'"),
        (
            light("spot", r#"<spectrum name="texture" value="1"/>"#),
            "the 'texture' of a spot must be one that varies, as a 'bitmap' does",
        ),
    ];
    let bitmap =
        |inside: &str| format!(r#"<texture name="irradiance" type="bitmap">{}{inside}</texture>"#, named("m.hdr"));
    let text = |name: &str, value: &str| format!(r#"<string name="{name}" value="{value}"/>"#);
    let rows = rows.into_iter().chain([
        (
            light("projector", &(to_world(r#"<scale value="2"/>"#) + &bitmap(""))),
            "the to_world of a projector may only move and rotate",
        ),
        (light("projector", &(float("fov", "180") + &bitmap(""))), "'fov' must be between 0 and 180 degrees, not 180"),
        (light("projector", &bitmap(&text("filename", "m.hdr"))), "'filename'"),
        (light("projector", &bitmap(&float("scale", "1"))), "texture 'bitmap' has no parameter 'scale'"),
        (light("projector", &bitmap(&text("wrap_mode", "around"))), "'wrap_mode' cannot be 'around'"),
    ]);
    let short = MAP.trim_end_matches("abcd");
    let files = [("m.hdr", MAP), ("text.hdr", "no picture"), ("short.hdr", short)];
    let rows: Vec<(String, &str)> = rows.map(|(body, expected)| (scene_with(&body), expected)).collect();
    all_refused(&rows, &files);
}

/// Maps whose values are not what radiance is.
#[test]
fn maps_with_odd_values() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = |value: f32| {
        let bad = |x: usize, y: usize| if (x, y) == (2, 1) { value } else { 0.5 };
        exr::prelude::write_rgb_file(folder.path().join("m.exr"), 4, 3, |x, y| (0.5, bad(x, y), 0.5)).unwrap();
        let body = r#"<emitter type="envmap"><string name="filename" value="m.exr"/></emitter>"#;
        let path = folder.path().join("scene.xml");
        fs::write(&path, scene_with(body)).unwrap();
        load(&path, &LoadOptions::default())
    };
    for value in [f32::NAN, f32::INFINITY] {
        let error = loaded(value).unwrap_err().to_string();
        assert!(
            error.contains("scene.xml:1:")
                && error.contains("m.exr' has a value that is not finite, in column 2 of row 1"),
            "{error}"
        );
    }
    let error = loaded(1e38).and_then(|mut s| {
        let LightKind::Environment { scale, .. } = &mut s.lights[0].kind else { panic!() };
        *scale = 10.0;
        compile(
            &s,
            &CompileOptions { accelerator: Accelerator::Native, quality: None, threads: 1, camera: 0, samples: None },
        )
        .map(|_| ())
    });
    let expected = "a radiance must be finite and not negative, but this is (inf, inf, inf)";
    assert!(error.unwrap_err().to_string().contains(expected));
    let negative = loaded(-1.0).unwrap();
    assert!(negative.warnings[0].contains("1 pixels of 'm.exr' have negative values, which are taken for 0"));
    let LightKind::Environment { map, .. } = &negative.lights[0].kind else { panic!() };
    assert_eq!(map.get(2, 1), Rgb::new(0.5, 0.0, 0.5));
}

#[test]
fn wrong_sensors_and_integrators_are_refused() {
    let float = |name: &str, value: &str| format!(r#"<float name="{name}" value="{value}"/>"#);
    let sensors = [
        (float("fov", "180"), "'fov' must be between 0 and 180 degrees, not 180"),
        (float("near_clip", "0"), "'near_clip' must be larger than zero"),
        (float("far_clip", "0.001"), "'far_clip' (0.001) must be larger than 'near_clip' (0.01)"),
        (float("shutter_open", "1"), "the shutter must not open after it closes"),
        (r#"<string name="fov_axis" value="z"/>"#.into(), "'fov_axis' cannot be 'z'"),
        (r#"<string name="focal_length" value="-5mm"/>"#.into(), "'focal_length' must be larger than zero"),
        (r#"<string name="focal_length" value="5m"/>"#.into(), "'5m' is not a number"),
        (
            float("fov", "40") + r#"<string name="focal_length" value="50"/>"#,
            "'fov' and 'focal_length' exclude each other",
        ),
        (
            r#"<transform name="to_world"><translate x="1e300"/></transform>"#.into(),
            "the camera is too far away for the size of the scene",
        ),
    ];
    all_refused(&sensors.map(|(inside, expected)| (scene_with_sensor(&inside), expected)), &[]);
}

#[test]
fn wrong_structure_is_refused() {
    let doubled: String =
        (1..24).map(|i| format!(r#"<default name="n{i:02}" value="$n{:02}$n{:02}"/>"#, i - 1, i - 1)).collect();
    let growing = format!(r#"<default name="n00" value="0123456789"/>{doubled}"#);
    let rows = [
        ("<scene version=\"3\"/>".into(), "the version '3' is not three numbers, for example 3.0.0"),
        (scene_with("<scene version=\"3.0.0\"/>"), "<scene> can only be the outermost element"),
        (scene_with(r#"<default name="" value="1"/>"#), "the name of a <default> must not be empty"),
        (scene_with(&ball(r#"<path value="."/>"#)), "<path> can only stand directly inside <scene>"),
        (scene_with(&growing), "bytes after substitution"),
        (scene_with(r#"<include filename="property.xml"/>"#), "property.xml:1:8: <float> has no attribute 'version'"),
        (scene_with(&r#"<include filename="empty.xml"/>"#.repeat(5000)), "the scene includes more than 4096 files"),
        (scene_with(r#"<include filename="."/>"#), "cannot read '"),
    ];
    let property = r#"<float version="3.0.0" name="x" value="1"/>"#;
    all_refused(&rows, &[("property.xml", property), ("empty.xml", r#"<scene version="3.0.0"/>"#)]);
}

#[test]
fn files_that_are_no_text_or_too_large_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, bytes: &[u8], length: Option<u64>, expected: &str| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        if let Some(length) = length {
            fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(length).unwrap();
        }
        let error = load(&path, &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(expected), "{error}\nexpected: {expected}");
    };
    refused(
        "latin.xml",
        b"<scene version=\"3.0.0\">\n \xe9</scene>",
        None,
        "latin.xml:2:2: the file is not UTF-8 text",
    );
    // A file with a hole takes no room.
    refused("long.xml", b"", Some((256 << 20) + 1), "is larger than 268435456 bytes");
    refused("dtd.xml", b"<!DOCTYPE a []><scene/>", None, "document type declarations (<!DOCTYPE");
}

/// Header, body, message.
#[test]
fn wrong_ply_files_are_refused() {
    let vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\n";
    let ascii = |elements: &str, body: &str| format!("ply\nformat ascii 1.0\n{elements}end_header\n{body}");
    let rows = [
        ("no\n".to_owned(), ":1: this is not a PLY file: it must begin with one line 'ply'"),
        ("ply\nformat ascii 1.0\n".into(), ":3: the header has no end"),
        ("ply\nend_header\n".into(), "the header has no format"),
        ("ply\nformat ebcdic 1.0\n".into(), ":2: 'ebcdic' is not a PLY format"),
        (ascii("property float x\n", ""), ":3: a property needs an element before it"),
        (ascii("element vertex x\n", ""), "'x' is not a number of elements"),
        (ascii("element vertex 0\nelement vertex 0\n", ""), ":4: a second element 'vertex'"),
        (
            ascii("element vertex 1\nproperty x\n", ""),
            "expected 'property TYPE NAME' or 'property list TYPE TYPE NAME'",
        ),
        (ascii("element vertex 1\nproperty flaot x\n", ""), "'flaot' is not a PLY type; did you mean 'float'?"),
        (ascii("colour\n", ""), ":3: 'colour' is not a line of a PLY header"),
        (ascii("element vertex 1\nproperty float x\n", "0 "), "the vertices have no x, y and z"),
        (ascii("element face 1\nproperty int a\n", "0 "), "the faces have no list 'vertex_indices'"),
        (ascii(vertex, &"0 ".repeat(9)), "the mesh has no faces"),
        (ascii(&format!("{vertex}{face}"), "0 0 0\n1 0 0\n1 1 0\n3 0 1"), "the file ends too early"),
        (ascii(&format!("{vertex}{face}"), "0 0 0\n1 0 0\n1 1 q\n3 0 1 2"), "'q' is not a number"),
        (ascii(&format!("{vertex}{face}"), "0 0 0\n1 0 0\n1 1 0\n-3 0 1 2"), "'-3' is not the length of a list"),
        (ascii(&format!("{vertex}{face}"), "0 0 0\n1 0 0\n1 1 0\n3 0 1 1.5"), ":13: '1.5' is not a vertex index"),
        (
            ascii(&format!("{vertex}{face}"), "0 0 0\n1 0 0\n1 1 0\n2 0 1"),
            "a face needs at least three vertices, not 2",
        ),
        (
            "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list uchar float x\nproperty float y\n\
             property float z\nend_header\nAAAAAAAAA"
                .into(),
            "the vertices have no x, y and z",
        ),
    ];
    let body = r#"<shape type="ply"><string name="filename" value="m.ply"/></shape>"#;
    for (text, expected) in rows {
        all_refused(&[(scene_with(body), expected)], &[("m.ply", &text)]);
    }
    let short = "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\x03AAA";
    all_refused(&[(scene_with(body), "the file ends too early")], &[("m.ply", short)]);
    all_refused(&[(scene_with(&body.replace("m.ply", ".")), "is not a regular file")], &[]);
}

#[test]
fn wrong_obj_files_are_refused() {
    let triangle = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
    let body = r#"<shape type="obj"><string name="filename" value="m.obj"/></shape>"#;
    for (end, expected) in [
        ("", "m.obj: the mesh has no faces"),
        ("f 1/1/1/1 2 3\n", "m.obj:4: '1/1/1/1' is not of the form v, v/vt, v//vn or v/vt/vn"),
        ("f 1 2 x\n", "m.obj:4: 'x' is not an index"),
        ("f 1//7 2 3\nvn 0 0 1\n", "m.obj:4: the normal index 7 is out of range; the file has 1"),
        ("v 1 2\n", "m.obj:4: expected three numbers, not 2"),
        ("v 1 2 z\nf 1 2 3\n", "m.obj:4: 'z' is not a number"),
        ("v 1 2 1e999\nf 1 2 4\n", "m.obj:4: '1e999' is not a finite number"),
    ] {
        all_refused(&[(scene_with(body), expected)], &[("m.obj", &format!("{triangle}{end}"))]);
    }
    let huge = "v 0 0 0\nv 1e300 0 0\nv 0 1e300 0\nf 1 2 3\n";
    let scaled = body.replace("</shape>", r#"<transform name="to_world"><scale value="1e20"/></transform></shape>"#);
    let expected = "'m.obj' reaches to where numbers end: a coordinate is not finite";
    all_refused(&[(scene_with(&scaled), expected)], &[("m.obj", huge)]);
}

#[test]
fn what_is_odd_but_not_wrong_is_warned_of() {
    let obj = r#"<shape type="obj"><string name="filename" value="m.obj"/></shape>"#;
    let lamp = |scale: &str| {
        format!(
            r#"{BALL}<shape type="rectangle" id="lamp"><transform name="to_world"><scale value="{scale}"/></transform>
            <emitter type="area"/></shape>"#
        )
    };
    let metal = |inside: &str| {
        let ggx = r#"<string name="distribution" value="ggx"/>"#;
        ball(&format!(r#"<bsdf type="roughconductor">{ggx}{inside}</bsdf>"#))
    };
    let rows = [
        (format!("{BALL} words"), "text between elements is ignored"),
        (
            format!(r#"{BALL}<integrator type="path"><boolean name="strict_normals" value="true"/></integrator>"#),
            "'strict_normals' is of Mitsuba 0.6 and has no effect, as in Mitsuba 3",
        ),
        (
            ball(r#"<bsdf type="mask"><float name="opacity" value="2"/><bsdf type="diffuse"/></bsdf>"#),
            "'opacity' is clamped to between 0 and 1",
        ),
        (
            r#"<shape type="rectangle"><transform name="to_world"><rotate angle="9" x="2" y="2"/></transform></shape>"#
                .into(),
            "the rotation axis is not of unit length and is not normalised, as in Mitsuba",
        ),
        (obj.into(), "1 triangles of 'm.obj' have no area"),
        (obj.replace("m.obj", "some.obj"), "some vertices of the mesh have no normal; all normals are computed"),
        (
            format!(r#"{BALL}{}"#, ball(r#"<float name="radius" value="1e-60"/>"#)),
            "is too small beside the scene to be seen",
        ),
        (lamp("1e-25"), "'lamp' is too small to shed light"),
        (
            metal(r#"<float name="specular_reflectance" value="2"/>"#),
            "'specular_reflectance' is larger than 1: the surface creates energy",
        ),
        (
            metal(r#"<spectrum name="specular_reflectance" value="400:0, 520:1, 530:0"/>"#),
            "the spectrum is outside the gamut of sRGB and was clamped, as in Mitsuba",
        ),
    ];
    let rows = rows.into_iter().chain([(
        r#"<emitter type="envmap"><string name="filename" value="m.hdr"/><transform name="to_world"><scale value="2"/>
        </transform></emitter>"#
            .into(),
        "that to_world scales an envmap changes nothing, for it is infinitely far away",
    )]);
    let files = [
        ("m.hdr", MAP),
        ("m.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 1 2 2\n"),
        ("some.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 2 3\n"),
    ];
    for (body, expected) in rows {
        let warnings = outcome(&scene_with(&body), &files, false).unwrap_or_else(|e| panic!("{body}\n{e}"));
        assert!(warnings.iter().any(|w| w.contains(expected)), "{body}\n{warnings:?}\nexpected: {expected}");
    }
}

/// What is not supported is an error, and for the lenient a warning that says what is done instead.
#[test]
#[allow(clippy::too_many_lines, reason = "a table")]
fn what_is_approximated_is_named() {
    let film =
        |inside: &str| scene_with_sensor(&format!(r#"<film type="hdrfilm">{inside}<rfilter type="box"/></film>"#));
    let rows = [
        (
            scene_with(&format!(r#"<integrator type="aov"><string name="aovs" value="d:dp_du"/></integrator>{BALL}"#)),
            "the aov type 'dp_du'",
            "no such channel instead",
        ),
        (
            scene_with(&format!(
                r#"<integrator type="moment"><integrator type="path"/><integrator type="path"/></integrator>{BALL}"#
            )),
            "a second integrator inside of another",
            "the first instead",
        ),
        (
            film(r#"<string name="file_format" value="pfm"/>"#),
            "a file format other than 'openexr'",
            "'openexr' instead",
        ),
        (
            film(r#"<string name="component_format" value="uint32"/>"#),
            "the component format 'uint32'",
            "'float32' instead",
        ),
        (
            scene_with(&format!(
                r#"<integrator type="direct"><integer name="bsdf_samples" value="2"/></integrator>{BALL}"#
            )),
            "'bsdf_samples' other than 1",
            "one sample instead",
        ),
        (
            scene_with(&ball(r#"<bsdf type="diffuse"><texture name="reflectance" type="volume"/></bsdf>"#)),
            "texture plugin 'volume'",
            "a uniform grey instead",
        ),
    ];
    for (text, what, instead) in rows {
        let error = outcome(&text, &[], false).expect_err(&text);
        assert!(error.contains(what) && error.contains("is not supported yet"), "{error}");
        let warnings = outcome(&text, &[], true).unwrap();
        assert!(warnings.iter().any(|w| w.contains(what) && w.ends_with(instead)), "{warnings:?}");
    }
}

fn map_light(map: std::sync::Arc<Picture>, to_world: DMat3) -> Light {
    common::light(LightKind::Environment { map, scale: 1.0, to_world, mis_compensation: false })
}

fn projector(texture: TextureId) -> LightKind {
    let fov = FieldOfView { degrees: 40.0, axis: FovAxis::X };
    LightKind::Projector { texture, scale: 1.0, to_world: DAffine3::IDENTITY, fov }
}

#[test]
fn light_below_zero_is_none() {
    let mut scene = enclosure(0.5, 1.0);
    scene.textures = vec![common::picture_texture(2, 2, |x, _| Rgb::splat(x as f32 - 0.5))];
    scene.lights.push(common::light(projector(TextureId(0))));
    let expected = "built in: negative values of the light's texture are taken for 0";
    assert_eq!(compile_native(&scene), Ok(vec![expected.into()]));
}

/// Descriptions that no loader makes are refused all the same.
#[test]
#[allow(clippy::too_many_lines, reason = "a table")]
fn wrong_descriptions_are_refused() {
    type Change = fn(&mut SceneDescription);
    let rows: [(Change, &str); 17] = [
        (|s| s.cameras[0].to_world.matrix3 = DMat3::ZERO, "built in: the camera's to_world gives it no direction"),
        (
            |s| s.cameras[0].to_world.translation = DVec3::MAX,
            "built in: the camera is too far away for the size of the scene",
        ),
        (|s| s.cameras.clear(), "camera 0 was asked for, but the scene has 0"),
        (
            |s| s.shapes[0].emission = Some(Emission::uniform(Rgb::new(1.0, -1.0, 0.0))),
            "built in: a radiance must be finite and not negative, but this is (1, -1, 0)",
        ),
        (
            |s| s.shapes[0].to_world = DAffine3::from_scale(DVec3::X),
            "built in: the to_world of 'shape' flattens it: it has no inverse",
        ),
        (
            |s| {
                s.shapes[0].geometry = Geometry::Sphere { centre: DVec3::ZERO, radius: 1.0, frame: DMat3::IDENTITY };
                s.shapes[0].to_world = DAffine3::from_scale(DVec3::new(1.0, 1.0, 2.0));
            },
            "built in: a sphere's to_world may only move, rotate and scale uniformly",
        ),
        (
            |s| {
                for side in [BsdfId(0), BsdfId(1)] {
                    s.bsdfs.push(Bsdf { kind: BsdfKind::TwoSided { front: side, back: side }, ..diffuse(0.5) });
                }
                s.shapes[0].bsdf = BsdfId(2);
            },
            "built in: two-sided bsdfs cannot be nested",
        ),
        (
            |s| {
                let side = BsdfId(1);
                s.bsdfs.push(Bsdf { kind: BsdfKind::TwoSided { front: side, back: side }, ..diffuse(0.5) });
            },
            "built in: a bsdf cannot be made of itself",
        ),
        (
            |s| {
                let side = BsdfId(7);
                s.bsdfs.push(Bsdf { kind: BsdfKind::TwoSided { front: side, back: side }, ..diffuse(0.5) });
            },
            "built in: the bsdf refers to another that is not there",
        ),
        (
            |s| s.bsdfs[0].varying.push((Parameter::Reflectance, TextureId(0))),
            "built in: the bsdf refers to a texture that is not there",
        ),
        (
            |s| {
                let kind = BsdfKind::Dielectric {
                    int_ior: 1.5,
                    ext_ior: 1.0,
                    specular_reflectance: Rgb::WHITE,
                    specular_transmittance: Rgb::WHITE,
                };
                s.bsdfs.push(Bsdf { kind, ..diffuse(0.5) });
                s.bsdfs.push(Bsdf { kind: BsdfKind::TwoSided { front: BsdfId(1), back: BsdfId(1) }, ..diffuse(0.5) });
                s.shapes[0].bsdf = BsdfId(2);
            },
            "built in: a two-sided bsdf cannot have a side that transmits light",
        ),
        (
            |s| s.lights.push(map_light(common::map(2, 2, |_, _| Rgb::WHITE), DMat3::IDENTITY)),
            "built in: an environment map has at least 2x3 pixels, not 2x2",
        ),
        (
            |s| s.lights.push(map_light(common::map(2, 3, |x, _| Rgb::splat(x as f32 - 1.0)), DMat3::IDENTITY)),
            "built in: a radiance must be finite and not negative, but this is (-1, -1, -1)",
        ),
        (
            |s| s.lights.push(map_light(common::map(2, 3, |_, _| Rgb::WHITE), DMat3::ZERO)),
            "built in: the light's direction must be neither zero nor infinite",
        ),
        (
            |s| s.lights.push(common::light(projector(TextureId(0)))),
            "built in: the light refers to a texture that is not there",
        ),
        (
            |s| {
                s.textures = vec![common::picture_texture(2, 2, |x, _| Rgb::splat(1.0 / x as f32))];
                s.lights.push(common::light(projector(TextureId(0))));
            },
            "built in: a value of the light's texture is not finite",
        ),
        (
            |s| {
                let kind = LightKind::Directional { direction: DVec3::Z, irradiance: Rgb::new(-1.0, 0.0, 0.0) };
                s.lights.push(common::light(kind));
            },
            "built in: an irradiance must be finite and not negative, but this is (-1, 0, 0)",
        ),
    ];
    for (change, expected) in rows {
        let mut scene = enclosure(0.5, 1.0);
        change(&mut scene);
        assert_eq!(compile_native(&scene), Err(expected.into()));
    }
    compiled(&enclosure(0.5, 1.0), Accelerator::Native);
}

/// A picture that cannot get its name is kept under another.
#[test]
fn a_picture_without_its_name_is_kept() {
    use snell::image::{ComponentFormat, Crop, Metadata, OutputFile, Picture, WriteOptions};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let place = OutputFile::reserve(&path).unwrap();
    fs::create_dir(&path).unwrap();
    let options = WriteOptions {
        full_size: (2, 2),
        crop: Crop { x: 0, y: 0, width: 2, height: 2 },
        component_format: ComponentFormat::Half,
        exposure: 0.0,
        metadata: Metadata::default(),
    };
    let error = place.write((&Picture::new(2, 2)).into(), &options).unwrap_err().to_string();
    assert!(error.contains("a.png: cannot give the picture its name: "), "{error}");
    let kept = error.split("; it is kept as ").nth(1).unwrap();
    assert!(fs::read(kept).unwrap().starts_with(b"\x89PNG"));
}
