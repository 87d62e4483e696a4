//! What is wrong with a glTF file is told in one line that names the file and the place in its JSON.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod gltf_file;

use gltf_file::{File, outcome};
use serde_json::{Value, json};
use snell::loader::{LoadOptions, load};

/// A change to a file, and what is then said of it.
type Row = (fn(&mut File), &'static str);

/// Every change must be refused with its message, behind the file's name.
fn all_refused(start: &File, rows: &[Row]) {
    for (change, expected) in rows {
        let mut file = start.clone();
        change(&mut file);
        let error = file.outcome(false).err().unwrap_or_else(|| panic!("not refused: {expected}\n{}", file.json));
        assert!(error.contains(&format!("m.gltf: {expected}")), "{error}\nexpected: {expected}\n{}", file.json);
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn containers() {
    let refused = |name: &str, bytes: &[u8], expected: &str| {
        let error = outcome(name, bytes, false).err().unwrap();
        assert!(error.contains(expected), "{error}\nexpected: {expected}");
    };
    refused("m.gltf", b"{\"asset\":\n {}}", "m.gltf:2:3: this is no glTF: missing field `version`");
    refused("m.gltf", b"", "m.gltf:1:1: this is no glTF: EOF");
    refused("m.glb", b"glTF", "m.glb: the file is cut short");
    let good = File::triangle().binary();
    for length in 0..good.len() {
        assert!(outcome("m.glb", &good[..length], false).is_err(), "cut to {length} bytes");
    }
    refused("m.glb", &good[..good.len() - 1], "the file is cut short: it has");
    let changed = |at: usize, byte: u8| {
        let mut bytes = good.clone();
        bytes[at] = byte;
        bytes
    };
    refused("m.glb", &changed(4, 1), "a binary glTF has version 2, not 1");
    refused("m.glb", &changed(16, b'X'), "a binary glTF begins with a chunk of JSON");
    refused("m.glb", &changed(14, 255), "bytes does not fit into the file");
    refused("m.glb", &changed(20, b'?'), "m.glb: its JSON is no glTF: expected value (line 1, column 1)");
    let folder = tempfile::tempdir().unwrap();
    let absent = load(&folder.path().join("absent.glb"), &LoadOptions::default()).unwrap_err().to_string();
    assert!(absent.contains("absent.glb: "), "{absent}");
    let options = LoadOptions { defines: vec![("x".into(), "1".into())], ..LoadOptions::default() };
    let error = load(&folder.path().join("absent.gltf"), &options).unwrap_err().to_string();
    assert_eq!(error, "-D x: a glTF file has no parameters, only an XML scene has");
}

#[test]
fn extensions_and_versions() {
    all_refused(
        &File::triangle(),
        &[
            (|f| f.json["asset"]["version"] = json!("1.0"), "glTF 1.0 is not supported yet; supported: glTF 2.0"),
            (|f| f.json["asset"]["minVersion"] = json!("2.1"), "glTF 2.1 is not supported yet"),
            (
                |f| f.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
                "extensionsRequired: KHR_draco_mesh_compression (its meshes are compressed by Draco) is not supported yet; \
                 supported: EXT_mesh_gpu_instancing, KHR_lights_punctual",
            ),
            (|f| f.json["extensionsRequired"] = json!(["X_new"]), "extensionsRequired: X_new is not supported yet"),
        ],
    );
    for (name, what) in [
        ("EXT_meshopt_compression", "its buffers are compressed by meshopt"),
        ("KHR_texture_basisu", "its textures are KTX2 pictures of Basis Universal"),
        ("EXT_texture_webp", "its textures are WebP pictures"),
        ("EXT_texture_avif", "its textures are AVIF pictures"),
        ("MSFT_texture_dds", "its textures are DDS pictures"),
        ("KHR_gaussian_splatting", "it has Gaussian splats"),
    ] {
        let mut file = File::triangle();
        file.json["extensionsRequired"] = json!([name]);
        assert!(file.outcome(false).unwrap_err().contains(what), "{name}");
        let warnings = file.outcome(true).unwrap().warnings;
        assert!(warnings[0].contains(&format!("extensionsRequired: {name} is left out ({what})")), "{warnings:?}");
    }
}

#[test]
fn buffers() {
    all_refused(
        &File::triangle(),
        &[
            (
                |f| f.json["buffers"] = json!([{"byteLength": 36}]),
                "buffers[0]: it has no uri, and is not the buffer of a",
            ),
            (
                |f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "data:;base64,AAAA"}]),
                "buffers[0]: it has 3 bytes, but byteLength says 4",
            ),
            (
                |f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "data:,AAAA"}]),
                "buffers[0]: expected base64 in its data: URI",
            ),
            (
                |f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "data:;base64,A*AA"}]),
                "buffers[0]: its base64 is wrong: ",
            ),
            (
                |f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "https://x.org/a.bin"}]),
                "buffers[0]: expected a data: URI or the name of a file, not 'https://x.org/a.bin'",
            ),
            (
                |f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "a%2.bin"}]),
                "buffers[0]: 'a%2.bin' is not a URI",
            ),
            (|f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "none.bin"}]), "buffers[0]: "),
            (
                |f| f.json["bufferViews"][0]["buffer"] = json!(7),
                "bufferViews[0]: there is no buffers[7]; the file has 1",
            ),
            (
                |f| f.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX),
                "bufferViews[0]: 36 bytes from 18446744073709551615 are outside of buffers[0], which has 36",
            ),
        ],
    );
}

#[test]
fn accessors() {
    all_refused(
        &File::triangle(),
        &[
            (
                |f| f.json["accessors"][0]["bufferView"] = json!(3),
                "accessors[0]: there is no bufferViews[3]; the file has 1",
            ),
            (
                |f| f.json["accessors"][0]["count"] = json!(4),
                "accessors[0]: 4 elements from byte 0 do not fit into its bufferView of 36 bytes",
            ),
            (
                |f| f.json["accessors"][0]["byteOffset"] = json!(u64::MAX),
                "accessors[0]: 3 elements from byte 18446744073709551615 do not fit",
            ),
            (
                |f| f.json["bufferViews"][0]["byteStride"] = json!(u64::MAX / 2),
                "accessors[0]: 3 elements from byte 0 do not fit into",
            ),
            (
                |f| f.json["bufferViews"][0]["byteStride"] = json!(8),
                "accessors[0]: elements of 12 bytes cannot be 8 bytes apart",
            ),
            (
                |f| f.json["accessors"][0]["count"] = json!(1u64 << 32),
                "accessors[0]: 4294967296 elements are too many to be numbered",
            ),
            (
                |f| f.json["accessors"][0] = json!({"componentType": 5126, "count": 1 << 25, "type": "VEC3"}),
                "accessors[0]: 33554432 elements without a bufferView are too many",
            ),
            (|f| f.json["accessors"][0]["type"] = json!("VEC5"), "accessors[0]: its type is not one of SCALAR, VEC2"),
            (
                |f| f.json["accessors"][0]["componentType"] = json!(5124),
                "accessors[0]: its componentType is not one of 5120, 5121",
            ),
            (
                |f| f.json["accessors"][0]["type"] = json!("VEC2"),
                "meshes[0].primitives[0].attributes.POSITION: expected 3 numbers an element, but accessors[0] is VEC2",
            ),
            (
                |f| f.json["accessors"][0]["componentType"] = json!(5125),
                "meshes[0].primitives[0].attributes.POSITION: accessors[0] has numbers of the wrong type (componentType 5125)",
            ),
            (|f| f.bytes[14..16].copy_from_slice(&[0x80, 0x7f]), "accessors[0]: element 1 is not finite"),
        ],
    );
}

#[test]
fn sparse_accessors() {
    let mut file = File::triangle();
    let (indices, values) = (file.view(&[2, 0, 3, 0]), file.view(&[0; 24]));
    file.json["accessors"][0]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values}});
    assert!(file.outcome(false).is_ok());
    all_refused(
        &file,
        &[
            (
                |f| f.json["accessors"][0]["sparse"]["count"] = json!(2),
                "accessors[0].sparse: there is no element 3 of 3",
            ),
            (
                |f| f.json["accessors"][0]["sparse"]["count"] = json!(u64::MAX),
                "accessors[0].sparse: it has 18446744073709551615 elements, but there are 3 to replace",
            ),
            (
                |f| f.json["accessors"][0]["sparse"]["count"] = json!(3),
                "accessors[0].sparse: 3 elements from byte 0 do not fit into its bufferView of 4 bytes",
            ),
            (
                |f| f.json["accessors"][0]["sparse"]["indices"]["componentType"] = json!(5126),
                "accessors[0].sparse: the componentType of its indices is not one of 5121, 5123, 5125",
            ),
        ],
    );
}

#[test]
fn meshes() {
    let mut file = File::textured(json!({"normalTexture": {"index": 0}}));
    let indices = file.accessor("SCALAR", 5121, 3, &[0, 1, 2]);
    let short = file.floats("VEC3", &[0.0; 6]);
    let colors = file.floats("VEC2", &[0.0; 6]);
    file.primitive()["indices"] = json!(indices);
    assert_eq!((indices, short, colors), (2, 3, 4));
    all_refused(
        &file,
        &[
            (|f| f.json["nodes"][0]["mesh"] = json!(1), "nodes[0]: there is no meshes[1]; the file has 1"),
            (|f| f.primitive()["material"] = json!(1), "meshes[0].primitives[0]: there is no materials[1]"),
            (|f| f.primitive()["mode"] = json!(7), "meshes[0].primitives[0]: its mode is not one from 0 to 6"),
            (
                |f| f.primitive()["attributes"]["POSITION"] = json!(9),
                "meshes[0].primitives[0].attributes.POSITION: there is no accessors[9]; the file has 5",
            ),
            (|f| f.bytes[60] = 3, "meshes[0].primitives[0].indices: there is no vertex 3; it has 3"),
            (
                |f| f.json["accessors"][2]["count"] = json!(2),
                "meshes[0].primitives[0]: 2 corners are no whole number of triangles",
            ),
            (
                |f| f.json["accessors"][2]["normalized"] = json!(true),
                "meshes[0].primitives[0].indices: accessors[2] has numbers of the wrong type (componentType 5121)",
            ),
            (
                |f| f.primitive()["attributes"]["NORMAL"] = json!(3),
                "meshes[0].primitives[0].attributes.NORMAL: it is of 2 vertices, but POSITION of 3",
            ),
            (
                |f| f.primitive()["attributes"]["TEXCOORD_0"] = json!(3),
                "meshes[0].primitives[0].attributes.TEXCOORD_0: it is of 2 vertices",
            ),
            (
                |f| f.primitive()["attributes"]["COLOR_0"] = json!(4),
                "meshes[0].primitives[0].attributes.COLOR_0: expected 3 numbers an element, but accessors[4] is VEC2",
            ),
            (
                |f| {
                    f.primitive()["targets"] = json!([{"POSITION": 3}]);
                    f.json["meshes"][0]["weights"] = json!([1]);
                },
                "meshes[0].primitives[0].targets[0]: it moves 2 vertices, but there are 3",
            ),
            (|f| f.json["nodes"][0]["weights"] = json!([1e300]), "nodes[0]: a weight of its mesh is not finite"),
        ],
    );
    let mut empty = File::new();
    empty.push("nodes", json!({}));
    all_refused(&empty, &[(|_| (), "there is nothing in it to look at, and it has no camera")]);
}

#[test]
fn skins() {
    let mut file = File::triangle();
    let joints = file.accessor("VEC4", 5121, 3, &[0; 12]);
    let weights = file.floats("VEC4", &[1.0; 12]);
    let matrix = file.floats("MAT4", &[3e38; 16]);
    assert_eq!((joints, weights, matrix), (1, 2, 3));
    file.primitive()["attributes"]["JOINTS_0"] = json!(joints);
    file.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
    file.json["skins"] = json!([{"joints": [1]}]);
    file.json["nodes"] = json!([{"mesh": 0, "skin": 0}, {}]);
    assert!(file.outcome(false).is_ok());
    all_refused(
        &file,
        &[
            (|f| f.json["nodes"][0]["skin"] = json!(1), "nodes[0].skin: there is no skins[1]; the file has 1"),
            (|f| f.json["skins"][0]["joints"] = json!([5]), "skins[0].joints: there is no nodes[5]; the file has 2"),
            (
                |f| {
                    f.primitive()["attributes"].as_object_mut().unwrap().remove("JOINTS_0");
                },
                "meshes[0].primitives[0]: a mesh with a skin needs JOINTS_0 and WEIGHTS_0",
            ),
            (|f| f.bytes[36] = 1, "meshes[0].primitives[0]: its skin has no joint 1"),
            (
                |f| f.json["accessors"][1]["count"] = json!(2),
                "meshes[0].primitives[0]: its joints are those of 2 vertices, but it has 3",
            ),
            (
                |f| {
                    f.json["skins"][0]["inverseBindMatrices"] = json!(3);
                    f.json["skins"][0]["joints"] = json!([0, 1]);
                },
                "skins[0].inverseBindMatrices: 1 matrices are not enough for 2 joints",
            ),
            (
                |f| {
                    let far = |child: usize| json!({"children": [child], "scale": [3e38, 3e38, 3e38]});
                    let chain: Vec<Value> = (1..8).map(far).collect();
                    let ends = [json!({"scale": [3e38, 3e38, 3e38]}), json!({"mesh": 0, "skin": 0})];
                    f.json["nodes"] = Value::Array([chain, ends.to_vec()].concat());
                    f.json["skins"][0] = json!({"joints": [7], "inverseBindMatrices": 3});
                },
                "meshes[0].primitives[0]: its pose is where numbers end: a vertex is not finite",
            ),
        ],
    );
}

#[test]
fn nodes() {
    all_refused(
        &File::triangle(),
        &[
            (
                |f| f.json["nodes"] = json!([{"mesh": 0}, {"children": [2]}, {"children": [1]}]),
                "nodes[1]: the node is below itself",
            ),
            (|f| f.json["nodes"][0]["children"] = json!([0]), "nodes[0]: the node is below itself"),
            (
                |f| f.json["nodes"][0]["children"] = json!([4]),
                "nodes[0].children: there is no nodes[4]; the file has 1",
            ),
            (
                |f| f.json["nodes"] = json!([{"children": [2]}, {"children": [2]}, {}]),
                "nodes[1].children: nodes[2] is in two places: below nodes[0], too",
            ),
            (
                |f| {
                    f.json["nodes"] = json!([{"children": [1]}, {}]);
                    f.json["scenes"] = json!([{"nodes": [0, 1]}]);
                },
                "scenes[0].nodes: nodes[1] is in two places: below nodes[0], too",
            ),
            (|f| f.json["scenes"] = json!([{"nodes": [0, 0]}]), "scenes[0].nodes: nodes[0] is in the scene twice"),
            (|f| f.json["scenes"] = json!([{"nodes": [3]}]), "scenes[0].nodes: there is no nodes[3]; the file has 1"),
            (|f| f.json["scene"] = json!(0), "scene: there is no scenes[0]; the file has 0"),
            (
                |f| f.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]),
                "nodes[0]: its rotation must be neither zero nor infinite",
            ),
            (
                |f| f.json["nodes"][0]["matrix"] = json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
                "nodes[0]: the last row of its matrix must be 0 0 0 1",
            ),
            (
                |f| f.json["nodes"][0]["translation"] = json!([1e300, 0, 0]),
                "nodes[0]: it is where numbers end: its place is not finite",
            ),
            (
                |f| f.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {}}),
                "nodes[0].extensions.EXT_mesh_gpu_instancing: it is not understood: missing field `attributes`",
            ),
            (
                |f| {
                    let (one, two) = (f.floats("VEC3", &[1.0; 3]), f.floats("VEC3", &[1.0; 6]));
                    f.json["nodes"][0]["extensions"] =
                        json!({"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": one, "TRANSLATION": two}}});
                },
                "nodes[0].extensions.EXT_mesh_gpu_instancing: its attributes must be of the same count",
            ),
        ],
    );
}

/// Chains of nodes as long as a file can have them, and a mesh that far away.
#[test]
fn long_chains_are_no_danger() {
    let mut file = File::triangle();
    let chain: Vec<Value> = (1..=100_000).map(|child| json!({"children": [child], "scale": [0.5, 0.5, 0.5]})).collect();
    file.json["nodes"] = Value::Array([chain, vec![json!({"mesh": 0})]].concat());
    let error = file.outcome(false).unwrap_err();
    assert!(error.contains("there is nothing in it to look at"), "{error}");
    file.json["nodes"] =
        json!([{"scale": [1e38, 1e38, 1e38], "children": [1]}, {"scale": [1e38, 1e38, 1e38], "mesh": 0}]);
    assert!(file.outcome(false).is_ok());
}

#[test]
fn textures() {
    let mut file = File::textured(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
        "normalTexture": {"index": 0}, "extensions": {}}));
    file.push("samplers", json!({}));
    file.json["textures"][0]["sampler"] = json!(0);
    all_refused(
        &file,
        &[
            (
                |f| f.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = json!(3),
                "materials[0].baseColorTexture: there is no textures[3]; the file has 1",
            ),
            (|f| f.json["textures"][0]["source"] = json!(3), "textures[0]: there is no images[3]; the file has 1"),
            (|f| f.json["textures"][0] = json!({}), "textures[0]: it has no source"),
            (
                |f| f.json["textures"][0] = json!({"extensions": {"KHR_texture_basisu": {"source": 0}}}),
                "textures[0]: it has no source: its textures are KTX2 pictures",
            ),
            (|f| f.json["textures"][0]["sampler"] = json!(3), "textures[0]: there is no samplers[3]; the file has 1"),
            (|f| f.json["samplers"][0]["magFilter"] = json!(1), "samplers[0]: its magFilter is not one of 9728, 9729"),
            (
                |f| f.json["samplers"][0]["wrapT"] = json!(1),
                "samplers[0]: how it wraps is not one of 10497, 33071, 33648",
            ),
            (|f| f.json["images"][0] = json!({}), "images[0]: it needs either a uri or a bufferView"),
            (
                |f| f.json["images"][0] = json!({"bufferView": 0}),
                "images[0]: cannot read the picture: it is none of OpenEXR, Radiance HDR, PNG, JPEG, BMP and TGA",
            ),
            (
                |f| f.json["materials"][0]["normalTexture"]["extensions"] = json!({"KHR_texture_transform": 1}),
                "materials[0].normalTexture: its transform is not understood: ",
            ),
            (
                |f| {
                    f.json["materials"][0]["normalTexture"]["extensions"] =
                        json!({"KHR_texture_transform": {"offset": [1e300, 0]}});
                },
                "materials[0].normalTexture: its transform is not finite",
            ),
        ],
    );
}

#[test]
fn materials() {
    let mut file = File::textured(json!({"pbrMetallicRoughness": {}, "extensions": {}}));
    all_refused(
        &file,
        &[
            (
                |f| f.json["materials"][0]["alphaMode"] = json!("GLASS"),
                "materials[0]: its alphaMode is not one of OPAQUE, MASK, BLEND",
            ),
            (
                |f| f.json["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(2),
                "materials[0].roughnessFactor: expected a number from 0 to 1, not 2",
            ),
            (
                |f| f.json["materials"][0]["extensions"]["KHR_materials_ior"] = json!({"ior": 0.5}),
                "materials[0].extensions.KHR_materials_ior.ior: expected a number at least 1, not 0.5",
            ),
            (
                |f| f.json["materials"][0]["extensions"]["KHR_materials_sheen"] = json!(1),
                "materials[0].extensions.KHR_materials_sheen: it is not understood: ",
            ),
            (
                |f| {
                    f.json["materials"][0]["extensions"]["KHR_materials_clearcoat"] =
                        json!({"clearcoatFactor": 1, "clearcoatTexture": {"index": 9}});
                },
                "materials[0].extensions.KHR_materials_clearcoat.clearcoatTexture: there is no textures[9]",
            ),
            (
                |f| f.json["materials"][0]["extensions"]["KHR_materials_volume"] = json!({"attenuationDistance": 0}),
                "materials[0].extensions.KHR_materials_volume.attenuationDistance: expected a number above 0, not 0",
            ),
        ],
    );
    // Who is lenient gets the nearest number, and is told.
    file.json["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(2);
    let warnings = file.outcome(true).unwrap().warnings;
    assert!(
        warnings[0].ends_with("expected a number from 0 to 1, not 2; it is taken as the nearest one"),
        "{warnings:?}"
    );
}

/// A triangle, a camera of either type, and a light.
fn lit_and_seen() -> File {
    let mut file = File::triangle();
    file.json["nodes"] = json!([{"mesh": 0}, {"camera": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}});
    file.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 1},
        "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}}),
    );
    assert!(file.outcome(false).is_ok());
    file
}

#[test]
fn lights() {
    fn light(f: &mut File) -> &mut Value {
        &mut f.json["extensions"]["KHR_lights_punctual"]["lights"][0]
    }
    all_refused(
        &lit_and_seen(),
        &[
            (
                |f| f.json["nodes"][2]["extensions"]["KHR_lights_punctual"]["light"] = json!(1),
                "nodes[2]: there is no extensions.KHR_lights_punctual.lights[1]; the file has 1",
            ),
            (
                |f| light(f)["type"] = json!("sun"),
                "extensions.KHR_lights_punctual.lights[0]: its type is not one of directional, point, spot",
            ),
            (
                |f| *light(f) = json!({"type": "spot"}),
                "extensions.KHR_lights_punctual.lights[0]: a spot light needs its 'spot'",
            ),
            (
                |f| light(f)["spot"] = json!({"innerConeAngle": 1, "outerConeAngle": 0.5}),
                "extensions.KHR_lights_punctual.lights[0]: expected 0 ≤ innerConeAngle ≤ outerConeAngle",
            ),
            (
                |f| light(f)["intensity"] = json!(-1),
                "extensions.KHR_lights_punctual.lights[0]: expected a number from 0 to",
            ),
        ],
    );
}

#[test]
fn cameras() {
    fn camera(f: &mut File) -> &mut Value {
        &mut f.json["cameras"][0]
    }
    all_refused(
        &lit_and_seen(),
        &[
            (|f| f.json["nodes"][1]["camera"] = json!(1), "nodes[1]: there is no cameras[1]; the file has 1"),
            (|f| f.json["nodes"][1]["scale"] = json!([0, 0, 0]), "nodes[1]: its place gives its camera no direction"),
            (|f| camera(f)["type"] = json!("fisheye"), "cameras[0]: its type is not one of perspective, orthographic"),
            (|f| *camera(f) = json!({"type": "perspective"}), "cameras[0]: it needs its 'perspective'"),
            (|f| *camera(f) = json!({"type": "orthographic"}), "cameras[0]: it needs its 'orthographic'"),
            (|f| camera(f)["perspective"]["yfov"] = json!(4), "cameras[0]: expected a yfov between 0 and π, not 4"),
            (
                |f| camera(f)["perspective"]["aspectRatio"] = json!(0),
                "cameras[0]: expected an aspectRatio above 0, not 0",
            ),
            (
                |f| camera(f)["perspective"]["znear"] = json!(0),
                "cameras[0]: expected 0 < znear < zfar (0 ≤ znear where it is orthographic)",
            ),
            (
                |f| {
                    camera(f)["type"] = json!("orthographic");
                    camera(f)["orthographic"]["xmag"] = json!(0);
                },
                "cameras[0]: its xmag and ymag must be neither zero nor infinite",
            ),
            (
                |f| {
                    camera(f)["type"] = json!("orthographic");
                    camera(f)["orthographic"]["znear"] = json!(1);
                },
                "cameras[0]: expected 0 < znear < zfar",
            ),
        ],
    );
}

/// Whatever a byte of a file is changed to: a scene or one line, never a panic.
#[test]
fn damaged_files_are_no_danger() {
    let mut file = File::textured(json!({"normalTexture": {"index": 0}, "alphaMode": "BLEND"}));
    let indices = file.accessor("SCALAR", 5121, 3, &[0, 1, 2]);
    file.primitive()["indices"] = json!(indices);
    let good = file.binary();
    for at in (0..good.len()).step_by(3) {
        for byte in [0, b'9', b'-', 0xff] {
            let mut bytes = good.clone();
            bytes[at] = byte;
            if let Err(error) = outcome("m.glb", &bytes, false) {
                assert!(error.contains("m.glb") && error.lines().count() == 1, "{error}");
            }
        }
    }
}
