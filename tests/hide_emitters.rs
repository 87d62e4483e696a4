//! `hide_emitters`: camera rays pass through what emits, and nothing else changes.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use glam::{DAffine3, DMat3, DVec3};
use snell::description::*;
use snell::image::Picture;
use snell::integrator::Estimator;
use snell::spectrum::Rgb;

/// Distance of the camera from the wall, along its axis; everything that emits is in the first half.
const WALL: f64 = 6.0;

/// A wall, seen past a lamp and a shape whose emitter is black; the corners of the picture miss the wall.
fn scene() -> SceneDescription {
    let geometry = Geometry::Sphere { centre: DVec3::new(0.3, 0.2, 4.0), radius: 0.4, frame: DMat3::IDENTITY };
    let black = DAffine3::from_scale_rotation_translation(
        DVec3::splat(0.3),
        Default::default(),
        DVec3::new(-0.5, -0.1, WALL - 2.5),
    );
    SceneDescription {
        integrator: Integrator::default(),
        cameras: vec![camera(DVec3::Z * WALL, DVec3::ZERO, 50.0, 32)],
        bsdfs: vec![diffuse(0.5)],
        textures: vec![],
        wants_uvs: false,
        groups: vec![],
        instances: vec![],
        shapes: vec![
            shape(Geometry::Rectangle, DAffine3::from_scale(DVec3::new(2.5, 2.0, 1.0)), 0, None),
            shape(geometry, DAffine3::IDENTITY, 0, Some(4.0)),
            shape(Geometry::Rectangle, black, 0, Some(0.0)),
        ],
        lights: vec![],
        warnings: vec![],
        inventory: Default::default(),
    }
}

fn seen(scene: &SceneDescription, hide_emitters: bool) -> Picture {
    let mut s = settings(Estimator::Path, 16);
    s.integrator.hide_emitters = hide_emitters;
    picture(&compiled(scene, snell::accel::Accelerator::Native), &s)
}

/// A near clip plane behind the lamp hides the same from the camera, and from nothing else. The uniform numbers are the
/// same, so that pixels differ by the rounding of points only.
#[test]
fn hiding_emitters_is_looking_from_behind_them() {
    let hidden = seen(&scene(), true);
    let mut clipped = scene();
    clipped.cameras[0].near_clip = WALL / 2.0 - 0.1;
    let behind = seen(&clipped, false);
    // Opposite the lamp, ρ·L·(r/d)² = 0.02.
    assert!(hidden.get(16, 16).max_component() > 0.015, "the wall is lit: {:?}", hidden.get(16, 16));
    for (i, (a, b)) in hidden.pixels().iter().zip(behind.pixels()).enumerate() {
        assert!((a.0 - b.0).abs().max_element() <= 1e-4 * b.max_component(), "pixel {i}: {a:?} against {b:?}");
    }
    assert!(mean(&seen(&scene(), false)) > 1.5 * mean(&hidden), "the lamp is bright where it is seen");
}

#[test]
fn what_is_behind_the_far_plane_stays_there() {
    let mut clipped = scene();
    clipped.cameras[0].far_clip = WALL - 1e-3;
    assert_eq!(mean(&seen(&clipped, true)), 0.0);
    clipped.cameras[0].far_clip = WALL + 1e-3;
    assert_eq!(seen(&clipped, true), seen(&scene(), true));
}

#[test]
fn the_sky_is_hidden_too_but_sheds_light() {
    let mut open = scene();
    open.shapes.truncate(1);
    open.lights.push(Light { at: at(), kind: LightKind::Constant { radiance: Rgb::splat(0.25) } });
    let [hidden, shown] = [true, false].map(|hide| seen(&open, hide));
    assert_eq!((hidden.get(0, 0), shown.get(0, 0)), (Rgb::BLACK, Rgb::splat(0.25)), "past the wall");
    assert_eq!(hidden.get(16, 16), shown.get(16, 16));
    assert!(hidden.get(16, 16).max_component() > 0.1, "the wall is lit by it");
}
