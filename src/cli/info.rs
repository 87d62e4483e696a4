//! `snell info`: what a scene holds and needs.

mod code;

use super::args::SceneArgs;
use super::prepare::{self, Prepared, Purpose, describe, mib};
use crate::description::{SceneDescription, Texture, TextureKind};
use crate::error::Result;
use crate::image::Raster;
use crate::scene::Scene;
use crate::shape::Shape;
use crate::shape::placed::Group;
use crate::shape::uv::UvField;
use crate::spectrum::Rgb;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::sync::Arc;

/// Lights whose power, and things folded, that are listed one by one.
const MAX_LISTED: usize = 16;

/// Reads and compiles the scene, and prints what it found.
pub(super) fn run(args: &SceneArgs) -> Result<()> {
    let pool = prepare::pool(args.threads)?;
    let p = prepare::prepare(args, Purpose::default(), &pool)?;
    let (scene, f) = (&p.scene, p.scene.features);
    let camera = &p.description.cameras[args.camera];
    let crop = scene.film.crop;
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:<12} {value}");
    };
    line("scene", args.scene.display().to_string());
    line("film", format!("{}x{} pixels", scene.film.size.0, scene.film.size.1));
    if (crop.width, crop.height) != scene.film.size {
        line("crop", format!("{}x{} pixels from {},{}", crop.width, crop.height, crop.x, crop.y));
    }
    line("camera", format!("{} of {}", args.camera, p.description.cameras.len()));
    line("samples", format!("{} per pixel, seed {}", camera.sampler.sample_count, camera.sampler.seed));
    let i = &p.description.integrator;
    let depth = i.max_depth.map_or("any depth".into(), |d| format!("depth at most {d}"));
    line("integrator", format!("{:?}, {depth}, roulette from {}", i.kind, i.rr_depth).to_lowercase());
    for plugins in plugins(&p.description) {
        line("plugins", plugins);
    }
    line("shapes", format!("{} with {} triangles, {} quadrics", scene.shapes.len(), f.triangles, f.quadrics));
    if f.instances > 0 {
        line("instances", f.instances.to_string());
    }
    line("materials", scene.materials.len().to_string());
    line(
        "lights",
        format!(
            "{} on surfaces, {} points, {} spots, {} projectors, {} directional, {} at infinity",
            f.area_lights, f.point_lights, f.spot_lights, f.projector_lights, f.directional_lights, f.infinite_lights
        ),
    );
    line("choice", scene.light_sampler.description());
    for power in powers(&p) {
        line("power", power);
    }
    for texture in textures(&p.description) {
        line("texture", texture);
    }
    for (name, told) in code::lines(scene, i).into_iter().chain(folded(&p)) {
        line(name, told);
    }
    let c = scene.centre;
    line("space", format!("centre ({}, {}, {}), lengths × 2^{}", c.x, c.y, c.z, libm::log2(scene.unit)));
    line("accelerator", accelerator(&p));
    line("memory", memory(&p));
    line("expected", format!("at most {}", describe(&p.memory)));
    for unused in &p.description.inventory.unused {
        line("not used", unused.clone());
    }
    for warning in &p.warnings {
        line("warning", warning.clone());
    }
    // Nobody may be reading.
    let _ = std::io::stdout().write_all(text.as_bytes());
    Ok(())
}

/// What was simpler than the file says, the first few of it.
fn folded(p: &Prepared) -> Vec<(&'static str, String)> {
    let mut lines: Vec<_> = p.folded.iter().take(MAX_LISTED).map(|folded| ("folded", folded.clone())).collect();
    if p.folded.len() > MAX_LISTED {
        lines.push(("folded", format!("... and {} things more", p.folded.len() - MAX_LISTED)));
    }
    lines
}

/// Who answers ray queries, and why.
fn accelerator(p: &Prepared) -> String {
    let (name, reason) = (p.scene.accel.name(), &p.accel_choice.reason);
    let (bytes, seconds) = (mib(p.scene.accel.memory_bytes()), p.build.as_secs_f64());
    let quality = format!("{:?}", p.accel_choice.quality).to_lowercase();
    format!("{name} ({reason}), {bytes}, built in {seconds:.3} s with {quality} quality")
}

/// What the scene takes, in all and by kind.
fn memory(p: &Prepared) -> String {
    let (accel, meshes) = (p.scene.accel.memory_bytes(), mesh_bytes(&p.scene));
    let pictures: u64 = pictures(&p.description).iter().map(|picture| picture.memory_bytes()).sum();
    let all = mib(accel + meshes + pictures);
    format!("{all}: meshes {}, textures {}, accelerator {}", mib(meshes), mib(pictures), mib(accel))
}

/// The plugins in use, a line for each kind.
fn plugins(description: &SceneDescription) -> Vec<String> {
    let mut kinds: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for ((kind, plugin), count) in &description.inventory.used {
        kinds.entry(kind).or_default().push(format!("{count} {plugin}"));
    }
    kinds.into_iter().map(|(kind, plugins)| format!("{kind}: {}", plugins.join(", "))).collect()
}

/// The pictures that textures show, each once.
fn pictures(description: &SceneDescription) -> Vec<&Raster> {
    let mut found: Vec<&Arc<Raster>> = Vec::new();
    for texture in &description.textures {
        if let TextureKind::Bitmap { image, .. } = &texture.kind
            && !found.iter().any(|other| Arc::ptr_eq(other, image))
        {
            found.push(image);
        }
    }
    found.into_iter().map(Arc::as_ref).collect()
}

/// A line for each texture in use that varies: a picture's size, type, memory and file.
fn textures(description: &SceneDescription) -> Vec<String> {
    let picture = |p: &Raster| {
        let (size, memory) = (format!("{}x{}", p.width(), p.height()), mib(p.memory_bytes()));
        format!("{size} {} {}, {memory}, {}", p.sample_type(), p.channels(), p.name())
    };
    let is_picture = |t: &&Texture| matches!(t.kind, TextureKind::Bitmap { .. });
    let others = description.textures.iter().filter(|t| t.is_varying() && !is_picture(t)).count();
    let mut lines: Vec<String> = pictures(description).into_iter().map(picture).collect();
    if others > 0 {
        lines.push(format!("{others} without a picture"));
    }
    lines
}

/// What shapes and their texture coordinates take, of a group once.
fn mesh_bytes(scene: &Scene) -> u64 {
    let mut groups: Vec<*const Group> = Vec::new();
    let mut sum = scene.uvs.iter().map(UvField::memory_bytes).sum();
    let of = |shape: &Shape| if let Shape::Mesh(mesh) = shape { mesh.memory_bytes() } else { 0 };
    for shape in &scene.shapes {
        sum += match shape {
            Shape::Placed(placed) if groups.contains(&Arc::as_ptr(&placed.group)) => 0,
            Shape::Placed(placed) => {
                groups.push(Arc::as_ptr(&placed.group));
                placed.group.shapes.iter().map(of).sum()
            }
            own => of(own),
        };
    }
    sum
}

/// The radiant flux of every light (of the first few) and of all together, in watts, the file's unit of length being the
/// metre.
fn powers(p: &Prepared) -> Vec<String> {
    // Powers of two: the way back to the file's unit rounds nothing.
    let per_area = 1.0 / (p.scene.unit * p.scene.unit);
    let mut total = [0.0; 3];
    let mut lines = Vec::new();
    for (light, name) in p.scene.lights.iter().zip(&p.light_names) {
        let text = match light.power(&p.scene.shapes) {
            Some(power) => {
                let power = power.map(|c| c * per_area);
                total = [0, 1, 2].map(|i| total[i] + power[i]);
                watts(power)
            }
            None => "not finite: it fills all space".into(),
        };
        lines.push(format!("{text}  {name}"));
    }
    let (count, more) = (lines.len(), lines.len().saturating_sub(MAX_LISTED));
    lines.truncate(MAX_LISTED);
    if more > 0 {
        lines.push(format!("... and {more} lights more"));
    }
    if count > 1 {
        lines.push(format!("{}  in all", watts(total)));
    }
    lines
}

/// The three channels and their luminance, with six digits.
fn watts(power: [f64; 3]) -> String {
    let digits = |x: f64| format!("{x:.5e}").parse::<f64>().unwrap_or(x).to_string();
    let [r, g, b] = power.map(digits);
    let y: f64 = Rgb::LUMINANCE.iter().zip(power).map(|(weight, c)| f64::from(*weight) * c).sum();
    format!("{r} {g} {b} W (R G B), {} W of luminance", digits(y))
}
