//! Laws of area lights.

use super::*;
use crate::sampler::{Sampler, SamplerKind};
use crate::shape::TriangleMesh;
use crate::shape::disk::Disk;

fn shapes() -> Vec<(&'static str, Shape)> {
    let positions = vec![
        Vec3::new(-0.5, -0.25, 0.0),
        Vec3::new(0.5, -0.25, 0.0),
        Vec3::new(0.5, 0.25, 0.1),
        Vec3::new(-0.5, 0.25, 0.1),
    ];
    let quad = TriangleMesh { positions, faces: vec![[0, 1, 2], [0, 2, 3]], ..TriangleMesh::default() };
    let sphere = Sphere { centre: Vec3::new(0.1, 0.0, -0.2), radius: 0.3, flip: false };
    let centre = DVec3::new(-0.1, 0.1, -0.2);
    let [u, v, h] = [DVec3::new(0.3, 0.1, 0.0), DVec3::new(-0.1, 0.4, 0.0), DVec3::new(0.1, 0.2, 0.5)];
    let cylinder = |axes, flip| Shape::Cylinder(Cylinder::new(centre, axes, flip).unwrap());
    vec![
        ("disk", Shape::Disk(Disk::new(centre, u, v, DVec3::Z).unwrap())),
        ("cylinder", cylinder([0.2 * DVec3::X, 0.2 * DVec3::Y, 0.4 * DVec3::Z], false)),
        ("oblique cylinder", cylinder([u, v, h], false)),
        ("cylinder from inside", cylinder([2.0 * DVec3::X, 2.0 * DVec3::Y, DVec3::Z], true)),
        ("quad", Shape::Mesh(quad)),
        ("sphere", Shape::Sphere(sphere)),
        ("sphere from inside", Shape::Sphere(Sphere { radius: 2.0, flip: true, ..sphere })),
    ]
}

fn samples(light: &AreaLight, surface: &Shape, p: DVec3) -> Vec<Option<LightSample>> {
    let sampler = Sampler { kind: SamplerKind::Sobol, seed: 1 };
    (0..1 << 16).map(|i| light.sample(surface, p, Vec3::ZERO, sampler.stream(0, 0, i).light(0).point())).collect()
}

/// The mean of f/pdf over light samples equals the integral of f over the solid angle, here f = 1 (the solid angle that
/// the light fills, found by uniform directions traced against the shape).
#[test]
fn densities_integrate_to_the_solid_angle_of_the_light() {
    for (name, surface) in shapes() {
        let light = AreaLight::new(0, &surface, Rgb::WHITE).unwrap();
        for p in [DVec3::new(0.0, 0.1, 0.7), DVec3::new(-0.6, 0.2, 0.3)] {
            let drawn = samples(&light, &surface, p);
            let n = drawn.len() as f64;
            let estimate = drawn.iter().flatten().map(|s| 1.0 / f64::from(s.pdf.unwrap().0)).sum::<f64>() / n;
            let sampler = Sampler { kind: SamplerKind::Sobol, seed: 2 };
            let seen = (0..1 << 16)
                .filter(|&i| {
                    let w = warp::square_to_uniform_sphere(sampler.stream(0, 0, i).light(0).point());
                    let ray = crate::math::ray::Ray::new(p.as_vec3(), w);
                    front_is_met(&surface, &ray)
                })
                .count();
            let expected = 4.0 * PI * seen as f64 / n;
            // Quasi-Monte Carlo over an edge: error of the count about n^(-3/4) of the sphere, five times over.
            let tolerance = 5.0 * 4.0 * PI * n.powf(-0.75);
            assert!((estimate - expected).abs() < tolerance, "{name} from {p}: {estimate} against {expected}");
        }
    }
}

fn front_is_met(surface: &Shape, ray: &crate::math::ray::Ray) -> bool {
    let nearest = (0..surface.primitive_count() as u32)
        .filter_map(|i| Some((surface.intersect(i, ray)?, i)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.is_some_and(|(_, i)| surface.meet(ray, i).point.n.dot(ray.d) < 0.0)
}

#[test]
fn sampled_and_queried_densities_agree_and_points_lie_on_the_ray() {
    for (name, surface) in shapes() {
        let light = AreaLight::new(0, &surface, Rgb::WHITE).unwrap();
        let p = DVec3::new(-0.6, 0.2, 0.3);
        for s in samples(&light, &surface, p).iter().flatten() {
            let end = s.end.unwrap().seen_from(p, s.wi);
            let queried = light.pdf(&surface, p, Vec3::ZERO, &end).0;
            assert!((queried / s.pdf.unwrap().0 - 1.0).abs() < 1e-4, "{name}: {queried} against {}", s.pdf.unwrap().0);
            let w = (end.p - p).normalize().as_vec3();
            assert!((w - s.wi).length() < 1e-6, "{name}: {w} against {}", s.wi);
            assert!(end.n.dot(s.wi) < 0.0, "{name}: the back side was sampled");
        }
    }
}

#[test]
fn small_and_distant_lights_keep_their_solid_angle() {
    for radius in [1e-6f32, 1e-4, 1e-2] {
        let surface = Shape::Sphere(Sphere { centre: Vec3::ZERO, radius, flip: false });
        let light = AreaLight::new(0, &surface, Rgb::WHITE).unwrap();
        for s in samples(&light, &surface, DVec3::new(0.6, -0.7, 0.3)).iter().flatten().take(1000) {
            let solid_angle = PI * f64::from(radius).powi(2) / 0.94;
            assert!(
                (1.0 / f64::from(s.pdf.unwrap().0) / solid_angle - 1.0).abs() < 1e-3,
                "radius {radius}: {}",
                s.pdf.unwrap().0
            );
        }
    }
}
