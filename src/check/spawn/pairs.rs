//! Surfaces that rays are spawned from, each with a neighbour that lies beside it like another skin.

use crate::check::random::Rng;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::ray::Ray;
use crate::shape::cylinder::Cylinder;
use crate::shape::disk::Disk;
use crate::shape::offset::SurfacePoint;
use crate::shape::placed::{Group, Placed, Placement};
use crate::shape::sphere::Sphere;
use crate::shape::{Hit, Shape, TriangleMesh};
use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// What rays are spawned from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Triangles of any form, of sizes over [`DECADES`], near the origin and up to ten million times their size from it.
    Triangle,
    /// Triangles 10 to 10⁶ times as long as wide.
    Sliver,
    /// Spheres, of radii over thirty decades.
    Sphere,
    /// Circles and ellipses.
    Disk,
    /// Cylinders: threads, rings, oblique ones.
    Cylinder,
    /// Triangles of a group that is placed by a shear, uneven scales and perhaps a mirror.
    PlacedTriangle,
    /// Spheres, disks and cylinders of such a group.
    PlacedQuadric,
}

impl Kind {
    /// All there are.
    pub const ALL: [Self; 7] = [
        Self::Triangle,
        Self::Sliver,
        Self::Sphere,
        Self::Disk,
        Self::Cylinder,
        Self::PlacedTriangle,
        Self::PlacedQuadric,
    ];

    /// One word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Triangle => "triangle",
            Self::Sliver => "sliver",
            Self::Sphere => "sphere",
            Self::Disk => "disk",
            Self::Cylinder => "cylinder",
            Self::PlacedTriangle => "placed-triangle",
            Self::PlacedQuadric => "placed-quadric",
        }
    }

    fn is_placed(self) -> bool {
        matches!(self, Self::PlacedTriangle | Self::PlacedQuadric)
    }
}

/// Sizes are ten to powers between these.
pub const DECADES: [f64; 2] = [-15.0, 15.0];

/// Decades of how far a surface is from the origin, in its sizes: at the upper end a triangle has a few bits.
const DISTANCES: [f64; 2] = [-2.0, 6.5];

/// Pairs of a mesh: each in a cell of its own of a lattice with [`ALONG`] cells along an edge.
const PAIRS: u32 = ALONG * ALONG * ALONG;
const ALONG: u32 = 3;

/// Size of a cell, in sizes of what lies in it.
const CELL: f64 = 4.0;

/// Decades of how much longer a sliver is than wide.
const SLIVERS: [f64; 2] = [1.0, 6.0];

/// Neighbours of triangles are so many times as large, so that a ray that leaves at some angle meets them.
const LARGER: f64 = 3.0;

/// Exponents of two of how far a neighbour is away, in bounds of what offsets and tests err by.
const GAPS: [f64; 2] = [0.5, 14.0];

/// A gap in which it is measured how many times as far a gap is in the scene.
const TRIAL_GAP: f64 = 1e-3;

/// Decades of the scales along the axes of what is placed.
const SCALES: [f64; 2] = [-3.0, 0.0];

/// Half axes and heights of disks and cylinders are ten to powers between these, beside others of 1.
const THIN: [f64; 2] = [-4.0, 0.0];

/// Meshes larger than the one, with coordinates less than the other, are put to Embree: of others the products of three
/// lengths that its test of triangles makes leave the numbers that f32 has. Scenes are compiled to coordinates of 1.
const EMBREE: [f64; 2] = [1e-9, 1e12];

/// A surface, and its neighbour.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// The surface.
    pub own: Hit,
    /// Its neighbour.
    pub neighbour: Hit,
    /// What makes it a skin beside the surface.
    skin: Skin,
}

/// How to get from a point of a surface to the neighbour.
#[derive(Clone, Copy, Debug)]
enum Skin {
    /// A plane: along this vector.
    Flat(DVec3),
    /// A larger or smaller one around the same centre: this factor.
    Sphere { centre: DVec3, factor: f64 },
    /// The same around an axis.
    Cylinder { cylinder: Cylinder, factor: f64 },
}

/// Some pairs, and nothing else.
#[derive(Clone, Debug)]
pub struct Pairs {
    /// What rays meet.
    pub shapes: Vec<Shape>,
    /// What they are spawned from.
    pub pairs: Vec<Pair>,
    /// About the size of each.
    pub size: f64,
    /// Whether Embree has something to say.
    pub suits_embree: bool,
}

/// Ten to a random power between these.
fn decade(rng: &mut Rng, [low, high]: [f64; 2]) -> f64 {
    libm::exp10(low + (high - low) * f64::from(rng.unit()))
}

/// Three unit vectors at right angles; half of the time those of the axes.
fn frame(rng: &mut Rng) -> [DVec3; 3] {
    let n = if rng.below(2) == 0 {
        rng.direction().as_dvec3().normalize()
    } else {
        [DVec3::X, DVec3::Y, DVec3::Z][rng.below(3)]
    };
    let (u, v) = n.any_orthonormal_pair();
    [u, v, n]
}

/// The gap, in units of what is stretched by `stretch` on its way to the scene, that is seen there as a random number of
/// bounds of the error.
fn gap(rng: &mut Rng, bound: f64, stretch: f64) -> f64 {
    let [low, high] = GAPS.map(|g| g as f32);
    bound * rng.power(low, high) / stretch
}

impl Pairs {
    /// The mesh of this kind with this number. `None` where numbers have no room for it: a triangle may vanish far away.
    pub fn new(kind: Kind, seed: u64, index: u64) -> Option<Self> {
        let rng = &mut Rng::of(seed, &[kind as u64, index]);
        match kind {
            Kind::Triangle | Kind::Sliver => triangles(rng, kind),
            Kind::Sphere => quadric(rng, sphere),
            Kind::Disk => quadric(rng, disk),
            Kind::Cylinder => quadric(rng, cylinder),
            Kind::PlacedTriangle => placed(rng, |rng| Some(flat_pair(rng, Kind::Triangle, DVec3::ZERO, 0.25))),
            Kind::PlacedQuadric => {
                let make = [sphere, disk, cylinder][rng.below(3)];
                placed(rng, |rng| make(rng, DVec3::ZERO, 0.25))
            }
        }
        .map(|pairs| Self { suits_embree: pairs.suits_embree && !kind.is_placed(), ..pairs })
    }

    /// A random point of a pair's surface, as the renderer finds it: where a ray meets it.
    pub fn start(&self, rng: &mut Rng, pair: &Pair) -> SurfacePoint {
        let shape = &self.shapes[pair.own.shape as usize];
        let target = on_surface(rng, shape, pair.own.primitive);
        let from = target + decade(rng, [-1.0, 2.0]) * self.size * rng.direction().as_dvec3();
        let ray = Ray::new(from.as_vec3(), (target - from).as_vec3());
        shape.meet(&ray, pair.own.primitive).point
    }

    /// How far the neighbour is from a point of the surface, along its normal, and on which side: positive in front.
    pub fn height(&self, pair: &Pair, at: &SurfacePoint) -> f64 {
        at.n.as_dvec3().normalize().dot(self.beside(pair, at.p) - at.p)
    }

    /// The point of the neighbour that is beside the point `p` of a surface.
    fn beside(&self, pair: &Pair, p: DVec3) -> DVec3 {
        match &self.shapes[pair.own.shape as usize] {
            Shape::Placed(placed) => {
                let q = placed.placement.to_group().transform_point3(p);
                placed.placement.point_to_scene(pair.skin.beside(q))
            }
            _ => pair.skin.beside(p),
        }
    }

    /// By how much an offset and the tests of surface and neighbour may be off from a point, along its normal, together.
    pub fn bound(&self, pair: &Pair, at: &SurfacePoint) -> f64 {
        let rounding = f64::from(UNIT_ROUNDOFF) * at.n.abs().as_dvec3().dot(at.p.abs());
        // The offset, the rounding of the origin, and that of the neighbour's vertices.
        4.0 * rounding + f64::from(at.slack) + self.slack(pair.neighbour, at)
    }

    /// What tests may displace the neighbour by.
    fn slack(&self, hit: Hit, at: &SurfacePoint) -> f64 {
        match &self.shapes[hit.shape as usize] {
            Shape::Mesh(mesh) => f64::from(mesh.plane(hit.primitive).slack),
            // Quadrics are met in f64, and maps err the same beside a surface.
            _ => f64::from(at.slack),
        }
    }

    /// The segment from a point of the neighbour, as if that were the surface.
    pub fn end(&self, rng: &mut Rng, pair: &Pair) -> SurfacePoint {
        self.start(rng, &Pair { own: pair.neighbour, ..*pair })
    }

    /// How a direction `w` from the point `at` of a curved surface stands to it, exactly. `None` of a flat one.
    pub fn departure(&self, pair: &Pair, at: &SurfacePoint, w: DVec3) -> Option<Departure> {
        let map = match &self.shapes[pair.own.shape as usize] {
            Shape::Placed(placed) => *placed.placement.to_group(),
            _ => DAffine3::IDENTITY,
        };
        let p = map.transform_point3(at.p);
        // Both in the space in which the surface is the unit sphere, or the unit circle along an axis.
        let local = |d: DVec3| {
            let d = map.matrix3 * d;
            match pair.skin {
                Skin::Flat(_) => None,
                Skin::Sphere { centre, .. } => Some((p - centre, d)),
                Skin::Cylinder { cylinder, .. } => {
                    let f = cylinder.project(p);
                    // As a difference of points that are far apart, so that no digits are lost where they are far away.
                    let d = (cylinder.project(p + d * self.size) - f) / self.size;
                    Some((f.extend(0.0), d.extend(0.0)))
                }
            }
        };
        let product = |d: DVec3| local(d).map_or(0.0, |(f, d)| f.dot(d));
        let (f, d) = local(w)?;
        let outward = DVec3::new(product(DVec3::X), product(DVec3::Y), product(DVec3::Z)).normalize();
        let skew = frobenius(map.matrix3) * frobenius(map.matrix3.inverse());
        Some(Departure { chord: -2.0 * f.dot(d) / d.length_squared(), outward, skew })
    }
}

/// How a direction from a point of a curved surface stands to it.
#[derive(Clone, Copy, Debug)]
pub struct Departure {
    /// Where it meets the surface again, in its lengths; not positive where it leads outside.
    pub chord: f64,
    /// The unit normal of the outside there.
    pub outward: DVec3,
    /// By how much the map to the scene changes angles, at most.
    pub skew: f64,
}

fn frobenius(m: DMat3) -> f64 {
    m.to_cols_array().into_iter().map(|c| c * c).sum::<f64>().sqrt()
}

impl Skin {
    fn beside(self, p: DVec3) -> DVec3 {
        match self {
            Self::Flat(along) => p + along,
            Self::Sphere { centre, factor } => centre + (p - centre) * factor,
            Self::Cylinder { cylinder, factor } => {
                let xy = cylinder.project(p);
                let at = |xy: DVec2| cylinder.point(xy, 0.0).point.p;
                let axis = 0.5 * (at(DVec2::X) + at(DVec2::NEG_X));
                p + (at(xy) - axis) * (factor - 1.0)
            }
        }
    }
}

/// A random point on a surface, in the scene, but for rounding.
fn on_surface(rng: &mut Rng, shape: &Shape, primitive: u32) -> DVec3 {
    let (y, x) = libm::sincos(TAU * f64::from(rng.unit()));
    match shape {
        Shape::Mesh(mesh) => {
            let [a, b, c] = mesh.triangle(primitive).map(Vec3::as_dvec3);
            let (mut s, mut t) = (f64::from(rng.unit()), f64::from(rng.unit()));
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            a + s * (b - a) + t * (c - a)
        }
        Shape::Sphere(sphere) => sphere.point(rng.direction().as_dvec3()).point.p,
        Shape::Disk(disk) => disk.point(f64::from(rng.unit()).sqrt() * DVec2::new(x, y)).point.p,
        Shape::Cylinder(cylinder) => cylinder.point(DVec2::new(x, y), f64::from(rng.unit())).point.p,
        Shape::Placed(placed) => placed.placement.point_to_scene(on_surface(rng, placed.shape(), primitive)),
    }
}

/// Two shapes of which the second is a skin beside the first, as a function of the gap.
type Make = Box<dyn Fn(f64) -> Option<(Shape, Shape, Skin)>>;

/// A mesh of triangles, in the cells of a lattice.
fn triangles(rng: &mut Rng, kind: Kind) -> Option<Pairs> {
    let size = decade(rng, DECADES);
    let centre = size * decade(rng, DISTANCES) * rng.direction().as_dvec3();
    let mut mesh = TriangleMesh::default();
    let mut pairs = Vec::new();
    for cell in 0..PAIRS {
        let place = [cell % ALONG, cell / ALONG % ALONG, cell / (ALONG * ALONG)].map(f64::from);
        let make = flat_pair(rng, kind, centre + CELL * size * DVec3::from_array(place), 0.5 * size);
        let Some((own, neighbour, skin)) = fitted(rng, &make, None) else { continue };
        let hit = |primitive| Hit { shape: 0, primitive };
        let first = mesh.faces.len() as u32;
        pairs.push(Pair { own: hit(first), neighbour: hit(first + 1), skin });
        for shape in [own, neighbour] {
            let Shape::Mesh(one) = shape else { continue };
            let base = mesh.positions.len() as u32;
            mesh.faces.push([base, base + 1, base + 2]);
            mesh.positions.extend(one.positions);
        }
    }
    let reach = mesh.positions.iter().map(|p| f64::from(p.abs().max_element())).fold(0.0, f64::max);
    let suits_embree = size > EMBREE[0] && reach < EMBREE[1];
    (!pairs.is_empty()).then(|| Pairs { shapes: vec![Shape::Mesh(mesh)], pairs, size, suits_embree })
}

/// A triangle around `centre` of about this size, and a larger one beside it.
fn flat_pair(rng: &mut Rng, kind: Kind, centre: DVec3, size: f64) -> Make {
    let [u, v, n] = frame(rng);
    let thin = if kind == Kind::Sliver { 1.0 / decade(rng, SLIVERS) } else { decade(rng, [-1.0, 0.0]) };
    let mut corner = || size * (f64::from(rng.between(-1.0, 1.0)) * u + thin * f64::from(rng.between(-1.0, 1.0)) * v);
    let corners = [corner(), corner(), corner()];
    let side = f64::from(rng.sign());
    Box::new(move |gap: f64| {
        // The neighbour lies beside the triangle as it is rounded.
        let own = corners.map(|c| (centre + c).as_vec3());
        let [a, b, c] = own.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a);
        if !(normal.length() > 0.0) {
            return None;
        }
        let normal = if normal.is_finite() { normal.normalize() } else { n };
        let middle = (a + b + c) / 3.0;
        let other = [a, b, c].map(|p| (middle + LARGER * (p - middle) + side * gap * normal).as_vec3());
        Some((triangle(own), triangle(other), Skin::Flat(side * gap * normal)))
    })
}

fn triangle(positions: [Vec3; 3]) -> Shape {
    Shape::Mesh(TriangleMesh { positions: positions.to_vec(), faces: vec![[0, 1, 2]], ..TriangleMesh::default() })
}

/// A pair with a gap that suits it, placed if so asked.
fn fitted(rng: &mut Rng, make: &Make, placement: Option<&Arc<Placement>>) -> Option<(Shape, Shape, Skin)> {
    let assemble = |made: (Shape, Shape, Skin)| {
        let (own, neighbour, skin) = made;
        let shapes = match placement {
            None => vec![own, neighbour],
            Some(placement) => place(vec![own, neighbour], placement),
        };
        let hit = |shape| Hit { shape, primitive: 0 };
        let pair = Pair { own: hit(0), neighbour: hit(1), skin };
        (Pairs { shapes, pairs: vec![pair], size: 1.0, suits_embree: false }, pair)
    };
    let (first, _, _) = make(0.0)?;
    let size = f64::from({
        let bounds = first.primitive_bounds(0);
        (bounds.max - bounds.min).max_element()
    });
    let trial = TRIAL_GAP * size;
    let (pairs, pair) = assemble(make(trial)?);
    let at = {
        let target = on_surface(rng, &pairs.shapes[0], 0);
        let from = target + size * rng.direction().as_dvec3();
        pairs.shapes[0].meet(&Ray::new(from.as_vec3(), (target - from).as_vec3()), 0).point
    };
    let stretch = pairs.height(&pair, &at).abs() / trial;
    if !(stretch > 0.0 && stretch.is_finite()) {
        return None;
    }
    let gap = gap(rng, pairs.bound(&pair, &at), stretch);
    make(gap.min(0.25 * size))
}

/// What is placed, as shapes of the scene.
fn place(shapes: Vec<Shape>, placement: &Arc<Placement>) -> Vec<Shape> {
    let count = shapes.len() as u32;
    let group = Arc::new(Group::new(shapes));
    let member = |index| Shape::Placed(Placed { group: group.clone(), index, placement: placement.clone() });
    (0..count).map(member).collect()
}

/// One pair of quadrics.
fn quadric(rng: &mut Rng, make: fn(&mut Rng, DVec3, f64) -> Option<Make>) -> Option<Pairs> {
    let size = decade(rng, DECADES);
    let centre = size * decade(rng, DISTANCES) * rng.direction().as_dvec3();
    let make = make(rng, centre, size)?;
    let (own, neighbour, skin) = fitted(rng, &make, None)?;
    let hit = |shape| Hit { shape, primitive: 0 };
    let pair = Pair { own: hit(0), neighbour: hit(1), skin };
    Some(Pairs { shapes: vec![own, neighbour], pairs: vec![pair], size, suits_embree: false })
}

fn sphere(rng: &mut Rng, centre: DVec3, size: f64) -> Option<Make> {
    let (centre, radius) = (centre.as_vec3(), size as f32);
    let (side, flip) = (f64::from(rng.sign()), rng.below(2) == 0);
    Some(Box::new(move |gap| {
        let other = (f64::from(radius) + side * gap) as f32;
        let factor = f64::from(other) / f64::from(radius);
        let sphere = |radius| Shape::Sphere(Sphere { centre, radius, flip });
        let skin = Skin::Sphere { centre: centre.as_dvec3(), factor };
        (other > 0.0 && radius > 0.0).then(|| (sphere(radius), sphere(other), skin))
    }))
}

fn disk(rng: &mut Rng, centre: DVec3, size: f64) -> Option<Make> {
    let [u, v, n] = frame(rng);
    let thin = if rng.below(2) == 0 { 1.0 } else { decade(rng, THIN) };
    let oblique = f64::from(rng.between(-0.5, 0.5));
    let (u, v, side) = (size * u, size * thin * (v + oblique * u), f64::from(rng.sign()));
    Some(Box::new(move |gap| {
        let along = side * gap * n;
        let own = Disk::new(centre, u, v, n)?;
        let other = Disk::new(centre + along, LARGER * u, LARGER * v, n)?;
        Some((Shape::Disk(own), Shape::Disk(other), Skin::Flat(along)))
    }))
}

fn cylinder(rng: &mut Rng, centre: DVec3, size: f64) -> Option<Make> {
    let [u, v, n] = frame(rng);
    let thin = [decade(rng, THIN), 1.0];
    let [across, along] = if rng.below(2) == 0 { thin } else { [thin[1], thin[0]] };
    let oblique = if rng.below(2) == 0 { 0.0 } else { f64::from(rng.between(-0.5, 0.5)) };
    let axes = [size * across * u, size * across * (v + oblique * u), size * along * (n + oblique * v)];
    let (side, flip) = (f64::from(rng.sign()), rng.below(2) == 0);
    Some(Box::new(move |gap| {
        let factor = 1.0 + side * gap / (size * across);
        let own = Cylinder::new(centre, axes, flip)?;
        let [u, v, h] = axes;
        // Longer at both ends, so that an oblique way out is met.
        let other = Cylinder::new(centre - h, [factor * u, factor * v, LARGER * h], flip)?;
        (factor > 0.5).then_some((
            Shape::Cylinder(own),
            Shape::Cylinder(other),
            Skin::Cylinder { cylinder: own, factor },
        ))
    }))
}

/// One pair of a group that is placed by scales along axes that are askew, a shear and perhaps a mirror.
fn placed(rng: &mut Rng, make: impl Fn(&mut Rng) -> Option<Make>) -> Option<Pairs> {
    let axes = DMat3::from_cols_array_2d(&frame(rng).map(|axis| axis.to_array()));
    let scales = DVec3::from_array([0; 3].map(|_| decade(rng, SCALES) * f64::from(rng.sign())));
    let [a, b] = [0; 2].map(|_| f64::from(rng.between(-1.0, 1.0)));
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(a, 1.0, 0.0), DVec3::new(0.0, b, 1.0));
    let map = 0.25 * (shear * axes * DMat3::from_diagonal(scales));
    let at = (0.5 * rng.in_cube()).as_dvec3();
    let placement = Arc::new(Placement::new(DAffine3 { matrix3: map, translation: at })?);
    let make = make(rng)?;
    let (own, neighbour, skin) = fitted(rng, &make, Some(&placement))?;
    let hit = |shape| Hit { shape, primitive: 0 };
    let pair = Pair { own: hit(0), neighbour: hit(1), skin };
    Some(Pairs { shapes: place(vec![own, neighbour], &placement), pairs: vec![pair], size: 0.25, suits_embree: false })
}
