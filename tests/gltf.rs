//! What the glTF loader makes of each feature of the format, on files of a few lines.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod common;
mod gltf_file;

use glam::{DAffine3, DMat3, DVec2, DVec3, DVec4};
use gltf_file::{File, outcome, png};
use serde_json::{Value, json};
use snell::accel::Accelerator;
use snell::description::*;
use snell::integrator::Estimator;
use snell::loader::{LoadOptions, load};
use snell::spectrum::Rgb;
use std::fs;
use std::sync::Arc;

fn mesh(scene: &SceneDescription, shape: usize) -> &Arc<Mesh> {
    match &scene.shapes[shape].geometry {
        Geometry::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn close(a: DVec3, b: DVec3) -> bool {
    (a - b).length() < 1e-6
}

/// The first bsdf of glTF's kind, and what varies of it.
fn gltf(scene: &SceneDescription) -> (Gltf, Vec<(Parameter, TextureId)>) {
    let found = scene.bsdfs.iter().find_map(|b| match b.kind {
        BsdfKind::Gltf(gltf) => Some((gltf, b.varying.clone())),
        _ => None,
    });
    found.unwrap()
}

/// A material put onto a triangle with texture coordinates.
fn with_material(material: Value) -> SceneDescription {
    File::textured(material).loaded()
}

/// The kind of the bsdf of the first shape.
fn surface(scene: &SceneDescription) -> &BsdfKind {
    &scene.bsdfs[scene.shapes[0].bsdf.0].kind
}

fn kind(scene: &SceneDescription, id: BsdfId) -> &BsdfKind {
    &scene.bsdfs[id.0].kind
}

#[test]
fn containers() {
    let file = File::triangle();
    let positions = &mesh(&file.loaded(), 0).positions.clone();
    assert_eq!(positions, &[DVec3::ZERO, DVec3::X, DVec3::Y]);
    // A binary file, whatever it is called, a text with a byte order mark, and a buffer in a file of its own.
    for name in ["m.glb", "m.GLB", "m.gltf"] {
        assert_eq!(&mesh(&outcome(name, &file.binary(), false).unwrap(), 0).positions, positions);
    }
    let marked = [b"\xef\xbb\xbf".to_vec(), file.text().into_bytes()].concat();
    assert!(outcome("m.gltf", &marked, false).is_ok());
    let folder = tempfile::tempdir().unwrap();
    let mut outside = file.clone();
    outside.json["buffers"] = json!([{"byteLength": file.bytes.len(), "uri": "a%20b.bin"}]);
    fs::write(folder.path().join("a b.bin"), &file.bytes).unwrap();
    fs::write(folder.path().join("m.gltf"), outside.text()).unwrap();
    let scene = load(&folder.path().join("m.gltf"), &LoadOptions::default()).unwrap();
    assert_eq!(&mesh(&scene, 0).positions, positions);
    // Base64 without its padding.
    let mut bare = File::triangle();
    bare.json["buffers"] = json!([{"byteLength": 1, "uri": "data:;base64,AA"}]);
    assert!(bare.outcome(false).unwrap_err().contains("outside of buffers[0], which has 1"));
}

#[test]
fn nodes_stand_where_their_parents_put_them() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([
        {"translation": [1, 2, 3], "rotation": [0, 0, 2, 2], "scale": [2, 2, 4], "children": [1]},
        {"matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1], "mesh": 0},
        {"mesh": 0},
    ]);
    file.json["scenes"] = json!([{"nodes": [2]}, {"nodes": [0]}]);
    assert_eq!(file.loaded().shapes[0].to_world, DAffine3::IDENTITY);
    file.json["scene"] = json!(1);
    let scene = file.loaded();
    assert_eq!(scene.shapes.len(), 1);
    // (x, y, z) ↦ (10 − y, x, z) ↦ a quarter turn of that, twice as large ↦ moved.
    let p = scene.shapes[0].to_world.transform_point3(DVec3::new(1.0, 5.0, 1.0));
    assert!(close(p, DVec3::new(1.0 - 2.0, 2.0 + 10.0, 3.0 + 4.0)), "{p}");
    // Without scenes every root is shown.
    file.json.as_object_mut().unwrap().remove("scenes");
    file.json.as_object_mut().unwrap().remove("scene");
    let scene = file.loaded();
    assert_eq!(scene.shapes.len(), 2);
    assert!(Arc::ptr_eq(mesh(&scene, 0), mesh(&scene, 1)), "the same mesh");
    // Flattened by its node.
    file.json["nodes"] = json!([{"mesh": 0, "scale": [1, 0, 1]}, {"mesh": 0}]);
    let scene = file.loaded();
    assert_eq!(scene.shapes.len(), 1);
    assert!(scene.warnings[0].ends_with("nodes[0]: its scale makes its mesh flat: it is left out"));
}

#[test]
fn a_mirrored_mesh_keeps_its_front() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([{"mesh": 0, "scale": [-1, 1, 1]}]);
    let scene = file.loaded();
    let mesh = mesh(&scene, 0);
    let [a, b, c] = mesh.faces[0].map(|i| scene.shapes[0].to_world.transform_point3(mesh.positions[i as usize]));
    assert!(close((b - a).cross(c - a), DVec3::Z), "counter-clockwise seen from +z, as without the mirror");
}

#[test]
fn triangles_strips_fans_and_what_has_no_surface() {
    let mut file = File::triangle();
    let square = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    let positions = file.floats("VEC3", &square);
    let faces = |mode: u32, component: u32, bytes: &[u8], count: usize| {
        let mut file = file.clone();
        let indices = file.accessor("SCALAR", component, count, bytes);
        *file.primitive() = json!({"attributes": {"POSITION": positions}, "mode": mode, "indices": indices});
        mesh(&file.loaded(), 0).faces.clone()
    };
    assert_eq!(faces(4, 5121, &[0, 1, 2, 2, 3, 0], 6), [[0, 1, 2], [2, 3, 0]]);
    assert_eq!(faces(5, 5123, &[0, 0, 1, 0, 3, 0, 2, 0], 4), [[0, 1, 3], [1, 2, 3]]);
    // A face that is none joins strips.
    assert_eq!(faces(5, 5121, &[0, 1, 2, 2, 3], 5), [[0, 1, 2]]);
    let words: Vec<u8> = [0u32, 1, 2, 3].iter().flat_map(|i| i.to_le_bytes()).collect();
    assert_eq!(faces(6, 5125, &words, 4), [[1, 2, 0], [2, 3, 0]]);
    // Vertices that no face uses are not kept.
    assert_eq!(faces(4, 5121, &[3, 1, 2], 3), [[2, 0, 1]]);
    for (mode, left) in [(0, "points and lines have no surface"), (3, "points and lines have no surface")] {
        let mut file = file.clone();
        let lines = json!({"attributes": {"POSITION": positions}, "mode": mode});
        file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(lines);
        let scene = file.loaded();
        assert_eq!(scene.shapes.len(), 1);
        assert!(scene.warnings[0].contains(left), "{:?}", scene.warnings);
    }
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(json!({"attributes": {}}));
    let empty = file.floats("VEC3", &[]);
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(json!({"attributes": {"POSITION": empty}}));
    let warnings = file.loaded().warnings;
    assert!(warnings[0].ends_with("primitives[1]: it has no POSITION: it is left out"));
    assert!(warnings[1].ends_with("primitives[2]: it has no triangles: it is left out"));
}

#[test]
fn accessors_may_be_interleaved_and_sparse() {
    let mut file = File::triangle();
    // Two positions and normals in turn, and a third.
    let vertices: Vec<f32> = [DVec3::ZERO, DVec3::Z, DVec3::X, DVec3::Z, DVec3::Y, DVec3::Z]
        .iter()
        .flat_map(|v| v.as_vec3().to_array())
        .collect();
    let first = file.floats("VEC3", &vertices);
    let view = file.json["accessors"][first]["bufferView"].clone();
    file.json["bufferViews"][view.as_u64().unwrap() as usize]["byteStride"] = json!(24);
    let part =
        |offset| json!({"bufferView": view, "byteOffset": offset, "componentType": 5126, "count": 3, "type": "VEC3"});
    let (positions, normals) = (file.push("accessors", part(0)), file.push("accessors", part(12)));
    file.primitive()["attributes"] = json!({"POSITION": positions, "NORMAL": normals});
    let scene = file.loaded();
    assert_eq!(mesh(&scene, 0).positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(mesh(&scene, 0).normals, [DVec3::Z; 3]);
    // The second of them moved; and the second and third of nothing but zeros.
    let (indices, values) =
        (file.view(&[1, 2]), file.view(&[2.0f32, 0.0, 0.0, 0.0, 3.0, 0.0].map(f32::to_le_bytes).concat()));
    let sparse = |count| json!({"count": count, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
    file.json["accessors"][positions]["sparse"] = sparse(1);
    assert_eq!(mesh(&file.loaded(), 0).positions, [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y]);
    file.json["accessors"][positions] = json!({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse(2)});
    assert_eq!(mesh(&file.loaded(), 0).positions, [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 3.0]);
}

#[test]
fn integers_are_normalised_or_not() {
    let mut file = File::triangle();
    let bytes: Vec<u8> =
        [0i16, 0, 0, 0, i16::MAX, 0, 0, 0, 0, i16::MIN, 0, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let positions = file.accessor("VEC3", 5122, 3, &bytes);
    let view = file.json["accessors"][positions]["bufferView"].as_u64().unwrap() as usize;
    file.json["bufferViews"][view]["byteStride"] = json!(8);
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    file.primitive()["attributes"]["POSITION"] = json!(positions);
    assert_eq!(mesh(&file.loaded(), 0).positions, [DVec3::ZERO, DVec3::X * 32767.0, DVec3::Y * -32768.0]);
    file.json["accessors"][positions]["normalized"] = json!(true);
    assert_eq!(mesh(&file.loaded(), 0).positions, [DVec3::ZERO, DVec3::X, DVec3::NEG_Y]);
}

#[test]
fn meshes_have_what_their_materials_ask_for() {
    let mut file = File::textured(json!({}));
    let other = file.floats("VEC2", &[0.5, 0.0, 0.5, 0.0, 0.5, 1.0]);
    file.primitive()["attributes"]["TEXCOORD_1"] = json!(other);
    let colors = file.accessor("VEC4", 5121, 3, &[255, 0, 0, 255, 0, 255, 0, 0, 0, 51, 255, 255]);
    file.json["accessors"][colors]["normalized"] = json!(true);
    let scene = file.loaded();
    assert!(mesh(&scene, 0).uvs.is_empty() && mesh(&scene, 0).attributes.is_empty() && scene.textures.is_empty());
    // The second set alone is the mesh's first.
    file.json["materials"][0] = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}}});
    let scene = file.loaded();
    assert_eq!(mesh(&scene, 0).uvs[2], DVec2::new(0.5, 1.0));
    assert!(mesh(&scene, 0).more_uvs.is_empty() && scene.textures[0].uv_set == 0);
    file.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    file.json["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    file.primitive()["attributes"]["COLOR_0"] = json!(colors);
    let scene = file.loaded();
    let m = mesh(&scene, 0);
    assert_eq!((m.uvs[2], m.more_uvs[0][2]), (DVec2::new(0.5, 1.0), DVec2::Y));
    let color = &m.attributes[0];
    assert_eq!((color.name.as_str(), color.width, color.of_faces, color.values[9]), ("color", 4, false, 0.2));
    let (_, varying) = gltf(&scene);
    let TextureKind::Product([picture, vertices]) = scene.textures[varying[0].1.0].kind else { panic!() };
    assert!(matches!(&scene.textures[vertices.0].kind, TextureKind::Attribute { name, .. } if name == "color"));
    assert!(matches!(&scene.textures[picture.0].kind, TextureKind::Bitmap { .. }));
    // A set that is not there.
    file.primitive()["attributes"].as_object_mut().unwrap().remove("TEXCOORD_1");
    let scene = file.loaded();
    assert_eq!(mesh(&scene, 0).uvs, [DVec2::ZERO; 3]);
    assert!(scene.warnings[0].contains("its material asks for TEXCOORD_1, which it lacks"));
}

#[test]
fn meshes_are_in_their_pose() {
    let mut file = File::triangle();
    let up = file.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0]);
    let normals = file.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    file.primitive()["targets"] = json!([{"POSITION": up, "NORMAL": up}, {"POSITION": up}]);
    assert_eq!(mesh(&file.loaded(), 0).positions[1], DVec3::X);
    file.json["meshes"][0]["weights"] = json!([0.5, 0]);
    let scene = file.loaded();
    assert_eq!(mesh(&scene, 0).positions[1], DVec3::new(1.0, 0.0, 1.0));
    assert_eq!(mesh(&scene, 0).normals[1], DVec3::new(0.0, 0.0, 2.0));
    // A node's own weights win, and make it a mesh of its own.
    file.push("nodes", json!({"mesh": 0, "weights": [1, 1]}));
    let scene = file.loaded();
    assert_eq!(mesh(&scene, 0).positions[1], DVec3::new(1.0, 0.0, 1.0));
    assert_eq!(mesh(&scene, 1).positions[1], DVec3::new(1.0, 0.0, 4.0));
}

#[test]
fn skins_put_meshes_where_their_joints_are() {
    let mut file = File::triangle();
    let joints = file.accessor("VEC4", 5121, 3, &[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0]);
    let mut inverse = DMat3::IDENTITY.to_cols_array().map(|v| v as f32).to_vec();
    inverse = [&inverse[0..3], &[0.0], &inverse[3..6], &[0.0], &inverse[6..9], &[0.0, -1.0, 0.0, 0.0, 1.0]].concat();
    let matrices = file.floats("MAT4", &[inverse.clone(), inverse].concat());
    file.primitive()["attributes"]["JOINTS_0"] = json!(joints);
    file.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
    file.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": matrices}]);
    file.json["nodes"] = json!([{"mesh": 0, "skin": 0, "translation": [100, 0, 0]}, {"translation": [1, 0, 0]}, {"translation": [1, 0, 8]}]);
    let scene = file.loaded();
    assert_eq!(scene.shapes[0].to_world, DAffine3::IDENTITY, "its node does not move it");
    assert_eq!(mesh(&scene, 0).positions, [DVec3::ZERO, DVec3::new(1.0, 0.0, 8.0), DVec3::new(0.0, 1.0, 4.0)]);
}

/// u runs along x and v, downwards, along −y: the green channel's direction, up in the picture, is +y.
#[test]
fn tangents_are_made_where_a_normal_map_needs_them() {
    let mut file = File::textured(json!({"normalTexture": {"index": 0, "scale": 0.5}}));
    let uvs = file.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    file.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
    assert_eq!(mesh(&file.loaded(), 0).tangents, [DVec4::new(1.0, 0.0, 0.0, 1.0); 3]);
    let scene = file.loaded();
    let BsdfKind::TwoSided { front, back } = *surface(&scene) else { panic!() };
    assert!(matches!(kind(&scene, back), BsdfKind::Null));
    let BsdfKind::Perturbed { nested, normal, terminator: Terminator::Bend } = *kind(&scene, front) else {
        panic!("{:?}", kind(&scene, front))
    };
    assert!(matches!(kind(&scene, nested), BsdfKind::Gltf(_)));
    let NormalSource::Map { texture, scale: 0.5 } = normal else { panic!("{normal:?}") };
    assert!(matches!(scene.textures[texture.0].kind, TextureKind::Bitmap { .. }));
    // A mirrored picture.
    let uvs = file.floats("VEC2", &[1.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    file.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
    assert_eq!(mesh(&file.loaded(), 0).tangents, [DVec4::new(-1.0, 0.0, 0.0, -1.0); 3]);
    // Those of the file, which count only where it has normals.
    let given = file.floats("VEC4", &[0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0]);
    file.primitive()["attributes"]["TANGENT"] = json!(given);
    assert_eq!(mesh(&file.loaded(), 0).tangents[0].w, -1.0);
    assert_eq!(mesh(&file.loaded(), 0).tangents[0].x, -1.0);
    let normals = file.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    assert_eq!(mesh(&file.loaded(), 0).tangents[0], DVec4::new(0.0, 1.0, 0.0, -1.0));
    assert_eq!(mesh(&file.loaded(), 0).tangents[2], DVec4::new(0.0, 1.0, 0.0, 1.0));
    // Seen from behind, a bump is a dent: the map is above the two sides.
    file.json["materials"][0]["doubleSided"] = json!(true);
    let scene = file.loaded();
    let BsdfKind::Perturbed { nested, .. } = *surface(&scene) else { panic!() };
    assert!(matches!(kind(&scene, nested), BsdfKind::TwoSided { front, back } if front == back));
}

#[test]
fn constant_materials_have_no_textures() {
    let scene = with_material(json!({"pbrMetallicRoughness":
        {"baseColorFactor": [0.5, 0.25, 1, 0.5], "metallicFactor": 0.25, "roughnessFactor": 0}}));
    let (material, varying) = gltf(&scene);
    let expected = Gltf { base_color: Rgb::new(0.5, 0.25, 1.0), metallic: 0.25, roughness: 0.0, ..Gltf::default() };
    assert_eq!((material, varying.len(), scene.textures.len()), (expected, 0, 0));
    let BsdfKind::TwoSided { front, back } = *surface(&scene) else { panic!() };
    assert!(front != back && matches!(kind(&scene, back), BsdfKind::Null));
    let scene = with_material(json!({"doubleSided": true}));
    assert!(matches!(*surface(&scene), BsdfKind::TwoSided { front, back } if front == back));
    // A primitive without a material has that of the specification.
    let scene = File::triangle().loaded();
    assert_eq!(gltf(&scene).0, Gltf::default());
}

#[test]
fn channels_and_factors() {
    let scene = with_material(json!({"pbrMetallicRoughness": {
        "baseColorFactor": [0.5, 1, 1, 1], "baseColorTexture": {"index": 0},
        "roughnessFactor": 0.5, "metallicRoughnessTexture": {"index": 0}}}));
    let (material, varying) = gltf(&scene);
    assert_eq!((material.metallic, material.roughness), (1.0, 0.5));
    let texture = |p: Parameter| &scene.textures[varying.iter().find(|v| v.0 == p).unwrap().1.0].kind;
    let TextureKind::Channel { of, channel: Channel::Blue } = *texture(Parameter::Metallic) else { panic!() };
    let TextureKind::Bitmap { image: raw, .. } = &scene.textures[of.0].kind else { panic!() };
    let TextureKind::Product([half, green]) = *texture(Parameter::Roughness) else { panic!() };
    assert!(matches!(scene.textures[half.0].kind, TextureKind::Constant(c) if c == Rgb::splat(0.5)));
    assert!(
        matches!(scene.textures[green.0].kind, TextureKind::Channel { of: same, channel: Channel::Green } if same == of)
    );
    let TextureKind::Product([factor, picture]) = *texture(Parameter::BaseColor) else { panic!() };
    assert!(matches!(scene.textures[factor.0].kind, TextureKind::Constant(c) if c == Rgb::new(0.5, 1.0, 1.0)));
    let TextureKind::Bitmap { image: color, bilinear: true, wrap: [Wrap::Repeat, Wrap::Repeat] } =
        &scene.textures[picture.0].kind
    else {
        panic!()
    };
    assert!(!Arc::ptr_eq(raw, color), "one is decoded as colours, one is not");
}

#[test]
fn textures_have_samplers_and_transforms() {
    let mut file = File::textured(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {
        "KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": std::f64::consts::FRAC_PI_2, "scale": [2, 3], "texCoord": 1}}}},
        "normalTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [5, 5]}}}}));
    let uvs = file.floats("VEC2", &[0.0; 6]);
    file.primitive()["attributes"]["TEXCOORD_1"] = json!(uvs);
    file.push("samplers", json!({"magFilter": 9728, "minFilter": 9987, "wrapS": 33071, "wrapT": 33648}));
    file.json["textures"][0]["sampler"] = json!(0);
    let scene = file.loaded();
    let TextureKind::Bitmap { bilinear: false, wrap: [Wrap::Clamp, Wrap::Mirror], .. } = scene.textures[0].kind else {
        panic!("{:?}", scene.textures[0])
    };
    assert_eq!(scene.textures[0].uv_set, 0, "the only set of colours comes first");
    // Counter-clockwise as seen where v runs down: u turns to −v.
    let to_uv = scene.textures[0].to_uv;
    assert!((to_uv.transform_point2(DVec2::X) - DVec2::new(0.5, 0.25 - 2.0)).length() < 1e-6, "{to_uv}");
    assert!((to_uv.transform_point2(DVec2::Y) - DVec2::new(0.5 + 3.0, 0.25)).length() < 1e-6, "{to_uv}");
    let normal = &scene.textures[1];
    assert_eq!((normal.to_uv.transform_point2(DVec2::ONE), normal.uv_set), (DVec2::splat(5.0), 1));
}

#[test]
fn pictures_may_be_in_buffers_and_files() {
    let mut file = File::textured(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let view = file.view(&png());
    file.json["images"][0] = json!({"bufferView": view, "mimeType": "image/png"});
    let width = |scene: &SceneDescription| match &scene.textures[0].kind {
        TextureKind::Bitmap { image, .. } => image.width(),
        other => panic!("{other:?}"),
    };
    assert_eq!(width(&file.loaded()), 2);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("p.png"), png()).unwrap();
    // What no material that is seen uses is not looked for.
    file.json["images"] = json!([{"uri": "p.png"}, {"uri": "absent.png"}]);
    file.push("textures", json!({"source": 1}));
    file.push("materials", json!({"emissiveTexture": {"index": 1}, "emissiveFactor": [1, 1, 1]}));
    file.json["materials"][0]["emissiveTexture"] = json!({"index": 1});
    fs::write(folder.path().join("m.gltf"), file.text()).unwrap();
    assert_eq!(width(&load(&folder.path().join("m.gltf"), &LoadOptions::default()).unwrap()), 2);
}

#[test]
fn alpha_is_ignored_cut_or_blended() {
    let material = |mode: &str, factor: f64, textured: bool| {
        let mut pbr = json!({"baseColorFactor": [1, 1, 1, factor]});
        if textured {
            pbr["baseColorTexture"] = json!({"index": 0});
        }
        with_material(
            json!({"alphaMode": mode, "alphaCutoff": 0.25, "pbrMetallicRoughness": pbr, "emissiveFactor": [1, 0, 0]}),
        )
    };
    let mask = |scene: &SceneDescription| match *surface(scene) {
        BsdfKind::Mask { opacity, nested } => {
            assert!(matches!(kind(scene, nested), BsdfKind::TwoSided { .. }));
            Some(opacity)
        }
        _ => None,
    };
    assert_eq!(mask(&material("OPAQUE", 0.5, true)), None);
    assert_eq!(mask(&material("BLEND", 0.5, false)), Some(Varying::Constant(0.5)));
    assert_eq!(mask(&material("BLEND", 1.0, false)), None);
    assert_eq!(mask(&material("MASK", 0.5, false)), None);
    // Nothing of it is there.
    let mut file =
        File::textured(json!({"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.4]}}));
    file.push("nodes", json!({"camera": 0}));
    file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}));
    assert!(file.loaded().shapes.is_empty());
    let scene = material("MASK", 0.5, true);
    let Some(Varying::Texture(id)) = mask(&scene) else { panic!() };
    let TextureKind::Threshold { of, cutoff: 0.25 } = scene.textures[id.0].kind else { panic!() };
    let TextureKind::Product([factor, alpha]) = scene.textures[of.0].kind else { panic!() };
    assert!(matches!(scene.textures[factor.0].kind, TextureKind::Constant(c) if c == Rgb::splat(0.5)));
    assert!(matches!(scene.textures[alpha.0].kind, TextureKind::Channel { channel: Channel::Alpha, .. }));
    // Holes do not glow.
    let emission = scene.shapes[0].emission.unwrap();
    assert_eq!((emission.radiance, emission.texture), (Rgb::new(1.0, 0.0, 0.0), Some(id)));
    let emission = material("BLEND", 0.5, false).shapes[0].emission.unwrap();
    assert_eq!((emission.radiance, emission.texture, emission.both_sides), (Rgb::new(0.5, 0.0, 0.0), None, false));
}

#[test]
fn materials_with_extensions() {
    let scene = with_material(json!({"extensions": {
        "KHR_materials_ior": {"ior": 1.25},
        "KHR_materials_specular": {"specularFactor": 0.5, "specularTexture": {"index": 0}, "specularColorFactor": [2, 1, 1]},
        "KHR_materials_transmission": {"transmissionFactor": 0.75, "transmissionTexture": {"index": 0}},
        "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 4, "attenuationColor": [0.5, 0, 1]},
        "KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": {"index": 0}, "clearcoatRoughnessFactor": 0.25},
        "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0, 0], "sheenColorTexture": {"index": 0},
            "sheenRoughnessFactor": 0.5, "sheenRoughnessTexture": {"index": 0}},
        "KHR_materials_iridescence": {"iridescenceFactor": 1, "iridescenceThicknessMinimum": 0,
            "iridescenceThicknessTexture": {"index": 0}},
    }}));
    let (material, varying) = gltf(&scene);
    let least = 1e-6_f64 as f32;
    let expected = Gltf {
        ior: 1.25,
        specular: 0.5,
        specular_color: Rgb::new(2.0, 1.0, 1.0),
        transmission: 0.75,
        volume: Some(Volume { attenuation_color: Rgb::new(0.5, least, 1.0), attenuation_distance: 4.0 }),
        clearcoat: 1.0,
        clearcoat_roughness: 0.25,
        sheen_color: Rgb::new(0.5, 0.0, 0.0),
        sheen_roughness: 0.5,
        iridescence: 1.0,
        iridescence_ior: f64::from(1.3_f32),
        iridescence_thickness: 400.0,
        ..Gltf::default()
    };
    assert_eq!(material, expected);
    use Parameter::*;
    let parameters: Vec<Parameter> = varying.iter().map(|v| v.0).collect();
    assert_eq!(parameters, [Specular, Transmission, Clearcoat, SheenColor, SheenRoughness, IridescenceThickness]);
    assert!(matches!(scene.textures[varying[2].1.0].kind, TextureKind::Channel { channel: Channel::Red, .. }));
    assert!(matches!(surface(&scene), BsdfKind::Gltf(_)), "what transmits has two sides of its own");
    // Without thickness there is nothing inside; what is off is not looked up.
    let scene = with_material(json!({"extensions": {
        "KHR_materials_ior": {"ior": 0}, "KHR_materials_volume": {"attenuationDistance": 4},
        "KHR_materials_clearcoat": {"clearcoatRoughnessTexture": {"index": 0}}}}));
    let (material, varying) = gltf(&scene);
    assert_eq!((material, varying.len()), (Gltf { ior: 1e6, ..Gltf::default() }, 0));
}

#[test]
fn ranges_older_models_and_what_is_left_out() {
    let older = json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.5, 0, 0, 1],
        "specularFactor": [0.08, 0.04, 0.04], "glossinessFactor": 0.75, "specularGlossinessTexture": {"index": 0}}}});
    let (material, varying) = gltf(&with_material(older));
    assert_eq!((material.base_color, material.metallic, material.roughness), (Rgb::new(0.5, 0.0, 0.0), 0.0, 0.25));
    assert_eq!((varying[0].0, varying[1].0), (Parameter::SpecularColor, Parameter::Roughness));
    assert!((material.specular_color.to_array()[0] - 2.0).abs() < 1e-5, "reflects 8 %");
    // From 100 to 400 nm.
    let scene = with_material(json!({"extensions": {"KHR_materials_iridescence":
        {"iridescenceFactor": 1, "iridescenceThicknessTexture": {"index": 0}}}}));
    let (Parameter::IridescenceThickness, id) = gltf(&scene).1[0] else { panic!() };
    let TextureKind::Sum([least, more]) = scene.textures[id.0].kind else { panic!() };
    let TextureKind::Product([range, _]) = scene.textures[more.0].kind else { panic!() };
    let constant = |id: TextureId| {
        if let TextureKind::Constant(c) = scene.textures[id.0].kind { c.to_array()[0] } else { f32::NAN }
    };
    assert_eq!([constant(least), constant(range)], [100.0, 300.0]);
    // A coat has the surface's normal, or its own.
    let coated = |coat: Value| {
        let material = json!({"normalTexture": {"index": 0}, "extensions": {"KHR_materials_clearcoat": coat}});
        gltf(&with_material(material)).0.coat_normal
    };
    assert_eq!(coated(json!({"clearcoatFactor": 1})), None);
    let map = json!({"index": 0, "scale": 0.5});
    let own = coated(json!({"clearcoatFactor": 1, "clearcoatNormalTexture": map}));
    assert!(matches!(own, Some(NormalSource::Map { scale: 0.5, .. })), "{own:?}");
    let mut file = File::triangle();
    file.json["extensionsUsed"] = json!(["KHR_materials_anisotropy", "KHR_materials_ior"]);
    file.json["animations"] = json!([{"channels": [], "samplers": []}]);
    let warnings = file.loaded().warnings;
    assert!(warnings[0].ends_with("extensionsUsed: KHR_materials_anisotropy is left out"), "{warnings:?}");
    assert!(warnings[1].ends_with("animations: they are left out: everything is where its node says"));
}

#[test]
fn what_glows_and_what_is_not_lit() {
    let glow = json!({"emissiveFactor": [1, 0.5, 0], "emissiveTexture": {"index": 0}, "doubleSided": true,
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}});
    let scene = with_material(glow.clone());
    let Emission { radiance, texture: Some(id), both_sides: true } = scene.shapes[0].emission.unwrap() else {
        panic!()
    };
    assert_eq!(radiance, Rgb::new(4.0, 2.0, 0.0));
    assert!(matches!(scene.textures[id.0].kind, TextureKind::Bitmap { .. }));
    assert!(scene.lights.is_empty(), "it is a lamp");
    // What is no brighter than white lights no room.
    let scene = with_material(json!({"emissiveFactor": [1, 1, 1]}));
    assert!(matches!(scene.lights[0].kind, LightKind::Environment { .. }));
    let scene = with_material(json!({"extensions": {"KHR_materials_unlit": {}}, "emissiveFactor": [1, 1, 1],
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0, 1], "baseColorTexture": {"index": 0}}}));
    let Emission { radiance, texture: Some(_), both_sides: false } = scene.shapes[0].emission.unwrap() else {
        panic!()
    };
    assert_eq!(radiance, Rgb::new(0.5, 0.5, 0.0));
    let BsdfKind::TwoSided { front, .. } = *surface(&scene) else { panic!() };
    assert!(matches!(*kind(&scene, front), BsdfKind::Diffuse { reflectance: Rgb::BLACK }));
}

#[test]
fn punctual_lights() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([{"mesh": 0}, {"rotation": [1, 0, 0, 1], "translation": [1, 2, 3], "children": [2, 3],
        "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"extensions": {"KHR_lights_punctual": {"light": 1}}}, {"extensions": {"KHR_lights_punctual": {"light": 2}}}]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "directional", "color": [1, 0.5, 0], "intensity": 2},
        {"type": "point", "range": 5},
        {"type": "spot", "intensity": 3, "spot": {"innerConeAngle": 0.5}},
    ]}});
    let lights = file.loaded().lights;
    let LightKind::Directional { direction, irradiance } = lights[0].kind else { panic!() };
    assert!(close(direction, DVec3::Y) && irradiance == Rgb::new(2.0, 1.0, 0.0), "{direction}");
    let LightKind::Point { position, intensity } = lights[1].kind else { panic!() };
    assert!(close(position, DVec3::new(1.0, 2.0, 3.0)) && intensity == Rgb::WHITE);
    let LightKind::Spot { direction, cutoff_angle, beam_width, intensity, .. } = lights[2].kind else { panic!() };
    assert!(close(direction, DVec3::Y) && intensity == Rgb::splat(3.0));
    assert!((cutoff_angle - 45.0).abs() < 1e-5 && (beam_width - 0.5_f64.to_degrees()).abs() < 1e-9);
    assert_eq!(lights.len(), 3);
}

#[test]
fn cameras_in_the_order_of_their_nodes() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([{"camera": 1, "translation": [0, 0, 5]}, {"mesh": 0},
        {"camera": 0, "scale": [2, 2, 2], "rotation": [0, 1, 0, 1]}]);
    file.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": std::f64::consts::FRAC_PI_2, "znear": 0.5, "aspectRatio": 0.5}},
        {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 1.5, "znear": 0, "zfar": 100}},
    ]);
    let cameras = file.loaded().cameras;
    assert_eq!(cameras.len(), 2);
    let ortho = &cameras[0];
    assert_eq!(ortho.projection, Projection::Orthographic);
    assert_eq!((ortho.film.width, ortho.film.height, ortho.far_clip), (768, 384, 100.0));
    assert!(ortho.near_clip > 0.0 && ortho.near_clip < 1e-3);
    // Left of the picture, at the edge of what it sees, is −x; it looks along −z.
    assert!(close(ortho.to_world.transform_vector3(DVec3::X), DVec3::new(-3.0, 0.0, 0.0)));
    assert!(close(ortho.to_world.transform_vector3(DVec3::Z), DVec3::NEG_Z));
    assert!(close(ortho.to_world.translation, DVec3::new(0.0, 0.0, 5.0)));
    let perspective = &cameras[1];
    assert_eq!((perspective.film.width, perspective.film.height), (384, 768));
    assert_eq!((perspective.near_clip, perspective.far_clip), (0.5, f64::INFINITY));
    let Projection::Perspective { fov: FieldOfView { degrees, axis: FovAxis::Y }, .. } = perspective.projection else {
        panic!()
    };
    assert!((degrees - 90.0).abs() < 1e-5);
    // A quarter turn about +y takes −z to −x; the scale does not count.
    assert!(close(perspective.to_world.transform_vector3(DVec3::Z), DVec3::NEG_X));
    assert!(close(perspective.to_world.transform_vector3(DVec3::Y), DVec3::Y));
}

#[test]
fn large_meshes_are_shared() {
    let mut file = File::new();
    let positions: Vec<f32> = (0..3 * 3000).flat_map(|i| [i as f32, (i % 3) as f32, (i % 2) as f32]).collect();
    let positions = file.floats("VEC3", &positions);
    let glow = file.push("materials", json!({"emissiveFactor": [1, 1, 1]}));
    file.push(
        "meshes",
        json!({"name": "leaf", "primitives": [{"attributes": {"POSITION": positions}},
        {"attributes": {"POSITION": positions}, "material": glow}]}),
    );
    for x in [0, 1, 2] {
        file.push("nodes", json!({"mesh": 0, "translation": [x, 0, 0]}));
    }
    // Mirrored once: another mesh, which is not worth a group.
    file.push("nodes", json!({"mesh": 0, "scale": [1, 1, -1]}));
    let scene = file.loaded();
    assert_eq!((scene.groups.len(), scene.groups[0].shapes.len(), scene.instances.len()), (1, 1, 3));
    assert_eq!(scene.instances[2].to_world.translation, DVec3::X * 2.0);
    // What emits cannot be in a group.
    let names: Vec<&str> = scene.shapes.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["leaf[1]", "leaf[1]", "leaf[1]", "leaf[0]", "leaf[1]"]);
    // The same by an extension.
    let (moved, scaled) =
        (file.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 7.0, 0.0]), file.floats("VEC3", &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]));
    let turned = file.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0]);
    file.json["nodes"] = json!([{"mesh": 0, "translation": [1, 0, 0], "extensions": {"EXT_mesh_gpu_instancing":
        {"attributes": {"TRANSLATION": moved, "SCALE": scaled, "ROTATION": turned}}}}]);
    file.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let scene = file.loaded();
    assert_eq!(scene.instances.len(), 0, "3000 triangles saved are too few");
    assert!(close(scene.shapes[2].to_world.transform_point3(DVec3::X), DVec3::new(1.0, 9.0, 0.0)));
    file.json["nodes"].as_array_mut().unwrap().push(json!({"mesh": 0}));
    assert_eq!(file.loaded().instances.len(), 3);
}

/// The pixels of a square in the middle of the triangle, seen from this height above it, in white surroundings.
fn seen(mut scene: SceneDescription, height: f64) -> Vec<Rgb> {
    let middle = DVec3::new(0.25, 0.25, 0.0);
    scene.cameras = vec![common::camera(middle + DVec3::Z * height, middle, 5.0, 4)];
    scene.lights = vec![common::light(LightKind::Constant { radiance: Rgb::WHITE })];
    let compiled = common::compiled(&scene, Accelerator::Native);
    common::picture(&compiled, &common::settings(Estimator::Path, 16)).pixels().to_vec()
}

/// A culled face is not seen from behind; without textures and with them.
#[test]
fn faces_have_the_sides_that_they_should() {
    let near = |p: &Rgb, value: f32| p.to_array().iter().all(|c| (c - value).abs() < 1e-6);
    for textured in [false, true] {
        let mut black = json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}});
        if textured {
            black["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({"index": 0});
        }
        assert!(seen(with_material(black.clone()), 1.0).iter().all(|p| p.luminance() < 0.5));
        assert!(seen(with_material(black.clone()), -1.0).iter().all(|p| near(p, 1.0)), "textured: {textured}");
        black["doubleSided"] = json!(true);
        assert!(seen(with_material(black), -1.0).iter().all(|p| p.luminance() < 0.5));
    }
    // What is not lit shows its colour and reflects nothing.
    let unlit = json!({"extensions": {"KHR_materials_unlit": {}},
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}});
    assert!(seen(with_material(unlit.clone()), 1.0).iter().all(|p| near(p, 0.5)));
    assert!(seen(with_material(unlit), -1.0).iter().all(|p| near(p, 1.0)));
}
