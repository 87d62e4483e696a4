//! Surfaces that emit the same radiance from every point of their front side, in every direction of that side.

use super::cap::Cap;
use super::circle::Circle;
use super::quad::{FoundOnQuad, Quad, Receivers};
use super::triangles::Triangles;
use super::{End, LightSample};
use crate::sampling::distribution::Discrete;
use crate::sampling::pdf::{AreaPdf, SolidAnglePdf};
use crate::sampling::warp;
use crate::shape::cylinder::Cylinder;
use crate::shape::offset::SurfacePoint;
use crate::shape::sphere::Sphere;
use crate::shape::{Hit, Shape, TriangleMesh};
use crate::spectrum::Rgb;
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A shape that emits.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// Which shape.
    pub shape: u32,
    /// Radiance of its front side in W·sr⁻¹·m⁻².
    pub radiance: Rgb,
    /// Density of a uniform point of its surface (which points of a cylinder are not).
    pdf: AreaPdf,
    /// How points of it are found.
    points: Points,
}

/// How points of a shape are found.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "they are read at every vertex")]
enum Points {
    /// A quadric knows.
    Quadric,
    /// A disk that is seen as a circle.
    Circle(Circle),
    /// Two triangles as what they are together.
    Quad(Quad),
    /// A few triangles.
    Few(Triangles),
    /// Triangles in proportion to their areas.
    Many(Discrete),
}

impl AreaLight {
    /// `shape` is the index of `surface`. `None` where the surface has no area.
    pub fn new(shape: u32, surface: &Shape, radiance: Rgb) -> Option<Self> {
        let points = match surface {
            Shape::Mesh(mesh) => match (Quad::of(mesh), Triangles::of(mesh)) {
                (Some(quad), _) => Points::Quad(quad),
                (None, Some(few)) => Points::Few(few),
                (None, None) => Points::Many(Discrete::new(mesh.areas())?),
            },
            Shape::Disk(disk) => Circle::of(disk).map_or(Points::Quadric, Points::Circle),
            _ => Points::Quadric,
        };
        let pdf = AreaPdf((1.0 / surface.area()) as f32);
        pdf.0.is_finite().then_some(Self { shape, radiance, pdf, points })
    }

    /// `n`: see [`super::Receiver`].
    #[inline(always)]
    pub(super) fn sample(&self, surface: &Shape, p: DVec3, n: Vec3, u: Vec2) -> Option<LightSample> {
        match (surface, &self.points) {
            (_, Points::Quad(quad)) => {
                let mut receiver = Receivers::<1>::default();
                receiver.put(0, p, n, u);
                self.found(quad, &quad.sample(&receiver), 0)
            }
            (Shape::Mesh(mesh), Points::Few(few)) => self.sample_few(mesh, few, &p, u),
            (Shape::Mesh(mesh), Points::Many(triangles)) => {
                let (face, x) = triangles.sample(u.x);
                let b = warp::square_to_triangle(Vec2::new(x, u.y));
                let end = mesh.point(face as u32, b.as_dvec3().to_array()).point;
                self.towards(p, self.pdf, end, face as u32)
            }
            (Shape::Sphere(sphere), _) => self.sample_sphere(sphere, &p, u),
            (quadric, _) => self.sample_quadric(quadric, &p, u),
        }
    }

    /// What it is if it is a quad.
    #[inline]
    pub fn quad(&self) -> Option<&Quad> {
        if let Points::Quad(quad) = &self.points { Some(quad) } else { None }
    }

    /// What the receiver in this lane has found, which asked for a point of `quad`, what this is.
    #[inline(always)]
    pub fn found<const L: usize>(&self, quad: &Quad, found: &FoundOnQuad<L>, lane: usize) -> Option<LightSample> {
        let pdf = found.pdf[lane];
        // A density beyond all numbers belongs to a light too small and near to be told from a point.
        (pdf > 0.0 && pdf.is_finite() && !self.radiance.is_black()).then(|| {
            let (face, end) = quad.point(found, lane);
            LightSample {
                wi: Vec3::new(found.wi[0][lane], found.wi[1][lane], found.wi[2][lane]),
                radiance: self.radiance,
                pdf: Some(SolidAnglePdf(pdf)),
                end: Some(End::Point(end)),
                on: Hit { shape: self.shape, primitive: face },
            }
        })
    }

    #[inline(never)]
    fn sample_few(&self, mesh: &TriangleMesh, few: &Triangles, p: &DVec3, u: Vec2) -> Option<LightSample> {
        let (face, end, pdf) = few.sample(mesh, p, u);
        self.towards_by(*p, |d2, cos| pdf.to_solid_angle(d2, cos), end, face)
    }

    #[inline(never)]
    pub(super) fn sample_quadric(&self, surface: &Shape, &p: &DVec3, u: Vec2) -> Option<LightSample> {
        match surface {
            Shape::Mesh(_) | Shape::Placed(_) => unreachable!("a mesh is no quadric, and what is placed is no light"),
            Shape::Sphere(sphere) => self.sample_sphere(sphere, &p, u),
            Shape::Disk(disk) => match &self.points {
                Points::Circle(circle) => {
                    let (end, pdf) = circle.sample(disk, p, u);
                    self.towards_by(p, |d2, cos| pdf.to_solid_angle(d2, cos), end, 0)
                }
                _ => self.towards(p, self.pdf, disk.point(warp::square_to_disk(u).as_dvec2()).point, 0),
            },
            Shape::Cylinder(cylinder) => {
                let arc = Arc::of(cylinder, p);
                let xy = arc.point(u.x);
                self.towards(p, arc.pdf(cylinder, xy), cylinder.point(xy, f64::from(u.y)).point, 0)
            }
        }
    }

    /// Density with which [`super::Light::sample`] finds the direction from `p` to the point `end` of this light, with the
    /// same `n`.
    #[inline(always)]
    pub fn pdf(&self, surface: &Shape, p: DVec3, n: Vec3, end: &SurfacePoint) -> SolidAnglePdf {
        match (surface, &self.points) {
            (Shape::Mesh(_), Points::Quad(quad)) => {
                let pdf = quad.pdf(p, n, end.p);
                Self::per_solid_angle(p, |d2, cos| pdf.to_solid_angle(d2, cos), end)
            }
            (Shape::Mesh(_), Points::Few(few)) => {
                let pdf = few.pdf(&p);
                Self::per_solid_angle(p, |d2, cos| pdf.to_solid_angle(d2, cos), end)
            }
            (Shape::Mesh(_) | Shape::Placed(_), _) => Self::seen_from(p, self.pdf, end),
            (Shape::Sphere(_) | Shape::Disk(_) | Shape::Cylinder(_), _) => self.quadric_pdf(surface, &p, &{ *end }),
        }
    }

    #[inline(never)]
    fn quadric_pdf(&self, surface: &Shape, &p: &DVec3, end: &SurfacePoint) -> SolidAnglePdf {
        match surface {
            Shape::Mesh(_) | Shape::Placed(_) => Self::seen_from(p, self.pdf, end),
            Shape::Disk(_) => match &self.points {
                Points::Circle(circle) => {
                    let pdf = circle.pdf(p, end.p);
                    Self::per_solid_angle(p, |d2, cos| pdf.to_solid_angle(d2, cos), end)
                }
                _ => Self::seen_from(p, self.pdf, end),
            },
            Shape::Sphere(sphere) => match Cap::of(sphere, p) {
                Some(cap) => cap.pdf(),
                None => Self::seen_from(p, self.pdf, end),
            },
            Shape::Cylinder(cylinder) => {
                let pdf = Arc::of(cylinder, p).pdf(cylinder, cylinder.project(end.p).normalize());
                Self::seen_from(p, pdf, end)
            }
        }
    }

    /// A point of a quadric, anywhere on it, and the density of that.
    pub(super) fn quadric_point(&self, surface: &Shape, u: Vec2) -> (AreaPdf, SurfacePoint) {
        match surface {
            Shape::Mesh(_) | Shape::Placed(_) => unreachable!("a mesh is no quadric, and what is placed is no light"),
            Shape::Sphere(sphere) => (self.pdf, sphere.point(warp::square_to_uniform_sphere(u).as_dvec3()).point),
            Shape::Disk(disk) => (self.pdf, disk.point(warp::square_to_disk(u).as_dvec2()).point),
            Shape::Cylinder(cylinder) => {
                let xy = Arc::ALL.point(u.x);
                (Arc::ALL.pdf(cylinder, xy), cylinder.point(xy, f64::from(u.y)).point)
            }
        }
    }

    /// Density of a uniform point of its surface (which points of a cylinder are not).
    pub(super) fn uniform_pdf(&self) -> AreaPdf {
        self.pdf
    }

    /// A density of points of the light, as one of directions from `p`.
    #[inline(always)]
    pub(super) fn seen_from(p: DVec3, pdf: AreaPdf, end: &SurfacePoint) -> SolidAnglePdf {
        Self::per_solid_angle(p, |d2, cos| pdf.to_solid_angle(d2, cos), end)
    }

    /// A density of directions from `p` that is a function of the squared distance and the cosine at the light.
    #[inline(always)]
    fn per_solid_angle(p: DVec3, pdf: impl Fn(f32, f32) -> SolidAnglePdf, end: &SurfacePoint) -> SolidAnglePdf {
        // The difference is what needs f64; its length does not.
        let to = (end.p - p).as_vec3();
        let distance_squared = to.length_squared();
        pdf(distance_squared, to.dot(end.n) / distance_squared.sqrt())
    }

    /// Radiance that leaves the surface point with normal `n` in direction `w`.
    #[inline]
    pub fn emitted(&self, n: Vec3, w: Vec3) -> Rgb {
        if n.dot(w) > 0.0 { self.radiance } else { Rgb::BLACK }
    }

    /// The sample that leads from `p` to a point of this primitive of the surface that was found with this density.
    #[inline(always)]
    pub(super) fn towards(&self, p: DVec3, pdf: AreaPdf, end: SurfacePoint, primitive: u32) -> Option<LightSample> {
        self.towards_by(p, |d2, cos| pdf.to_solid_angle(d2, cos), end, primitive)
    }

    /// The same with a density of directions that is a function of the squared distance and the cosine at the light.
    #[inline(always)]
    fn towards_by(
        &self,
        p: DVec3,
        pdf: impl Fn(f32, f32) -> SolidAnglePdf,
        end: SurfacePoint,
        primitive: u32,
    ) -> Option<LightSample> {
        let to = (end.p - p).as_vec3();
        let distance_squared = to.length_squared();
        let distance = distance_squared.sqrt();
        let wi = to / distance;
        // As in `pdf`: a grazing cosine is all rounding, but the same rounding.
        let pdf = pdf(distance_squared, to.dot(end.n) / distance);
        let radiance = self.emitted(end.n, -wi);
        // Seen from behind or edge-on, or p on the surface itself (where wi is NaN).
        // A density beyond all numbers belongs to a light too small and near to be told from a point.
        (pdf.0 > 0.0 && pdf.0.is_finite() && !radiance.is_black()).then_some(LightSample {
            wi,
            radiance,
            pdf: Some(pdf),
            end: Some(End::Point(end)),
            on: Hit { shape: self.shape, primitive },
        })
    }

    /// A direction in which `p` sees the sphere. Where that meets it is nobody's business unless it is asked for.
    #[inline(never)]
    fn sample_sphere(&self, sphere: &Sphere, &p: &DVec3, u: Vec2) -> Option<LightSample> {
        let Some(cap) = Cap::of(sphere, p) else {
            return self.towards(p, self.pdf, sphere.point(warp::square_to_uniform_sphere(u).as_dvec3()).point, 0);
        };
        let pdf = cap.pdf();
        (pdf.0.is_finite() && !self.radiance.is_black()).then(|| LightSample {
            wi: cap.direction(u),
            radiance: self.radiance,
            pdf: Some(pdf),
            end: Some(End::Sphere(*sphere)),
            on: Hit { shape: self.shape, primitive: 0 },
        })
    }
}

/// The part of a cylinder whose front a point can see, as seen along the axis: an interval of angles.
pub(super) struct Arc {
    /// The angle in its middle.
    middle: f64,
    /// From there to either end.
    half: f64,
}

impl Arc {
    /// All around.
    pub(super) const ALL: Self = Self { middle: 0.0, half: PI };

    /// A point outside at ρ radii from the axis sees the outside of an endless cylinder within ±acos(1/ρ) of its own
    /// angle (affine maps keep this, so ρ is taken where the cross section is the unit circle). Where the front is the
    /// inside, or the point is, all of it.
    #[inline]
    fn of(cylinder: &Cylinder, p: DVec3) -> Self {
        let xy = cylinder.project(p);
        // tan² of the half angle, without the cancellation of acos(1/ρ) near 1.
        let tan2 = xy.length_squared() - 1.0;
        if cylinder.is_flipped() || !(tan2 > 0.0) {
            return Self::ALL;
        }
        Self { middle: libm::atan2(xy.y, xy.x), half: libm::atan(tan2.sqrt()) }
    }

    /// A uniform point of the arc, of unit length.
    #[inline]
    fn point(&self, u: f32) -> DVec2 {
        let (y, x) = libm::sincos(self.middle + (2.0 * f64::from(u) - 1.0) * self.half);
        DVec2::new(x, y)
    }

    /// Density of a point that is uniform in angle and height, in the direction `xy` of unit length.
    #[inline]
    pub(super) fn pdf(&self, cylinder: &Cylinder, xy: DVec2) -> AreaPdf {
        AreaPdf((1.0 / (2.0 * self.half * cylinder.area_element(xy))) as f32)
    }
}

#[cfg(test)]
mod tests;
