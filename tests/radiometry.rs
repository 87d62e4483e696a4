//! Radiometry in closed form: what a point, a disk, a sphere of light and light from infinity do to a diffuse surface, and
//! what power they have.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use glam::{DAffine3, DMat3, DVec3};
use snell::accel::Accelerator;
use snell::description::{
    Emission, FieldOfView, FovAxis, Geometry, Light, LightKind, Mesh, SceneDescription, Shape, TextureId,
};
use snell::integrator::Estimator;
use snell::spectrum::Rgb;
use std::f64::consts::PI;
use std::sync::Arc;

const ALBEDO: f32 = 0.6;
/// Half the field of view of the only pixel, in degrees.
const HALF_FOV: f64 = 1e-5;
/// How far from the point that the pixel aims at it may see: the camera is 2.6 away, and foreshortening stretches the spot
/// threefold; directions are rounded to f32, and so is the camera's place.
const SPOT: f64 = 8.0 * (HALF_FOV / 180.0 * PI + ULP) + 4.0 * ULP;
const ULP: f64 = f32::EPSILON as f64;

/// One pixel that looks at the point `at` of a diffuse floor in the plane z = 0, from the side.
fn floor(at: DVec3, mut shapes: Vec<Shape>, lights: Vec<Light>) -> SceneDescription {
    // A finite floor that the lights do not shine through from below.
    shapes.push(shape(Geometry::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), 0, None));
    let cameras = vec![camera(at + DVec3::new(1.5, -2.0, 0.8), at, 2.0 * HALF_FOV, 1)];
    SceneDescription { cameras, shapes, lights, ..enclosure(ALBEDO, 0.0) }
}

fn direct(estimator: Estimator, samples: u32) -> snell::render::RenderSettings {
    let mut s = settings(estimator, samples);
    s.integrator.max_depth = 2;
    s
}

/// L = ρ/π · I·cos θ/d² without noise: every sample is the same but for the place in the pixel, over which h/d³ changes by
/// at most 3/d per length. Of roundings, those of the unit vector and of the frame (four half ulps) count in relation to
/// the cosine, ten more in relation to the product.
#[test]
fn a_point_light_s_irradiance_is_i_cos_over_d_squared() {
    let intensity = Rgb::new(1.0, 20.0, 300.0);
    for scale in [1.0, 1000.0, 1e-3] {
        for offset in [DVec3::ZERO, DVec3::new(1e6, -1e6, 3e5) * scale] {
            for (light, at) in [
                (DVec3::new(0.3, 0.2, 1.1), DVec3::new(0.5, -0.4, 0.0)),
                (DVec3::new(0.3, 0.2, 0.1), DVec3::new(0.3, 0.2, 0.0)),
                (DVec3::new(-2.0, 1.0, 0.05), DVec3::new(1.0, -0.4, 0.0)),
                (DVec3::new(300.0, 100.0, 900.0), DVec3::new(1.0, -0.4, 0.0)),
            ] {
                let d = light - at;
                let expected = f64::from(ALBEDO) / PI * (d.z / d.length()) / d.length_squared();
                let tolerance = 3.0 * SPOT / d.length() + ULP * (2.0 * d.length() / d.z + 5.0);
                let room = transformed(floor(at, vec![], vec![point_light(light, intensity)]), scale, offset);
                for accelerator in accelerators() {
                    let seen = picture(&compiled(&room, accelerator), &direct(Estimator::Path, 16)).get(0, 0);
                    for (seen, i) in seen.to_array().into_iter().zip(intensity.to_array()) {
                        let error = f64::from(seen) / (expected * f64::from(i)) - 1.0;
                        let what = format!("{light}, {at} × {scale} + {offset}, {accelerator:?}");
                        assert!(error.abs() <= tolerance, "{what}: {error:e}, at most {tolerance:e}");
                    }
                }
            }
        }
    }
}

/// L = ρ/π · E·cos θ, the same all over the floor, whatever is far away. The bound is that of a point light's roundings.
#[test]
fn directional_light_s_irradiance_is_e_cos() {
    let irradiance = Rgb::new(1.0, 20.0, 300.0);
    for direction in [DVec3::NEG_Z, DVec3::new(0.5, -3.0, -1.0), DVec3::new(-1e-3, 2e-3, -1e-4) * 1e20] {
        let lights = vec![light(LightKind::Directional { direction, irradiance })];
        let cos = -direction.normalize().z;
        for (scale, accelerator) in
            [1.0, 1e-3].into_iter().flat_map(|s| accelerators().into_iter().map(move |a| (s, a)))
        {
            let room = transformed(floor(DVec3::new(0.5, -0.4, 0.0), vec![], lights.clone()), scale, DVec3::ZERO);
            let seen = picture(&compiled(&room, accelerator), &direct(Estimator::Path, 16)).get(0, 0);
            for (seen, e) in seen.to_array().into_iter().zip(irradiance.to_array()) {
                let error = f64::from(seen) / (f64::from(ALBEDO) / PI * f64::from(e) * cos) - 1.0;
                assert!(error.abs() <= ULP * (2.0 / cos + 5.0), "{direction} × {scale}, {accelerator:?}: {error:e}");
            }
        }
    }
    // From below nothing arrives.
    let lights = vec![light(LightKind::Directional { direction: DVec3::new(0.1, 0.0, 1.0), irradiance })];
    let dark = compiled(&floor(DVec3::ZERO, vec![], lights), Accelerator::Auto);
    assert_eq!(mean(&picture(&dark, &direct(Estimator::Path, 16))), 0.0);
}

/// What a point light of the same intensity does, times (c − θ)/(c − b) between the beam's width b and the cutoff c. Over the
/// spot that the pixel sees that changes by its slope, 1/(c − b), over the distance.
#[test]
fn a_spot_is_a_point_light_in_a_cone() {
    let (position, at) = (DVec3::new(0.3, 0.2, 1.1), DVec3::new(0.5, -0.4, 0.0));
    let intensity = Rgb::new(1.0, 20.0, 300.0);
    let towards = (at - position).normalize();
    let across = towards.any_orthonormal_vector();
    let seen = |kind: LightKind, scale: f64| {
        let room = transformed(floor(at, vec![], vec![light(kind)]), scale, DVec3::ZERO);
        picture(&compiled(&room, Accelerator::Auto), &direct(Estimator::Path, 16)).get(0, 0)
    };
    for (cutoff_angle, beam_width, angle) in [
        (20.0, 15.0, 10.0),
        (20.0, 15.0, 17.0),
        (20.0, 15.0, 21.0),
        (60.0, 0.0, 45.0),
        (30.0, 30.0, 29.9),
        (170.0, 0.0, 95.0),
    ] {
        let direction = DAffine3::from_axis_angle(across, f64::to_radians(angle)).transform_vector3(towards) * 7.0;
        let factor = ((cutoff_angle - angle) / (cutoff_angle - beam_width)).clamp(0.0, 1.0);
        for scale in [1.0, 1000.0] {
            let point = seen(LightKind::Point { position, intensity }, scale);
            let spot = seen(
                LightKind::Spot { position, direction, intensity, cutoff_angle, beam_width, texture: None },
                scale,
            );
            let slope = 1.0 / f64::to_radians(cutoff_angle - beam_width).max(ULP);
            let tolerance = if factor == 1.0 || factor == 0.0 { ULP } else { SPOT * slope + 4.0 * ULP };
            for (spot, point) in spot.to_array().into_iter().zip(point.to_array()) {
                let error = f64::from(spot) / f64::from(point) - factor;
                assert!(error.abs() <= tolerance, "{cutoff_angle} {beam_width} {angle} × {scale}: {error:e}");
            }
        }
    }
}

/// Where the picture of a projector falls on the floor, every point is lit by π·v/z² for the depth z of the floor, which the
/// projector looks straight down at: L = ρ/π · that. Corners of the picture, seen from behind it: its left at the camera's +x.
#[test]
fn a_projector_shows_its_picture() {
    let value = |x: u32, y: u32| Rgb::new(x as f32, y as f32, 1.0);
    let (height, half_width, scale) = (1.25, f64::to_radians(30.0).tan(), 3.0);
    // Looking down, +x to the east and +y to the north.
    let down = DMat3::from_cols(DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z);
    let position = DVec3::new(0.2, 0.1, height);
    let kind = LightKind::Projector {
        texture: TextureId(0),
        scale,
        to_world: DAffine3::from_mat3_translation(down, position),
        fov: FieldOfView { degrees: 60.0, axis: FovAxis::X },
    };
    for (unit, accelerator) in [1.0, 1000.0].into_iter().flat_map(|s| accelerators().into_iter().map(move |a| (s, a))) {
        for (u, v, expected) in [
            (0.125, 0.25, Some([0.0, 0.0, 1.0])),
            (0.375, 0.75, Some([1.0, 1.0, 1.0])),
            (0.875, 0.75, Some([3.0, 1.0, 1.0])),
            (0.5, 0.5, Some([1.5, 0.5, 1.0])),
            (0.999, 0.25, Some([1.512, 0.0, 1.0])),
            (1.01, 0.25, None),
            (0.5, -0.01, None),
        ] {
            let at = position + height * half_width * DVec3::new(2.0 * u - 1.0, 0.5 - v, 0.0) - height * DVec3::Z;
            let mut room = transformed(floor(at, vec![], vec![light(kind.clone())]), unit, DVec3::ZERO);
            room.textures = vec![picture_texture(4, 2, value)];
            let seen = picture(&compiled(&room, accelerator), &direct(Estimator::Path, 16)).get(0, 0);
            let per_value = f64::from(ALBEDO) * scale / (height * height);
            for (seen, v) in seen.to_array().into_iter().zip(expected.unwrap_or_default()) {
                // A step of one from pixel to pixel, 0.36 wide, over the spot that the camera's pixel sees.
                let error = f64::from(seen) / per_value - v;
                assert!(error.abs() <= 3.0 * SPOT + 8.0 * ULP * 3.0, "{u}, {v} × {unit}: {seen}, {error:e}");
            }
        }
    }
    let textures = vec![picture_texture(4, 2, value)];
    let room = SceneDescription { lights: vec![light(kind)], textures, ..enclosure(0.5, 0.0) };
    let scene = compiled(&room, Accelerator::Native);
    let power = scene.lights[0].power(&scene.shapes).unwrap().map(|w| w / (scene.unit * scene.unit));
    let area = 2.0 * half_width * half_width;
    for (power, mean) in power.into_iter().zip([1.5, 0.5, 1.0]) {
        assert!((power / (PI * scale * area * mean) - 1.0).abs() < 1e-12, "{power}");
    }
}

/// Radiance θ/π around the normal of the floor, θ from its zenith: the irradiance is 2π·∫(θ/π)·cos θ·sin θ dθ over the
/// hemisphere, π/4; of radiance 1 it is π. Both are so whatever the number of rows, for between them maps are linear; and
/// with MIS compensation, too, which light sampling alone must not notice.
///
/// Hypothesis and false-alarm rate as of form factors below, with 24 cases.
#[test]
fn irradiance_under_an_environment_map() {
    let up = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
    for (width, height) in [(2, 3), (9, 64)] {
        for (value, factor) in [(1.0, 1.0), (0.0, 0.25)] {
            for mis_compensation in [false, true] {
                let radiance = |y: u32| value + (1.0 - value) * y as f32 / (height - 1) as f32;
                let map = map(width, height, |_, y| Rgb::splat(radiance(y)));
                let sky = light(LightKind::Environment { map, scale: 3.0, to_world: up, mis_compensation });
                let scene = compiled(&floor(DVec3::ZERO, vec![], vec![sky]), Accelerator::Auto);
                let expected = f64::from(ALBEDO) * 3.0 * factor;
                for estimator in [Estimator::Path, Estimator::Nee, Estimator::Bsdf] {
                    let (m, se) = mean_of_seeds(&scene, &direct(estimator, 1024));
                    let se = se.max(1e-6 * expected);
                    let what = format!("{width}x{height}, {value}, {mis_compensation}, {estimator:?}");
                    assert!(((m - expected) / se).abs() < 6.0, "{what}: {m} ± {se}, but {expected}");
                    assert!(se < 5e-3 * expected, "{what}: too noisy to tell, {se}");
                }
            }
        }
    }
}

/// A sun of a few pixels, above which the sky is dark: the irradiance is the sum over its cells, by quadrature of the bilinear
/// map. Light sampling finds it at once.
#[test]
fn a_sun_in_a_map_is_found() {
    let (width, height, sun) = (64u32, 33u32, (20, 9));
    let value = |x: u32, y: u32| if (x, y) == sun { 49_000.0 } else { 0.01 };
    let up = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
    let map = map(width, height, |x, y| Rgb::splat(value(x, y)));
    let sky = light(LightKind::Environment { map, scale: 1.0, to_world: up, mis_compensation: false });
    // The tent of the sun's pixel times sin θ·cos θ; and the rest of the sky.
    let (steps, h) = (2000, PI / f64::from(height - 1));
    let tent: f64 = (0..steps)
        .map(|i| {
            let t = 2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0;
            let theta = (f64::from(sun.1) + t) * h;
            (1.0 - t.abs()) * theta.sin() * theta.cos() * 2.0 * h / f64::from(steps)
        })
        .sum();
    let irradiance = 0.01 * PI + (49_000.0 - 0.01) * tent * 2.0 * PI / f64::from(width);
    let expected = f64::from(ALBEDO) / PI * irradiance;
    let scene = compiled(&floor(DVec3::ZERO, vec![], vec![sky]), Accelerator::Auto);
    for estimator in [Estimator::Path, Estimator::Nee] {
        let (m, se) = mean_of_seeds(&scene, &direct(estimator, 256));
        assert!(((m - expected) / se).abs() < 6.0, "{estimator:?}: {m} ± {se}, but {expected}");
        assert!(se < 2e-3 * expected, "{estimator:?}: too noisy to tell, {se}");
    }
}

/// Shapes that hang with a face, a rim or a corner at `light`, above the floor.
fn ceilings(light: DVec3) -> Vec<(&'static str, Shape)> {
    let at = |z: f64| DAffine3::from_translation(light + z * DVec3::Z);
    let tilted = |angle: f64| at(0.0) * DAffine3::from_axis_angle(DVec3::new(0.8, -0.6, 0.0), angle);
    let cylinder = Geometry::Cylinder {
        p0: light + DVec3::new(-0.5, 0.1, 0.3),
        p1: light + DVec3::new(0.5, -0.1, 0.3),
        radius: 0.3,
    };
    let corner = at(0.0) * DAffine3::from_scale(DVec3::new(-0.5, 0.5, 0.5));
    let mesh = Mesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        faces: vec![[0, 1, 2], [0, 1, 3], [0, 2, 3]],
        ..Mesh::default()
    };
    let unturned = DAffine3::IDENTITY;
    [
        ("rectangle", Geometry::Rectangle, at(0.0)),
        ("tilted rectangle", Geometry::Rectangle, tilted(0.3)),
        ("steep rectangle", Geometry::Rectangle, tilted(-0.2)),
        ("rectangle's edge", Geometry::Rectangle, at(0.0) * DAffine3::from_translation(DVec3::X)),
        ("disk", Geometry::Disk, at(0.0)),
        ("tilted disk", Geometry::Disk, tilted(-0.3)),
        ("sphere", Geometry::Sphere { centre: light + 0.4 * DVec3::Z, radius: 0.4, frame: DMat3::IDENTITY }, unturned),
        ("cylinder", cylinder, unturned),
        ("corner", Geometry::Mesh(Arc::new(mesh)), corner),
    ]
    .map(|(name, geometry, map)| (name, shape(geometry, map, 0, None)))
    .into()
}

/// A light that hangs on a surface is seen from where the surface is seen, whatever rounding makes of its height: where
/// the ceiling does not hide it, it does what it does alone.
#[test]
fn a_point_light_on_a_ceiling_is_not_hidden_by_it() {
    let at = DVec3::new(0.5, -0.4, 0.0);
    for height in [1.1, 1.2345, 1.25, 1.3, 0.77] {
        let light = DVec3::new(0.3, 0.2, height);
        let lights = vec![point_light(light, Rgb::WHITE)];
        let seen = |ceiling: Vec<Shape>, scale: f64, accelerator| {
            let room = transformed(floor(at, ceiling, lights.clone()), scale, DVec3::new(7.0, 3.0, -1e3) * scale);
            picture(&compiled(&room, accelerator), &direct(Estimator::Path, 16)).get(0, 0).to_array()[0]
        };
        for accelerator in accelerators() {
            for scale in [1.0, 0.7] {
                let alone = seen(vec![], scale, accelerator);
                for (name, ceiling) in ceilings(light) {
                    let there = seen(vec![ceiling], scale, accelerator);
                    // Where the ceiling moves the middle of the scene, coordinates are rounded differently.
                    let error = f64::from(there / alone - 1.0).abs();
                    assert!(
                        error < 3.0 * SPOT + 16.0 * ULP,
                        "{name} at {height} × {scale}, {accelerator:?}: {error:e}"
                    );
                }
            }
        }
    }
}

/// Hypothesis: the mean of 16 seeds is ρ·Le·F, F the form factor. Each z follows Student's t with 15 degrees of freedom:
/// |z| > 6 has probability 2.4·10⁻⁵, for the 20 cases together 5·10⁻⁴. The seeds are fixed.
fn assert_form_factor(what: &str, light: Shape, at: DVec3, factor: f64) {
    const EMISSION: f32 = 3.0;
    let mut light = light;
    light.emission = Some(Emission::uniform(Rgb::splat(EMISSION)));
    let scene = compiled(&floor(at, vec![light], vec![]), Accelerator::Auto);
    let expected = f64::from(ALBEDO) * f64::from(EMISSION) * factor;
    for estimator in [Estimator::Path, Estimator::Nee] {
        let (m, se) = mean_of_seeds(&scene, &direct(estimator, 1024));
        // Without noise (a light that is sampled perfectly) what remains is the rounding of f32.
        let se = se.max(1e-6 * expected);
        assert!(((m - expected) / se).abs() < 6.0, "{what}, {estimator:?}: {m} ± {se}, but {expected}");
        assert!(se < 5e-3 * expected, "{what}, {estimator:?}: too noisy to tell, {se}");
    }
}

fn lamp(geometry: Geometry, map: DAffine3, flip: bool) -> Shape {
    let mut lamp = shape(geometry, map, 0, None);
    lamp.flip_normals = flip;
    lamp
}

/// A disk of radius R at height h over a point, parallel to the surface there and moved sideways by a. With H = h/a,
/// R' = R/a and Z = 1 + H² + R'²: F = ½·(1 − (1 + H² − R'²)/√(Z² − 4R'²)); for a = 0, R²/(R² + h²) (Howell, Mengüç, Daun
/// and Siegel 2020, *Thermal Radiation Heat Transfer*, appendix C, configuration B-12).
#[test]
fn form_factor_of_a_disk() {
    for (radius, h, a) in [(0.5, 1.0, 0.0), (0.5, 0.2, 0.0), (0.5, 1.0, 0.8), (0.3, 0.4, 1.5), (0.01, 0.7, 0.3)] {
        let map = DAffine3::from_translation(DVec3::new(a, 0.0, h)) * DAffine3::from_scale(DVec3::splat(radius));
        let factor = if a == 0.0 {
            radius * radius / (radius * radius + h * h)
        } else {
            let (h, r): (f64, f64) = (h / a, radius / a);
            let z = 1.0 + h * h + r * r;
            0.5 * (1.0 - (1.0 + h * h - r * r) / (z * z - 4.0 * r * r).sqrt())
        };
        assert_form_factor(&format!("disk {radius} {h} {a}"), lamp(Geometry::Disk, map, true), DVec3::ZERO, factor);
    }
}

/// A sphere that is all above the horizon: F = cos θ·(R/d)² (Lambert 1760; the same source, configuration B-42).
#[test]
fn form_factor_of_a_sphere() {
    for (radius, centre) in [(0.5, DVec3::Z), (0.5, DVec3::new(1.0, 0.5, 0.7)), (1e-3, DVec3::new(0.5, 0.1, 0.3))] {
        let sphere = Geometry::Sphere { centre, radius, frame: DMat3::IDENTITY };
        let factor = centre.z / centre.length() * radius * radius / centre.length_squared();
        assert_form_factor(
            &format!("sphere {radius} {centre}"),
            lamp(sphere, DAffine3::IDENTITY, false),
            DVec3::ZERO,
            factor,
        );
    }
}

/// What a cylinder that stands over a point open-ended shows of its inside: the disk at its lower end less the one at its
/// upper end, as seen from the middle of the floor.
#[test]
fn form_factor_of_the_inside_of_a_cylinder() {
    let (radius, low, high) = (0.6, 0.3, 1.2);
    let disk = |h: f64| radius * radius / (radius * radius + h * h);
    let cylinder = Geometry::Cylinder { p0: low * DVec3::Z, p1: high * DVec3::Z, radius };
    let lamp = lamp(cylinder, DAffine3::IDENTITY, true);
    assert_form_factor("inside of a cylinder", lamp, DVec3::ZERO, disk(low) - disk(high));
}

/// π·A·L, 4π·I and a spot's part of it, in the file's units, to the rounding of f32 coordinates.
#[test]
fn powers_of_lights_are_exact() {
    let stretched = DAffine3::from_scale(DVec3::new(2.0, 3.0, 0.5));
    let areas = [
        (Geometry::Rectangle, stretched, 24.0),
        (Geometry::Disk, stretched, 6.0 * PI),
        (
            Geometry::Sphere { centre: DVec3::ONE, radius: 0.7, frame: DMat3::IDENTITY },
            DAffine3::IDENTITY,
            4.0 * PI * 0.49,
        ),
        (
            Geometry::Cylinder { p0: DVec3::ONE, p1: DVec3::ZERO, radius: 0.7 },
            DAffine3::IDENTITY,
            1.4 * PI * 3f64.sqrt(),
        ),
    ];
    let shapes: Vec<Shape> = areas.iter().map(|(g, m, _)| shape(g.clone(), *m, 0, Some(5.0))).collect();
    // Half a sphere.
    let spot = LightKind::Spot {
        position: DVec3::ONE,
        direction: DVec3::X,
        intensity: Rgb::splat(7.0),
        cutoff_angle: 90.0,
        beam_width: 90.0,
        texture: None,
    };
    let lights = vec![point_light(DVec3::X, Rgb::splat(7.0)), light(spot)];
    let expected: Vec<f64> = areas.iter().map(|a| 5.0 * PI * a.2).chain([4.0 * PI * 7.0, 2.0 * PI * 7.0]).collect();
    for scale in [1.0, 1e3, 1e-4] {
        let room = SceneDescription { shapes: shapes.clone(), lights: lights.clone(), ..enclosure(0.5, 0.0) };
        let scene = compiled(&transformed(room, scale, DVec3::ZERO), Accelerator::Native);
        assert_eq!(scene.lights.len(), expected.len());
        for (light, expected) in scene.lights.iter().zip(&expected) {
            let power = light.power(&scene.shapes).unwrap()[0] / (scene.unit * scene.unit);
            assert!((power / (expected * scale * scale) - 1.0).abs() < 1e-6, "{power} × {scale}²: {expected}");
        }
    }
}

fn snell(arguments: &[&std::ffi::OsStr]) -> std::process::Output {
    std::process::Command::new(env!("CARGO_BIN_EXE_snell")).args(arguments).output().unwrap()
}

#[test]
fn info_prints_powers_in_watts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let text = r#"<scene version="3.0.0">
        <sensor type="perspective"><film type="hdrfilm"><rfilter type="box"/></film></sensor>
        <shape type="disk" id="lamp"><transform name="to_world"><scale value="1000"/></transform>
            <emitter type="area"><rgb name="radiance" value="1 2 0"/></emitter></shape>
        <emitter type="point"><rgb name="intensity" value="1 2 3"/></emitter>
        <emitter type="spot"><float name="cutoff_angle" value="90"/><float name="beam_width" value="90"/></emitter>
        <emitter type="directional"/>
        <emitter type="constant"/></scene>"#;
    std::fs::write(&path, text).unwrap();
    let told = String::from_utf8(snell(&["info".as_ref(), path.as_ref()]).stdout).unwrap();
    // π²·10⁶ and twice that; 4π, 8π and 12π; 2π; together.
    for expected in [
        "1 on surfaces, 1 points, 1 spots, 0 projectors, 1 directional, 1 at infinity",
        "9869600 19739200 0 W (R G B)",
        "'lamp'",
        "12.5664 25.1327 37.6991 W (R G B), 23.3684 W of luminance  point (",
        "6.28319 6.28319 6.28319 W (R G B), 6.28319 W of luminance  spot (",
        "not finite: it fills all space  directional (",
        "not finite: it fills all space  constant (",
        "9869620 19739200 43.9823 W (R G B)",
    ] {
        assert!(told.contains(expected), "expected '{expected}' in\n{told}");
    }
}

#[test]
fn a_light_that_nothing_can_find_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, picture) = (folder.path().join("scene.xml"), folder.path().join("picture.exr"));
    let text = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
        <integer name="width" value="2"/><integer name="height" value="2"/></film></sensor>
        <shape type="cube"/><emitter type="point"/></scene>"#;
    let lights = ["point", "spot", "directional"];
    let cases = [("bsdf", true), ("naive", true), ("nee", false), ("path", false)];
    for (light, (integrator, dark)) in lights.into_iter().flat_map(|l| cases.map(|c| (l, c))) {
        std::fs::write(&scene, text.replace("\"point\"", &format!("\"{light}\""))).unwrap();
        let arguments =
            ["render".as_ref(), scene.as_ref(), "-o".as_ref(), picture.as_os_str(), "--integrator".as_ref()];
        let output = snell(&[&arguments[..], &[integrator.as_ref()]].concat());
        assert!(output.status.success(), "{output:?}");
        let warned = String::from_utf8(output.stderr).unwrap();
        let expected = format!("lights without size stay dark: '{integrator}' only counts light that a path runs into");
        assert_eq!(warned.contains(&expected), dark, "{warned}");
    }
}
