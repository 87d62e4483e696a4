//! The law table of the lights: what they sample, from near, far, grazing and inside, has the density that they state.

use super::*;
use crate::image::{Picture, Raster};
use crate::sampler::{Sampler, SamplerKind};
use crate::sampling::chi_square::{Outcome, on_sphere, on_square, sidak};
use crate::sampling::warp;
use crate::shape::TriangleMesh;
use crate::shape::cylinder::Cylinder;
use crate::shape::disk::Disk;
use crate::shape::sphere::Sphere;
use crate::shape::uv::{Quadric, UvField};
use crate::texture::{Attribute, Bitmap, MeshValues, Texture, TextureKind, Textures, Wrap};
use glam::{Affine2, DAffine3, DMat3, DVec2};
use std::f64::consts::TAU;
use std::sync::Arc;

mod sky;

const SAMPLES: u32 = 40_000;

/// A light on a shape, and the points it is sampled from.
struct Row {
    name: &'static str,
    surface: Shape,
    /// Of a quadric, what makes it of the unit sphere, disk or cylinder. (A triangle has one of its own.)
    map: DAffine3,
    from: Vec<Vec3>,
}

fn uniform(i: u32) -> Vec2 {
    Sampler { kind: SamplerKind::Independent, seed: 29 }.stream(0, 0, i).light(0).point()
}

fn map(width: u32, height: u32, value: impl Fn(u32, u32) -> Rgb) -> Arc<Picture> {
    let mut map = Picture::new(width, height);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        map.set(x, y, value(x, y));
    }
    Arc::new(map)
}

fn table() -> Vec<Row> {
    let c = DVec3::new(-0.1, 0.1, -0.2);
    let [u, v, h] = [DVec3::new(0.3, 0.1, 0.0), DVec3::new(-0.1, 0.4, 0.0), DVec3::new(0.1, 0.2, 0.5)];
    let oblique = DMat3::from_cols(u, v, h);
    let wide = DMat3::from_cols(1.5 * u, 1.5 * v, h);
    let round = |r: f64, length: f64| DMat3::from_diagonal(DVec3::new(r, r, length));
    let quadric = |name, map: DMat3, from: &[Vec3], shape: &dyn Fn(DVec3, DVec3, DVec3) -> Shape| Row {
        name,
        surface: shape(map.x_axis, map.y_axis, map.z_axis),
        map: DAffine3::from_mat3_translation(map, c),
        from: from.to_vec(),
    };
    let disk = |u, v, _: DVec3| Shape::Disk(Disk::new(c, u, v, DVec3::Z).unwrap());
    let cylinder = |flip| move |u, v, h| Shape::Cylinder(Cylinder::new(c, [u, v, h], flip).unwrap());
    let sphere = |flip| {
        move |u: DVec3, _: DVec3, _: DVec3| Shape::Sphere(Sphere { centre: c.as_vec3(), radius: u.x as f32, flip })
    };
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let outside = [p(0.0, 0.1, 0.9), p(-0.7, 0.2, 0.3), p(0.8, -0.9, 0.7), p(0.7, 0.6, -0.8)];
    // In front of a plane through the middle: near, far, grazing.
    let above = [p(-0.1, 0.1, -0.15), p(0.4, -0.7, 0.9), p(0.9, 0.5, -0.15)];
    let within = [p(-0.1, 0.1, 0.1), p(0.2, 0.15, 0.2), p(-0.1, 0.1, -0.9)];
    let mut rows = meshes(&outside);
    rows.extend([
        quadric("sphere", round(0.3, 0.3), &[&outside[..], &[p(0.04448, -0.0806, -0.00736)]].concat(), &sphere(false)),
        quadric("small sphere", round(1e-3, 1e-3), &outside, &sphere(false)),
        quadric("sphere from inside", round(0.9, 0.9), &outside[..2], &sphere(true)),
        quadric("disk", round(0.3, 1.0), &[&[p(-0.1, 0.35, -0.19)], &above[..]].concat(), &disk),
        quadric("small disk", round(1e-3, 1.0), &above, &disk),
        quadric("ellipse", oblique, &above, &disk),
        quadric("cylinder", round(0.2, 0.4), &[&outside[..], &[p(0.11, 0.1, 0.0)]].concat(), &cylinder(false)),
        quadric("thread", round(1e-3, 0.4), &outside, &cylinder(false)),
        quadric("oblique cylinder", oblique, &outside, &cylinder(false)),
        quadric("cylinder from inside", round(0.5, 0.9), &within, &cylinder(true)),
        quadric("oblique cylinder from inside", wide, &within, &cylinder(true)),
    ]);
    rows
}

fn meshes(outside: &[Vec3]) -> Vec<Row> {
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let mesh = |name, positions: &[Vec3], faces: &[[u32; 3]], from: &[Vec3]| {
        let mesh = TriangleMesh { positions: positions.to_vec(), faces: faces.to_vec(), ..Default::default() };
        Row { name, surface: Shape::Mesh(mesh), map: DAffine3::IDENTITY, from: from.to_vec() }
    };
    let quad = [p(-0.5, -0.3, 0.0), p(0.5, -0.3, 0.0), p(0.5, 0.3, 0.1), p(-0.5, 0.3, 0.1)];
    let shear = p(0.3, 0.0, 0.0);
    let tetrahedron = [Vec3::ZERO, 0.3 * Vec3::X, 0.4 * Vec3::Y, 0.5 * Vec3::Z];
    let above = [p(0.1, 0.0, 0.1), p(0.0, 0.1, 0.9), p(0.9, 0.5, 0.2)];
    vec![
        mesh("triangle", &quad[..3], &[[0, 1, 2]], &[&[p(0.3, -0.1, 0.06)], &outside[..3]].concat()),
        mesh("quad", &quad, &[[0, 1, 2], [0, 2, 3]], &above),
        mesh("quad, turned", &quad, &[[1, 2, 0], [2, 3, 0]], &above),
        mesh("parallelogram", &[quad[0], quad[1], quad[2] + shear, quad[3] + shear], &[[2, 0, 1], [3, 0, 2]], &above),
        mesh("quadrangle", &[quad[0], quad[1], quad[2] + shear, quad[3]], &[[2, 0, 1], [3, 0, 2]], &above),
        mesh("closed mesh", &tetrahedron, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], outside),
    ]
}

/// The point of a surface at these coordinates of the unit square, and its area per area of the square.
fn point(row: &Row, u: DVec2) -> (SurfacePoint, f64) {
    let m = row.map.matrix3;
    match &row.surface {
        Shape::Placed(_) => panic!("what is placed is no light"),
        Shape::Sphere(sphere) => {
            let d = warp::square_to_uniform_sphere(u.as_vec2()).as_dvec3();
            (sphere.point(d).point, 2.0 * TAU * m.x_axis.length_squared())
        }
        Shape::Disk(disk) => {
            let ab = warp::square_to_disk(u.as_vec2()).as_dvec2();
            (disk.point(ab).point, 0.5 * TAU * m.x_axis.cross(m.y_axis).length())
        }
        Shape::Cylinder(cylinder) => {
            let (sin, cos) = (TAU * u.x).sin_cos();
            let around = TAU * (cos * m.y_axis - sin * m.x_axis);
            (cylinder.point(DVec2::new(cos, sin), u.y).point, around.cross(m.z_axis).length())
        }
        Shape::Mesh(mesh) => {
            let count = mesh.faces.len() as f64;
            let face = (u.x * count).min(count - 1.0).floor();
            let b = warp::square_to_triangle(DVec2::new(u.x * count - face, u.y).as_vec2());
            let m = face_map(mesh, face as u32).matrix3;
            (mesh.point(face as u32, b.as_dvec3().to_array()).point, 0.5 * count * m.x_axis.cross(m.y_axis).length())
        }
    }
}

/// To a triangle from coordinates along two edges and its normal.
fn face_map(mesh: &TriangleMesh, face: u32) -> DAffine3 {
    let [a, b, c] = mesh.triangle(face).map(|v| v.as_dvec3());
    let n = (b - a).cross(c - a).normalize();
    DAffine3::from_mat3_translation(DMat3::from_cols(b - a, c - a, n), a)
}

/// Where on the square a point of a surface is.
fn place(row: &Row, p: DVec3) -> Vec2 {
    let q = row.map.inverse().transform_point3(p);
    match &row.surface {
        Shape::Mesh(mesh) => {
            let local = |face| face_map(mesh, face).inverse().transform_point3(p);
            // How far it is off the triangle.
            let off = |q: DVec3| q.z.abs().max(-q.x).max(-q.y).max(q.x + q.y - 1.0);
            let faces = 0..mesh.faces.len() as u32;
            let face = faces.min_by(|&a, &b| off(local(a)).total_cmp(&off(local(b)))).unwrap();
            let q = local(face);
            let u = warp::triangle_to_square(DVec3::new(1.0 - q.x - q.y, q.x, q.y).as_vec3());
            Vec2::new((face as f32 + u.x) / mesh.faces.len() as f32, u.y)
        }
        Shape::Sphere(_) => warp::uniform_sphere_to_square(q.as_vec3()),
        Shape::Disk(_) => warp::disk_to_square(q.truncate().as_vec2()),
        _ => DVec2::new((q.y.atan2(q.x) / TAU).rem_euclid(1.0), q.z).as_vec2(),
    }
}

/// A density that may be the light's.
type Claim<'a> = dyn Fn(&AreaLight, &Shape, DVec3, &SurfacePoint) -> f64 + 'a;

fn right(light: &AreaLight, surface: &Shape, p: DVec3, end: &SurfacePoint) -> f64 {
    light.pdf(surface, p, Vec3::ZERO, end).0.into()
}

/// Normals at the points from which lights are sampled: none, and two that see part of the lights or all.
const NORMALS: [Vec3; 3] = [Vec3::ZERO, Vec3::new(0.0, -0.6, -0.8), Vec3::new(-0.8, 0.6, 0.0)];

/// Tests points instead of directions, for a light may be seen as a thread, and the density of points has no edge: that
/// per solid angle times cos θ/d².
fn test(row: &Row, from: Vec3, n: Vec3, claimed: &Claim<'_>) -> Outcome {
    let light = AreaLight::new(0, &row.surface, Rgb::WHITE).unwrap();
    let p = from.as_dvec3();
    on_square(
        SAMPLES,
        |i| light.sample(&row.surface, p, n, uniform(i)).map(|s| place(row, s.end.unwrap().seen_from(p, s.wi).p)),
        |u| {
            let (end, area) = point(row, u.as_dvec2());
            let to = p - end.p;
            let cos = end.n.as_dvec3().dot(to) / to.length();
            if cos > 0.0 { claimed(&light, &row.surface, p, &end) * area * cos / to.length_squared() } else { 0.0 }
        },
    )
}

/// Hypothesis: directions have the density that [`AreaLight::pdf`] states, and are lost as often as it falls short of 1.
/// 40,000 independent samples for each light and point, together a false-alarm rate of 1 %; the seed is fixed.
#[test]
fn samples_follow_their_density_from_everywhere() {
    let table = table();
    let normals = |row: &Row| if matches!(row.surface, Shape::Mesh(_)) { &NORMALS[..] } else { &NORMALS[..1] };
    let level = sidak(0.01, table.iter().map(|row| row.from.len() * normals(row).len()).sum());
    let mut wrong = Vec::new();
    for row in &table {
        for (&from, &n) in row.from.iter().flat_map(|from| normals(row).iter().map(move |n| (from, n))) {
            let o = test(row, from, n, &|light, surface, p, end| light.pdf(surface, p, n, end).0.into());
            // The integral has the error of its quadrature at edges.
            if !(o.p_value > level && o.integral < 1.01 && (o.integral + o.lost - 1.0).abs() < 0.02) {
                wrong.push(format!("{} from {from}, normal {n}: {o:?}", row.name));
            }
        }
    }
    assert!(wrong.is_empty(), "level {level:e}:\n{}", wrong.join("\n"));
}

/// A row's light with a texture of several brightnesses that is nowhere black, on one side or on both.
fn varying(row: &Row, both_sides: bool) -> VaryingLight {
    let area = AreaLight::new(0, &row.surface, Rgb::new(1.0, 2.0, 0.5)).unwrap();
    let picture =
        map(3, 4, |x, y| if (x, y) == (1, 2) { Rgb::WHITE } else { Rgb::new(0.1, 0.05, 0.02) * (1 + x) as f32 });
    let kind = TextureKind::Bitmap(Bitmap {
        image: Arc::new(Raster::from(&*picture)),
        bilinear: true,
        wrap: [Wrap::Repeat, Wrap::Mirror],
    });
    let textures = Arc::new(Textures::new(vec![Texture { kind, uv_set: 0, to_uv: Affine2::IDENTITY }]));
    let uvs = match &row.surface {
        Shape::Mesh(_) => UvField::Mesh { uvs: Vec::new(), tangents: Vec::new() },
        Shape::Sphere(_) => UvField::quadric(Quadric::Sphere, row.map),
        Shape::Disk(_) => UvField::quadric(Quadric::Disk, row.map),
        _ => UvField::quadric(Quadric::Cylinder, row.map),
    };
    let coat = Coat { slide: Slide::new(&textures, 0, 1.0), uvs, values: None };
    VaryingLight::new(area, &row.surface, Some(coat), both_sides)
}

/// Hypothesis: points of lights that vary, or that emit from both sides, have the density that [`VaryingLight::pdf`] states;
/// false alarms as above. What a sample says of its point is what is said of the point.
#[test]
fn varying_lights_follow_their_density_and_say_what_they_emit() {
    let table = table();
    let level = sidak(0.01, 2 * table.iter().map(|row| row.from.len()).sum::<usize>());
    let mut wrong = Vec::new();
    for (row, both) in table.iter().flat_map(|row| [(row, false), (row, true)]) {
        let (light, surface) = (varying(row, both), &row.surface);
        for from in row.from.iter().map(|p| p.as_dvec3()) {
            let o = on_square(
                SAMPLES,
                |i| {
                    light.sample(surface, &from, uniform(i)).map(|s| place(row, s.end.unwrap().seen_from(from, s.wi).p))
                },
                |u| {
                    let (end, area) = point(row, u.as_dvec2());
                    let to = from - end.p;
                    let cos = end.n.as_dvec3().dot(to) / to.length();
                    let cos = if both { cos.abs() } else { cos.max(0.0) };
                    let face = (u.x * surface.primitive_count() as f32) as u32;
                    f64::from(light.pdf(surface, &from, &end, face).0) * area * cos / to.length_squared()
                },
            );
            if !(o.p_value > level && o.integral < 1.01 && (o.integral + o.lost - 1.0).abs() < 0.02) {
                wrong.push(format!("{} from {from}, both sides: {both}: {o:?}", row.name));
            }
            for s in (0..200).filter_map(|i| light.sample(surface, &from, uniform(i))) {
                let (end, face) = (s.end.unwrap().seen_from(from, s.wi), s.on.primitive);
                assert_eq!(s.radiance, light.emitted(surface, face, &end, &-s.wi), "{}", row.name);
                // A grazing cosine is all rounding, but the same rounding, except where the cone's is its own.
                let (said, pdf) = (s.pdf.unwrap().0, light.pdf(surface, &from, &end, face).0);
                assert!((said / pdf - 1.0).abs() < 1e-3, "{}: {said}, {pdf}", row.name);
                assert!(s.radiance.max_component() <= Light::Varying(Box::new(light.clone())).brightest());
            }
        }
    }
    assert!(wrong.is_empty(), "level {level:e}:\n{}", wrong.join("\n"));
}

/// Where one of four triangles is all that is bright, half of the samples go there and the others by area, so that the density
/// is half of the uniform one elsewhere.
#[test]
fn bright_triangles_are_chosen_more_often() {
    let table = table();
    let row = table.iter().find(|row| row.name == "closed mesh").unwrap();
    let plain = AreaLight::new(0, &row.surface, Rgb::WHITE).unwrap();
    let Shape::Mesh(mesh) = &row.surface else { panic!() };
    let textures = Arc::new(Textures::new(vec![Texture {
        kind: TextureKind::Attribute { index: 0, scale: 3.0 },
        uv_set: 0,
        to_uv: Affine2::IDENTITY,
    }]));
    let bright = Attribute { of_faces: true, width: 1, values: vec![0.0, 0.0, 2.0, 0.0] };
    let values = Some(Arc::new(MeshValues { uvs: vec![], attributes: vec![Some(bright)] }));
    let largest = textures.range(0, values.as_deref()).unwrap()[1];
    assert_eq!(largest, 6.0);
    let uvs = UvField::Mesh { uvs: Vec::new(), tangents: Vec::new() };
    let coat = Coat { slide: Slide::new(&textures, 0, largest), uvs, values };
    let light = VaryingLight::new(plain.clone(), &row.surface, Some(coat), false);
    let areas: Vec<f64> = mesh.areas().collect();
    let total: f64 = areas.iter().sum();
    let from = DVec3::new(0.3, 0.4, 0.9);
    for (face, area) in areas.iter().enumerate() {
        let end = mesh.point(face as u32, [0.2, 0.3, 0.5]).point;
        let by_area = AreaLight::seen_from(from, plain.uniform_pdf(), &end);
        let ratio = light.pdf(&row.surface, &from, &end, face as u32).0 / by_area.0;
        let expected = if face == 2 { 0.5 + 0.5 * total / area } else { 0.5 };
        assert!((f64::from(ratio) / expected - 1.0).abs() < 1e-5, "{face}: {ratio}, {expected}");
    }
    let power = Light::Varying(Box::new(light)).power(std::slice::from_ref(&row.surface)).unwrap();
    assert!((power[1] / (std::f64::consts::PI * 6.0 * areas[2]) - 1.0).abs() < 1e-12, "{power:?}");
}

/// Mistakes as they are made: each must be rejected somewhere in the table.
#[test]
fn wrong_densities_are_rejected() {
    let distance2 = |p: DVec3, end: &SurfacePoint| (end.p - p).length_squared();
    let cos = |p: DVec3, end: &SurfacePoint| (end.p - p).normalize().dot(end.n.as_dvec3()).abs();
    let claims: [(&str, &str, &Claim<'_>); 9] = [
        ("quad", "no cosine", &|l, s, p, end| right(l, s, p, end) * cos(p, end)),
        ("quad", "uniform over the area", &|_, s, p, end| distance2(p, end) / (s.area() * cos(p, end))),
        ("disk", "no squared distance", &|l, s, p, end| right(l, s, p, end) / distance2(p, end)),
        ("disk", "uniform over the area", &|_, s, p, end| distance2(p, end) / (s.area() * cos(p, end))),
        ("triangle", "uniform over the area", &|_, s, p, end| distance2(p, end) / (s.area() * cos(p, end))),
        ("ellipse", "an area without π", &|l, s, p, end| right(l, s, p, end) * std::f64::consts::PI),
        ("sphere", "uniform over the area", &|_, s, p, end| distance2(p, end) / (s.area() * cos(p, end))),
        ("cylinder", "as if its back were sampled, too", &|l, s, p, end| 0.5 * right(l, s, p, end)),
        ("oblique cylinder from inside", "uniform area", &|_, s, p, end| distance2(p, end) / (s.area() * cos(p, end))),
    ];
    for (name, what, claim) in claims {
        let table = table();
        let row = table.iter().find(|row| row.name == name).unwrap();
        let o = test(row, row.from[1], Vec3::ZERO, claim);
        assert!(o.p_value < 1e-6, "{name}: {what} was accepted: {o:?}");
    }
}

#[test]
fn a_point_light_obeys_the_inverse_square_law() {
    let light = PointLight {
        position: DVec3::new(0.1, 0.2, 0.3),
        intensity: Rgb::new(1.0, 2.0, 0.0),
        clearance: 0.0,
        touching: vec![],
    };
    for to in [DVec3::new(0.3, 0.0, 0.4), DVec3::new(-1e-9, 0.0, 0.0), DVec3::new(1e5, 1e5, 0.0)] {
        let s = light.sample(&(light.position - to)).unwrap();
        let expected = 1.0 / to.length_squared();
        let [r, g, b] = s.radiance.to_array().map(f64::from);
        // The position is rounded when it is subtracted, which counts for the nearest.
        assert!((r / expected - 1.0).abs() < 1e-6 && (g / expected - 2.0).abs() < 2e-6 && b == 0.0, "{s:?}");
        assert!((s.wi.as_dvec3() - to.normalize()).length() < 1e-7 && s.pdf.is_none());
    }
    assert!(light.sample(&light.position).is_none());
}

fn spot(beam: f64, cutoff: f64) -> SpotLight {
    let [beam, cutoff] = [beam, cutoff].map(f64::to_radians);
    let point =
        PointLight { position: DVec3::new(0.1, 0.2, 0.3), intensity: Rgb::WHITE, clearance: 0.0, touching: vec![] };
    SpotLight { point, axis: DVec3::new(0.48, -0.6, 0.64), beam, cutoff, slide: None }
}

/// The integral of what it sends over the sphere, by the trapezoidal rule, is what its power is computed from.
#[test]
fn spots_send_what_their_power_says() {
    for (beam, cutoff) in [(15.0, 20.0), (0.0, 1.0), (10.0, 10.0), (90.0, 90.0), (0.0, 180.0), (100.0, 170.0)] {
        let light = spot(beam, cutoff);
        let across = light.axis.any_orthonormal_vector();
        let steps = 40_000;
        let step = light.cutoff / f64::from(steps);
        let sum: f64 = (0..steps)
            .map(|i| {
                let angle = (f64::from(i) + 0.5) * step;
                let p = light.point.position + light.axis * angle.cos() + across * angle.sin();
                let intensity = light.sample(&p).map_or(0.0, |s| f64::from(s.radiance.0.x));
                TAU * angle.sin() * intensity * step
            })
            .sum();
        let expected = light.effective_solid_angle();
        assert!((sum / expected - 1.0).abs() < 1e-5, "{beam} {cutoff}: {sum}, but {expected}");
    }
    assert!((spot(180.0, 180.0).effective_solid_angle() / (2.0 * TAU) - 1.0).abs() < 1e-15);
}
