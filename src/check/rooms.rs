//! Scenes that are built in, as descriptions: rooms whose radiance is known in closed form, and what they are made of.

use crate::description::*;
use crate::error::Span;
use crate::spectrum::Rgb;
use glam::{DAffine2, DAffine3, DMat3, DVec3};
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

/// Where cameras begin to see.
const NEAR: f64 = 1e-3;

/// No file.
pub fn at() -> Span {
    Span::whole(Path::new("built in"))
}

/// A camera at `origin` that looks at `target`, with a square film.
pub fn camera(origin: DVec3, target: DVec3, fov: f64, pixels: u32) -> Camera {
    let forward = (target - origin).normalize();
    let up = if forward.y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
    let left = up.cross(forward).normalize();
    let matrix = DMat3::from_cols(left, forward.cross(left), forward);
    let film = Film {
        at: at(),
        width: pixels,
        height: pixels,
        crop: Crop { x: 0, y: 0, width: pixels, height: pixels },
        filter: Filter::Box,
        sample_border: false,
        component_format: ComponentFormat::Float,
        pixel_format: PixelFormat::Rgb,
    };
    Camera {
        at: at(),
        to_world: DAffine3::from_mat3_translation(matrix, origin),
        projection: perspective(fov, FovAxis::X),
        near_clip: NEAR,
        far_clip: 1e4,
        film,
        sampler: Sampler { sample_count: 16, seed: 0 },
    }
}

/// A pinhole with this field of view.
pub fn perspective(degrees: f64, axis: FovAxis) -> Projection {
    Projection::Perspective { fov: FieldOfView { degrees, axis }, principal_point_offset: (0.0, 0.0) }
}

/// A shape with the bsdf of this number, that perhaps emits this radiance.
pub fn shape(geometry: Geometry, to_world: DAffine3, bsdf: usize, emission: Option<f32>) -> Shape {
    Shape {
        at: at(),
        name: "shape".into(),
        geometry,
        to_world,
        flip_normals: false,
        bsdf: BsdfId(bsdf),
        emission: emission.map(|v| Emission::uniform(Rgb::splat(v))),
    }
}

/// A diffuse bsdf.
pub fn diffuse(albedo: f32) -> Bsdf {
    Bsdf { at: at(), name: String::new(), kind: BsdfKind::Diffuse { reflectance: Rgb::splat(albedo) }, varying: vec![] }
}

/// The six walls of the box [−1, 1]³ · `half`, seen from inside.
pub fn walls(half: DVec3, emission: f32) -> Vec<Shape> {
    let turn = |axis: DVec3, angle: f64| DAffine3::from_axis_angle(axis, angle);
    let quarter = std::f64::consts::FRAC_PI_2;
    let rotations = [
        DAffine3::IDENTITY,
        turn(DVec3::X, 2.0 * quarter),
        turn(DVec3::X, quarter),
        turn(DVec3::X, -quarter),
        turn(DVec3::Y, quarter),
        turn(DVec3::Y, -quarter),
    ];
    rotations
        .into_iter()
        .map(|r| {
            // The rectangle looks along +z: put it behind the middle, then turn.
            let inwards = r * DAffine3::from_translation(-DVec3::Z);
            shape(Geometry::Rectangle, DAffine3::from_scale(half) * inwards, 0, Some(emission))
        })
        .collect()
}

/// A point light.
pub fn point_light(position: DVec3, intensity: Rgb) -> Light {
    Light { at: at(), kind: LightKind::Point { position, intensity } }
}

/// A light of the scene's own.
pub fn light(kind: LightKind) -> Light {
    Light { at: at(), kind }
}

/// A picture of these values.
pub fn map(width: u32, height: u32, value: impl Fn(u32, u32) -> Rgb) -> Arc<Picture> {
    let mut map = Picture::new(width, height);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        map.set(x, y, value(x, y));
    }
    Arc::new(map)
}

/// A texture of these values.
pub fn picture_texture(width: u32, height: u32, value: impl Fn(u32, u32) -> Rgb) -> Texture {
    let image = Arc::new(crate::image::Raster::from(&*map(width, height, value)));
    let kind = TextureKind::Bitmap { image, bilinear: true, wrap: [Wrap::Repeat; 2] };
    Texture { at: at(), kind, uv_set: 0, to_uv: DAffine2::IDENTITY }
}

/// The side of a cylinder and the disks that close its ends, under an affine map, fronts inside.
pub fn closed_cylinder(map: DAffine3, emission: Option<f32>) -> Vec<Shape> {
    let side = Geometry::Cylinder { p0: DVec3::NEG_Z, p1: DVec3::Z, radius: 1.0 };
    let end = |z: f64| map * DAffine3::from_translation(DVec3::new(0.0, 0.0, z));
    let mut side = shape(side, map, 0, emission);
    side.flip_normals = true;
    let mut top = shape(Geometry::Disk, end(1.0), 0, emission);
    top.flip_normals = true;
    vec![side, shape(Geometry::Disk, end(-1.0), 0, emission), top]
}

/// A closed room whose walls have this albedo and emit this radiance; a camera inside.
pub fn enclosure(albedo: f32, emission: f32) -> SceneDescription {
    SceneDescription {
        integrator: Integrator::default(),
        cameras: vec![camera(DVec3::new(0.3, -0.2, 0.5), DVec3::new(-1.0, 0.4, -0.7), 90.0, 24)],
        bsdfs: vec![diffuse(albedo)],
        textures: vec![],
        wants_uvs: false,
        shapes: walls(DVec3::new(1.0, 0.7, 1.3), emission),
        groups: vec![],
        instances: vec![],
        lights: vec![],
        warnings: vec![],
        inventory: Default::default(),
    }
}

/// What is told of a scene in closed form.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// The scene.
    pub scene: SceneDescription,
    /// The radiance that all of its picture has.
    pub expected: f64,
    /// The longest path that the closed form speaks of, in segments.
    pub max_depth: u32,
}

/// Albedo and radiance of the walls of furnaces.
const FURNACE: [f32; 2] = [0.5, 0.75];

/// Albedo of floors.
const FLOOR: f32 = 0.6;

/// Half the field of view, in degrees, of what sees one point.
const HALF_FOV: f64 = 1e-5;

/// All cases.
pub fn cases() -> Vec<Case> {
    let [albedo, emission] = FURNACE;
    let furnace = f64::from(emission / (1.0 - albedo));
    let room = |name, shapes: Vec<Shape>| Case {
        name,
        scene: SceneDescription { shapes, ..enclosure(albedo, emission) },
        expected: furnace,
        max_depth: u32::MAX,
    };
    let skew = DMat3::from_cols(DVec3::new(0.9, 0.1, 0.0), DVec3::new(-0.2, 0.7, 0.1), DVec3::new(0.1, 0.3, 1.2));
    let ball = Geometry::Sphere { centre: DVec3::new(0.1, -0.3, 0.2), radius: 2.3, frame: DMat3::IDENTITY };
    let ball = Shape { flip_normals: true, ..shape(ball, DAffine3::IDENTITY, 0, Some(emission)) };
    let mut cases = vec![
        room("furnace of rectangles", enclosure(albedo, emission).shapes),
        room("furnace in a sphere", vec![ball]),
        room("furnace in a skewed cylinder", closed_cylinder(DAffine3::from_mat3(skew), Some(emission))),
        Case { name: "furnace of many albedos", scene: mixed(furnace), expected: furnace, max_depth: u32::MAX },
    ];
    cases.extend(skies());
    cases.extend(floors());
    cases
}

/// A room with lights of two kinds and of different sizes: every surface has an albedo of its own and emits what it takes for
/// all to show the same. One wall and one sphere do not emit.
fn mixed(radiance: f64) -> SceneDescription {
    let [albedo, emission] = FURNACE;
    let albedos = [0.2, 0.4, 0.5, 0.3, 0.6, 1.0, 0.1, 1.0];
    let mut scene = enclosure(albedo, emission);
    scene.bsdfs = albedos.into_iter().map(diffuse).collect();
    for (centre, radius) in [(DVec3::new(-0.4, 0.3, -0.6), 0.25), (DVec3::new(-0.5, -0.4, -0.2), 0.2)] {
        let ball = Geometry::Sphere { centre, radius, frame: DMat3::IDENTITY };
        scene.shapes.push(shape(ball, DAffine3::IDENTITY, 0, None));
    }
    for (i, (shape, albedo)) in scene.shapes.iter_mut().zip(albedos).enumerate() {
        shape.bsdf = BsdfId(i);
        shape.emission = (albedo < 1.0).then(|| Emission::uniform(Rgb::splat(radiance as f32 * (1.0 - albedo))));
    }
    scene
}

/// Under a white sky nobody sees what loses nothing: smooth glass, clear to all depths, a pane, and white walls.
fn skies() -> Vec<Case> {
    let dielectric = |int_ior| BsdfKind::Dielectric {
        int_ior,
        ext_ior: 1.0,
        specular_reflectance: Rgb::WHITE,
        specular_transmittance: Rgb::WHITE,
    };
    let pane = BsdfKind::ThinDielectric {
        int_ior: 1.5,
        ext_ior: 1.0,
        specular_reflectance: Rgb::WHITE,
        specular_transmittance: Rgb::WHITE,
    };
    let white = BsdfKind::Diffuse { reflectance: Rgb::WHITE };
    [("glass under the sky", dielectric(1.5)), ("a pane under the sky", pane), ("white under the sky", white)]
        .map(|(name, kind)| {
            let ball = Geometry::Sphere { centre: DVec3::ZERO, radius: 1.0, frame: DMat3::IDENTITY };
            let scene = SceneDescription {
                cameras: vec![camera(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 45.0, 24)],
                bsdfs: vec![Bsdf { at: at(), name: String::new(), kind, varying: vec![] }],
                shapes: vec![shape(ball, DAffine3::IDENTITY, 0, None)],
                lights: vec![light(LightKind::Constant { radiance: Rgb::WHITE })],
                ..enclosure(0.5, 0.0)
            };
            Case { name, scene, expected: 1.0, max_depth: u32::MAX }
        })
        .into()
}

/// The middle of a diffuse floor, lit in ways whose irradiance is known (Howell, Mengüç, Daun and Siegel 2020, *Thermal
/// Radiation Heat Transfer*, appendix C).
fn floors() -> Vec<Case> {
    let lamp =
        |geometry, to_world, flip_normals| vec![Shape { flip_normals, ..shape(geometry, to_world, 0, Some(1.0)) }];
    let floor = |name, lamps: Vec<Shape>, lights: Vec<Light>, irradiance: f64| {
        let mut shapes = lamps;
        shapes.push(shape(Geometry::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), 0, None));
        let cameras = vec![camera(DVec3::new(1.5, -2.0, 0.8), DVec3::ZERO, 2.0 * HALF_FOV, 1)];
        let scene = SceneDescription { cameras, shapes, lights, ..enclosure(FLOOR, 0.0) };
        Case { name, scene, expected: f64::from(FLOOR) / PI * irradiance, max_depth: 2 }
    };
    let disk = DAffine3::from_translation(0.7 * DVec3::Z) * DAffine3::from_scale(DVec3::new(0.4, 0.4, 1.0));
    let ball = |centre, radius| Geometry::Sphere { centre, radius, frame: DMat3::IDENTITY };
    let aside = DVec3::new(1.0, 0.5, 0.7);
    let cylinder = Geometry::Cylinder { p0: 0.3 * DVec3::Z, p1: 1.2 * DVec3::Z, radius: 0.6 };
    let seen = |r: f64, h: f64| PI * r * r / (r * r + h * h);
    let lambert = |centre: DVec3, r: f64| PI * centre.z / centre.length() * r * r / centre.length_squared();
    let point = DVec3::new(0.3, 0.2, 1.1);
    let sky = light(LightKind::Constant { radiance: Rgb::WHITE });
    let sun = LightKind::Directional { direction: DVec3::new(0.5, -3.0, -1.0), irradiance: Rgb::WHITE };
    vec![
        floor("floor under a disk", lamp(Geometry::Disk, disk, true), vec![], seen(0.4, 0.7)),
        floor("floor under a sphere", lamp(ball(aside, 0.5), DAffine3::IDENTITY, false), vec![], lambert(aside, 0.5)),
        floor(
            "floor under a tiny sphere",
            lamp(ball(aside, TINY), DAffine3::IDENTITY, false),
            vec![],
            lambert(aside, TINY),
        ),
        floor("floor in a cylinder", lamp(cylinder, DAffine3::IDENTITY, true), vec![], seen(0.6, 0.3) - seen(0.6, 1.2)),
        floor(
            "floor under a point",
            vec![],
            vec![point_light(point, Rgb::WHITE)],
            point.z / point.length() / point.length_squared(),
        ),
        floor("floor in the sun", vec![], vec![light(sun)], 1.0 / DVec3::new(0.5, -3.0, -1.0).length()),
        floor("floor under the sky", vec![], vec![sky], PI),
    ]
}

/// The radius of a lamp that is nearly a point.
const TINY: f64 = 1e-4;

/// One of everything, for the bits of its picture: shapes of all kinds, placed ones among them, materials that reflect, transmit
/// and absorb, lights of all kinds.
pub fn menagerie() -> SceneDescription {
    let mut room = enclosure(0.5, 0.0);
    room.shapes.pop();
    room.bsdfs.extend(materials());
    let place = |x: f64, y: f64, z: f64, size: f64| {
        DAffine3::from_translation(DVec3::new(x, y, z)) * DAffine3::from_scale(DVec3::splat(size))
    };
    let ball = || Geometry::Sphere { centre: DVec3::ZERO, radius: 1.0, frame: DMat3::IDENTITY };
    let tilt = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    room.shapes.extend([
        shape(ball(), place(-0.5, -0.3, -0.7, 0.3), 1, None),
        shape(ball(), place(-0.3, 0.3, -0.2, 0.25), 2, None),
        shape(Geometry::Disk, place(-0.6, 0.1, 0.2, 0.3) * tilt, 3, None),
        shape(Geometry::Rectangle, place(0.2, 0.6, -0.3, 0.2) * tilt, 0, Some(5.0)),
        shape(ball(), place(-0.8, 0.5, -0.9, 0.05), 0, Some(20.0)),
        shape(Geometry::Mesh(Arc::new(blob())), place(0.3, -0.4, -0.6, 0.3), 4, None),
    ]);
    for mut end in closed_cylinder(place(-0.7, -0.5, 0.3, 0.15) * tilt, None) {
        (end.flip_normals, end.bsdf) = (!end.flip_normals, BsdfId(5));
        room.shapes.push(end);
    }
    let members = vec![
        shape(ball(), place(0.0, 0.0, 0.0, 0.1), 3, None),
        shape(Geometry::Mesh(Arc::new(blob())), place(0.1, 0.0, 0.1, 0.08), 1, None),
    ];
    room.groups = vec![Group { shapes: members }];
    let shear = DMat3::from_cols(DVec3::new(0.9, 0.1, 0.0), DVec3::new(-0.4, 0.7, 0.1), DVec3::new(0.1, 0.3, -1.2));
    room.instances = [(0.5, -0.2, -0.9), (-0.1, 0.0, -0.9), (0.1, 0.35, -0.8)]
        .map(|(x, y, z)| {
            let to_world = DAffine3::from_mat3_translation(shear, DVec3::new(x, y, z));
            Instance { at: at(), name: "instance".into(), group: GroupId(0), to_world }
        })
        .into();
    let spot = LightKind::Spot {
        position: DVec3::new(0.4, 0.5, 0.5),
        direction: DVec3::new(-1.0, -0.8, -1.2),
        intensity: Rgb::new(0.5, 1.0, 2.0),
        cutoff_angle: 40.0,
        beam_width: 10.0,
        texture: None,
    };
    let sky = map(16, 9, |x, y| Rgb::new(x as f32, y as f32, 5.0) * 0.02);
    room.lights = vec![
        point_light(DVec3::new(0.2, 0.3, 0.7), Rgb::new(0.3, 0.2, 0.1)),
        light(spot),
        light(LightKind::Directional { direction: DVec3::new(1.0, -0.3, -0.4), irradiance: Rgb::splat(0.5) }),
        light(LightKind::Environment { map: sky, scale: 1.0, to_world: DMat3::IDENTITY, mis_compensation: true }),
    ];
    room
}

/// Of [`menagerie`], from number 1 on: clear glass, frosted glass, rough gold, a material of glTF with something inside, plastic.
fn materials() -> Vec<Bsdf> {
    let bsdf = |kind| Bsdf { at: at(), name: String::new(), kind, varying: vec![] };
    let facets = |alpha_u, alpha_v| Microfacets {
        alpha_u,
        alpha_v,
        distribution: MicrofacetDistribution::Ggx,
        multiple_scattering: false,
    };
    let (eta, k) = (Rgb::new(0.2, 0.9, 1.4), Rgb::new(3.9, 2.4, 1.6));
    let volume = Some(Volume { attenuation_color: Rgb::new(0.9, 0.3, 0.1), attenuation_distance: 0.3 });
    let inside = Gltf { metallic: 0.0, roughness: 0.2, ior: 1.4, transmission: 1.0, volume, ..Gltf::default() };
    vec![
        bsdf(BsdfKind::Dielectric {
            int_ior: 1.5,
            ext_ior: 1.0,
            specular_reflectance: Rgb::WHITE,
            specular_transmittance: Rgb::WHITE,
        }),
        bsdf(BsdfKind::RoughDielectric {
            facets: facets(0.3, 0.3),
            int_ior: 1.5,
            ext_ior: 1.0,
            specular_reflectance: Rgb::WHITE,
            specular_transmittance: Rgb::WHITE,
        }),
        bsdf(BsdfKind::RoughConductor { facets: facets(0.1, 0.4), eta, k, specular_reflectance: Rgb::WHITE }),
        bsdf(BsdfKind::Gltf(inside)),
        bsdf(BsdfKind::OrenNayar { reflectance: Rgb::new(0.7, 0.5, 0.3), roughness: 0.6 }),
    ]
}

/// A closed mesh with bumps.
fn blob() -> Mesh {
    let mesh = super::meshes::displaced_sphere(6);
    Mesh { positions: mesh.positions.iter().map(|p| p.as_dvec3()).collect(), faces: mesh.faces, ..Mesh::default() }
}
