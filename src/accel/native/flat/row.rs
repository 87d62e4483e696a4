//! The rows of a flat list: triangles and parallelograms as affine functions of a point.

use super::super::item::Item;
use crate::accel::Hit;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::ray::Ray;
use crate::shape::Shape;
use crate::shape::triangle::WatertightRay;
use glam::{DVec3, Vec3};

/// A row is refused if its triangle has a height below this fraction of the list's size: too much of it would be in
/// doubt, and settling that takes longer than a tree.
const LEAST_HEIGHT: f64 = 1.0 / 256.0;

/// How far, in unit roundoffs, the functions of two triangles may differ for the two to pass for a parallelogram: enough
/// for corners that were rounded to f32 where the sides are longer than an eighth of the list's size.
pub(super) const PAIR_ROUNDINGS: f64 = 16.0;

/// The row of no triangle.
pub(super) const NO_ROW: u32 = u32::MAX;

/// A triangle v₀v₁v₂, or the parallelogram of it and v₃v₂v₁, as the test in f32 reads it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Row {
    /// N: its gradient, and its value at the origin of the space.
    pub(super) n: [f32; 4],
    /// B₁ and B₂ likewise.
    pub(super) b: [[f32; 4]; 2],
    /// s, which is B₀ + B₁ + B₂ everywhere.
    pub(super) scale: f32,
}

/// A triangle, as the exact tests read it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    vertices: [Vec3; 3],
    /// The plane n·x = c; n is not normalised, and points to no side in particular.
    n: DVec3,
    c: f64,
    pub(super) id: Hit,
}

/// All triangles, in rows.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// Parallelograms, then triangles.
    pub(super) rows: Vec<Row>,
    /// How many are parallelograms.
    pub(super) pairs: usize,
    /// The first triangle of each row, and the second; of a triangle's own row, both are the same.
    pub(super) triangles: Vec<[Triangle; 2]>,
    /// Where the triangles of each shape start in `row_of`; [`NO_ROW`] for a shape that has none.
    first: Vec<u32>,
    /// The row of each triangle, if no ray that starts on it meets it: [`NO_ROW`] for those of a parallelogram that is
    /// not quite plane.
    row_of: Vec<u32>,
}

/// An affine function of a point.
#[derive(Clone, Copy, Debug)]
struct Affine {
    gradient: DVec3,
    /// Its value at the origin of the space.
    zero: f64,
}

/// N, B₁ and B₂ of a triangle, and s.
#[derive(Clone, Copy, Debug)]
struct Functions {
    n: Affine,
    b: [Affine; 2],
    scale: f64,
}

impl Affine {
    /// With this gradient, and zero at `x`.
    fn through(gradient: DVec3, x: DVec3) -> Self {
        Self { gradient, zero: -gradient.dot(x) }
    }

    fn at(&self, x: DVec3) -> f64 {
        self.gradient.dot(x) + self.zero
    }

    fn rounded(&self) -> [f32; 4] {
        let [x, y, z] = self.gradient.as_vec3().to_array();
        [x, y, z, self.zero as f32]
    }

    /// How far apart two functions are, in unit roundoffs: the most by which their gradients change along a vector whose
    /// components are at most 1, or their values at `x` in units of `reach`.
    fn distance(&self, other: &Self, x: DVec3, reach: f64) -> f64 {
        let gradient = (self.gradient - other.gradient).abs().element_sum();
        gradient.max((self.at(x) - other.at(x)).abs() / reach) / f64::from(UNIT_ROUNDOFF)
    }
}

impl Functions {
    /// `None` for a triangle without area.
    fn new([v0, v1, v2]: [DVec3; 3]) -> Option<Self> {
        let (e1, e2) = (v1 - v0, v2 - v0);
        let n = e1.cross(e2);
        let area = n.length();
        let scale = area / e1.length().max(e2.length()).max((v2 - v1).length());
        if !(scale > 0.0) {
            return None;
        }
        let n = n / area;
        let b = [Affine::through(e2.cross(n) * (scale / area), v0), Affine::through(n.cross(e1) * (scale / area), v0)];
        Some(Self { n: Affine::through(n, v0), b, scale })
    }

    /// Whether the triangle v₃v₂v₁ has the same functions but for [`PAIR_ROUNDINGS`].
    fn fit([v3, v2, v1]: [DVec3; 3], to: &Self, reach: f64) -> bool {
        let Some(other) = Self::new([v3, v2, v1]) else { return false };
        // Its own barycentric coordinates are 1 − b₁ at v₂ and 1 − b₂ at v₁.
        let mirrored = |b: &Affine| {
            let k = to.scale / other.scale;
            Affine { gradient: -k * b.gradient, zero: to.scale - k * b.zero }
        };
        let apart = [
            to.n.distance(&other.n, v1, reach),
            to.b[0].distance(&mirrored(&other.b[0]), v1, reach),
            to.b[1].distance(&mirrored(&other.b[1]), v1, reach),
        ];
        apart.iter().all(|&d| d <= PAIR_ROUNDINGS)
    }

    fn rounded(&self) -> Row {
        Row { n: self.n.rounded(), b: [self.b[0].rounded(), self.b[1].rounded()], scale: self.scale as f32 }
    }
}

impl Triangle {
    fn new(shapes: &[Shape], id: Hit) -> Self {
        let Shape::Mesh(mesh) = &shapes[id.shape as usize] else {
            unreachable!("a list of triangles is built from meshes");
        };
        let vertices = mesh.triangle(id.primitive);
        let [a, b, c] = vertices.map(Vec3::as_dvec3);
        let n = (b - a).cross(c - a);
        Self { vertices, n, c: n.dot(a), id }
    }

    /// Its vertices, from the `first` on, in their order.
    fn from(&self, first: usize) -> [Vec3; 3] {
        let v = self.vertices;
        [v[first], v[(first + 1) % 3], v[(first + 2) % 3]]
    }

    /// The distance at which a ray that crosses its inside meets it, if it does in its interval.
    #[inline]
    pub(super) fn plane_distance(&self, ray: &Ray) -> Option<f32> {
        let t = (self.c - self.n.dot(ray.o.as_dvec3())) / self.n.dot(ray.d.as_dvec3());
        ray.contains(t).then_some(t as f32)
    }

    /// The distance at which any ray meets it.
    #[cold]
    pub(super) fn distance(&self, ray: &Ray) -> Option<f32> {
        let [a, b, c] = self.vertices;
        WatertightRay::new(ray).intersect(a, b, c)
    }
}

impl Rows {
    /// Of all `items`, whose largest coordinate is `reach` and whose box is `size` long; `None` if one is too thin.
    pub(super) fn new(items: &[Item], shapes: &[Shape], reach: f32, size: f32) -> Option<Self> {
        let mut left: Vec<_> = items.iter().map(|item| Triangle::new(shapes, item.id())).collect();
        let (mut pairs, mut singles) = (Vec::new(), Vec::new());
        while !left.is_empty() {
            let first = left.remove(0);
            let partner = (0..left.len()).find_map(|i| pair(&first, &left[i], f64::from(reach)).map(|f| (i, f)));
            if let Some((i, functions)) = partner {
                pairs.push((functions, [first, left.remove(i)]));
            } else {
                singles.push((Functions::new(first.vertices.map(Vec3::as_dvec3))?, [first; 2]));
            }
        }
        let mut rows = Self { pairs: pairs.len(), ..Self::default() };
        for (functions, triangles) in pairs.into_iter().chain(singles) {
            if functions.scale < f64::from(size) * LEAST_HEIGHT {
                return None;
            }
            rows.rows.push(functions.rounded());
            rows.triangles.push(triangles);
        }
        rows.number(items, shapes.len());
        Some(rows)
    }

    /// Fills `first` and `row_of`.
    fn number(&mut self, items: &[Item], shapes: usize) {
        let count = |shape: usize| items.iter().filter(|item| item.id().shape as usize == shape).count() as u32;
        self.first = (0..shapes)
            .scan(0, |next, shape| {
                let (first, triangles) = (*next, count(shape));
                *next += triangles;
                Some(if triangles == 0 { NO_ROW } else { first })
            })
            .collect();
        self.row_of = vec![NO_ROW; items.len()];
        for (row, pair) in (0..).zip(&self.triangles) {
            if row as usize >= self.pairs || is_plane(pair) {
                for triangle in pair {
                    self.row_of[(self.first[triangle.id.shape as usize] + triangle.id.primitive) as usize] = row;
                }
            }
        }
    }

    /// The row that no ray meets that starts on this primitive; [`NO_ROW`] where that is unknown.
    #[inline]
    pub(super) fn of(&self, id: Hit) -> u32 {
        let first = self.first.get(id.shape as usize).copied().unwrap_or(NO_ROW);
        self.row_of.get(first.saturating_add(id.primitive) as usize).copied().unwrap_or(NO_ROW)
    }
}

/// Whether two triangles lie in one plane, exactly: they do if v₀ + v₃ = v₁ + v₂, and f64 adds f32 numbers of similar
/// size without rounding.
fn is_plane([a, b]: &[Triangle; 2]) -> bool {
    let shared = |v: &Vec3| b.vertices.contains(v);
    let sum = |t: &Triangle| t.vertices.iter().map(|v| v.as_dvec3()).sum::<DVec3>();
    let diagonal: DVec3 = a.vertices.iter().filter(|v| shared(v)).map(|v| v.as_dvec3()).sum();
    sum(a) + sum(b) == 3.0 * diagonal
}

/// The functions of the parallelogram that two triangles make, if they do: v₀ is the corner that only `a` has.
fn pair(a: &Triangle, b: &Triangle, reach: f64) -> Option<Functions> {
    for i in 0..3 {
        for k in 0..3 {
            let ([v0, v1, v2], [v3, w2, w1]) = (a.from(i), b.from(k));
            // The other way round the two would turn different sides to the ray: no harm, but never so in a plain mesh.
            if v1 == w1 && v2 == w2 {
                let functions = Functions::new([v0, v1, v2].map(Vec3::as_dvec3))?;
                return Functions::fit([v3, v2, v1].map(Vec3::as_dvec3), &functions, reach).then_some(functions);
            }
        }
    }
    None
}
