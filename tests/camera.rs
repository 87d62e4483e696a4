//! The cameras against Mitsuba's: fields of view along every axis, films that are not square, principal points, crops, clip
//! planes, lenses; and our own panorama.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod common;

use common::*;
use glam::{DAffine3, DMat3, DVec3, Vec2};
use snell::accel::Accelerator;
use snell::description::*;
use snell::integrator::Estimator;
use snell::math::ray::Ray;
use snell::scene::Scene;
use snell::spectrum::Rgb;

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

/// Where all cameras of this file stand.
const ORIGIN: DVec3 = DVec3::new(1.0, 2.0, 3.0);

/// Mitsuba's look-at from there: camera space has +x to the left.
fn look_at() -> DAffine3 {
    let (target, up) = (DVec3::new(0.5, -1.0, 0.25), DVec3::new(0.0, 1.0, 0.2));
    let forward = (target - ORIGIN).normalize();
    let left = up.cross(forward).normalize();
    DAffine3::from_mat3_translation(DMat3::from_cols(left, forward.cross(left), forward), ORIGIN)
}

/// The closed room with such a camera there.
fn room(projection: Projection, to_world: DAffine3, (width, height): (u32, u32)) -> SceneDescription {
    let mut scene = enclosure(0.5, 1.0);
    let camera = &mut scene.cameras[0];
    (camera.projection, camera.to_world) = (projection, to_world);
    (camera.near_clip, camera.far_clip) = (0.25, 30.0);
    (camera.film.width, camera.film.height) = (width, height);
    camera.film.crop = Crop { x: 0, y: 0, width, height };
    scene
}

/// The points, in the file's space, at which a ray begins and ends to see.
fn ends(scene: &Scene, ray: &Ray) -> [DVec3; 2] {
    [ray.tmin, ray.tmax].map(|t| (ray.o + ray.d * t).as_dvec3() / scene.unit + scene.centre)
}

#[test]
fn rays_are_mitsubas() {
    for case in CASES {
        let fov = FieldOfView { degrees: case.fov, axis: case.axis };
        let projection = Projection::Perspective { fov, principal_point_offset: case.offset };
        let scene = compiled(&room(projection, look_at(), case.size), Accelerator::Native);
        for (point, direction, near, far) in case.rays {
            let ray = scene.camera.ray(Vec2::from(point), Vec2::ZERO);
            let told = format!("{:?} {} at {point:?}: {ray:?}", case.axis, case.fov);
            assert!(ray.d.as_dvec3().abs_diff_eq(DVec3::from(direction), TOLERANCE), "{told}");
            assert!((ray.o.as_dvec3() / scene.unit + scene.centre).abs_diff_eq(ORIGIN, TOLERANCE), "{told}");
            for (got, want) in [(ray.tmin, near), (ray.tmax, far)] {
                assert!((f64::from(got) / scene.unit / want - 1.0).abs() < TOLERANCE, "{told}: {want}");
            }
        }
    }
}

/// Film point, lens point, and what Mitsuba 3.9.1 prints: where the ray begins to see, its direction, how far it sees.
type Seen = ([f32; 2], [f32; 2], [f64; 3], [f64; 3], f64);

fn assert_seen(scene: &SceneDescription, rays: &[Seen]) {
    let scene = compiled(scene, Accelerator::Native);
    for &(film, lens, near, direction, length) in rays {
        let ray = scene.camera.ray(film.into(), lens.into());
        let [begin, end] = ends(&scene, &ray);
        let told = format!("{film:?}, {lens:?}: {ray:?}: from {begin} to {end}");
        assert!(ray.d.as_dvec3().abs_diff_eq(DVec3::from(direction), TOLERANCE), "{told}");
        // Coordinates up to 3, in single precision here and there.
        assert!(begin.abs_diff_eq(DVec3::from(near), 4.0 * TOLERANCE), "{told}");
        assert!(((end - begin).length() / length - 1.0).abs() < TOLERANCE, "{told}");
    }
}

#[test]
fn rays_through_a_lens_are_mitsubas() {
    let fov = FieldOfView { degrees: 50.0, axis: FovAxis::Y };
    let lens = |aperture_radius, focus_distance| {
        room(Projection::ThinLens { fov, aperture_radius, focus_distance }, look_at(), (64, 48))
    };
    let middle = ([0.905_313_55, 1.773_923_3, 2.891_09], [-0.353_028_6, -0.842_903_2, -0.406_060_07]);
    assert_seen(
        &lens(0.25, 4.0),
        &[
            ([16.0, 36.0], [0.5, 0.5], middle.0, middle.1, 31.917_215_3),
            (
                [57.6, 4.8],
                [0.9, 0.3],
                [0.917_741_2, 1.829_504_1, 2.828_196_8],
                [0.274_234_98, -0.365_739_5, -0.889_398_5],
                35.815_021_5,
            ),
            (
                [16.0, 36.0],
                [0.1, 0.75],
                [1.048_894_8, 1.841_525_3, 2.791_236_6],
                [-0.381_988_32, -0.844_824_7, -0.374_641_2],
                32.479_442_6,
            ),
        ],
    );
    // Mitsuba's default: in focus where the view ends.
    assert_seen(
        &lens(0.1, 30.0),
        &[
            ([16.0, 36.0], [0.5, 0.5], middle.0, middle.1, 31.917_215_3),
            (
                [57.6, 4.8],
                [0.9, 0.3],
                [1.006_867_5, 1.862_181_7, 2.776_346_3],
                [0.246_961_64, -0.385_617_43, -0.888_993_2],
                35.072_013_9,
            ),
        ],
    );
}

#[test]
fn parallel_rays_are_mitsubas() {
    let stretched = look_at() * DAffine3::from_scale(DVec3::new(1.5, 0.75, 2.0));
    let d = [-0.121_942_16, -0.731_652_9, -0.670_681_9];
    let rays = [
        ([16.0, 36.0], [0.5; 2], [0.264_371_6, 1.408_932_7, 3.033_041_5], d, 29.75),
        ([57.6, 4.8], [0.5; 2], [2.018_48, 1.994_559, 2.075_247_3], d, 29.75),
    ];
    assert_seen(&room(Projection::Orthographic, stretched, (64, 48)), &rays);
}

/// All rays of one film point of a lens meet in the plane of focus, where the pinhole's ray goes; of a lens without radius
/// they are the pinhole's.
#[test]
fn a_lens_is_in_focus_where_it_should_be() {
    let fov = FieldOfView { degrees: 50.0, axis: FovAxis::X };
    let scene = |projection| compiled(&room(projection, look_at(), (64, 48)), Accelerator::Native);
    let pinhole = scene(Projection::Perspective { fov, principal_point_offset: (0.0, 0.0) });
    let lens = |aperture_radius| scene(Projection::ThinLens { fov, aperture_radius, focus_distance: 4.0 });
    let (wide, closed) = (lens(0.25), lens(0.0));
    for film in [Vec2::new(3.0, 40.0), Vec2::new(32.0, 24.0), Vec2::new(60.5, 1.25)] {
        let through = pinhole.camera.ray(film, Vec2::ZERO);
        // The near plane is at a distance of 0.25 along the axis, the plane of focus at 4.
        let focus = (through.o + through.d * (through.tmin * 16.0)).as_dvec3();
        for u in [[0.0, 0.0], [0.99, 0.01], [0.5, 0.5], [0.2, 0.9]].map(Vec2::from) {
            assert_eq!(closed.camera.ray(film, u), through, "{film}, {u}");
            let ray = wide.camera.ray(film, u);
            let off = (focus - ray.o.as_dvec3()).cross(ray.d.as_dvec3()).length();
            assert!(off < 4e-6 * wide.unit, "{film}, {u}: {}", off / wide.unit);
            let beside = (ray.o - through.o).length() / wide.unit as f32;
            assert!(beside <= 0.25 * (1.0 + 4.0 * f32::EPSILON), "{beside}");
        }
    }
}

/// The middle of a panorama looks along +z, its left half to +x, its upper half to +y; every direction has its place.
#[test]
fn a_panorama_sees_in_all_directions() {
    let scene = compiled(&room(Projection::Panorama, look_at(), (64, 48)), Accelerator::Native);
    let m = look_at().matrix3;
    let rays = [
        ([32.0, 24.0], DVec3::Z),
        ([16.0, 24.0], DVec3::X),
        ([48.0, 24.0], DVec3::NEG_X),
        ([0.0, 24.0], DVec3::NEG_Z),
        ([64.0, 24.0], DVec3::NEG_Z),
        ([7.0, 0.0], DVec3::Y),
        ([50.0, 48.0], DVec3::NEG_Y),
        ([40.0, 12.0], DVec3::new(-0.5, 2.0f64.sqrt() / 2.0, 0.5)),
    ];
    for (film, direction) in rays {
        let ray = scene.camera.ray(film.into(), Vec2::ZERO);
        assert!(ray.d.as_dvec3().abs_diff_eq(m * direction, TOLERANCE), "{film:?}: {}, not {}", ray.d, m * direction);
        let [near, far] = ends(&scene, &ray);
        assert!(((near - ORIGIN).length() / 0.25 - 1.0).abs() < 4.0 * TOLERANCE);
        assert!(((far - ORIGIN).length() / 30.0 - 1.0).abs() < 4.0 * TOLERANCE);
    }
}

/// In a closed room whose walls emit L and reflect a, every ray of every camera finds L/(1 − a), up to the noise of light
/// that is found at random: 24×24 pixels of 64 samples, within 2 %.
#[test]
fn every_camera_sees_the_furnace() {
    let fov = FieldOfView { degrees: 60.0, axis: FovAxis::X };
    let inside = DAffine3::from_translation(DVec3::new(0.3, -0.2, 0.5));
    let projections = [
        Projection::Perspective { fov, principal_point_offset: (0.0, 0.0) },
        Projection::ThinLens { fov, aperture_radius: 0.2, focus_distance: 0.5 },
        Projection::Orthographic,
        Projection::Panorama,
    ];
    for projection in projections {
        let scale = if projection == Projection::Orthographic { 0.3 } else { 1.0 };
        let mut description = room(projection, inside * DAffine3::from_scale(DVec3::new(scale, scale, 1.0)), (24, 24));
        description.cameras[0].near_clip = 1e-3;
        let picture = picture(&compiled(&description, Accelerator::Native), &settings(Estimator::Path, 64));
        assert!((mean(&picture) / 2.0 - 1.0).abs() < 0.02, "{projection:?}: {}", mean(&picture));
    }
}

/// From however far away an orthographic camera looks, it sees the same: a wall with a hole in it, to the pixel.
#[test]
fn parallel_rays_keep_their_precision_from_afar() {
    let look = |distance: f64| {
        let mut scene = enclosure(0.5, 0.0);
        let at =
            |x: f64| DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)) * DAffine3::from_scale(DVec3::splat(0.25));
        scene.shapes = [-0.5, 0.5].map(|x| shape(Geometry::Rectangle, at(x), 0, Some(1.0))).into();
        let camera = &mut scene.cameras[0];
        camera.projection = Projection::Orthographic;
        let turned = DAffine3::from_axis_angle(DVec3::Y, std::f64::consts::PI);
        camera.to_world = DAffine3::from_translation(DVec3::Z * distance) * turned;
        camera.far_clip = 1e12;
        let rendered = picture(&compiled(&scene, Accelerator::Native), &settings(Estimator::Path, 4));
        rendered.pixels().to_vec()
    };
    let near = look(2.0);
    // The squares' edges lie on those of pixels.
    assert!(near.iter().all(|&p| p == Rgb::BLACK || p == Rgb::WHITE));
    assert!(near.contains(&Rgb::BLACK) && near.contains(&Rgb::WHITE));
    for distance in [10.0, 1e4, 1e9] {
        assert!(look(distance) == near, "from {distance}");
    }
}
