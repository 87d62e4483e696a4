//! Meshes that are rendered by themselves.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod desk;

use desk::*;
use std::fs;

/// A pyramid on a square, red and emitting by its materials.
const PYRAMID: &str = "mtllib m.mtl\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1 0\nf 1 2 3 4\nusemtl red\n\
    f 4 3 5\nf 3 2 5\nusemtl lamp\nf 2 1 5\nf 1 4 5\n";

#[test]
fn a_bare_mesh_is_shown() {
    let desk = Desk::new();
    fs::write(desk.path("p.obj"), PYRAMID.replace("mtllib m.mtl\n", "")).unwrap();
    let render = |extra: &[&str]| {
        let output =
            desk.snell(&[&["render", "p.obj", "--size", "32x24", "--spp", "8", "-o", "a.exr"], extra].concat());
        assert!(output.status.success(), "{output:?}");
        (String::from_utf8_lossy(&output.stderr).into_owned(), snell::image::read_picture(&desk.path("a.exr")).unwrap())
    };
    let (told, lit) = render(&[]);
    assert!(!told.contains("warning") && lit.picture.pixels().iter().all(|p| p.luminance() > 0.05), "{told}");
    // A library that is not there is worth a word; with it, the mesh lights itself, before black.
    fs::write(desk.path("p.obj"), PYRAMID).unwrap();
    assert!(render(&[]).0.contains("warning: p.obj: a material library is left out: m.mtl: "));
    fs::write(desk.path("m.mtl"), "newmtl red\nKd 0.9 0.1 0.1\nmap_Kd t.png\nnewmtl lamp\nKe 5 5 5\n").unwrap();
    let (told, own) = render(&["--crop", "0,0,32,12"]);
    assert!(told.contains("textures of its materials are left out"), "{told}");
    assert!(own.picture.get(0, 0).is_black() && own.picture.height() == 12);
    fs::write(desk.path("m.mtl"), "newmtl lamp\nKe 5 5 5\n").unwrap();
    assert!(render(&[]).0.contains("warning: p.obj: no library has the material 'red'; it is grey"));
    let info = desk.snell(&["info", "p.obj"]);
    assert!(info.status.success() && String::from_utf8_lossy(&info.stdout).contains("768x576"), "{info:?}");
}

/// Camera, floor and lamp are in proportion to the mesh.
#[test]
fn a_bare_mesh_has_no_unit() {
    let desk = Desk::new();
    let picture = |edge: i32| {
        let vertices = [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1], [0, 1, 0]].map(|v| v.map(|c| c * edge));
        let lines: String = vertices.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
        fs::write(desk.path("p.obj"), lines + "f 1 2 3 4\nf 4 3 5\nf 3 2 5\nf 2 1 5\nf 1 4 5\n").unwrap();
        desk.succeeds(&["render", "p.obj", "--size=24x32", "--spp=2", "-oa.exr", "-q"]);
        snell::image::read_picture(&desk.path("a.exr")).unwrap().picture
    };
    assert!(picture(1) == picture(1 << 24), "another unit, another picture");
}

#[test]
fn bad_meshes_are_refused() {
    let desk = Desk::new();
    fs::write(desk.path("point.obj"), "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n").unwrap();
    fs::write(desk.path("good.OBJ"), PYRAMID).unwrap();
    fs::write(desk.path("text.ply"), "no mesh\n").unwrap();
    desk.refuses(&["render", "point.obj"], &["point.obj: ", "no size"]);
    desk.refuses(&["render", "good.OBJ", "-Dx=1"], &["-D x", "a mesh has no parameters"]);
    desk.refuses(&["render", "text.ply"], &["text.ply:1: ", "not a PLY file"]);
    desk.refuses(&["render", "absent.ply"], &["absent.ply: "]);
}
