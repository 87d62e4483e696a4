//! What fuzzing starts from: small files of each format that use as much of it as they can.

use super::gltf_file::{File, png};
use super::targets::serialized_triangle;
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder, Text,
    WritableImage,
};
use flate2::write::ZlibEncoder;
use half::f16;
use image::{DynamicImage, ImageFormat};
use serde_json::json;
use snell::image::sums_file;
use std::io::{Cursor, Write};
use std::os::unix::process::CommandExt;
use std::process::Command;

/// The seeds of a target.
pub fn of(target: &str) -> Vec<Vec<u8>> {
    match target {
        "xml" => xml(),
        "obj" => texts(&[
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "# c\nv 0 0 0 1 1 1\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\ng a\ns 1\nusemtl a\n\
                f 1/1/1 2/2/1 3/3/1 4/1/1\nf -4//-1 -3//-1 -2//-1\nl 1 2\np 1\n",
            "mtllib m.mtl\nv 1e3 0 -1e-3\nv 1. .5 0\nv 0 1 \\\n0\nusemtl b\nf 1 2 3\nf 1 2 3 3 2 1\n",
        ]),
        "mtl" => texts(&[
            "newmtl a\nKd 0.5 0.4 0.3\nnewmtl b\nKe 1 2 3\nmap_Kd x.png\n",
            "newmtl a\nKd 0 0 0\nKs 0.9 0.8 0.1\nNs 200\nillum 3\nnewmtl b\nd 0.2\nNi 1.33\nillum 7\nTr 0.5\n",
        ]),
        "ply" => ply(),
        "serialized" => serialized(),
        "gltf" => gltf().iter().map(|file| file.text().into_bytes()).chain([plain_gltf()]).collect(),
        "glb" => gltf().iter().map(File::binary).collect(),
        "png" => encoded(ImageFormat::Png, &[0, 1, 2, 3, 4, 5, 6, 7]),
        "jpeg" => encoded(ImageFormat::Jpeg, &[0, 2]),
        "tga" => encoded(ImageFormat::Tga, &[0, 1, 2, 3]),
        "bmp" => encoded(ImageFormat::Bmp, &[0, 1, 2, 3]),
        "hdr" => encoded(ImageFormat::Hdr, &[8]).into_iter().chain([runs_of_hdr()]).collect(),
        "exr" => exr_files(),
        "sums" => sums(),
        other => panic!("{other}"),
    }
}

fn texts(all: &[&str]) -> Vec<Vec<u8>> {
    all.iter().map(|text| text.as_bytes().to_vec()).collect()
}

const SENSOR: &str = r#"<sensor type="perspective"><float name="fov" value="40"/><transform name="to_world">
    <lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform></sensor>"#;

fn xml() -> Vec<Vec<u8>> {
    let bodies = [
        r#"<default name="r" value="0.5"/><shape type="sphere"><float name="radius" value="$r"/><point name="center" x="0" y="1"
        z="0"/><bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.5, 0.25, 1"/></bsdf></shape>
        <emitter type="envmap"><string name="filename" value="e.hdr"/></emitter>"#,
        r#"<include filename="i.xml"/><shape type="obj"><string name="filename" value="m.obj"/><ref id="included"/></shape>
        <shape type="ply"><string name="filename" value="m.ply"/><bsdf type="twosided"><bsdf type="principled">
        <texture type="mesh_attribute" name="base_color"><string name="name" value="vertex_r"/></texture></bsdf></bsdf></shape>
        <emitter type="point"><spectrum name="intensity" filename="s.spd"/></emitter>"#,
        r#"<bsdf type="blendbsdf" id="b"><float name="weight" value="0.25"/><bsdf type="conductor"><string name="material"
        value="Au"/></bsdf><bsdf type="mask"><float name="opacity" value="0.5"/><bsdf type="dielectric"/></bsdf></bsdf>
        <shape type="serialized"><string name="filename" value="m.serialized"/><ref id="b"/></shape>
        <emitter type="constant"/>"#,
        r#"<shape type="shapegroup" id="g"><shape type="cube"/><shape type="cylinder"><point name="p1" value="1,0,0"/></shape>
        </shape><shape type="instance"><ref id="g"/><transform name="to_world"><scale x="2" y="1" z="1"/><rotate y="1"
        angle="30"/><translate value="0,1,0"/></transform></shape><emitter type="spot"><rgb name="intensity" value="1,2,3"/>
        </emitter><integrator type="path"><integer name="max_depth" value="4"/></integrator>"#,
        r#"<shape type="rectangle"><bsdf type="normalmap"><texture type="bitmap" name="normalmap"><string name="filename"
        value="p.bmp"/><boolean name="raw" value="true"/></texture><bsdf type="roughdielectric"><float name="alpha" value="0.1"/>
        </bsdf></bsdf><emitter type="area"><spectrum name="radiance" value="400:1, 500:2, 700:0.5"/></emitter></shape>
        <shape type="disk"><bsdf type="oren_nayar"><texture type="checkerboard" name="reflectance"><transform name="to_uv">
        <matrix value="2 0 0 0 2 0 0 0 1"/></transform></texture></bsdf></shape>
        <emitter type="projector"><texture type="bitmap" name="irradiance"><string name="filename" value="p.bmp"/></texture>
        </emitter><emitter type="directional"><vector name="direction" value="0,-1,0"/></emitter>"#,
    ];
    let film = r#"<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><float name="focus_distance" value="3"/>
        <film type="hdrfilm"><integer name="width" value="9"/><integer name="height" value="7"/><rfilter type="lanczos"/>
        <string name="pixel_format" value="rgba"/></film><sampler type="independent"><integer name="sample_count" value="4"/>
        </sampler></sensor><sensor type="panorama"/><sensor type="orthographic"/><shape type="sphere"/>
        <integrator type="aov"><string name="aovs" value="a:depth,b:uv"/><integrator type="direct"/></integrator>"#;
    let old = r#"<scene version="0.6.0"><sensor type="perspective"><transform name="toWorld"><lookAt origin="0,0,4"
        target="0,0,0" up="0,1,0"/></transform></sensor><shape type="sphere"><bsdf type="diffuse"><rgb
        name="diffuseReflectance" value="0.1, 0.2, 0.3"/></bsdf></shape></scene>"#;
    let scene = |body: &str| format!(r#"<scene version="3.0.0">{body}</scene>"#).into_bytes();
    let mut all: Vec<Vec<u8>> = bodies.iter().map(|body| scene(&format!("{SENSOR}{body}"))).collect();
    all.extend([scene(film), old.into()]);
    all
}

fn ply() -> Vec<Vec<u8>> {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty double y\nproperty float z\n\
            property float nx\nproperty float ny\nproperty float nz\nproperty uchar r_0\nelement extra 1\n\
            property list ushort short data\nelement face 1\nproperty list uchar int vertex_indices\nproperty int tag\nend_header\n"
        )
    };
    let numbers = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let mut all = vec![
        format!("{}0 0 0 0 0 1 9\n1 0 0 0 0 1 8\n0 1 0 0 0 1 7\n2 1 2\n3 0 1 2 5\n", header("ascii")).into_bytes(),
    ];
    for big in [false, true] {
        let mut out = header(if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
        let mut put = |mut bytes: Vec<u8>| {
            if big {
                bytes.reverse();
            }
            out.extend(bytes);
        };
        for [x, y] in numbers {
            put((x as f32).to_le_bytes().to_vec());
            put(f64::to_le_bytes(y).to_vec());
            for value in [0.0_f32, 0.0, 0.0, 1.0] {
                put(value.to_le_bytes().to_vec());
            }
            put(vec![9]);
        }
        [2_u16, 1, 2].iter().for_each(|v| put(v.to_le_bytes().to_vec()));
        put(vec![3]);
        [0_i32, 1, 2, 5].iter().for_each(|v| put(v.to_le_bytes().to_vec()));
        all.push(out);
    }
    all
}

/// One of version 4, and a file of two of version 3 with normals, in double precision.
fn serialized() -> Vec<Vec<u8>> {
    let mut content = 0x2001_u32.to_le_bytes().to_vec();
    content.extend([3_u64, 1].iter().flat_map(|n| n.to_le_bytes()));
    let positions = [0.0_f64, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    content.extend(positions.iter().chain(&positions).flat_map(|v| v.to_le_bytes()));
    content.extend([0_u32, 1, 2].iter().flat_map(|v| v.to_le_bytes()));
    let (mut file, mut table) = (Vec::new(), Vec::new());
    for _ in 0..2 {
        table.extend((file.len() as u32).to_le_bytes());
        file.extend([0x1c, 0x04, 3, 0]);
        // Stored, so that changes of bytes are changes of numbers.
        let mut encoder = ZlibEncoder::new(file, flate2::Compression::none());
        encoder.write_all(&content).unwrap();
        file = encoder.finish().unwrap();
    }
    file.extend(table);
    file.extend(2_u32.to_le_bytes());
    vec![serialized_triangle(), file]
}

/// Whose buffer is a file.
fn plain_gltf() -> Vec<u8> {
    json!({
        "asset": {"version": "2.0"}, "nodes": [{"mesh": 0, "rotation": [0, 0, 1, 0]}],
        "buffers": [{"byteLength": 48, "uri": "b.bin"}], "bufferViews": [{"buffer": 0, "byteLength": 48, "byteStride": 12}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "emissiveFactor": [1, 1, 1],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 5}}}],
        "textures": [{"source": 0}], "images": [{"uri": "p.bmp"}],
    })
    .to_string()
    .into_bytes()
}

fn gltf() -> Vec<File> {
    let mut coated = File::textured(json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "roughnessFactor": 0.4, "metallicFactor": 0.5},
        "normalTexture": {"index": 0}, "alphaMode": "BLEND", "doubleSided": true,
        "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.5}, "KHR_materials_sheen": {"sheenColorFactor": [1, 0, 0]},
            "KHR_materials_iridescence": {"iridescenceFactor": 1}, "KHR_materials_specular": {"specularFactor": 0.5}},
    }));
    let morph = coated.floats("VEC3", &[0.0; 9]);
    coated.primitive()["targets"] = json!([{"POSITION": morph}]);
    coated.json["meshes"][0]["weights"] = json!([0.5]);

    let mut glass = File::triangle();
    glass.primitive()["material"] = json!(0);
    glass.push(
        "materials",
        json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
            "KHR_materials_ior": {"ior": 1.3},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationColor": [0.5, 1, 1], "attenuationDistance": 2}}}),
    );
    let indices = glass.accessor("SCALAR", 5121, 3, &[0, 2, 1]);
    glass.primitive()["indices"] = json!(indices);
    let places = glass.floats("VEC3", &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    glass.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    glass.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 3,
        "spot": {"innerConeAngle": 0.2}}, {"type": "point"}, {"type": "directional"}]}});
    for light in 0..3 {
        glass.push("nodes", json!({"extensions": {"KHR_lights_punctual": {"light": light}}, "translation": [0, 0, 3]}));
    }
    glass.push("nodes", json!({"camera": 0, "translation": [0, 0, 5]}));
    glass.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}));

    let mut skinned = File::triangle();
    let joints = skinned.accessor("VEC4", 5121, 3, &[0; 12]);
    let weights = skinned.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(3));
    let matrices = skinned.floats("MAT4", &[1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]);
    let sparse = (skinned.view(&[1]), skinned.view(&[0; 12]));
    skinned.json["accessors"][0]["sparse"] = json!({"count": 1, "indices": {"bufferView": sparse.0, "componentType": 5121},
        "values": {"bufferView": sparse.1}});
    let colours = skinned.accessor("VEC4", 5121, 3, &[200; 12]);
    skinned.json["accessors"][colours]["normalized"] = json!(true);
    let attributes = &mut skinned.primitive()["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    attributes["COLOR_0"] = json!(colours);
    skinned.json["nodes"][0]["skin"] = json!(0);
    skinned.push("nodes", json!({"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1]}));
    skinned.push("skins", json!({"joints": [1], "inverseBindMatrices": matrices}));

    let mut own_picture =
        File::textured(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions":
        {"KHR_texture_transform": {"scale": [2, 2], "rotation": 1}}}}, "alphaMode": "MASK"}));
    let view = own_picture.view(&png());
    own_picture.json["images"][0] = json!({"bufferView": view, "mimeType": "image/png"});
    own_picture.push("samplers", json!({"wrapS": 33071, "magFilter": 9728}));
    own_picture.json["textures"][0]["sampler"] = json!(0);
    vec![coated, glass, skinned, own_picture]
}

/// Pictures of some types, written as `format` has them.
fn encoded(format: ImageFormat, types: &[usize]) -> Vec<Vec<u8>> {
    let ramp = |n: usize| (0..n).map(|i| (i * 37 % 251) as u8).collect::<Vec<u8>>();
    let wide = |n: usize| (0..n).map(|i| (i * 9973 % 65521) as u16).collect::<Vec<u16>>();
    let (w, h) = (9, 5);
    let n = 45;
    let picture = |kind: usize| -> DynamicImage {
        match kind {
            0 => image::GrayImage::from_raw(w, h, ramp(n)).unwrap().into(),
            1 => image::GrayAlphaImage::from_raw(w, h, ramp(2 * n)).unwrap().into(),
            2 => image::RgbImage::from_raw(w, h, ramp(3 * n)).unwrap().into(),
            3 => image::RgbaImage::from_raw(w, h, ramp(4 * n)).unwrap().into(),
            4 => DynamicImage::ImageLuma16(image::ImageBuffer::from_raw(w, h, wide(n)).unwrap()),
            5 => DynamicImage::ImageLumaA16(image::ImageBuffer::from_raw(w, h, wide(2 * n)).unwrap()),
            6 => DynamicImage::ImageRgb16(image::ImageBuffer::from_raw(w, h, wide(3 * n)).unwrap()),
            7 => DynamicImage::ImageRgba16(image::ImageBuffer::from_raw(w, h, wide(4 * n)).unwrap()),
            _ => {
                let values = ramp(3 * n).iter().map(|&v| f32::from(v) / 16.0).collect();
                DynamicImage::ImageRgb32F(image::ImageBuffer::from_raw(w, h, values).unwrap())
            }
        }
    };
    let write = |&kind: &usize| {
        let mut bytes = Cursor::new(Vec::new());
        picture(kind).write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    };
    types.iter().map(write).collect()
}

/// Scan lines of runs, new and old.
fn runs_of_hdr() -> Vec<u8> {
    let mut file = b"#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n".to_vec();
    file.extend([2, 2, 0, 8]);
    for channel in 0..4_u8 {
        file.extend([128 + 6, 64 + channel, 2, 1, 129]);
    }
    file.extend([128, 128, 128, 129, 1, 1, 1, 7]);
    file
}

/// With every compression, half and float, scan lines and tiles.
fn exr_files() -> Vec<Vec<u8>> {
    let size = (6, 5);
    let values: Vec<f32> = (0..30).map(|i| (i * 7 % 11) as f32 / 4.0).collect();
    let channels = |half: bool, names: &[&str]| {
        let channel = |name: &&str| {
            let samples = if half {
                FlatSamples::F16(values.iter().map(|&v| f16::from_f32(v)).collect())
            } else {
                FlatSamples::F32(values.clone())
            };
            AnyChannel::new(Text::from(*name), samples)
        };
        AnyChannels::sort(names.iter().map(channel).collect())
    };
    let tiles = |compression| Encoding {
        compression,
        blocks: exr::prelude::Blocks::Tiles(exr::prelude::Vec2(4, 4)),
        line_order: LineOrder::Increasing,
    };
    let lines = |compression| Encoding { compression, ..Encoding::UNCOMPRESSED };
    let kinds = [
        (lines(Compression::Uncompressed), false, &["R", "G", "B"][..]),
        (lines(Compression::RLE), true, &["R", "G", "B", "A"]),
        (lines(Compression::ZIP1), true, &["Y"]),
        (lines(Compression::ZIP16), false, &["R", "G", "B"]),
        (lines(Compression::PIZ), true, &["R", "G", "B"]),
        (lines(Compression::PXR24), false, &["R", "G", "B"]),
        (lines(Compression::B44), true, &["R", "G", "B"]),
        (tiles(Compression::ZIP16), true, &["R", "G", "B"]),
        (tiles(Compression::RLE), false, &["Y", "A"]),
    ];
    let write = |(encoding, half, names): (Encoding, bool, &[&str])| {
        let layer = Layer::new(size, LayerAttributes::named("l"), encoding, channels(half, names));
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    };
    kinds.into_iter().map(write).collect()
}

/// A shard with much beside the picture, the same of a render without, a checkpoint of one with samples where the error is, and the
/// records of all.
fn sums() -> Vec<Vec<u8>> {
    let desk = tempfile::tempdir().unwrap();
    let scene = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"><integer name="width" value="2"/>
        <integer name="height" value="2"/></film></sensor><shape type="sphere"><emitter type="area"/></shape></scene>"#;
    std::fs::write(desk.path().join("s.xml"), scene).unwrap();
    let mut seeds = Vec::new();
    for (kept, spp, aov) in [
        (["--shard=1/2", "-op.exr"], "--spp=2", "--aov=error,samples,primitive"),
        (["--shard=1/1", "-op.exr"], "--spp=2", "-v"),
        (["--checkpoint=p.exr", "-oq.exr"], "--spp=16", "--adaptive"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_snell"));
        // The command is in the file, and where it lies is nobody's business.
        command.arg0("snell").current_dir(desk.path());
        let status = command.args(["render", "s.xml", spp, aov]).args(kept).status();
        assert!(status.unwrap().success());
        let file = std::fs::read(desk.path().join("p.exr")).unwrap();
        std::fs::remove_file(desk.path().join("p.exr")).unwrap();
        seeds.push(sums_file::decode(&file).unwrap().record.into_bytes());
        seeds.push(file);
    }
    seeds
}
