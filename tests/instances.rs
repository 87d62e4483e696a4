//! Groups and instances: pictures that must be those of the same shapes without groups, in closed form where there is one.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

#[path = "accel_support/mod.rs"]
mod accel_support;
mod common;

use common::*;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use snell::accel::Accelerator;
use snell::description::*;
use snell::image::Picture;
use snell::integrator::Estimator;
use snell::render::RenderSettings;
use snell::shape::TriangleMesh;
use snell::spectrum::Rgb;
use std::sync::Arc;

fn instance(group: usize, to_world: DAffine3) -> Instance {
    Instance { at: at(), name: "instance".into(), group: GroupId(group), to_world }
}

/// A scene of groups alone, under a sky of radiance 1.
fn under_the_sky(groups: Vec<Vec<Shape>>, instances: Vec<Instance>, camera: Camera) -> SceneDescription {
    SceneDescription {
        cameras: vec![camera],
        shapes: vec![],
        groups: groups.into_iter().map(|shapes| Group { shapes }).collect(),
        instances,
        lights: vec![Light { at: at(), kind: LightKind::Constant { radiance: Rgb::WHITE } }],
        ..enclosure(0.5, 0.0)
    }
}

/// Diffuse on both sides, all over.
fn two_sided(mut scene: SceneDescription, albedo: f32) -> SceneDescription {
    let both = BsdfKind::TwoSided { front: BsdfId(1), back: BsdfId(1) };
    scene.bsdfs = vec![Bsdf { kind: both, ..diffuse(albedo) }, diffuse(albedo)];
    scene
}

/// The same scene without groups.
fn flattened(mut scene: SceneDescription) -> SceneDescription {
    for instance in std::mem::take(&mut scene.instances) {
        for shape in &scene.groups[instance.group.0].shapes {
            scene.shapes.push(Shape { to_world: instance.to_world * shape.to_world, ..shape.clone() });
        }
    }
    scene.groups.clear();
    scene
}

fn mesh(mesh: &TriangleMesh) -> Geometry {
    let positions = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
    Geometry::Mesh(Arc::new(Mesh { positions, faces: mesh.faces.clone(), ..Mesh::default() }))
}

const BALL: Geometry = Geometry::Sphere { centre: DVec3::new(0.125, 0.0, -0.25), radius: 0.75, frame: DMat3::IDENTITY };

/// Maps of every kind: moved, turned, stretched, sheared, mirrored, tiny and far, one axis 1000 times another.
fn maps() -> Vec<DAffine3> {
    let turned = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 0.5).normalize(), 0.7);
    let skew = DMat3::from_cols(DVec3::new(0.9, 0.1, 0.0), DVec3::new(-0.2, 0.7, 0.1), DVec3::new(0.1, 0.3, 1.2));
    let thin = turned * DMat3::from_diagonal(DVec3::new(1.0, 1e-3, 0.7));
    let matrices = [
        DMat3::IDENTITY,
        turned,
        skew,
        turned * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)),
        skew * -1.0,
        thin,
        DMat3::IDENTITY * 1e-4,
    ];
    let place = |i: usize| 2.5 * DVec3::new((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0, 0.1 * i as f64 - 1e-7);
    matrices.into_iter().enumerate().map(|(i, m)| DAffine3::from_mat3_translation(m, place(i))).collect()
}

fn one_sample(estimator: Estimator, max_depth: u32) -> RenderSettings {
    let mut s = settings(estimator, 1);
    (s.integrator.max_depth, s.integrator.rr_depth) = (max_depth, u32::MAX);
    s
}

fn picture_of(scene: &SceneDescription, accelerator: Accelerator, settings: &RenderSettings) -> Picture {
    picture(&compiled(scene, accelerator), settings)
}

fn overview(pixels: u32) -> Camera {
    camera(DVec3::new(1.0, 2.0, 9.0), DVec3::ZERO, 50.0, pixels)
}

/// A convex body, sampled by its bsdf alone under a white sky: every path ends there, after one vertex or none. So with
/// paths of at most two segments each sample is 1 or the albedo: a ray that met the surface it left, or its neighbour in
/// the same plane, would be a black pixel.
#[test]
fn placed_convex_bodies_do_not_shade_themselves() {
    let bodies = [
        vec![shape(BALL, DAffine3::from_scale(DVec3::splat(0.8)), 0, None)],
        vec![shape(mesh(&convex()), DAffine3::IDENTITY, 0, None)],
        closed_cylinder(DAffine3::from_scale(DVec3::new(0.6, 0.6, 0.9)), None)
            .into_iter()
            .map(|s| Shape { flip_normals: !s.flip_normals, ..s })
            .collect(),
    ];
    for body in bodies {
        for map in maps() {
            let towards = DVec3::new(0.3, 0.4, 1.0).normalize();
            // As large in the picture wherever and however large.
            let size = map.matrix3.to_cols_array().into_iter().fold(0.0, |m: f64, c| m.max(c.abs()));
            let mut view = camera(map.translation + towards * 4.0 * size, map.translation, 40.0, 64);
            view.near_clip = 1e-3 * size;
            let scene = two_sided(under_the_sky(vec![body.clone()], vec![instance(0, map)], view), 0.5);
            for accelerator in accelerators() {
                let picture = picture_of(&scene, accelerator, &one_sample(Estimator::Bsdf, 2));
                let count = |value: f32| picture.pixels().iter().filter(|p| **p == Rgb::splat(value)).count();
                assert_eq!(count(1.0) + count(0.5), picture.pixels().len(), "{accelerator:?} {map:?}");
                assert!(count(0.5) > 100, "the body is seen: {}", count(0.5));
            }
        }
    }
}

/// A box of triangles, of which each has a neighbour in its plane.
fn convex() -> TriangleMesh {
    let corners = (Vec3::new(-0.7, -0.4, -0.91), Vec3::new(0.3, 0.83, 0.6));
    let snell::shape::Shape::Mesh(mesh) = accel_support::soup(&accel_support::cuboid(corners.0, corners.1)) else {
        unreachable!("a soup is a mesh")
    };
    mesh
}

/// A black room under a bright sky shows nothing of it: one closed mesh, placed in every way, seen from inside, and rooms
/// of six instances of one wall, whose borders meet but for rounding. 12 bounces each of 64×64 paths.
#[test]
fn no_light_leaks_through_placed_surfaces_or_between_them() {
    let mut scenes = Vec::new();
    for map in maps() {
        let room = shape(mesh(&accel_support::displaced_sphere(12)), DAffine3::IDENTITY, 0, None);
        let eye = map.transform_point3(DVec3::new(0.1, 0.05, -0.1));
        let mut view = camera(eye, map.translation, 120.0, 64);
        view.near_clip = 1e-9;
        scenes.push(under_the_sky(vec![vec![room]], vec![instance(0, map)], view));
    }
    for half in [DVec3::ONE, DVec3::new(1.0, 0.7, 1.3), DVec3::new(0.3, 1e-2, 0.77)] {
        let wall = vec![shape(Geometry::Rectangle, DAffine3::IDENTITY, 0, None)];
        let instances = walls(half, 0.0).into_iter().map(|s| instance(0, s.to_world)).collect();
        let mut view = camera(half * DVec3::new(0.3, -0.2, 0.5), DVec3::ZERO, 90.0, 64);
        view.near_clip = 1e-9;
        scenes.push(under_the_sky(vec![wall], instances, view));
    }
    for (i, scene) in scenes.into_iter().map(|scene| two_sided(scene, 1.0)).enumerate() {
        for accelerator in accelerators() {
            for estimator in [Estimator::Bsdf, Estimator::Path] {
                let picture = picture_of(&scene, accelerator, &one_sample(estimator, 12));
                let bright = picture.pixels().iter().filter(|p| !p.is_black()).count();
                assert_eq!(bright, 0, "scene {i}, {accelerator:?}, {estimator:?}");
            }
        }
    }
}

/// Shapes of every kind in two groups, placed in every way, beside a shape that is not placed.
fn crowd() -> SceneDescription {
    let at = |x: f64, y: f64| DAffine3::from_translation(DVec3::new(x, y, 0.0));
    let first = vec![
        shape(BALL, at(-0.5, 0.0), 0, None),
        shape(Geometry::Rectangle, at(0.5, 0.25) * DAffine3::from_scale(DVec3::splat(0.75)), 1, None),
        shape(Geometry::Disk, at(0.25, -1.0), 1, None),
    ];
    let second = vec![
        shape(mesh(&accel_support::displaced_sphere(8)), DAffine3::IDENTITY, 1, None),
        shape(Geometry::Cylinder { p0: DVec3::ZERO, p1: DVec3::Z, radius: 0.25 }, at(1.0, 0.5), 1, None),
    ];
    let place = |(i, m): (usize, DAffine3)| instance(i % 2, m);
    let mut scene =
        under_the_sky(vec![first, second], maps().into_iter().enumerate().map(place).collect(), overview(32));
    scene.bsdfs = vec![diffuse(0.5), diffuse(0.8)];
    scene.bsdfs[1].kind = BsdfKind::TwoSided { front: BsdfId(0), back: BsdfId(0) };
    let floor = DAffine3::from_translation(DVec3::Z * -2.0) * DAffine3::from_scale(DVec3::splat(6.0));
    scene.shapes = vec![shape(Geometry::Rectangle, floor, 1, None)];
    scene
}

/// Spheres stay spheres, so that the scene can be flattened: only maps that turn, move and scale.
fn crowd_of_similar() -> SceneDescription {
    let mut scene = crowd();
    scene.instances.retain(|i| {
        let m = i.to_world.matrix3;
        let gram = m.transpose() * m;
        gram.abs_diff_eq(DMat3::IDENTITY * gram.x_axis.x, 1e-12 * gram.x_axis.x) && m.determinant() > 0.0
    });
    assert!(scene.instances.len() >= 3);
    scene
}

/// The mean of the picture with instances and without, 16 seeds each of 16 samples: the difference is within 4.5 standard
/// errors, in both accelerators (false alarms: 10⁻⁵ in all).
#[test]
fn an_instanced_scene_is_its_flattened_one() {
    let scene = crowd_of_similar();
    for accelerator in accelerators() {
        let of =
            |scene: &SceneDescription| mean_of_seeds(&compiled(scene, accelerator), &settings(Estimator::Path, 16));
        let ((a, sa), (b, sb)) = (of(&scene), of(&flattened(scene.clone())));
        let z = (a - b) / sa.hypot(sb);
        assert!(z.abs() < 4.5, "{accelerator:?}: {a} and {b}: {z}");
    }
}

/// Where instances are moved by numbers that single precision holds, pixel by pixel: what the camera sees, and the first
/// bounce. The two compute points of surfaces in another order, so a direction may differ by an ulp, and with it which
/// side of an edge a ray passes: at most one pixel in a hundred.
#[test]
fn moved_instances_are_moved_shapes_pixel_by_pixel() {
    let mut scene = crowd();
    for (i, instance) in scene.instances.iter_mut().enumerate() {
        let i = i as f64;
        instance.to_world = DAffine3::from_translation(DVec3::new(2.0 * i - 6.0, 1.5 * (i % 3.0) - 1.5, 0.25 * i));
    }
    let flat = flattened(scene.clone());
    for accelerator in accelerators() {
        let of = |scene: &SceneDescription| picture_of(scene, accelerator, &one_sample(Estimator::Path, 3));
        let (a, b) = (of(&scene), of(&flat));
        let same = |(a, b): &(&Rgb, &Rgb)| (a.0 - b.0).abs().max_element() <= 1e-5 * a.0.max_element();
        let different = a.pixels().iter().zip(b.pixels()).filter(|pair| !same(pair)).count();
        assert!(different * 100 <= a.pixels().len(), "{accelerator:?}: {different} of {}", a.pixels().len());
    }
}

/// All lengths times a power of two: the same bits. Both accelerators: the same bits.
#[test]
fn scale_and_accelerator_change_no_bit() {
    let scene = crowd();
    let settings = settings(Estimator::Path, 4);
    let reference = picture_of(&scene, Accelerator::Native, &settings);
    for accelerator in accelerators() {
        for k in [-40, -1, 0, 3, 40] {
            let scaled = transformed(scene.clone(), libm::ldexp(1.0, k), DVec3::ZERO);
            let picture = picture_of(&scaled, accelerator, &settings);
            assert!(picture.pixels() == reference.pixels(), "{accelerator:?}, 2^{k}");
        }
    }
}

/// A million units away, an instance is lit as it is here: the convex bodies show the closed form there, too.
#[test]
fn instances_may_be_far_away() {
    let body = vec![shape(mesh(&convex()), DAffine3::IDENTITY, 0, None)];
    let centre = maps()[2].translation;
    let view = camera(centre + DVec3::new(1.0, 2.0, 4.0), centre, 40.0, 48);
    let scene = two_sided(under_the_sky(vec![body], vec![instance(0, maps()[2])], view), 0.5);
    let far = transformed(scene, 1.0, DVec3::new(1e6, -3e5, 2e6));
    for accelerator in accelerators() {
        let picture = picture_of(&far, accelerator, &one_sample(Estimator::Bsdf, 2));
        assert!(picture.pixels().iter().all(|p| *p == Rgb::WHITE || *p == Rgb::splat(0.5)), "{accelerator:?}");
        assert!(picture.pixels().contains(&Rgb::splat(0.5)));
    }
}

/// The tangents of an anisotropic material are those of the flattened scene: its picture is, within 4.5 standard errors.
#[test]
fn tangents_are_placed_too() {
    let mut scene = crowd_of_similar();
    let facets = Microfacets {
        distribution: MicrofacetDistribution::Ggx,
        alpha_u: 0.05,
        alpha_v: 0.4,
        multiple_scattering: false,
    };
    let metal =
        BsdfKind::RoughConductor { facets, eta: Rgb::splat(0.2), k: Rgb::splat(3.0), specular_reflectance: Rgb::WHITE };
    scene.bsdfs[0].kind = metal;
    // The light from one side only, so that it matters.
    scene.lights = vec![point_light(DVec3::new(8.0, 1.0, 6.0), Rgb::splat(50.0))];
    let of =
        |scene: &SceneDescription| mean_of_seeds(&compiled(scene, Accelerator::Native), &settings(Estimator::Path, 16));
    let ((a, sa), (b, sb)) = (of(&scene), of(&flattened(scene.clone())));
    assert!(((a - b) / sa.hypot(sb)).abs() < 4.5, "{a} ± {sa} and {b} ± {sb}");
}

/// A group is stored once: a thousand instances take little more than one.
#[test]
fn a_thousand_instances_share_one_mesh() {
    let body = vec![shape(mesh(&accel_support::displaced_sphere(40)), DAffine3::IDENTITY, 0, None)];
    for accelerator in accelerators() {
        let bytes = |count: usize| {
            let place = |i: usize| DAffine3::from_translation(DVec3::new((i % 32) as f64, (i / 32) as f64, 0.0) * 3.0);
            let instances = (0..count).map(|i| instance(0, place(i))).collect();
            let scene = compiled(&under_the_sky(vec![body.clone()], instances, overview(8)), accelerator);
            assert_eq!((scene.features.triangles, scene.features.instances), (19_200, count as u64));
            scene.accel.memory_bytes()
        };
        let (one, thousand) = (bytes(1), bytes(1000));
        assert!(one > 500_000 && thousand < one + 1000 * 256, "{accelerator:?}: {one} and {thousand}");
    }
}
