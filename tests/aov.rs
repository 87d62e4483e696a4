//! What goes beside the picture: quantities of the surface that is seen, in closed form, and independent of everything that
//! may not matter.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use snell::accel::Accelerator;
use snell::description::*;
use snell::film::{Film, SampleId};
use snell::integrator::Estimator;
use snell::integrator::aov::{Aov, Aovs, Index, Number, Quantity};
use snell::integrator::record::Event;
use snell::render::{Progress, RenderSettings, render_with};
use snell::scene::Scene;

const ALL: [Quantity; 11] = [
    Quantity::Albedo,
    Quantity::DiffuseReflectance,
    Quantity::Normal,
    Quantity::ShadingNormal,
    Quantity::Depth,
    Quantity::DepthFromNear,
    Quantity::Position,
    Quantity::Uv,
    Quantity::Radiance,
    Quantity::Xyz,
    Quantity::Alpha,
];

const NUMBERS: [Number; 3] = [
    Number { index: Index::Primitive, first: 1 },
    Number { index: Index::Shape, first: 1 },
    Number { index: Index::Material, first: 1 },
];

/// Every quantity, plain and squared, and every number.
fn everything() -> Aovs {
    let means = ALL.iter().flat_map(|&quantity| [false, true].map(|squared| Aov { quantity, squared }));
    Aovs {
        means: means.collect(),
        numbers: NUMBERS.to_vec(),
        sample_counts: true,
        sky_counts: true,
        looked_at: u32::MAX,
    }
}

fn film(scene: &Scene, settings: &RenderSettings, aovs: &Aovs, threads: usize) -> Film {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    render_with(scene, settings, aovs, &pool, &Progress::default()).film
}

/// The means of a quantity: a vector of its components for each pixel, in the file's unit.
fn means(scene: &Scene, film: &Film, aovs: &Aovs, quantity: Quantity, squared: bool) -> Vec<[f64; 3]> {
    let at = aovs.means.iter().position(|aov| *aov == Aov { quantity, squared }).unwrap();
    let first: usize = aovs.means[..at].iter().map(|aov| aov.quantity.components()).sum();
    let unit = aovs.means[at].unit(scene);
    let planes: Vec<Vec<f64>> = (0..quantity.components()).map(|c| film.means(first + c)).collect();
    let component = |c: usize, i: usize| planes.get(c).map_or(0.0, |plane| plane[i] * unit);
    (0..planes[0].len()).map(|i| [0, 1, 2].map(|c| component(c, i))).collect()
}

/// All planes of a film, as bits.
fn bits(film: &Film, aovs: &Aovs) -> Vec<u64> {
    let planes: usize = aovs.means.iter().map(|aov| aov.quantity.components()).sum();
    let means = (0..planes).flat_map(|i| film.means(i)).map(f64::to_bits);
    let numbers = (0..aovs.numbers.len()).flat_map(|i| film.numbers(i));
    means.chain(numbers.chain(film.sample_counts()).map(u64::from)).collect()
}

fn alone(camera: Camera, shapes: Vec<Shape>) -> SceneDescription {
    SceneDescription {
        integrator: Integrator::default(),
        cameras: vec![camera],
        bsdfs: vec![diffuse(0.25)],
        textures: vec![],
        wants_uvs: true,
        groups: vec![],
        instances: vec![],
        shapes,
        lights: vec![Light { at: at(), kind: LightKind::Constant { radiance: snell::spectrum::Rgb::splat(0.5) } }],
        warnings: vec![],
        inventory: Default::default(),
    }
}

/// Where a plane faces the camera at distance d, the ray at the angle θ to the axis meets it at depth d/cos θ. All this is
/// far from the origin, in a unit that is no power of two.
#[test]
fn a_plane_at_known_depth() {
    /// Pixels a side, distance and tangent of half the field of view, and where the camera stands.
    const N: u32 = 16;
    const D: f64 = 3.7;
    let origin = DVec3::new(-1.0e5, 7.0, 2.0e6);
    let mut camera = camera(origin, origin - DVec3::Z, 90.0, N);
    camera.near_clip = 0.3;
    let plane = DAffine3::from_translation(origin - DVec3::Z * D) * DAffine3::from_scale(DVec3::splat(10.0));
    let description = alone(camera, vec![shape(Geometry::Rectangle, plane, 0, None)]);
    let scene = compiled(&description, Accelerator::Native);
    let aovs = everything();
    let film = film(&scene, &settings(Estimator::Path, 64), &aovs, 2);
    let of = |quantity| means(&scene, &film, &aovs, quantity, false);
    // The compiled scene's f32 are of the order of the plane's size, of which the camera's distance is a part.
    let tolerance = 20.0 * f64::from(f32::EPSILON);
    for i in 0..(N * N) as usize {
        let (x, y) = (f64::from(i as u32 % N), f64::from(i as u32 / N));
        let place = |pixel: f64| 2.0 * (pixel + 0.5) / f64::from(N) - 1.0;
        // Halves of the range of each coordinate of the plane over the pixel.
        let (px, py, half) = (place(x) * D, -place(y) * D, D / f64::from(N));
        let p = of(Quantity::Position)[i];
        assert!((p[2] - (origin.z - D)).abs() <= tolerance, "z of {i}: {}", p[2] - origin.z);
        // 64 points of a (0, 2)-sequence are an 8 by 8 grid: their mean is at most half a cell off.
        assert!((p[0] - origin.x - px).abs() <= half / 8.0 + tolerance, "x of {i}: {}", p[0] - origin.x);
        assert!((p[1] - origin.y - py).abs() <= half / 8.0 + tolerance, "y of {i}: {}", p[1] - origin.y);
        let [u, v, _] = of(Quantity::Uv)[i];
        let (u_of_p, v_of_p) = ((p[0] - origin.x) / 20.0 + 0.5, (p[1] - origin.y) / 20.0 + 0.5);
        assert!((u - u_of_p).abs() <= tolerance && (v - v_of_p).abs() <= tolerance, "uv of {i}: {u}, {v}");
        let distance = |x: f64, y: f64| (x * x + y * y + D * D).sqrt();
        let (far, near) = (distance(px.abs() + half, py.abs() + half), distance(px.abs() - half, py.abs() - half));
        let depth = of(Quantity::Depth)[i][0];
        assert!(depth > near && depth < far, "depth of {i}: {depth}, not between {near} and {far}");
        let from_near = depth * (1.0 - 0.3 / D);
        assert!((of(Quantity::DepthFromNear)[i][0] - from_near).abs() <= tolerance, "depth from the near plane of {i}");
        assert_eq!(of(Quantity::Normal)[i], [0.0, 0.0, 1.0]);
        assert_eq!(of(Quantity::ShadingNormal)[i], [0.0, 0.0, 1.0]);
        assert_eq!(of(Quantity::Albedo)[i], [0.25; 3]);
        assert_eq!(of(Quantity::DiffuseReflectance)[i], [0.25; 3]);
        assert_eq!(of(Quantity::Alpha)[i][0], 1.0);
    }
    assert_eq!(film.sample_counts(), [64; (N * N) as usize]);
}

/// On a sphere of centre c and radius r the point is c + r·n, and so are their means, over a sphere and nothing, if the
/// part that is covered counts for the centre. Of the angles of its texture coordinates, one tells z.
#[test]
fn a_spheres_normals() {
    let (c, r) = (DVec3::new(3.0, -2.0, 5.0), 1.3);
    let sphere = Geometry::Sphere { centre: c, radius: r, frame: DMat3::from_cols(DVec3::Z, DVec3::X, DVec3::Y) };
    for flip_normals in [false, true] {
        let mut ball = shape(sphere.clone(), DAffine3::IDENTITY, 0, None);
        ball.flip_normals = flip_normals;
        let mut description = alone(camera(c + DVec3::new(0.3, 0.1, 4.0), c, 50.0, 24), vec![ball]);
        description.lights.clear();
        let scene = compiled(&description, Accelerator::Native);
        let aovs = everything();
        let film = film(&scene, &settings(Estimator::Path, 16), &aovs, 2);
        let of = |quantity| means(&scene, &film, &aovs, quantity, false);
        let (mut whole, mut part, mut none) = (0, 0, 0);
        let [n, ns, p, a, uv] =
            [Quantity::Normal, Quantity::ShadingNormal, Quantity::Position, Quantity::Alpha, Quantity::Uv].map(of);
        for i in 0..n.len() {
            let cover = a[i][0];
            *(if cover == 1.0 {
                &mut whole
            } else if cover == 0.0 {
                &mut none
            } else {
                &mut part
            }) += 1;
            let sign = if flip_normals { -r } else { r };
            let off = DVec3::from(p[i]) - c * cover - DVec3::from(n[i]) * sign;
            assert!(off.length() <= 8.0 * f64::from(f32::EPSILON) * c.length(), "pixel {i}: {off}");
            assert_eq!(n[i], ns[i]);
        }
        assert!(whole > 100 && part > 20 && none > 100, "{whole} whole, {part} part, {none} none");
        // The pole is up: the middle of the picture sees the equator.
        let middle = uv[12 * 24 + 12];
        assert!((middle[1] - 0.5).abs() < 0.03, "{middle:?}");
    }
}

/// Angles and heights of points whose place is known.
#[test]
fn texture_coordinates_of_quadrics() {
    let turned = DAffine3::from_quat(DQuat::from_rotation_y(0.4));
    let cases = [
        (Geometry::Disk, DVec3::new(0.0, 0.0, 4.0), DVec3::new(0.3, -0.4, 0.0), [0.5, 0.852_416_382_349_566_7]),
        (
            Geometry::Cylinder { p0: DVec3::ZERO, p1: DVec3::Z * 2.0, radius: 1.0 },
            DVec3::new(0.0, 5.0, 0.5),
            DVec3::new(0.0, 1.0, 0.5),
            [0.25, 0.25],
        ),
        (
            Geometry::Sphere { centre: DVec3::ZERO, radius: 2.0, frame: DMat3::IDENTITY },
            DVec3::new(0.0, -9.0, 0.0),
            DVec3::new(0.0, -2.0, 0.0),
            [0.75, 0.5],
        ),
    ];
    for (geometry, from, to, expected) in cases {
        let is_sphere = matches!(geometry, Geometry::Sphere { .. });
        let map = if is_sphere { DAffine3::IDENTITY } else { turned };
        let camera = camera(map.transform_point3(from), map.transform_point3(to), 1e-3, 1);
        let scene = compiled(&alone(camera, vec![shape(geometry, map, 0, None)]), Accelerator::Native);
        let aovs = everything();
        let film = film(&scene, &settings(Estimator::Path, 1), &aovs, 1);
        let uv = means(&scene, &film, &aovs, Quantity::Uv, false)[0];
        for (got, want) in uv.iter().zip(expected) {
            // The picture is 10⁻⁴ wide.
            assert!((got - want).abs() < 1e-4, "{uv:?}, not {expected:?}");
        }
    }
}

/// Under filters that reach into other tiles, and with numbers that only one sample of a pixel tells.
#[test]
fn threads_crops_and_accelerators_change_no_bit() {
    for filter in [Filter::Box, Filter::DEFAULT, Filter::Lanczos { lobes: 3 }] {
        let mut description = load("scenes/cornell-box-materials/scene.xml", &[("res", "48")]);
        let own = &mut description.cameras[0].film;
        (own.filter, own.sample_border) = (filter, true);
        let s = file_settings(&description, Estimator::Path, 20);
        let aovs = everything();
        let scene = compiled(&description, Accelerator::Native);
        let one = film(&scene, &s, &aovs, 1);
        for threads in [2, 7] {
            assert_eq!(bits(&one, &aovs), bits(&film(&scene, &s, &aovs, threads), &aovs), "{filter:?}, {threads}");
        }
        // The picture is what it is without anything beside it.
        assert_eq!(one.develop(), rendered(&scene, &s, 2).film.develop(), "{filter:?}");
        let crop = Crop { x: 3, y: 21, width: 21, height: 18 };
        description.cameras[0].film.crop = crop;
        let part = film(&compiled(&description, Accelerator::Native), &s, &aovs, 2);
        let planes: usize = aovs.means.iter().map(|aov| aov.quantity.components()).sum();
        for plane in 0..planes {
            let (whole, part) = (one.means(plane), part.means(plane));
            for (i, value) in part.iter().enumerate() {
                let (x, y) = (i as u32 % crop.width + crop.x, i as u32 / crop.width + crop.y);
                assert_eq!(*value, whole[(y * 48 + x) as usize], "{filter:?}, plane {plane}, {x},{y}");
            }
        }
    }
}

/// Lengths scale, everything else stays, bit for bit.
#[test]
fn powers_of_two_change_no_bit() {
    let description = load("scenes/cornell-box-materials/scene.xml", &[("res", "24")]);
    let s = file_settings(&description, Estimator::Path, 4);
    let aovs = everything();
    let scene = compiled(&description, Accelerator::Native);
    let base = bits(&film(&scene, &s, &aovs, 2), &aovs);
    for exponent in [-40, 3] {
        let scaled = transformed(description.clone(), 2f64.powi(exponent), DVec3::ZERO);
        let scaled = compiled(&scaled, Accelerator::Native);
        // The film's sums are in the compiled scene's unit.
        assert_eq!(base, bits(&film(&scaled, &s, &aovs, 2), &aovs), "2^{exponent}");
        assert_eq!(scaled.unit, scene.unit * 2f64.powi(-exponent));
    }
}

/// Numbers are those of sample 0, whatever else the pixel sees.
#[test]
fn numbers_are_those_of_the_first_sample() {
    const N: i32 = 32;
    let mut description = load("scenes/shelf/scene.xml", &[("res", "32")]);
    description.cameras[0].film.filter = Filter::DEFAULT;
    let s = file_settings(&description, Estimator::Path, 9);
    let scene = compiled(&description, Accelerator::Native);
    let aovs = everything();
    let film = film(&scene, &s, &aovs, 2);
    let got: Vec<Vec<u32>> = (0..3).map(|i| film.numbers(i)).collect();
    for (x, y) in (0..N).flat_map(|y| (0..N).map(move |x| (x, y))) {
        let mut expected = [0; 3];
        let mut listen = |event: Event| {
            if let Event::Traced { vertex: 1, hit, .. } = event
                && hit.is_some()
            {
                let material = scene.appearances[hit.shape as usize].material;
                expected = [hit.primitive, hit.shape, material].map(|index| index + 1);
            }
        };
        s.integrator.replay(&scene, &s.sampler, SampleId { x, y, index: 0 }, &mut listen);
        let i = (y * N + x) as usize;
        assert_eq!([got[0][i], got[1][i], got[2][i]], expected, "pixel {x},{y}");
    }
    assert!(got[1].iter().max() > Some(&2), "several shapes are seen");
}

/// The mean of squares is the squared mean and the variance: equal where every sample is the same, and with one sample a
/// pixel; at least as large elsewhere.
#[test]
fn second_moments() {
    let aovs = everything();
    let description = load("scenes/cornell-box/scene.xml", &[("res", "16")]);
    let scene = compiled(&description, Accelerator::Native);
    for samples in [1, 16] {
        let film = film(&scene, &file_settings(&description, Estimator::Path, samples), &aovs, 2);
        for quantity in ALL {
            let first = means(&scene, &film, &aovs, quantity, false);
            let second = means(&scene, &film, &aovs, quantity, true);
            for (m, m2) in first.iter().zip(&second).flat_map(|(m, m2)| m.iter().zip(m2)) {
                // Rounding of f64, a few times over, and the unit of the sum, 2⁻⁵⁶ of the lamp's radiance squared.
                let slack = 1e-13 * m * m + 1e-13;
                assert!(m2 - m * m >= -slack, "{quantity:?}: {m2} is less than the square of {m}");
                assert!(samples > 1 || m2 - m * m <= slack, "{quantity:?}: {m2} is not the square of {m}");
            }
        }
    }
}

/// A path that goes nowhere still sees what the camera sees.
#[test]
fn without_depth_there_are_still_surfaces() {
    let description = load("scenes/cornell-box/scene.xml", &[("res", "16")]);
    let scene = compiled(&description, Accelerator::Native);
    let aovs = everything();
    let mut s = file_settings(&description, Estimator::Path, 4);
    let seen = film(&scene, &s, &aovs, 2);
    s.integrator.max_depth = 0;
    let black = film(&scene, &s, &aovs, 2);
    let of = |film: &Film, quantity| means(&scene, film, &aovs, quantity, false);
    for quantity in [Quantity::Normal, Quantity::Depth, Quantity::Position, Quantity::Albedo] {
        assert_eq!(of(&seen, quantity), of(&black, quantity), "{quantity:?}");
    }
    assert!(black.develop().pixels().iter().all(|p| p.is_black()));
}

/// Clear glass loses nothing, whichever way each sample goes; a mirror's albedo is its factor where Fresnel's is 1.
#[test]
fn albedo_of_what_is_not_diffuse() {
    let white = snell::spectrum::Rgb::WHITE;
    let glass =
        BsdfKind::Dielectric { int_ior: 1.5, ext_ior: 1.0, specular_reflectance: white, specular_transmittance: white };
    let mirror = BsdfKind::Conductor {
        eta: snell::spectrum::Rgb::BLACK,
        k: white,
        specular_reflectance: snell::spectrum::Rgb::splat(0.75),
    };
    for (kind, expected) in [(glass, 1.0), (mirror, 0.75)] {
        let sphere = Geometry::Sphere { centre: DVec3::ZERO, radius: 1.0, frame: DMat3::IDENTITY };
        let ball = shape(sphere, DAffine3::IDENTITY, 0, None);
        let mut description = alone(camera(DVec3::Z * 5.0, DVec3::ZERO, 10.0, 8), vec![ball]);
        description.bsdfs[0].kind = kind;
        let (scene, aovs) = (compiled(&description, Accelerator::Native), everything());
        let film = film(&scene, &settings(Estimator::Path, 32), &aovs, 2);
        for albedo in means(&scene, &film, &aovs, Quantity::Albedo, false).concat() {
            // The weight's few roundings in f32.
            assert!((albedo - expected).abs() <= 4.0 * f64::from(f32::EPSILON), "{albedo}, not {expected}");
        }
        assert!(means(&scene, &film, &aovs, Quantity::DiffuseReflectance, false).concat().iter().all(|v| *v == 0.0));
    }
}

/// Alpha is what is covered: by surfaces and by a sky, unless the camera does not see that.
#[test]
fn alpha_counts_what_is_seen() {
    let sphere = Geometry::Sphere { centre: DVec3::ZERO, radius: 1.0, frame: DMat3::IDENTITY };
    let lit = alone(camera(DVec3::Z * 5.0, DVec3::ZERO, 30.0, 16), vec![shape(sphere, DAffine3::IDENTITY, 0, None)]);
    let scene = compiled(&lit, Accelerator::Native);
    let mut aovs = Aovs { sky_counts: true, ..Aovs::default() };
    assert_eq!(aovs.alpha(), 0);
    let seen = |hide_emitters: bool, hide_environment: bool| {
        let mut s = settings(Estimator::Path, 16);
        (s.integrator.hide_emitters, s.integrator.hide_environment) = (hide_emitters, hide_environment);
        let film = film(&scene, &s, &aovs, 2);
        (film.develop(), film.means(0))
    };
    let (shown, all) = seen(false, false);
    assert!(all.iter().all(|a| *a == 1.0));
    for (hide_emitters, hide_environment) in [(true, false), (false, true), (true, true)] {
        let (hidden, alpha) = seen(hide_emitters, hide_environment);
        // The disk that is seen has the radius 5·tan(asin(1/5)) of 16/(2·tan(15°)) pixels, up to its rim.
        let area: f64 = alpha.iter().sum();
        let radius = (0.2f64.asin()).tan() / 15f64.to_radians().tan() * 8.0;
        let disk = std::f64::consts::PI * radius * radius;
        assert!((area / disk - 1.0).abs() < 0.01, "{area}, not {disk}");
        for (i, a) in alpha.iter().enumerate() {
            let (h, s) = (hidden.pixels()[i].0.x, shown.pixels()[i].0.x);
            // What is hidden is the sky's 0.5, wherever nothing is.
            let sky = (0.5 * (1.0 - a)) as f32;
            assert!((h + sky - s).abs() <= 2.0 * f32::EPSILON, "pixel {i}: {h} and {s}, alpha {a}");
        }
    }
}
