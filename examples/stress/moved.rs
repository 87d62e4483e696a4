//! Scenes at other sizes and places.

use super::estimate::{Estimate, Worst};
use super::{Found, Result, accelerators, compiled, load, picture, settings};
use glam::{DAffine3, DVec3};
use snell::accel::Accelerator;
use snell::check::scenes::fingerprint;
use snell::description::{Geometry, Mesh, SceneDescription, Shape};
use std::path::Path;
use std::sync::Arc;

/// Pixels a side, and samples of a pixel: bits are the same or not, whatever their number.
const BITS: (u32, u32) = (32, 4);

/// The same where pictures are compared within their noise, and the seeds that tell of the noise.
const NOISE: (u32, u32, u64) = (32, 16, 16);

/// Differences in standard errors that none of 25 comparisons exceeds but in 10⁻³ of cases: Student's t with 30 degrees of
/// freedom for the mean and for each of 16 tiles.
const MOST: Worst = Worst { whole: 4.8, tile: 5.6, pixel: f64::INFINITY };

/// Every length × 2^k, k = −40…40.
pub(super) fn bits(path: &Path) -> Result<Found> {
    let scene = load(path, BITS.0)?;
    let settings = settings(&scene, BITS.1);
    let (mut count, mut different) = (0, Vec::new());
    for accelerator in accelerators() {
        let bits = |k: i32| -> Result<u64> {
            let scaled = scene.clone().transformed(2f64.powi(k), DVec3::ZERO);
            Ok(fingerprint(&picture(&compiled(&scaled, accelerator)?, &settings)))
        };
        let first = bits(0)?;
        for k in -40..=40 {
            count += 1;
            if bits(k)? != first {
                different.push(format!("2^{k} {accelerator:?}"));
            }
        }
    }
    let text =
        format!("{count} pictures of {0}x{0}, {1} samples: {2} differ {different:?}", BITS.0, BITS.1, different.len());
    Ok(Found { text, right: different.is_empty() })
}

/// Of a scene with the limits of another, by seeds so much later, so that two are independent.
fn estimate(scene: &SceneDescription, first: &SceneDescription, shift: u64) -> Result<Estimate> {
    let settings = settings(first, NOISE.1);
    let compiled = compiled(scene, Accelerator::Auto)?;
    Ok(Estimate::of_shifted(&compiled, &settings, NOISE.2, shift))
}

/// Every length × 10^k, k = −12…12.
pub(super) fn scale(path: &Path) -> Result<Found> {
    let scene = load(path, NOISE.0)?;
    let first = estimate(&scene, &scene, 0)?;
    let (mut worst, mut wrong) = ((0.0, 0.0), Vec::new());
    for k in -12..=12 {
        let scaled = scene.clone().transformed(10f64.powi(k), DVec3::ZERO);
        let z = estimate(&scaled, &scene, 1000)?.worst_z_against(&first);
        worst = (f64::max(worst.0, z.whole), f64::max(worst.1, z.tile));
        if !z.within(&MOST) {
            wrong.push(format!("10^{k}: {z:?}"));
        }
    }
    let text = format!(
        "25 scales, worst z {:.1} of the mean, {:.1} of a tile; {} beyond {MOST:?} {wrong:?}",
        worst.0,
        worst.1,
        wrong.len()
    );
    Ok(Found { text, right: wrong.is_empty() })
}

/// Moved by 10^k of its size, k = 0…7.
pub(super) fn offset(path: &Path) -> Result<Found> {
    let scene = load(path, NOISE.0)?;
    let first = estimate(&scene, &scene, 0)?;
    let size = 1.0 / compiled(&scene, Accelerator::Auto)?.unit;
    let (mut worst, mut wrong, mut breaks) = ((0.0, 0.0), Vec::new(), None);
    for k in 0..=7 {
        let offset = DVec3::new(1.0, -0.7, 0.3) * size * 10f64.powi(k);
        let moved = scene.clone().transformed(1.0, offset);
        let z = estimate(&moved, &scene, 1000)?.worst_z_against(&first);
        worst = (f64::max(worst.0, z.whole), f64::max(worst.1, z.tile));
        if !z.within(&MOST) {
            wrong.push(format!("10^{k}: {z:?}"));
        }
        let rounded = estimate(&rounded(moved), &scene, 1000);
        let same = rounded.is_ok_and(|e| e.worst_z_against(&first).within(&MOST));
        if breaks.is_none() && !same {
            breaks = Some(k);
        }
    }
    let of_f32 = breaks.map_or("nowhere up to 10^7".into(), |k| format!("at 10^{k} sizes"));
    let text = format!(
        "10^0 to 10^7 sizes, worst z {:.1} of the mean, {:.1} of a tile; {} beyond {wrong:?}; with vertices in f32 it breaks {of_f32}",
        worst.0,
        worst.1,
        wrong.len()
    );
    Ok(Found { text, right: wrong.is_empty() })
}

/// With the vertices of meshes and rectangles where a file with single precision would have them.
fn rounded(mut scene: SceneDescription) -> SceneDescription {
    for shape in &mut scene.shapes {
        let Some(mesh) = mesh(shape) else { continue };
        let place = |p: &DVec3| shape.to_world.transform_point3(*p).as_vec3().as_dvec3();
        let normals = shape.to_world.matrix3.inverse().transpose();
        let world = Mesh {
            positions: mesh.positions.iter().map(place).collect(),
            normals: mesh.normals.iter().map(|&n| normals * n).collect(),
            ..(*mesh).clone()
        };
        shape.geometry = Geometry::Mesh(Arc::new(world));
        shape.to_world = DAffine3::IDENTITY;
    }
    scene
}

fn mesh(shape: &Shape) -> Option<Arc<Mesh>> {
    match &shape.geometry {
        Geometry::Mesh(mesh) if shape.to_world.matrix3.determinant() > 0.0 => Some(mesh.clone()),
        Geometry::Rectangle if shape.to_world.matrix3.determinant() > 0.0 => {
            let positions = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
            Some(Arc::new(Mesh { positions: positions.into(), faces: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }))
        }
        _ => None,
    }
}
