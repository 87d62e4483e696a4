//! Meshes that are hard on accelerators.

use super::random::Rng;
use super::shapes;
use crate::shape::{Hit, Shape, TriangleMesh};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Names of [`Mesh::new`], and what each is.
pub const MESHES: [(&str, &str); 16] = [
    ("soup", "random triangles of all sizes"),
    ("slivers", "triangles 1e3 to 1e7 times as long as wide"),
    ("coplanar", "triangles that overlap in four planes"),
    ("duplicates", "each triangle four times, in two meshes"),
    ("degenerate", "points, segments and lines among triangles"),
    ("nested", "triangles around one corner, of sizes over 30 powers of two"),
    ("room", "two boxes in a room: few enough for a list"),
    ("boxes", "a grid of boxes that share faces"),
    ("sphere", "a closed mesh, near to round"),
    ("bumpy", "a closed mesh with bumps"),
    ("spindle", "a closed mesh of slivers around two tips"),
    ("far", "the closed mesh with bumps, a million times its size from the origin"),
    ("tiny", "the same with a soup, of size 10^-30"),
    ("huge", "the same with a soup, of size 10^30"),
    ("quadrics", "spheres, disks and cylinders that touch, overlap and are thin, with triangles among them"),
    ("placed", "a group placed by shears, mirrorings and uneven scales, once around all the others"),
];

/// Size of the mesh `tiny`; that of `huge` is its inverse.
const TINY: f32 = 1e-30;

/// Where the mesh `far` is, in its sizes.
const FAR: Vec3 = Vec3::new(1e6, -7e5, 3e5);

/// Widths of slivers, as a fraction of their length.
const SLIVERS: [f32; 4] = [1e-3, 1e-5, 1e-6, 1e-7];

/// Sizes of the triangles of a soup.
const SOUP: [f32; 4] = [1.0, 0.1, 1e-2, 1e-4];

/// The angle that the thin sides of a spindle take.
const THIN_SIDE: f64 = 1e-6;

/// A mesh, or several, and what rays must know to be aimed at it.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// One of [`MESHES`].
    pub name: &'static str,
    /// Its place in [`MESHES`].
    pub index: usize,
    /// What rays meet.
    pub shapes: Vec<Shape>,
    /// What rays are aimed at: all triangles, those that are placed as they are in the scene, rounded to f32; and some that
    /// lie in quadrics or touch them.
    pub triangles: Vec<[Vec3; 3]>,
    /// Which primitive each of `triangles` is; [`Hit::NONE`] of those that stand for a quadric.
    pub ids: Vec<Hit>,
    /// Everything lies in a cube around this point,
    pub centre: Vec3,
    /// with sides of twice this length.
    pub size: f32,
    /// Points such that every ray without an end through their neighbourhood ([`CAVITY`] of the size) meets something.
    pub cavities: Vec<Vec3>,
    /// Whether Embree has something to say: it ignores triangles beyond 1.8·10¹⁸, and its products vanish where the mesh is
    /// tiny. What is placed it never sees: that is left to our own trees, which would be compared with themselves. So are
    /// quadrics, but that both together find what is nearest is worth a check.
    pub suits_embree: bool,
}

/// How far from a cavity rays may pass, along each axis, as a fraction of the mesh's size.
pub const CAVITY: f32 = 0.0625;

impl Mesh {
    /// The mesh of [`MESHES`] with this index, of so many.
    pub fn new(index: usize, seed: u64) -> Self {
        let name = MESHES[index].0;
        let rng = &mut Rng::of(seed, &[index as u64]);
        let (shapes, cavities) = match name {
            "soup" => (vec![soup(&soup_of_all_sizes(rng))], vec![]),
            "slivers" => (vec![soup(&SLIVERS.map(|width| slivers(rng, 150, width)).concat())], vec![]),
            "coplanar" => (vec![soup(&coplanar(rng))], vec![]),
            "duplicates" => (duplicates(rng), vec![]),
            "degenerate" => (vec![soup(&degenerate(rng, 100))], vec![]),
            "nested" => (vec![soup(&nested())], vec![]),
            "room" => (vec![boxes()], vec![Vec3::new(0.0, 0.6, 0.5)]),
            "boxes" => box_grid(),
            "sphere" => (vec![Shape::Mesh(round(displaced_sphere(10)))], vec![Vec3::ZERO]),
            "spindle" => (vec![Shape::Mesh(spindle(rng, 200))], vec![Vec3::ZERO]),
            "tiny" | "huge" => (bumpy_in_soup(rng), vec![Vec3::ZERO]),
            "quadrics" => (shapes::quadrics(rng), vec![]),
            "placed" => (shapes::placed(rng), vec![Vec3::ZERO]),
            _ => (vec![Shape::Mesh(displaced_sphere(10))], vec![Vec3::ZERO]),
        };
        let (centre, size) = match name {
            "far" => (FAR, 1.0),
            "tiny" => (Vec3::ZERO, TINY),
            "huge" => (Vec3::ZERO, 1.0 / TINY),
            _ => (Vec3::ZERO, 1.0),
        };
        let to_place = |v: Vec3| centre + size * v;
        let shapes: Vec<Shape> = shapes.iter().map(|shape| moved(shape, to_place)).collect();
        let targets = (0..).zip(&shapes).flat_map(|(index, shape)| shapes::targets(rng, index, shape));
        let (ids, triangles) = targets.unzip();
        let cavities = cavities.into_iter().map(to_place).collect();
        let suits_embree = size == 1.0 && name != "placed";
        Self { name, index, shapes, triangles, ids, centre, size, cavities, suits_embree }
    }

    /// Whether no ray can get out.
    pub fn is_closed(&self) -> bool {
        !self.cavities.is_empty()
    }

    /// From coordinates in which it fills [−1, 1]³.
    pub fn place(&self, v: Vec3) -> Vec3 {
        self.centre + self.size * v
    }
}

fn moved(shape: &Shape, to_place: impl Fn(Vec3) -> Vec3) -> Shape {
    match shape {
        Shape::Mesh(mesh) => {
            let positions = mesh.positions.iter().map(|&v| to_place(v)).collect();
            Shape::Mesh(TriangleMesh { positions, ..mesh.clone() })
        }
        other => other.clone(),
    }
}

/// A mesh of separate triangles.
pub fn soup(triangles: &[[Vec3; 3]]) -> Shape {
    Shape::Mesh(TriangleMesh {
        positions: triangles.iter().flatten().copied().collect(),
        faces: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Default::default()
    })
}

/// Random triangles of about `size` around points of the cube [−1, 1]³.
pub fn random_soup(rng: &mut Rng, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|_| {
            let centre = rng.in_cube();
            [0; 3].map(|_| centre + size * rng.in_cube())
        })
        .collect()
}

fn soup_of_all_sizes(rng: &mut Rng) -> Vec<[Vec3; 3]> {
    SOUP.map(|size| random_soup(rng, 200, size)).concat()
}

/// Needles of this width, in lengths of about 1.
pub fn slivers(rng: &mut Rng, count: usize, width: f32) -> Vec<[Vec3; 3]> {
    let triangles = random_soup(rng, count, 0.5);
    triangles.into_iter().map(|[a, b, _]| [a, b, a + rng.unit() * (b - a) + width * rng.in_cube()]).collect()
}

/// Five triangles for each of `count`: a point, two segments, three points in line, and one that is none of these.
pub fn degenerate(rng: &mut Rng, count: usize) -> Vec<[Vec3; 3]> {
    let all = |[a, b, c]: [Vec3; 3]| [[a, a, a], [a, b, b], [a, b, a], [a, 0.5 * (a + b), b], [a, b, c]];
    random_soup(rng, count, 0.6).into_iter().flat_map(all).collect()
}

/// `count` triangles that overlap in the plane y = `height`.
pub fn layers(rng: &mut Rng, count: usize, height: f32) -> Vec<[Vec3; 3]> {
    (0..count).map(|_| [0; 3].map(|_| Vec3::new(rng.between(-1.0, 1.0), height, rng.between(-1.0, 1.0)))).collect()
}

/// Layers in three planes that are at right angles, and in one that is askew.
fn coplanar(rng: &mut Rng) -> Vec<[Vec3; 3]> {
    let mut triangles = layers(rng, 50, 0.25);
    triangles.extend(layers(rng, 50, 0.0).into_iter().map(|t| t.map(|v| Vec3::new(v.y, v.x, v.z))));
    triangles.extend(layers(rng, 50, -0.75).into_iter().map(|t| t.map(|v| Vec3::new(v.x, v.z, v.y))));
    triangles.extend(layers(rng, 50, 0.0).into_iter().map(|t| t.map(|v| Vec3::new(v.x, 0.5 * v.x - 0.25 * v.z, v.z))));
    triangles
}

/// Two meshes of the same triangles, each of which has them twice.
fn duplicates(rng: &mut Rng) -> Vec<Shape> {
    let triangles = random_soup(rng, 100, 0.4);
    let twice: Vec<_> = triangles.iter().chain(triangles.iter().rev()).copied().collect();
    vec![soup(&twice), soup(&twice)]
}

/// Ten triangles of each size, around the origin.
fn nested() -> Vec<[Vec3; 3]> {
    let triangle = [Vec3::new(-0.5, 0.0, -0.5), Vec3::new(1.0, 0.0, -0.5), Vec3::new(-0.5, 0.0, 1.0)];
    let turned = |v: Vec3, i: i32| match i % 3 {
        0 => v,
        1 => Vec3::new(v.y, v.z, v.x),
        _ => Vec3::new(v.z, v.x, v.y + 0.125 * v.x),
    };
    (0..300).map(|i| triangle.map(|v| turned(v, i) * libm::exp2f(-(i / 10) as f32))).collect()
}

/// A room of 12 triangles with two boxes of 12 in it, in [−1, 1]³.
pub fn boxes() -> Shape {
    let mut triangles = cuboid(Vec3::splat(-1.0), Vec3::splat(1.0));
    triangles.extend(cuboid(Vec3::new(-0.7, -0.999, -0.6), Vec3::new(-0.1, 0.3, 0.0)));
    triangles.extend(cuboid(Vec3::new(0.1, -0.999, 0.0), Vec3::new(0.7, -0.3, 0.6)));
    soup(&triangles)
}

/// The twelve triangles of a box.
pub fn cuboid(lower: Vec3, upper: Vec3) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [lower, upper] {
            let corner = |i: usize, j: usize| {
                let mut v = lower;
                v[axis] = side[axis];
                v[(axis + 1) % 3] = [lower, upper][i][(axis + 1) % 3];
                v[(axis + 2) % 3] = [lower, upper][j][(axis + 2) % 3];
                v
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// Boxes that fill [−1, 1]³ but for some, with their centres. Their corners are no good numbers.
fn box_grid() -> (Vec<Shape>, Vec<Vec3>) {
    /// Boxes along an edge.
    const ALONG: i32 = 4;
    let corner = |i: i32| i as f32 * (2.0 / ALONG as f32) - 1.0 + 0.1 * libm::sinf(5.0 * i as f32);
    let at = |[i, j, k]: [i32; 3]| Vec3::new(corner(i), corner(j), corner(k)).clamp(Vec3::NEG_ONE, Vec3::ONE);
    let (mut triangles, mut centres) = (Vec::new(), Vec::new());
    let places = (0..ALONG.pow(3)).map(|n| [n % ALONG, n / ALONG % ALONG, n / (ALONG * ALONG)]);
    for place in places.filter(|[i, j, k]| (i + 2 * j + 3 * k) % 7 != 0) {
        let (lower, upper) = (at(place), at(place.map(|c| c + 1)));
        triangles.extend(cuboid(lower, upper));
        centres.push(0.5 * (lower + upper));
    }
    (vec![soup(&triangles)], centres)
}

/// The mesh with all vertices moved to the unit sphere around the origin.
fn round(mesh: TriangleMesh) -> TriangleMesh {
    let positions = mesh.positions.iter().map(|v| v.as_dvec3().normalize().as_vec3()).collect();
    TriangleMesh { positions, ..mesh }
}

/// Two cones with a common rim of `count` wide sides, with as many that are a million times as long as wide.
fn spindle(rng: &mut Rng, count: u32) -> TriangleMesh {
    let step = std::f64::consts::TAU / f64::from(count);
    let angles: Vec<f64> = (0..count)
        .flat_map(|i| {
            let angle = step * (f64::from(i) + 0.5 * f64::from(rng.unit()));
            [angle, angle + THIN_SIDE]
        })
        .collect();
    let mut positions = vec![Vec3::Y, Vec3::NEG_Y];
    positions.extend(angles.iter().map(|&a| DVec3::new(libm::cos(a), 0.0, libm::sin(a)).as_vec3()));
    let sides = 2 * count;
    let faces = (0..sides).flat_map(|i| {
        let (a, b) = (2 + i, 2 + (i + 1) % sides);
        [[0, b, a], [1, a, b]]
    });
    TriangleMesh { positions, faces: faces.collect(), ..Default::default() }
}

fn bumpy_in_soup(rng: &mut Rng) -> Vec<Shape> {
    vec![Shape::Mesh(displaced_sphere(6)), soup(&random_soup(rng, 150, 0.3))]
}

/// A closed mesh of 12·n² triangles: a cube blown up to a sphere with bumps, of radius 0.6 to 1.
pub fn displaced_sphere(n: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut places = HashMap::new();
    let mut vertex = |mesh: &mut TriangleMesh, lattice: [u32; 3]| {
        *places.entry(lattice).or_insert_with(|| {
            let p =
                DVec3::from_array(lattice.map(|c| (f64::from(c) / f64::from(n) - 0.5) * std::f64::consts::FRAC_PI_2));
            let p = DVec3::new(p.x.tan(), p.y.tan(), p.z.tan()).normalize();
            let bump =
                (11.0 * p.x).sin() * (13.0 * p.y).sin() * (9.0 * p.z).cos() + 0.2 * (57.0 * (p.x + p.y - p.z)).sin();
            mesh.positions.push((p * (0.8 + 0.16 * bump)).as_vec3());
            mesh.positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let corner = |i, j| {
                        let mut lattice = [0; 3];
                        (lattice[axis], lattice[(axis + 1) % 3], lattice[(axis + 2) % 3]) = (side, i, j);
                        lattice
                    };
                    let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]
                        .map(|lattice| vertex(&mut mesh, lattice));
                    mesh.faces.extend(if side == 0 { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] });
                }
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::oracle;
    use crate::math::ray::Ray;

    /// 2,000 rays through cavities of each mesh that has some: every one meets something.
    #[test]
    fn no_ray_through_a_cavity_gets_out() {
        for mesh in (0..MESHES.len()).map(|index| Mesh::new(index, 1)).filter(Mesh::is_closed) {
            let mut rng = Rng(2);
            for _ in 0..2000 {
                let q = mesh.cavities[rng.below(mesh.cavities.len())] + mesh.size * CAVITY * rng.in_cube();
                let ray = Ray::new(q, rng.direction());
                assert!(oracle::occluded(&mesh.shapes, &ray), "{}: {ray:?}", mesh.name);
            }
        }
    }

    #[test]
    fn meshes_fill_their_cubes_and_are_small() {
        for mesh in (0..MESHES.len()).map(|index| Mesh::new(index, 3)) {
            let (centre, size) = (mesh.centre.as_dvec3(), f64::from(mesh.size));
            let reach = mesh.triangles.iter().flatten().map(|v| (v.as_dvec3() - centre).abs().max_element() / size);
            let reach = reach.fold(0.0, f64::max);
            assert!(reach > 0.5 && reach < 3.0, "{}: {reach}", mesh.name);
            assert!(mesh.triangles.len() < 5000, "{}", mesh.name);
            assert_eq!(mesh.triangles.len(), mesh.ids.len(), "{}", mesh.name);
            let named = mesh.ids.iter().filter(|hit| hit.is_some()).count();
            assert_eq!(named == mesh.ids.len(), !["quadrics", "placed"].contains(&mesh.name), "{}", mesh.name);
        }
    }
}
