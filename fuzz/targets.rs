//! What is done with hostile bytes: read as snell reads them, and, where they are a scene, compiled and rendered.
//!
//! Used by the fuzz targets here and by `tests/fuzz_corpus.rs`, which replays their corpora. No disk is touched: all files
//! are held in memory.

use cpu_time::ProcessTime;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use image::ImageFormat;
use rayon::{ThreadPool, ThreadPoolBuilder};
use snell::accel::Accelerator;
use snell::description::{IntegratorKind, SceneDescription};
use snell::files::{Files, Memory};
use snell::image::sums_file::{self, Sums};
use snell::image::{Crop, Raster};
use snell::integrator::{Estimator, Integrator, PathReuse};
use snell::loader::{LoadOptions, load};
use snell::render::{Progress, RenderSettings, render};
use snell::sampler::{Sampler, SamplerKind};
use snell::scene::compile::{CompileOptions, compile};
use snell::scene::predict::predict;
use std::io::Write;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

/// Memory that a scene may ask for. Reason: a file of some kilobytes that needs more has lied.
const MEMORY: u64 = 64 << 20;

/// And to compile and render it, the program included.
const MEMORY_TO_RENDER: u64 = 3 * MEMORY;

/// Longest paths. Reason: a closed white room is no fault, but takes all the time there is.
const MAX_DEPTH: u32 = 6;

/// Pixels a side.
const SIZE: u32 = 2;

/// Longest time to read a file: so much for each kilobyte that is begun.
const TIME_PER_KILOBYTE: Duration = Duration::from_secs(1);

/// Whether hostile bytes were read after all, or what was wrong with them.
pub type Outcome = Result<(), String>;

/// A name, and what is done with hostile bytes under it.
pub type Target = (&'static str, fn(&[u8]) -> Outcome);

/// Every target.
pub const TARGETS: [Target; 14] = [
    ("xml", xml),
    ("obj", obj),
    ("mtl", mtl),
    ("ply", ply),
    ("serialized", serialized),
    ("gltf", gltf),
    ("glb", glb),
    ("png", |data| picture(data, "png")),
    ("jpeg", |data| picture(data, "jpg")),
    ("tga", |data| picture(data, "tga")),
    ("bmp", |data| picture(data, "bmp")),
    ("hdr", |data| picture(data, "hdr")),
    ("exr", |data| picture(data, "exr")),
    ("sums", sums),
];

/// Gives `data` to the target of this name; returns only if nothing is wrong with snell.
pub fn run(target: &str, data: &[u8]) -> Outcome {
    let (_, run) = TARGETS.iter().find(|row| row.0 == target).expect("a target of this name");
    run(data)
}

const OBJ: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n\
    usemtl a\nf 1/1/1 2/2/1 3/3/1\nusemtl b\nf 2/2/1 4/1/1 3/3/1\n";

const MTL: &str = "newmtl a\nKd 0.5 0.5 0.5\nnewmtl b\nKe 1 1 1\n";

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    property float u\nproperty float v\nproperty float r_0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0 0 0 1\n1 0 0 1 0 1\n0 1 0 0 1 1\n3 0 1 2\n";

const SPECTRUM: &str = "400 0.2\n550 0.7\n700 0.4\n";

/// An object for `<include>`.
const INCLUDED: &str = r#"<bsdf version="3.0.0" type="diffuse" id="included"/>"#;

/// Two by two pixels, uncompressed.
const BMP: &[u8] = b"BM\x46\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x02\0\0\0\x02\0\0\0\x01\0\x18\0\0\0\0\0\x10\0\0\0\
    \0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x20\x40\x80\xff\x20\x10\0\0\x80\x80\x80\x01\x02\x03\0\0";

/// Two by three pixels, uncompressed.
const HDR: &[u8] = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 2\n\
    \x80\x80\x80\x81\x40\x80\x20\x82\x10\x20\x30\x80\x80\x10\x80\x81\x80\x80\x80\x81\x40\x80\x20\x82";

/// A triangle of version 4 as a stream, and the table of a file of one mesh.
pub fn serialized_triangle() -> Vec<u8> {
    const SINGLE_WITH_UVS: u32 = 0x1002;
    let mut content = SINGLE_WITH_UVS.to_le_bytes().to_vec();
    content.extend(b"t\0");
    content.extend([3_u64, 1].iter().flat_map(|n| n.to_le_bytes()));
    content.extend([0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()));
    content.extend([0.0_f32, 0.0, 1.0, 0.0, 0.0, 1.0].iter().flat_map(|v| v.to_le_bytes()));
    content.extend([0_u32, 1, 2].iter().flat_map(|v| v.to_le_bytes()));
    let mut encoder = ZlibEncoder::new(vec![0x1c, 0x04, 4, 0], Compression::fast());
    encoder.write_all(&content).expect("memory does not fail");
    let mut file = encoder.finish().expect("memory does not fail");
    file.extend(0_u64.to_le_bytes());
    file.extend(1_u32.to_le_bytes());
    file
}

/// The files that a hostile scene may name, and hostile ones in place of some of them.
fn files(own: &[(&str, &[u8])]) -> Files {
    static SERIALIZED: OnceLock<Vec<u8>> = OnceLock::new();
    let serialized = SERIALIZED.get_or_init(serialized_triangle);
    let buffer = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0].map(f32::to_le_bytes).concat();
    let given: [(&str, &[u8]); 9] = [
        ("m.obj", OBJ.as_bytes()),
        ("m.mtl", MTL.as_bytes()),
        ("m.ply", PLY.as_bytes()),
        ("m.serialized", serialized),
        ("p.bmp", BMP),
        ("e.hdr", HDR),
        ("s.spd", SPECTRUM.as_bytes()),
        ("i.xml", INCLUDED.as_bytes()),
        ("b.bin", &buffer),
    ];
    let all = given.iter().chain(own).map(|(name, bytes)| ((*name).into(), bytes.to_vec()));
    Files::held(all).within(Memory::limited(MEMORY))
}

/// Reads the scene `name` among `files`, and renders what comes of it.
fn scene(name: &str, own: &[(&str, &[u8])], lenient: bool, uvs: bool) -> Outcome {
    let size: usize = own.iter().map(|file| file.1.len()).sum();
    let options = LoadOptions { lenient, uvs, files: files(own), ..LoadOptions::default() };
    let start = ProcessTime::now();
    let loaded = pool().install(|| load(Path::new(name), &options));
    check_time(size, start);
    let mut description = loaded.map_err(|e| e.to_string())?;
    draw(&mut description)
}

/// CPU time, not the clock's: others may keep the machine busy.
fn check_time(bytes: usize, start: ProcessTime) {
    let (took, kilobytes) = (start.elapsed(), bytes as u32 / 1024 + 1);
    assert!(took <= TIME_PER_KILOBYTE * kilobytes, "{took:?} to read {bytes} bytes");
}

/// Two by two pixels of one sample.
fn draw(description: &mut SceneDescription) -> Outcome {
    for camera in &mut description.cameras {
        (camera.film.width, camera.film.height) = (SIZE, SIZE);
        camera.film.crop = Crop { x: 0, y: 0, width: SIZE, height: SIZE };
        camera.film.sample_border = false;
    }
    let options =
        CompileOptions { accelerator: Accelerator::Auto, quality: None, threads: 1, camera: 0, samples: Some(1) };
    // As the command does with --memory-limit.
    let needed = predict(description, &options).total();
    if needed > MEMORY_TO_RENDER {
        return Err(format!("{needed} bytes are too many"));
    }
    let compiled = pool().install(|| compile(description, &options)).map_err(|e| e.to_string())?;
    let file = &description.integrator;
    let most = if file.kind == IntegratorKind::Direct { 2 } else { MAX_DEPTH };
    let integrator = Integrator {
        estimator: Estimator::Path,
        max_depth: file.max_depth.unwrap_or(MAX_DEPTH).min(most),
        rr_depth: file.rr_depth,
        hide_emitters: file.hide_emitters,
        hide_environment: false,
        light_samples: 1,
        reuse: PathReuse::Off,
    };
    let sampler = Sampler { kind: SamplerKind::Sobol, seed: 1 };
    let settings = RenderSettings { samples: 1, sampler, integrator, clamp: None };
    render(&compiled.scene, &settings, pool(), &Progress::default());
    Ok(())
}

/// One thread, so that the time that it takes is that of the work.
fn pool() -> &'static ThreadPool {
    static POOL: OnceLock<ThreadPool> = OnceLock::new();
    POOL.get_or_init(|| ThreadPoolBuilder::new().num_threads(1).build().expect("a thread"))
}

/// A scene of these shapes and lights.
fn around(body: &str) -> String {
    format!(r#"<scene version="3.0.0"><sensor type="perspective"/>{body}</scene>"#)
}

/// A mesh with everything on it that can be asked of it.
fn of_mesh(plugin: &str, file: &str, more: &str) -> String {
    around(&format!(
        r#"<shape type="{plugin}"><string name="filename" value="{file}"/>{more}
        <bsdf type="roughconductor"><float name="alpha_u" value="0.1"/><float name="alpha_v" value="0.3"/>
        <texture type="bitmap" name="specular_reflectance"><string name="filename" value="p.bmp"/></texture></bsdf>
        <emitter type="area"><texture type="mesh_attribute" name="radiance"><string name="name" value="vertex_r"/></texture>
        </emitter></shape>"#
    ))
}

fn xml(data: &[u8]) -> Outcome {
    // A scene that is right as far as it is understood must do no harm either.
    scene("scene.xml", &[("scene.xml", data)], true, false)
}

fn obj(data: &[u8]) -> Outcome {
    let alone = scene("m.obj", &[("m.obj", data)], false, false);
    let text = of_mesh("obj", "m.obj", "").replace("mesh_attribute", "checkerboard").replace(NAME, "");
    scene("scene.xml", &[("scene.xml", text.as_bytes()), ("m.obj", data)], false, true).and(alone)
}

/// The parameter of `mesh_attribute` alone.
const NAME: &str = r#"<string name="name" value="vertex_r"/>"#;

fn mtl(data: &[u8]) -> Outcome {
    scene("m.obj", &[("m.mtl", data)], false, false)
}

fn ply(data: &[u8]) -> Outcome {
    let alone = scene("m.ply", &[("m.ply", data)], false, false);
    let text = of_mesh("ply", "m.ply", r#"<boolean name="face_normals" value="true"/>"#);
    scene("scene.xml", &[("scene.xml", text.as_bytes()), ("m.ply", data)], true, true).and(alone)
}

fn serialized(data: &[u8]) -> Outcome {
    let of = |index: u32| {
        let more = format!(r#"<integer name="shape_index" value="{index}"/>"#);
        let text =
            of_mesh("serialized", "m.serialized", &more).replace("mesh_attribute", "checkerboard").replace(NAME, "");
        scene("scene.xml", &[("scene.xml", text.as_bytes()), ("m.serialized", data)], false, true)
    };
    // Most files have no second mesh.
    let _ = of(1);
    of(0)
}

fn gltf(data: &[u8]) -> Outcome {
    scene("m.gltf", &[("m.gltf", data)], true, false)
}

fn glb(data: &[u8]) -> Outcome {
    scene("m.glb", &[("m.glb", data)], true, true)
}

/// A picture by itself, as a texture, and as a sky.
fn picture(data: &[u8], extension: &str) -> Outcome {
    let start = ProcessTime::now();
    let memory = Memory::limited(MEMORY);
    let named = ImageFormat::from_extension(extension);
    let decoded = Raster::decode(data, named, true, &memory);
    check_time(data.len(), start);
    decoded?;
    let name = format!("x.{extension}");
    let text = around(&format!(
        r#"<shape type="sphere"><bsdf type="bumpmap"><texture type="bitmap"><string name="filename" value="{name}"/>
        <boolean name="raw" value="true"/></texture><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
        <string name="filename" value="{name}"/></texture></bsdf></bsdf></shape>
        <emitter type="envmap"><string name="filename" value="{name}"/></emitter>"#
    ));
    scene("scene.xml", &[("scene.xml", text.as_bytes()), (&name, data)], false, false)
}

/// A checkpoint, with samples where the error is or everywhere, or a shard; or the record of one, with sums of 2×2 pixels.
/// Whoever can write can make the hash fit, which changes of bytes do not, so that records come alone, too.
fn sums(data: &[u8]) -> Outcome {
    /// Sums beside radiance, and whole numbers.
    const MEANS: usize = 8;
    const NUMBERS: usize = 4;
    /// Of a block: two halves of two sequences; and the samples and vertices of each of these.
    const TILES: usize = 4;
    const SAMPLES: u32 = 8;
    const VERTICES: [u32; 4] = [17, 0, 17, u32::MAX];
    let start = ProcessTime::now();
    let sums = if data.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        sums_file::decode(data)
    } else {
        let record = String::from_utf8_lossy(data).into_owned();
        let means = (0..MEANS).map(|m| format!("mean.{m}"));
        // Of both parts that a film keeps apart.
        let wide = ["sum.R", "sum.G", "sum.B", "weight", "1.sum.R", "1.sum.G", "1.sum.B", "1.weight"];
        let wide = wide.map(String::from).into_iter().chain(means);
        let names = wide.flat_map(|name| (0..4).map(move |part| format!("snell.{name}.{part}")));
        let names: Vec<_> = names.chain((0..NUMBERS).map(|n| format!("snell.number.{n}"))).collect();
        // The same of the tiles of one block, each of which fills a plane.
        let of_tile = |name: &String, tile: usize| format!("{}.{tile}", name.replacen("snell.", "snell.tile.", 1));
        let of_tiles: Vec<_> = names.iter().flat_map(|name| (0..TILES).map(move |tile| of_tile(name, tile))).collect();
        let values = |i: usize| [0, 1, u32::MAX, 0x1234_5678].map(|v: u32| v.rotate_left(i as u32 % 32)).to_vec();
        let planes = names.into_iter().chain(of_tiles).enumerate().map(|(i, name)| (name, values(i)));
        let samples = [("snell.samples.0".to_owned(), vec![SAMPLES, SAMPLES, 0, 0])];
        let vertices = [("snell.vertices.0".to_owned(), VERTICES.to_vec())];
        Ok(Sums::new(record, (SIZE, SIZE), planes.chain(samples).chain(vertices)))
    };
    check_time(data.len(), start);
    snell::cli::check_sums(&sums?)
}
