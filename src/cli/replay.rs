//! `--replay`: one sample, step by step.

use crate::error::{Error, Result};
use crate::film::SampleId;
use crate::image::Crop;
use crate::integrator::record::Event;
use crate::render::RenderSettings;
use crate::scene::Scene;
use crate::spectrum::Rgb;
use std::io::Write;

/// Traces sample `id` alone, of a render in `blocks` or one in tiles, and prints what happens to it. Points and distances are in the file's space.
pub(super) fn run(scene: &Scene, settings: &RenderSettings, id: SampleId, blocks: bool) -> Result<()> {
    let (w, h) = scene.film.size;
    let whole = Crop { x: 0, y: 0, width: w, height: h };
    if !scene.film.filter.sampled_area(whole, scene.film.sample_border).contains(id.x, id.y) {
        return Err(Error::Usage(format!(
            "--replay: pixel {},{} is outside the picture, which is {w}x{h}",
            id.x, id.y
        )));
    }
    let mut out = std::io::stdout().lock();
    let mut print = |event: Event| {
        // Nobody may be reading.
        let _ = writeln!(out, "{}", describe(scene, event));
    };
    settings.integrator.replay(scene, &settings.sampler, id, blocks, &mut print);
    Ok(())
}

fn describe(scene: &Scene, event: Event) -> String {
    let rgb = |c: Rgb| {
        let [r, g, b] = c.to_array();
        format!("({r}, {g}, {b})")
    };
    match event {
        Event::Traced { vertex, ray, hit } => {
            let o = ray.o.as_dvec3() / scene.unit + scene.centre;
            let from = format!(
                "vertex {vertex}: from ({}, {}, {}) along ({}, {}, {})",
                o.x, o.y, o.z, ray.d.x, ray.d.y, ray.d.z
            );
            if !hit.is_some() {
                return format!("{from} nothing is met");
            }
            let p = scene.shapes[hit.shape as usize].meet(&ray, hit.primitive).point.p / scene.unit + scene.centre;
            format!("{from} to ({}, {}, {}) on shape {} primitive {}", p.x, p.y, p.z, hit.shape, hit.primitive)
        }
        Event::Found { radiance, weight } => format!("  light found: {} with weight {weight}", rgb(radiance)),
        Event::Sampled { radiance, weight } => format!("  light sampled: {} with weight {weight}", rgb(radiance)),
        Event::Shadow { occluded, .. } => format!("  light sample {}", if occluded { "hidden" } else { "visible" }),
        Event::Scattered { throughput, survival, .. } => {
            format!("  goes on with throughput {}, survival {survival}", rgb(throughput))
        }
        Event::Shared => "shared with neighbours".into(),
        Event::Ended { reason } => format!("  ends: {reason}"),
        Event::Finished { radiance } => format!("radiance {}", rgb(radiance)),
    }
}
