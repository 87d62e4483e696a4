//! What meshes say themselves of their vertices and faces: read from PLY, asked for by textures, seen in the picture.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod common;

use common::*;
use glam::{DAffine3, DVec2, DVec3, DVec4};
use snell::accel::Accelerator;
use snell::description::*;
use snell::integrator::Estimator;
use snell::loader::LoadOptions;
use snell::scene::compile::{CompileOptions, compile};
use snell::spectrum::Rgb;
use std::fs;
use std::sync::Arc;

/// The square [−1, 1]² in z = 0, red growing from 0 to 1 with x, green with y; a face without area; faces of two greys.
const SQUARE: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    property float r\nproperty float g\nproperty float b\nelement face 3\nproperty list uchar int vertex_indices\n\
    property float shade_0\nend_header\n-1 -1 0 0 0 0\n1 -1 0 1 0 0\n1 1 0 1 1 0\n-1 1 0 0 1 0\n\
    3 0 0 1 9\n3 0 1 2 0.25\n3 0 2 3 0.75\n";

fn scene(texture: &str) -> String {
    format!(
        r#"<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="2"/></integrator>
        <sensor type="orthographic"><transform name="to_world"><lookat origin="0, 0, 2" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film></sensor>
        <shape type="ply"><string name="filename" value="square.ply"/><bsdf type="diffuse">{texture}</bsdf></shape>
        <emitter type="constant"><rgb name="radiance" value="1"/></emitter></scene>"#
    )
}

fn read(texture: &str) -> Result<SceneDescription, String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("square.ply"), SQUARE).unwrap();
    fs::write(folder.path().join("scene.xml"), scene(texture)).unwrap();
    snell::loader::load(&folder.path().join("scene.xml"), &LoadOptions::default()).map_err(|e| e.to_string())
}

fn compile_error(description: &SceneDescription) -> String {
    let options =
        CompileOptions { accelerator: Accelerator::Native, quality: None, threads: 1, camera: 0, samples: None };
    compile(description, &options).err().unwrap().to_string()
}

fn attribute(name: &str) -> String {
    format!(
        r#"<texture type="mesh_attribute" name="reflectance"><string name="name" value="{name}"/>
        <float name="scale" value="0.5"/></texture>"#
    )
}

/// Under a sky of radiance 1 nothing but the albedo is seen.
#[test]
fn colours_of_vertices_and_faces_are_seen() {
    for accelerator in accelerators() {
        let render = |name: &str| {
            let scene = compiled(&read(&attribute(name)).unwrap(), accelerator);
            picture(&scene, &settings(Estimator::Path, 256))
        };
        let (vertices, faces) = (render("vertex_color"), render("face_shade"));
        for y in 0..4 {
            for x in 0..4 {
                // The mean of a linear function over a pixel is its value in the middle; 256 points of a sequence of
                // low discrepancy know that to 1/16 of the pixel's range at least.
                let expected = [0.5 * (x as f32 + 0.5) / 4.0, 0.5 * (3.5 - y as f32) / 4.0, 0.0];
                let found = vertices.get(x, y).0.to_array();
                for (found, expected) in found.into_iter().zip(expected) {
                    assert!((found - expected).abs() <= 0.125 / 16.0, "{x} {y}: {found} for {expected}");
                }
                let grey = faces.get(x, y).0.x;
                if x != 3 - y {
                    let expected = if x > 3 - y { 0.125 } else { 0.375 };
                    // The sky's light is noisy to some 1e-4; the wrong face would be off by 0.25.
                    assert!((grey - expected).abs() < 1e-2, "{x} {y}: {grey}");
                }
            }
        }
    }
}

#[test]
fn what_a_mesh_does_not_have_is_an_error() {
    let refused = |texture: &str| match read(texture) {
        Err(error) => error,
        Ok(description) => compile_error(&description),
    };
    let error = refused(&attribute("vertex_colour"));
    assert!(
        error.ends_with(
            "'square.ply' has no attribute 'vertex_colour' that a texture asks for ('vertex_color', 'face_shade')"
        ),
        "{error}"
    );
    let error = refused(&attribute("color"));
    assert!(error.ends_with("an attribute's name begins with 'vertex_' or 'face_', unlike 'color'"), "{error}");

    let mut other = read(&attribute("vertex_color")).unwrap();
    other.shapes[0].geometry = Geometry::Rectangle;
    let error = compile_error(&other);
    assert!(error.ends_with("'square.ply' is no mesh, but a texture asks for what only a mesh has"), "{error}");

    let mut second = read(&attribute("vertex_color")).unwrap();
    second.textures[0] = Texture { uv_set: 1, kind: TextureKind::Constant(Rgb::WHITE), ..second.textures[0].clone() };
    let error = compile_error(&second);
    assert!(error.ends_with("'square.ply' has no texture coordinates of set 1"), "{error}");

    let mut bare = read(&attribute("vertex_color")).unwrap();
    let Geometry::Mesh(mesh) = &mut bare.shapes[0].geometry else { unreachable!() };
    Arc::make_mut(mesh).attributes.clear();
    assert!(compile_error(&bare).ends_with("'vertex_color' that a texture asks for (none)"));
}

#[test]
fn textures_that_are_not_there_are_errors() {
    let mut circle = read(&attribute("vertex_color")).unwrap();
    circle.textures[0].kind = TextureKind::Product([TextureId(0); 2]);
    let error = compile_error(&circle);
    assert!(error.ends_with("a texture can only be made of textures that stand before it"), "{error}");

    let mut emitting = read(&attribute("vertex_color")).unwrap();
    emitting.shapes[0].emission = Some(Emission { texture: Some(TextureId(1)), ..Emission::uniform(Rgb::WHITE) });
    let error = compile_error(&emitting);
    assert!(error.ends_with("the emission refers to a texture that is not there"), "{error}");
}

/// A normal map that tilts the normal towards its green axis reflects a mirror's view there, whichever way that is in the
/// file, also where the mesh is mirrored, in a group or by itself: then the axis moves with the surface.
#[test]
fn bitangents_move_with_the_surface() {
    for (side, mirror, in_group) in [1.0, -1.0]
        .into_iter()
        .flat_map(|s| [false, true].map(|m| (s, m)))
        .flat_map(|(s, m)| [false, true].map(|g| (s, m, g)))
    {
        let mut description = read(r#"<rgb name="reflectance" value="0"/>"#).unwrap();
        // A mirror; n is along (0, 1/2, 1) in its map, so that what is seen lies at (0, 0.8, 0.6).
        description.textures = vec![Texture {
            at: at(),
            kind: TextureKind::Constant(Rgb::new(0.5, 0.75, 1.0)),
            uv_set: 0,
            to_uv: Default::default(),
        }];
        let mirror_bsdf = BsdfKind::Conductor { eta: Rgb::BLACK, k: Rgb::WHITE, specular_reflectance: Rgb::WHITE };
        description.bsdfs = vec![
            Bsdf { kind: mirror_bsdf, ..diffuse(0.0) },
            Bsdf {
                kind: BsdfKind::Perturbed {
                    nested: BsdfId(0),
                    normal: NormalSource::Map { texture: TextureId(0), scale: 1.0 },
                    terminator: Terminator::Cut { flip_invalid: true, shadowing: false },
                },
                ..diffuse(0.0)
            },
        ];
        description.shapes[0].bsdf = BsdfId(1);
        let Geometry::Mesh(mesh) = &mut description.shapes[0].geometry else { unreachable!() };
        let mesh = Arc::make_mut(mesh);
        mesh.uvs = vec![DVec2::ZERO; 4];
        mesh.tangents = vec![DVec4::new(1.0, 0.0, 0.0, side); 4];
        let map = DAffine3::from_scale(DVec3::new(1.0, if mirror { -1.0 } else { 1.0 }, 1.0));
        if in_group {
            let shape = description.shapes.remove(0);
            description.groups = vec![Group { shapes: vec![shape] }];
            description.instances = vec![Instance { at: at(), name: "i".into(), group: GroupId(0), to_world: map }];
        } else {
            description.shapes[0].to_world = map;
        }
        // A sky that is bright where y > 0 only.
        let sky = common::map(8, 9, |_, y| Rgb::splat(if y < 4 { 1.0 } else { 0.0 }));
        description.lights = vec![light(LightKind::Environment {
            map: sky,
            scale: 1.0,
            to_world: glam::DMat3::IDENTITY,
            mis_compensation: false,
        })];
        let scene = compiled(&description, Accelerator::Native);
        let seen = picture(&scene, &settings(Estimator::Path, 4)).get(1, 1).0.x;
        // n × t = +y; mirrored in y, what was up is down.
        let up = (side > 0.0) != mirror;
        assert_eq!(seen > 0.5, up, "{side} {mirror} {in_group}: {seen}");
    }
}
