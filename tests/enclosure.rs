//! Closed rooms, whose radiance is known in closed form: where every wall emits Le and reflects the fraction a of what
//! it gets, every wall shows Le·(1 + a + a² + …) = Le / (1 − a) in every direction. A ray that slips out between two
//! walls, or meets the wall it starts from, darkens or brightens a pixel.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod accel_support;
mod common;

use common::*;
use glam::{DAffine3, DMat3, DVec3};
use snell::accel::Accelerator;
use snell::description::{BsdfId, Emission, Geometry, Mesh, SceneDescription, Shape};
use snell::image::Picture;
use snell::integrator::Estimator;
use snell::shape::TriangleMesh;
use snell::spectrum::Rgb;
use std::sync::Arc;

const ALBEDO: f32 = 0.5;
const EMISSION: f32 = 0.75;
const EXPECTED: f32 = EMISSION / (1.0 - ALBEDO);

/// The same room as one sphere, and a camera that is not in its middle. Rounding puts half of its points inside of it.
fn sphere() -> SceneDescription {
    let geometry = Geometry::Sphere { centre: DVec3::new(0.1, -0.3, 0.2), radius: 2.3, frame: DMat3::IDENTITY };
    let wall = Shape { flip_normals: true, ..shape(geometry, DAffine3::IDENTITY, 0, Some(EMISSION)) };
    SceneDescription { shapes: vec![wall], ..enclosure(ALBEDO, EMISSION) }
}

/// A room with lights of two kinds and of different sizes: every surface has an albedo aᵢ of its own and emits
/// `EXPECTED`·(1 − aᵢ), so that all show `EXPECTED`. One wall and the sphere in the room do not emit.
fn mixed() -> SceneDescription {
    let albedos = [0.2, 0.4, 0.5, 0.3, 0.6, 1.0, 0.1, 1.0];
    let mut scene = enclosure(ALBEDO, EMISSION);
    scene.bsdfs = albedos.into_iter().map(diffuse).collect();
    for (centre, radius) in [(DVec3::new(-0.4, 0.3, -0.6), 0.25), (DVec3::new(-0.5, -0.4, -0.2), 0.2)] {
        scene.shapes.push(shape(
            Geometry::Sphere { centre, radius, frame: DMat3::IDENTITY },
            DAffine3::IDENTITY,
            0,
            None,
        ));
    }
    for (i, (shape, albedo)) in scene.shapes.iter_mut().zip(albedos).enumerate() {
        shape.bsdf = BsdfId(i);
        shape.emission = (albedo < 1.0).then(|| Emission::uniform(Rgb::splat(EXPECTED * (1.0 - albedo))));
    }
    scene
}

/// A room of these shapes around the origin.
fn room(shapes: Vec<Shape>) -> SceneDescription {
    SceneDescription { shapes, ..enclosure(ALBEDO, EMISSION) }
}

/// The inside of a mesh, with flat faces or with smooth normals.
fn inside(mesh: &TriangleMesh, smooth: bool) -> SceneDescription {
    let positions = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
    let normals = if smooth { vertex_normals(mesh) } else { Vec::new() };
    let mesh = Geometry::Mesh(Arc::new(Mesh { positions, normals, faces: mesh.faces.clone(), ..Mesh::default() }));
    room(vec![Shape { flip_normals: true, ..shape(mesh, DAffine3::IDENTITY, 0, Some(EMISSION)) }])
}

/// Not of unit length.
fn face_normal(mesh: &TriangleMesh, face: [u32; 3]) -> DVec3 {
    let [a, b, c] = face.map(|i| mesh.positions[i as usize].as_dvec3());
    (b - a).cross(c - a)
}

/// The sums of the adjacent faces' normals.
fn vertex_normals(mesh: &TriangleMesh) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; mesh.positions.len()];
    for &face in &mesh.faces {
        face.iter().for_each(|&i| normals[i as usize] += face_normal(mesh, face));
    }
    normals
}

/// The cube as the loader makes it, its front inside.
fn cube() -> Shape {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.xml");
    let text = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"/></sensor>
        <shape type="cube"><boolean name="flip_normals" value="true"/></shape></scene>"#;
    std::fs::write(&path, text).unwrap();
    let mut shape = snell::loader::load(&path, &Default::default()).unwrap().shapes.remove(0);
    (shape.bsdf, shape.emission) = (BsdfId(0), Some(Emission::uniform(Rgb::splat(EMISSION))));
    shape
}

/// Every shape that can enclose.
fn rooms() -> Vec<(&'static str, SceneDescription)> {
    let skew = DMat3::from_cols(DVec3::new(0.9, 0.1, 0.0), DVec3::new(-0.2, 0.7, 0.1), DVec3::new(0.1, 0.3, 1.2));
    let skew = DAffine3::from_mat3(skew);
    let turned = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 0.5).normalize(), 0.7);
    vec![
        ("box of rectangles", enclosure(ALBEDO, EMISSION)),
        ("sphere", sphere()),
        ("cube", room(vec![cube()])),
        ("skewed cube", room(vec![Shape { to_world: skew, ..cube() }])),
        ("bumpy mesh", inside(&accel_support::displaced_sphere(20), false)),
        ("closed cylinder", room(closed_cylinder(DAffine3::IDENTITY, Some(EMISSION)))),
        ("turned cylinder", room(closed_cylinder(turned, Some(EMISSION)))),
        ("skewed cylinder", room(closed_cylinder(skew, Some(EMISSION)))),
    ]
}

/// Paths of at most 40 segments by bsdf sampling alone.
fn without_variance(scene: &SceneDescription, accelerator: Accelerator) -> Picture {
    let mut s = settings(Estimator::Bsdf, 16);
    s.integrator.max_depth = 40;
    s.integrator.rr_depth = u32::MAX;
    picture(&compiled(scene, accelerator), &s)
}

/// What rounding may do to a pixel, relatively. The partial sums of the series, (1 − 2⁻ᵏ)·`EXPECTED`, are exact as long
/// as 24 bits hold them. Two more additions round, by half an ulp each; what is smaller than half an ulp then vanishes,
/// all together below one ulp (the depth limit's tail, 2⁻⁴⁰, with it). Throughputs are powers of two, and the mean of the
/// samples rounds once more, by half an ulp. An ulp at `EXPECTED` is less than f32's ε of it.
const ROUNDING: f32 = 2.5 * f32::EPSILON;

/// Bsdf sampling without roulette has no variance here: every path collects the same geometric series, so that each pixel
/// must have the value itself, where the room was made and up to a million times its size away.
#[test]
fn every_pixel_of_every_closed_room_has_the_closed_form_value() {
    for (name, description) in rooms() {
        for accelerator in accelerators() {
            for offset in [0.0, 1e3, 1e6] {
                let moved = transformed(description.clone(), 1.0, DVec3::new(1.0, -0.7, 0.3) * offset);
                let picture = without_variance(&moved, accelerator);
                let values = picture.pixels().iter().flat_map(|p| p.to_array());
                let worst = values.map(|v| (v / EXPECTED - 1.0).abs()).fold(0.0, f32::max);
                assert!(worst <= ROUNDING, "{name}, {accelerator:?}, offset {offset}: off by {worst:e}");
            }
        }
    }
}

/// Smooth normals tilt the cosine lobe, so that a part of it points through the wall and is lost: of a lobe tilted by ε
/// the part (1 − cos ε)/2. With the largest tilt of any corner that bounds the mean from below; nothing is above the
/// closed form.
#[test]
fn smooth_normals_lose_no_more_than_their_tilt() {
    let mut mesh = accel_support::displaced_sphere(20);
    for p in &mut mesh.positions {
        let d = p.normalize();
        *p = d * (1.0 + 0.1 * (3.0 * (d.x + d.y - d.z)).sin());
    }
    let normals = vertex_normals(&mesh);
    let tilts = mesh.faces.iter().flat_map(|&face| {
        let flat = face_normal(&mesh, face).normalize();
        face.map(|i| flat.dot(normals[i as usize].normalize()))
    });
    let cos = tilts.fold(1.0, f64::min) as f32;
    let least = EMISSION / (1.0 - ALBEDO * 0.5 * (1.0 + cos));
    assert!(cos < 0.999 && least > 0.98 * EXPECTED, "the bound says something: {cos}, {least}");
    for accelerator in accelerators() {
        let picture = without_variance(&inside(&mesh, true), accelerator);
        let most = picture.pixels().iter().flat_map(|p| p.to_array()).fold(0.0, f32::max);
        assert!(most <= EXPECTED * (1.0 + ROUNDING), "{accelerator:?}: {most}");
        let mean = mean(&picture) as f32;
        assert!(mean >= least, "{accelerator:?}: {mean}, at least {least}");
    }
}

/// The same by light sampling, with noise: the mean of 24² pixels × 256 samples. Hypothesis: its expectation is the
/// closed form. The error is taken from 16 independent seeds; 5 standard errors give a false alarm in 10⁻⁴ of cases (t
/// with 15 degrees of freedom), for eighteen cases together below 2·10⁻³; the seeds are fixed.
#[test]
fn every_estimator_finds_the_closed_form_in_the_mean() {
    let rooms = [("box", enclosure(ALBEDO, EMISSION)), ("sphere", sphere()), ("mixed", mixed())];
    for ((name, room), accelerator) in rooms.iter().flat_map(|room| accelerators().into_iter().map(move |a| (room, a)))
    {
        let scene = compiled(room, accelerator);
        for estimator in [Estimator::Path, Estimator::Nee, Estimator::Naive] {
            let (m, se) = mean_of_seeds(&scene, &settings(estimator, 16));
            let z = (m - f64::from(EXPECTED)) / se;
            assert!(z.abs() < 5.0, "{name} {estimator:?} {accelerator:?}: mean {m} ± {se}, z {z}");
            assert!(se < 1e-2, "{name} {estimator:?} {accelerator:?}: too noisy to tell, {se}");
        }
    }
}

#[test]
fn scaling_by_a_power_of_two_changes_no_bit() {
    for accelerator in accelerators() {
        let s = settings(Estimator::Path, 4);
        for room in [enclosure(ALBEDO, EMISSION), sphere(), mixed()] {
            let base = picture(&compiled(&room, accelerator), &s);
            for exponent in [-40, -1, 1, 40] {
                let scaled = transformed(room.clone(), 2f64.powi(exponent), DVec3::ZERO);
                let other = picture(&compiled(&scaled, accelerator), &s);
                assert_eq!(base, other, "2^{exponent} with {accelerator:?}");
            }
        }
    }
}
