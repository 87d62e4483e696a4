//! `--confine`: nothing outside of a folder is read, whatever a scene names and however.

#![cfg(unix)]
#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod desk;

use desk::*;
use snell::files::Files;
use snell::loader::{LoadOptions, load};
use std::fs;
use std::os::unix::fs::symlink;

const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// An element that reads a file, made from its name, and the file.
type Reader = (fn(&str) -> String, &'static str, Vec<u8>);

fn readers() -> Vec<Reader> {
    let png = {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbImage::new(2, 2).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let include = r#"<shape version="3.0.0" type="sphere"/>"#;
    vec![
        (|f| format!(r#"<include filename="{f}"/>"#), "a.xml", include.into()),
        (|f| format!(r#"<shape type="obj"><string name="filename" value="{f}"/></shape>"#), "m.obj", MESH.into()),
        (|f| format!(r#"<shape type="ply"><string name="filename" value="{f}"/></shape>"#), "m.ply", ply.into()),
        (
            |f| {
                format!(
                    r#"<shape type="sphere"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
                    <string name="filename" value="{f}"/></texture></bsdf></shape>"#
                )
            },
            "p.png",
            png.clone(),
        ),
        (
            |f| {
                format!(
                    r#"<shape type="sphere"/><emitter type="envmap"><string name="filename" value="{f}"/></emitter>"#
                )
            },
            "e.png",
            png,
        ),
        (
            |f| {
                format!(
                    r#"<shape type="sphere"><bsdf type="diffuse"><spectrum name="reflectance" filename="{f}"/></bsdf>
                    </shape>"#
                )
            },
            "s.spd",
            b"400 0.5\n700 0.5\n".to_vec(),
        ),
    ]
}

#[test]
fn what_a_scene_names_is_read_inside_only() {
    let desk = Desk::new();
    for folder in ["in", "in/sub", "out"] {
        fs::create_dir(desk.path(folder)).unwrap();
    }
    symlink("../out", desk.path("in/link")).unwrap();
    for (element, name, bytes) in readers() {
        fs::write(desk.path("in/sub").join(name), &bytes).unwrap();
        fs::write(desk.path("out").join(name), &bytes).unwrap();
        symlink(format!("../out/{name}"), desk.path("in").join(format!("to-{name}"))).unwrap();
        let info = |named: &str, confined: bool| {
            fs::write(desk.path("in/s.xml"), scene_text(&element(named))).unwrap();
            let words: &[&str] =
                if confined { &["info", "--confine", "in", "in/s.xml"] } else { &["info", "in/s.xml"] };
            desk.snell(words)
        };
        let outside = desk.path("out").join(name).display().to_string();
        let (up, linked, to) = (format!("../out/{name}"), format!("link/{name}"), format!("to-{name}"));
        let inside = format!("sub/../sub/{name}");
        assert!(info(&inside, true).status.success(), "{name}");
        for named in [&up, &outside, &linked, &to] {
            assert!(info(named, false).status.success(), "{named}");
            let refused = info(named, true);
            let error = String::from_utf8_lossy(&refused.stderr).into_owned();
            assert_eq!(refused.status.code(), Some(2), "{named}: {error}");
            let expected = format!("there is no file '{named}' inside of 'in' (--confine) (looked in 'in', ");
            assert!(error.contains("in/s.xml:") && error.contains(&expected), "{named}: {error}");
        }
        // Nor does a file outside differ from one that is not there.
        let absent = info("../out/absent", true);
        assert!(String::from_utf8_lossy(&absent.stderr).contains("'../out/absent' inside of 'in' (--confine)"));
    }
    let through = r#"<path value="../out"/><shape type="obj"><string name="filename" value="m.obj"/></shape>"#;
    fs::write(desk.path("in/s.xml"), scene_text(through)).unwrap();
    desk.refuses(&["info", "--confine", "in", "in/s.xml"], &["in/s.xml:3:", "there is no file '../out' inside of"]);
}

#[test]
fn an_include_inside_may_not_lead_outside() {
    let desk = Desk::new();
    fs::create_dir(desk.path("in")).unwrap();
    fs::write(desk.path("secret.obj"), MESH).unwrap();
    fs::write(desk.path("in/s.xml"), scene_text(r#"<include filename="i.xml"/>"#)).unwrap();
    let included = r#"<shape version="3.0.0" type="obj"><string name="filename" value="../secret.obj"/></shape>"#;
    fs::write(desk.path("in/i.xml"), included).unwrap();
    desk.refuses(&["info", "--confine", "in", "in/s.xml"], &["in/i.xml:1:", "'../secret.obj' inside of 'in'"]);
    desk.succeeds(&["info", "--confine", ".", "in/s.xml"]);
}

#[test]
fn what_the_user_names_must_be_inside_too() {
    let desk = Desk::new();
    fs::create_dir(desk.path("in")).unwrap();
    fs::write(desk.path("in/m.obj"), MESH).unwrap();
    fs::write(desk.path("m.obj"), MESH).unwrap();
    image::Rgb32FImage::new(4, 2).save(desk.path("sky.hdr")).unwrap();
    let no_such = "there is no such file inside of 'in' (--confine)";
    desk.refuses(&["info", "--confine", "in", "m.obj"], &["m.obj: ", no_such]);
    desk.refuses(
        &["info", "--confine", "in", "in/m.obj", "--env", "sky.hdr"],
        &["--env: cannot read 'sky.hdr'", no_such],
    );
    desk.refuses(&["render", "--confine", "m.obj", "m.obj"], &["--confine: 'm.obj': is not a folder"]);
    desk.refuses(&["render", "--confine", "none", "m.obj"], &["--confine: 'none': "]);
    desk.succeeds(&["render", "--confine", "in", "in/m.obj", "--size", "2x2", "--spp", "1", "-o", "a.png"]);
    let bench =
        ["bench", "in/m.obj", "--out", "b", "--spp", "1", "--seeds", "2", "-q", "--", "--size", "8x8", "--confine"];
    desk.refuses(&[&bench[..], &["none"]].concat(), &["--confine: 'none': "]);
}

#[test]
fn material_libraries_and_files_of_gltf_are_read_inside_only() {
    let desk = Desk::new();
    fs::create_dir(desk.path("in")).unwrap();
    fs::write(desk.path("out.mtl"), "newmtl a\nKd 1 0 0\n").unwrap();
    fs::write(desk.path("in/m.obj"), format!("mtllib ../out.mtl\nusemtl a\n{MESH}")).unwrap();
    let told = String::from_utf8(desk.succeeds(&["info", "--confine", "in", "in/m.obj"]).stdout).unwrap();
    assert!(told.contains("../out.mtl: there is no such file inside of 'in' (--confine)"), "{told}");

    let triangle: Vec<u8> =
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(desk.path("t.bin"), triangle).unwrap();
    image::RgbImage::new(2, 2).save(desk.path("p.png")).unwrap();
    fs::copy(desk.path("t.bin"), desk.path("in/t.bin")).unwrap();
    fs::copy(desk.path("p.png"), desk.path("in/p.png")).unwrap();
    symlink("../t.bin", desk.path("in/link.bin")).unwrap();
    let gltf = |buffer: &str, image: &str| {
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
            "textures":[{{"source":0}}],"images":[{{"uri":"{image}"}}],"buffers":[{{"byteLength":36,"uri":"{buffer}"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}]}}"#
        );
        fs::write(desk.path("in/m.gltf"), text).unwrap();
    };
    let command = ["info", "--confine", "in", "in/m.gltf"];
    gltf("t.bin", "p.png");
    desk.succeeds(&command);
    for uri in ["../t.bin", "%2e%2e/t.bin", "link.bin", "/etc/passwd"] {
        gltf(uri, "p.png");
        desk.refuses(&command, &["in/m.gltf: buffers[0]: ", "there is no such file inside of 'in' (--confine)"]);
    }
    gltf("t.bin", "../p.png");
    desk.refuses(&command, &["in/m.gltf: images[0]: ", "there is no such file inside of 'in' (--confine)"]);
}

#[test]
fn every_file_that_was_read_is_known() {
    let desk = Desk::new();
    let elements: String = readers().iter().map(|(element, name, _)| element(name)).collect();
    for (_, name, bytes) in readers() {
        fs::write(desk.path(name), bytes).unwrap();
    }
    fs::write(desk.path("s.xml"), scene_text(&elements)).unwrap();
    fs::write(desk.path("unread.obj"), MESH).unwrap();
    let options = LoadOptions { files: Files::default(), ..LoadOptions::default() };
    load(&desk.path("s.xml"), &options).unwrap();
    let read = options.files.read_so_far();
    let names: Vec<_> = read.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["a.xml", "e.png", "m.obj", "m.ply", "p.png", "s.spd", "s.xml"]);
}
