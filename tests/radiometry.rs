//! Radiometry in closed form: what a point, a disk and a sphere of light do to a diffuse surface, and what power they
//! have.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use glam::{DAffine3, DMat3, DVec3};
use snell::accel::Accelerator;
use snell::description::{Geometry, Light, Mesh, SceneDescription, Shape};
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
    light.emission = Some(Rgb::splat(EMISSION));
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

/// π·A·L and 4π·I, in the file's units, to the rounding of f32 coordinates.
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
    let lights = vec![point_light(DVec3::X, Rgb::splat(7.0))];
    let expected: Vec<f64> = areas.iter().map(|a| 5.0 * PI * a.2).chain([4.0 * PI * 7.0]).collect();
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
        <emitter type="constant"/></scene>"#;
    std::fs::write(&path, text).unwrap();
    let told = String::from_utf8(snell(&["info".as_ref(), path.as_ref()]).stdout).unwrap();
    // π²·10⁶ and twice that; 4π, 8π and 12π; together.
    for expected in [
        "1 on surfaces, 1 points, 1 at infinity",
        "9869600 19739200 0 W (R G B)",
        "'lamp'",
        "12.5664 25.1327 37.6991 W (R G B), 23.3684 W of luminance  point (",
        "not finite",
        "9869620 19739200 37.6991 W (R G B)",
    ] {
        assert!(told.contains(expected), "expected '{expected}' in\n{told}");
    }
}

#[test]
fn a_point_light_that_nothing_can_find_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, picture) = (folder.path().join("scene.xml"), folder.path().join("picture.exr"));
    let text = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
        <integer name="width" value="2"/><integer name="height" value="2"/></film></sensor>
        <shape type="cube"/><emitter type="point"/></scene>"#;
    std::fs::write(&scene, text).unwrap();
    for (integrator, dark) in [("bsdf", true), ("naive", true), ("nee", false), ("path", false)] {
        let arguments =
            ["render".as_ref(), scene.as_ref(), "-o".as_ref(), picture.as_os_str(), "--integrator".as_ref()];
        let output = snell(&[&arguments[..], &[integrator.as_ref()]].concat());
        assert!(output.status.success(), "{output:?}");
        let warned = String::from_utf8(output.stderr).unwrap();
        let expected = format!("point lights stay dark: '{integrator}' only counts light that a path runs into");
        assert_eq!(warned.contains(&expected), dark, "{warned}");
    }
}
