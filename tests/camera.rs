//! The perspective camera against Mitsuba's: fields of view along every axis, films that are not square, principal points,
//! crops, clip planes.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod common;

use common::*;
use glam::{DAffine3, DVec3, Vec2};
use snell::accel::Accelerator;
use snell::description::*;

/// A camera, and two points of its film with what Mitsuba 3.9.1 prints for them: direction, and the distances along the
/// ray at which it begins and ends to see.
struct Case {
    axis: FovAxis,
    fov: f64,
    size: (u32, u32),
    offset: (f64, f64),
    rays: [([f32; 2], [f64; 3], f64, f64); 2],
}

const UPRIGHT: [([f32; 2], [f64; 3], f64, f64); 2] = [
    ([16.0, 36.0], [-0.3530286, -0.8429032, -0.4060601], 0.268212, 32.18543),
    ([57.6, 4.8], [0.2453822, -0.386749, -0.8889391], 0.294381, 35.32575),
];

const WIDE: [([f32; 2], [f64; 3], f64, f64); 2] = [
    ([16.0, 36.0], [-0.3019814, -0.8267474, -0.4746535], 0.260401, 31.24812),
    ([57.6, 4.8], [0.1687746, -0.4753296, -0.8634679], 0.275844, 33.10133),
];

const CASES: [Case; 9] = [
    Case { axis: FovAxis::X, fov: 50.0, size: (64, 48), offset: (0.0, 0.0), rays: WIDE },
    Case { axis: FovAxis::Larger, fov: 50.0, size: (64, 48), offset: (0.0, 0.0), rays: WIDE },
    Case { axis: FovAxis::Y, fov: 50.0, size: (64, 48), offset: (0.0, 0.0), rays: UPRIGHT },
    Case { axis: FovAxis::Smaller, fov: 50.0, size: (64, 48), offset: (0.0, 0.0), rays: UPRIGHT },
    Case {
        axis: FovAxis::Diagonal,
        fov: 50.0,
        size: (64, 48),
        offset: (0.0, 0.0),
        rays: [
            ([16.0, 36.0], [-0.2688146, -0.8134285, -0.5158224], 0.256705, 30.80462),
            ([57.6, 4.8], [0.1167315, -0.5302133, -0.8397902], 0.266829, 32.01948),
        ],
    },
    Case {
        axis: FovAxis::Smaller,
        fov: 70.0,
        size: (32, 80),
        offset: (0.0, 0.0),
        rays: [
            ([8.0, 60.0], [-0.2118363, -0.9771103, 0.0195097], 0.343571, 41.22846),
            ([28.8, 8.0], [0.082195, 0.1360589, -0.9872851], 0.45242, 54.29045),
        ],
    },
    Case {
        axis: FovAxis::Larger,
        fov: 70.0,
        size: (32, 80),
        offset: (0.0, 0.0),
        rays: [
            ([8.0, 60.0], [-0.1774203, -0.9133472, -0.3664951], 0.267183, 32.06191),
            ([28.8, 8.0], [-0.0117018, -0.2915508, -0.9564837], 0.291975, 35.03702),
        ],
    },
    Case {
        axis: FovAxis::Diagonal,
        fov: 70.0,
        size: (32, 80),
        offset: (0.1, -0.2),
        rays: [
            ([8.0, 60.0], [-0.1841677, -0.7754152, -0.6039979], 0.251286, 30.1543),
            ([28.8, 8.0], [-0.0168003, -0.1461688, -0.989117], 0.323676, 38.84117),
        ],
    },
    // Mitsuba had the crop 30×17 from 10,20 here: film points are those of the whole film all the same.
    Case {
        axis: FovAxis::Y,
        fov: 35.0,
        size: (64, 48),
        offset: (-0.25, 0.15),
        rays: [
            ([17.5, 32.75], [-0.4289535, -0.8130552, -0.3936242], 0.27437, 32.9244),
            ([37.0, 21.7], [-0.246872, -0.7723724, -0.5852306], 0.253109, 30.37309),
        ],
    },
];

/// Mitsuba computes and prints single precision: six to seven digits.
const TOLERANCE: f64 = 2e-6;

#[test]
fn rays_are_mitsubas() {
    let (origin, target, up) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.5, -1.0, 0.25), DVec3::new(0.0, 1.0, 0.2));
    for case in CASES {
        let mut scene = enclosure(0.5, 1.0);
        let camera = &mut scene.cameras[0];
        // Mitsuba's look-at: camera space has +x to the left.
        let forward = (target - origin).normalize();
        let left = up.cross(forward).normalize();
        let axes = glam::DMat3::from_cols(left, forward.cross(left), forward);
        camera.to_world = DAffine3::from_mat3_translation(axes, origin);
        (camera.fov, camera.fov_axis, camera.principal_point_offset) = (case.fov, case.axis, case.offset);
        (camera.near_clip, camera.far_clip) = (0.25, 30.0);
        (camera.film.width, camera.film.height) = case.size;
        camera.film.crop = Crop { x: 0, y: 0, width: case.size.0, height: case.size.1 };
        let scene = compiled(&scene, Accelerator::Native);
        for (point, direction, near, far) in case.rays {
            let ray = scene.camera.ray(Vec2::from(point));
            let told = format!("{:?} {} at {point:?}: {ray:?}", case.axis, case.fov);
            assert!(ray.d.as_dvec3().abs_diff_eq(DVec3::from(direction), TOLERANCE), "{told}");
            assert!((ray.o.as_dvec3() / scene.unit + scene.centre).abs_diff_eq(origin, TOLERANCE), "{told}");
            for (got, want) in [(ray.tmin, near), (ray.tmax, far)] {
                assert!((f64::from(got) / scene.unit / want - 1.0).abs() < TOLERANCE, "{told}: {want}");
            }
        }
    }
}
