//! Thin and touching things in rooms where everything shows the same radiance.
//!
//! In a furnace every surface emits E·(1 − a) and reflects the fraction a, so that everything shows E. A ray that slips between
//! two sheets, into a box or behind a light meets a back, which is black; one that meets the surface it leaves counts it twice.

use super::{Found, POOL, Result, accelerators, compiled, picture};
use glam::{DAffine3, DMat3, DVec3};
use snell::accel::Accelerator;
use snell::check::rooms::{Case, at, camera, enclosure, light, shape, walls};
use snell::check::scenes;
use snell::description::{Bsdf, BsdfId, BsdfKind, Camera, Geometry, LightKind, SceneDescription, Shape};
use snell::integrator::Estimator;
use snell::spectrum::Rgb;

const ALBEDO: f32 = 0.5;
const EMISSION: f32 = 0.75;
const EXPECTED: f32 = EMISSION / (1.0 - ALBEDO);

/// What rounding may do to a pixel of a room, relatively: derived in `tests/enclosure.rs`.
const ROUNDING: f32 = 2.5 * f32::EPSILON;

/// Samples of a pixel and seed where there is noise.
const SAMPLES: u32 = 64;

/// How small a thing of a room may be.
struct Limit<'a> {
    name: &'a str,
    /// It must be right down to this.
    must: f64,
    /// Whether it is right at a size.
    is_right: &'a dyn Fn(f64, Accelerator) -> Result<bool>,
}

/// All cases, with how far each goes; wrong if one fails at a size at which it must hold.
pub(super) fn run() -> Result<Found> {
    let pixels = |room: &dyn Fn(f64) -> SceneDescription, size, accelerator| -> Result<bool> {
        let part = wrong_part(&room(size), accelerator)?;
        println!("  {accelerator:?}, {size:.0e}: {part:.2e} of the pixels are wrong");
        Ok(part == 0.0)
    };
    let mean = |scene: SceneDescription, expected: f64, size: f64, accelerator| -> Result<bool> {
        let case = Case { name: "", scene, expected, max_depth: u32::MAX };
        let reading = scenes::read(&case, Estimator::Path, accelerator, SAMPLES, &POOL)?;
        let (mean, error) = (reading.mean / expected, reading.error / expected);
        println!("  {accelerator:?}, {size:.0e}: {mean:.6} ± {error:.1e} of what it should be, z {:.1}", reading.z());
        Ok(reading.is_right())
    };
    let furnace = f64::from(EXPECTED);
    let anywhere = |radius| sphere_on_plane(radius, DVec3::new(0.13, 0.0, 0.07));
    let limits = [
        Limit { name: "sheets apart", must: 1e-6, is_right: &|size, a| pixels(&sheets, size, a) },
        Limit { name: "box over the floor", must: 1e-6, is_right: &|size, a| pixels(&hovering, size, a) },
        Limit { name: "boxes that share faces", must: 1e-6, is_right: &|size, a| pixels(&|_| coincident(), size, a) },
        Limit { name: "sphere on a floor, anywhere", must: 1e-5, is_right: &|size, a| pixels(&anywhere, size, a) },
        Limit {
            name: "sphere on a plane, in the middle",
            must: 1e-6,
            is_right: &|size, a| pixels(&open_plane, size, a),
        },
        Limit { name: "lamp over the floor", must: 1e-6, is_right: &|size, a| mean(hovering(size), furnace, size, a) },
        Limit { name: "cubes of glass apart", must: 1e-6, is_right: &|size, a| mean(cubes(size), 1.0, size, a) },
        Limit { name: "film of water in glass", must: 1e-6, is_right: &|size, a| mean(water(size), 1.0, size, a) },
    ];
    let (mut texts, mut right) = (Vec::new(), true);
    for Limit { name, must, is_right } in limits {
        println!("{name}:");
        for accelerator in accelerators() {
            let mut holds = 1.0;
            for size in (1..=9).map(|k| 10f64.powi(-k)) {
                if !is_right(size, accelerator)? {
                    break;
                }
                holds = size;
            }
            right &= holds <= must * 1.001;
            texts.push(format!("{name}, {accelerator:?}: down to {holds:.0e}"));
        }
    }
    // Nobody can tell which of two surfaces in the same place is in front: how much that does is told, not judged.
    println!("exactly in the same place:");
    for accelerator in accelerators() {
        println!(" lights in lights:");
        mean(flush(), furnace, 0.0, accelerator)?;
        println!(" glass beside glass:");
        mean(cubes(0.0), 1.0, 0.0, accelerator)?;
    }
    Ok(Found { text: texts.join("; "), right })
}

/// The part of the pixels that do not show what they should, by bsdf sampling without roulette, which has no noise here.
fn wrong_part(room: &SceneDescription, accelerator: Accelerator) -> Result<f64> {
    let mut settings = scenes::settings(Estimator::Bsdf, 16, 40);
    settings.integrator.rr_depth = u32::MAX;
    let picture = picture(&compiled(room, accelerator)?, &settings);
    let is_wrong = |v: f32| (v / EXPECTED - 1.0).abs() > ROUNDING;
    let wrong = picture.pixels().iter().filter(|p| p.to_array().into_iter().any(is_wrong)).count();
    Ok(wrong as f64 / picture.pixels().len() as f64)
}

/// A box whose fronts are outside.
fn cuboid(centre: DVec3, half: DVec3) -> Vec<Shape> {
    let outwards = |mut wall: Shape| {
        wall.to_world = DAffine3::from_translation(centre) * wall.to_world;
        wall.flip_normals = true;
        wall
    };
    walls(half, EMISSION).into_iter().map(outwards).collect()
}

/// A room seen from above the middle of its floor, which is at y = −1.
fn room(more: Vec<Shape>) -> SceneDescription {
    let mut scene = enclosure(ALBEDO, EMISSION);
    scene.shapes = walls(DVec3::ONE, EMISSION);
    scene.shapes.extend(more);
    scene.cameras = vec![camera(DVec3::new(0.3, -0.5, 0.7), DVec3::new(0.0, -0.95, 0.0), 50.0, 48)];
    scene
}

/// A sheet as thick as this: two sheets with their backs to each other.
fn sheets(gap: f64) -> SceneDescription {
    let turn = DAffine3::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), 1.0);
    let sheets = cuboid(DVec3::ZERO, DVec3::new(0.3, 0.5 * gap, 0.3)).into_iter().map(|mut sheet| {
        sheet.to_world = DAffine3::from_translation(DVec3::new(0.0, -0.6, 0.0)) * turn * sheet.to_world;
        sheet
    });
    room(sheets.collect())
}

/// A box that hovers as high as this over the floor.
fn hovering(gap: f64) -> SceneDescription {
    room(cuboid(DVec3::new(0.1, -0.9 + gap, 0.05), DVec3::new(0.2, 0.1, 0.2)))
}

/// A ball that touches the plane y = `floor` at this place, and a camera near by.
fn ball_on(floor: f64, radius: f64, place: DVec3) -> (Shape, Camera) {
    let centre = place + (floor + radius) * DVec3::Y;
    let ball = Geometry::Sphere { centre, radius, frame: DMat3::IDENTITY };
    let mut camera = camera(centre + radius * DVec3::new(3.0, 2.0, 4.0), centre, 40.0, 48);
    camera.near_clip = 1e-3 * radius;
    (shape(ball, DAffine3::IDENTITY, 0, Some(EMISSION)), camera)
}

/// A sphere of this radius, in half sizes of the room, that touches its floor.
fn sphere_on_plane(radius: f64, place: DVec3) -> SceneDescription {
    let (ball, camera) = ball_on(-1.0, radius, place);
    let mut scene = room(vec![ball]);
    scene.cameras = vec![camera];
    scene
}

/// The same on a plane alone under a sky that is as bright, so that what is compiled has its origin nearly where they touch.
fn open_plane(radius: f64) -> SceneDescription {
    let (ball, camera) = ball_on(0.0, radius, DVec3::ZERO);
    let mut scene = room(vec![]);
    let up = DAffine3::from_axis_angle(DVec3::X, -std::f64::consts::FRAC_PI_2);
    scene.shapes = vec![shape(Geometry::Rectangle, up, 0, Some(EMISSION)), ball];
    scene.lights = vec![light(LightKind::Constant { radiance: Rgb::splat(EXPECTED) })];
    scene.cameras = vec![camera];
    scene
}

/// Boxes that share faces with the room and with each other, and a floor that is there twice.
fn coincident() -> SceneDescription {
    let half = DVec3::splat(0.2);
    let mut shapes = cuboid(DVec3::new(0.0, -0.8, 0.0), half);
    shapes.extend(cuboid(DVec3::new(0.4, -0.8, 0.0), half));
    shapes.extend(cuboid(DVec3::new(0.2, -0.4, 0.0), half));
    let mut floors: Vec<Shape> = walls(DVec3::ONE, EMISSION);
    shapes.append(&mut floors);
    room(shapes)
}

/// Lights in the planes of walls that are as bright.
fn flush() -> SceneDescription {
    let part = |wall: Shape| {
        let smaller = DAffine3::from_scale(DVec3::new(0.3, 0.4, 1.0));
        Shape { to_world: wall.to_world * smaller, ..wall }
    };
    room(walls(DVec3::ONE, EMISSION).into_iter().map(part).collect())
}

fn glass(int_ior: f64, ext_ior: f64) -> Bsdf {
    let kind =
        BsdfKind::Dielectric { int_ior, ext_ior, specular_reflectance: Rgb::WHITE, specular_transmittance: Rgb::WHITE };
    Bsdf { at: at(), name: String::new(), kind, varying: vec![] }
}

fn under_the_sky(bsdfs: Vec<Bsdf>, shapes: Vec<Shape>) -> SceneDescription {
    SceneDescription {
        cameras: vec![camera(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 40.0, 32)],
        bsdfs,
        shapes,
        lights: vec![light(LightKind::Constant { radiance: Rgb::WHITE })],
        ..enclosure(0.5, 0.0)
    }
}

/// Cubes of glass of different indices, so far from each other.
fn cubes(gap: f64) -> SceneDescription {
    let cube = |(bsdf, x): (usize, f64)| {
        cuboid(DVec3::new(x, 0.0, 0.0), DVec3::splat(0.4)).into_iter().map(move |mut wall| {
            (wall.emission, wall.bsdf) = (None, BsdfId(bsdf));
            wall
        })
    };
    let places = [-0.4 - gap, 0.4];
    under_the_sky(vec![glass(1.5, 1.0), glass(1.33, 1.0)], places.into_iter().enumerate().flat_map(cube).collect())
}

/// A round block of glass with water in it, all around a film of glass as thin as this away from the outside.
fn water(film: f64) -> SceneDescription {
    let side = |radius: f64, y: f64, bsdf: usize| {
        shape(Geometry::Cylinder { p0: -y * DVec3::Y, p1: y * DVec3::Y, radius }, DAffine3::IDENTITY, bsdf, None)
    };
    let up = DAffine3::from_axis_angle(DVec3::X, -std::f64::consts::FRAC_PI_2);
    let disk = |radius: f64, y: f64, bsdf: usize| {
        let map = DAffine3::from_translation(y * DVec3::Y) * up * DAffine3::from_scale(DVec3::new(radius, radius, 1.0));
        Shape { flip_normals: y < 0.0, ..shape(Geometry::Disk, map, bsdf, None) }
    };
    let block =
        |radius: f64, y: f64, bsdf: usize| [side(radius, y, bsdf), disk(radius, y, bsdf), disk(radius, -y, bsdf)];
    let shapes = [block(0.6, 0.7, 0), block(0.6 - film, 0.7 - film, 1)].concat();
    under_the_sky(vec![glass(1.5, 1.0), glass(1.33, 1.5)], shapes)
}
