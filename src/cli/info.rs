//! `snell info`: what a scene holds and needs.

use super::args::SceneArgs;
use super::prepare::{self, Prepared};
use crate::error::Result;
use crate::spectrum::Rgb;
use std::fmt::Write as _;
use std::io::Write as _;

/// Lights whose power is listed one by one.
const MAX_LISTED: usize = 16;

/// Reads and compiles the scene, and prints what it found.
pub(super) fn run(args: &SceneArgs) -> Result<()> {
    let pool = prepare::pool(args.threads)?;
    let p = prepare::prepare(args, false, &pool)?;
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
    for power in powers(&p) {
        line("power", power);
    }
    let has = [
        ("vertex normals", f.vertex_normals),
        ("delta lobes", f.delta_lobes),
        ("transmission", f.transmission),
        ("anisotropy", f.anisotropy),
    ];
    let (yes, no): (Vec<_>, Vec<_>) = has.iter().partition(|(_, has)| *has);
    let names = |list: Vec<&(&str, bool)>| list.iter().map(|(n, _)| *n).collect::<Vec<_>>().join(", ");
    line("has", names(yes));
    line("has no", names(no));
    let c = scene.centre;
    line("space", format!("centre ({}, {}, {}), lengths × 2^{}", c.x, c.y, c.z, libm::log2(scene.unit)));
    let mib = scene.accel.memory_bytes() as f64 / f64::from(1 << 20);
    line("accelerator", format!("{}, {mib:.1} MiB, built in {:.3} s", scene.accel.name(), p.build.as_secs_f64()));
    for warning in &p.warnings {
        line("warning", warning.clone());
    }
    // Nobody may be reading.
    let _ = std::io::stdout().write_all(text.as_bytes());
    Ok(())
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
