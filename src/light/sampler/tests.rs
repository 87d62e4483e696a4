//! Laws of choosing a light.

use super::*;
use crate::light::{AreaLight, ConstantLight, DirectionalLight, Lobe, PointLight};
use crate::shape::disk::Disk;
use crate::shape::sphere::Sphere;
use glam::DVec3;

/// So many small lights of powers over five decades, disks, spheres and points, and some at infinity.
fn scene(finite: usize, infinite: usize) -> (Vec<Light>, Vec<Shape>) {
    let (mut lights, mut shapes) = (Vec::new(), Vec::new());
    for i in 0..finite {
        let digit = |d: usize| ((i * 37 + 11) / d % 10) as f32 / 10.0 - 0.45;
        let centre = Vec3::new(digit(1), digit(10), digit(3));
        let radiance = Rgb::new(0.2, 0.5, 0.1) * 10.0_f32.powi((i % 6) as i32);
        let shape = match i % 3 {
            0 => Shape::Sphere(Sphere { centre, radius: 0.01, flip: false }),
            1 => {
                let [u, v] = [DVec3::new(0.02, 0.0, 0.0), DVec3::new(0.0, 0.01, 0.01)];
                Shape::Disk(Disk::new(centre.as_dvec3(), u, v, DVec3::Z).unwrap())
            }
            _ => {
                let position = centre.as_dvec3();
                let intensity = radiance * 1e-3;
                lights.push(Light::Point(PointLight { position, intensity, clearance: 0.0, touching: vec![] }));
                continue;
            }
        };
        lights.push(Light::Area(AreaLight::new(shapes.len() as u32, &shape, radiance).unwrap()));
        shapes.push(shape);
    }
    for i in 0..infinite {
        lights.insert(
            i % (lights.len() + 1),
            match i % 2 {
                0 => Light::Constant(ConstantLight { radiance: Rgb::splat(0.1) }),
                _ => Light::Directional(DirectionalLight { wi: Vec3::Z, irradiance: Rgb::splat(3.0) }),
            },
        );
    }
    (lights, shapes)
}

fn receivers() -> Vec<Receiver> {
    let normals = [Vec3::ZERO, Vec3::Z, Vec3::NEG_Z, Vec3::new(0.6, -0.8, 0.0)];
    let points = [Vec3::ZERO, Vec3::splat(0.5), Vec3::new(0.9, -0.9, 0.3), Vec3::new(-0.45, 0.05, -0.25)];
    let plain = points.iter().flat_map(|&p| normals.iter().map(move |&n| Receiver::new(p, n)));
    plain.flat_map(|at| [at, Receiver { lobe: lobe_around(Vec3::new(0.48, 0.6, 0.64)), ..at }]).collect()
}

/// A narrow lobe.
fn lobe_around(axis: Vec3) -> Lobe {
    Lobe { axis, spread: 1e-3, share: 0.9 }
}

/// Of lights that are alike the one that a mirror would show is chosen most, and the more the narrower the lobe; a lobe that is as
/// wide as all directions changes next to nothing.
#[test]
fn lights_in_a_lobe_are_preferred() {
    let point = |x: f64| {
        let position = DVec3::new(x, 0.0, 1.0);
        Light::Point(PointLight { position, intensity: Rgb::WHITE, clearance: 0.0, touching: vec![] })
    };
    let sampler = LightSampler::new(&[point(-1.0), point(1.0)], &[]);
    let axis = Vec3::new(1.0, 0.0, 1.0).normalize();
    let pmf = |spread: f32| {
        let lobe = Lobe { axis, spread, share: 0.5 };
        sampler.pmf(1, || Receiver { lobe, ..Receiver::new(Vec3::ZERO, Vec3::Z) })
    };
    assert!((pmf(1e6) - 0.5).abs() < 1e-5, "{}", pmf(1e6));
    // By hand: a fifth by the cosine, which both have; else ½·√½ + ½·q/(q + c²)², where c² is 0 and 2.
    let by_hand = |q: f32| {
        let part = |c2: f32| 0.5 * 0.5_f32.sqrt() + 0.5 * q / (q + c2).powi(2);
        0.2 * 0.5 + 0.8 * part(0.0) / (part(0.0) + part(2.0))
    };
    for spread in [1e-4, 1e-2, 1.0] {
        assert!((pmf(spread) - by_hand(spread)).abs() < 1e-5, "{spread}: {} {}", pmf(spread), by_hand(spread));
    }
    assert!(pmf(1e-4) > 0.899 && pmf(1e-2) > pmf(1.0));
}

/// Every number belongs to the light that has it in its interval: evenly spaced ones come to each as often as its probability
/// says, but for one at either end; and what is said of a choice is what is said of the light.
#[test]
fn lights_are_chosen_as_often_as_is_said() {
    for (finite, infinite) in [(1, 0), (0, 1), (0, 3), (2, 0), (1, 1), (7, 2), (16, 0), (17, 0), (60, 0), (60, 3)] {
        let (lights, shapes) = scene(finite, infinite);
        let sampler = LightSampler::new(&lights, &shapes);
        for at in receivers() {
            const N: u32 = 1 << 15;
            let mut counts = vec![0_u32; lights.len()];
            for i in 0..N {
                if let Some((light, p)) = sampler.sample(|| at, || (f64::from(i) + 0.5) / f64::from(N)) {
                    assert_eq!(p.to_bits(), sampler.pmf(light, || at).to_bits(), "{finite} {infinite}: {light}");
                    assert!(p > 0.0);
                    counts[light] += 1;
                }
            }
            for (light, count) in counts.into_iter().enumerate() {
                let expected = f64::from(sampler.pmf(light, || at)) * f64::from(N);
                let off = (f64::from(count) - expected).abs();
                assert!(off <= 1.5, "{finite} {infinite}, {at:?}: {light} {count} {expected}");
            }
        }
    }
}

/// Whatever sends something to a point has a probability there: sampled points of every light tell.
#[test]
fn no_light_is_forgotten() {
    for (finite, infinite) in [(2, 0), (9, 2), (300, 2)] {
        let (lights, shapes) = scene(finite, infinite);
        let sampler = LightSampler::new(&lights, &shapes);
        for at in receivers() {
            for (index, light) in lights.iter().enumerate() {
                for i in 0..64_u16 {
                    let u = glam::Vec2::new(f32::from(i % 8) / 8.0, f32::from(i / 8) / 8.0);
                    let Some(s) = light.sample(&shapes, at.p.as_dvec3(), at.n, u, false) else { continue };
                    let arrives = at.n == Vec3::ZERO || s.wi.dot(at.n) > 0.0;
                    assert!(!arrives || sampler.pmf(index, || at) > 0.0, "{at:?}: {index}, {s:?}");
                }
            }
        }
    }
}

/// Beside a lamp a dim sky is still chosen, and so is the lamp below a bright one.
#[test]
fn neither_sky_nor_lamps_are_neglected() {
    for radiance in [1e-20, 1.0, 1e20] {
        let (mut lights, shapes) = scene(3, 0);
        lights.push(Light::Constant(ConstantLight { radiance: Rgb::splat(radiance) }));
        let sampler = LightSampler::new(&lights, &shapes);
        for at in receivers() {
            let sky = f64::from(sampler.pmf(3, || at));
            assert!(sky > LEAST_SHARE - 1e-6, "{radiance}, {at:?}: {sky}");
            let lamps: f64 = (0..3).map(|i| f64::from(sampler.pmf(i, || at))).sum();
            assert!((sky + lamps - 1.0).abs() < 1e-6, "{radiance}, {at:?}: {sky} {lamps}");
            assert!(lamps > LEAST_SHARE - 1e-6 || sky == 1.0, "{radiance}, {at:?}: {lamps}");
        }
    }
}

/// Lights that are all bright or all dim are chosen alike: only ratios count. By powers of two no bit changes.
#[test]
fn brightness_as_such_does_not_matter() {
    let (lights, shapes) = scene(40, 2);
    let [plain, bright, dim] = [1.0, libm::ldexpf(1.0, 60), libm::ldexpf(1.0, -60)].map(|factor| {
        let mut lights = lights.clone();
        for light in &mut lights {
            match light {
                Light::Area(light) => light.radiance *= factor,
                Light::Point(light) => light.intensity *= factor,
                Light::Constant(light) => light.radiance *= factor,
                Light::Directional(light) => light.irradiance *= factor,
                _ => {}
            }
        }
        LightSampler::new(&lights, &shapes)
    });
    for at in receivers() {
        for light in 0..lights.len() {
            let expected = plain.pmf(light, || at);
            assert_eq!((bright.pmf(light, || at), dim.pmf(light, || at)), (expected, expected));
        }
    }
}
