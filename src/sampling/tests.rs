//! The law of the warps: what they draw has the density that stands beside them.

use super::chi_square::{Outcome, on_sphere, on_square, sidak};
use super::warp::*;
use crate::sampler::{Sampler, SamplerKind};
use glam::{Vec2, Vec3};

const SAMPLES: u32 = 100_000;

fn uniform(i: u32) -> Vec2 {
    Sampler { kind: SamplerKind::Independent, seed: 17 }.stream(0, 0, i).light(0).point()
}

fn directions(warp: impl Fn(Vec2) -> Vec3, pdf: impl Fn(Vec3) -> f32) -> Outcome {
    on_sphere(SAMPLES, |i| Some(warp(uniform(i))), |w| pdf(w).into())
}

/// A cone around an axis that no cell of the test is aligned with.
fn cone(one_minus_cos: f32, claimed: f32) -> Outcome {
    let frame = crate::math::frame::Frame::from_normal(Vec3::new(0.48, -0.6, 0.64));
    // |w − axis|² = 2 (1 − cos) keeps the digits of a narrow cone.
    let inside = |w: Vec3| w.distance_squared(frame.n) < 2.0 * one_minus_cos;
    let pdf = |w| if inside(w) { square_to_uniform_cone_pdf(claimed).0 } else { 0.0 };
    directions(|u| frame.to_world(square_to_uniform_cone(u, one_minus_cos)), pdf)
}

/// Hypothesis: samples have the stated density. 100,000 independent samples each, eight tests, together a false-alarm
/// rate of 1 %; the seed is fixed.
#[test]
fn samples_follow_their_densities() {
    let disk = |u| 0.5 * square_to_disk(u) + 0.5;
    let in_disk = |v: Vec2| if (2.0 * v - 1.0).length() <= 1.0 { 4.0 * square_to_disk_pdf() } else { 0.0 };
    let in_triangle = |v: Vec2| if v.x + v.y <= 1.0 { square_to_triangle_pdf() } else { 0.0 };
    let outcomes = [
        ("disk", on_square(SAMPLES, |i| Some(disk(uniform(i))), |v| in_disk(v).into())),
        (
            "triangle",
            on_square(SAMPLES, |i| Some(square_to_triangle(uniform(i)).truncate()), |v| in_triangle(v).into()),
        ),
        ("cosine hemisphere", directions(square_to_cosine_hemisphere, |w| square_to_cosine_hemisphere_pdf(w).0)),
        ("uniform hemisphere", directions(square_to_uniform_hemisphere, |w| square_to_uniform_hemisphere_pdf(w).0)),
        ("uniform sphere", directions(square_to_uniform_sphere, |_| square_to_uniform_sphere_pdf().0)),
        ("narrow cone", cone(1e-6, 1e-6)),
        ("cone", cone(0.2, 0.2)),
        ("most of the sphere", cone(1.9, 1.9)),
    ];
    let level = sidak(0.01, outcomes.len());
    for (name, o) in &outcomes {
        assert!(o.p_value > level && o.lost == 0.0, "{name}: {o:?}");
        assert!((o.integral - 1.0).abs() < 0.01, "{name}: {o:?}");
    }
}

#[test]
fn a_wrong_density_is_rejected() {
    for o in [cone(0.2, 0.21), directions(square_to_uniform_sphere, |w| square_to_cosine_hemisphere_pdf(w).0)] {
        assert!(o.p_value < 1e-6, "{o:?}");
    }
}
