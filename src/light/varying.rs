//! Surfaces that emit more here than there, or from both sides.
//!
//! Points are found as on any other surface that emits, but on a mesh with a texture: half of its triangles are chosen by
//! their area, half by area times the mean of the texture, taken at some points of each. So wherever there may be light, the
//! density is at least half of the uniform one, and where most of a mesh is dark, few samples are lost there.

use super::area::Arc as Sector;
use super::{AreaLight, End, LightSample, Slide};
use crate::sampling::distribution::Discrete;
use crate::sampling::pdf::{AreaPdf, SolidAnglePdf};
use crate::sampling::warp;
use crate::shape::offset::SurfacePoint;
use crate::shape::uv::UvField;
use crate::shape::{Shape, TriangleMesh};
use crate::spectrum::Rgb;
use crate::texture::{MeshPoint, MeshValues, TexturePoint};
use glam::{DVec3, Vec2, Vec3};
use std::sync::Arc;

/// Points at which a texture is looked up for its mean over a surface, and at least for that over a triangle. Only noise
/// depends on them, and the power that is told.
const POINTS: usize = 4096;
const LEAST_POINTS: usize = 8;

/// A shape that emits.
#[derive(Clone, Debug)]
pub struct VaryingLight {
    /// The same light if all of it were as bright as the texture's 1, and its back dark.
    area: AreaLight,
    both_sides: bool,
    texture: Option<Coat>,
    /// Triangles by how often they are chosen, and the density of each one's points; `None` for a quadric.
    triangles: Option<(Discrete, Vec<AreaPdf>)>,
    /// Mean of the texture over the surface.
    mean: [f64; 3],
}

/// A texture on a surface.
#[derive(Clone, Debug)]
pub struct Coat {
    /// The texture.
    pub slide: Slide,
    /// The surface's texture coordinates.
    pub uvs: UvField,
    /// What else the texture asks of a mesh, if it does.
    pub values: Option<Arc<MeshValues>>,
}

impl VaryingLight {
    /// What `texture` makes of `area`, the light on `surface`.
    pub fn new(area: AreaLight, surface: &Shape, texture: Option<Coat>, both_sides: bool) -> Self {
        let mut light = Self { area, both_sides, texture, triangles: None, mean: [1.0; 3] };
        match surface {
            Shape::Mesh(mesh) => light.look_at_triangles(surface, mesh),
            quadric => {
                let points = |u| light.area.quadric_point(quadric, u);
                let shades = point_set(POINTS).map(points).map(|(pdf, p)| (light.shade(quadric, 0, &p), pdf));
                light.mean = mean(shades.map(|(shade, pdf)| (shade, 1.0 / f64::from(pdf.0))));
            }
        }
        light
    }

    fn look_at_triangles(&mut self, surface: &Shape, mesh: &TriangleMesh) {
        let areas: Vec<f64> = mesh.areas().collect();
        let count = (POINTS / areas.len()).max(LEAST_POINTS);
        let shade = |face: u32| {
            let point = |u| mesh.point(face, warp::square_to_triangle(u).as_dvec3().to_array()).point;
            mean(point_set(count).map(|u| (self.shade(surface, face, &point(u)), 1.0)))
        };
        let shades: Vec<[f64; 3]> = match &self.texture {
            Some(_) => (0..areas.len() as u32).map(shade).collect(),
            None => vec![[1.0; 3]; areas.len()],
        };
        let sum = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>();
        let total = sum(&mut areas.iter().copied());
        self.mean = [0, 1, 2].map(|c| sum(&mut areas.iter().zip(&shades).map(|(area, shade)| area * shade[c])) / total);
        let (all, luminance) = (luminance(self.mean), luminance);
        let weight =
            |(area, shade): (&f64, &[f64; 3])| if all > 0.0 { area * (all + luminance(*shade)) } else { *area };
        let weights = areas.iter().zip(&shades).map(weight);
        self.triangles = Discrete::new(weights).map(|triangles| {
            let pdf = |(i, area): (usize, &f64)| AreaPdf((f64::from(triangles.pmf(i)) / area) as f32);
            let pdfs = areas.iter().enumerate().map(pdf).collect();
            (triangles, pdfs)
        });
    }

    /// Which shape emits.
    pub fn shape(&self) -> u32 {
        self.area.shape
    }

    /// Whether its back emits, too.
    pub(super) fn both_sides(&self) -> bool {
        self.both_sides
    }

    /// A bound of the radiance of any point in any channel.
    pub(super) fn brightest(&self) -> f32 {
        self.area.radiance.max_component() * self.texture.as_ref().map_or(1.0, |t| t.slide.largest())
    }

    /// Mean radiance of the sides that emit, times their number.
    pub(super) fn mean_radiance(&self) -> [f64; 3] {
        let sides = if self.both_sides { 2.0 } else { 1.0 };
        let radiance = self.area.radiance.to_array();
        [0, 1, 2].map(|c| sides * f64::from(radiance[c]) * self.mean[c])
    }

    #[inline(never)]
    pub(super) fn sample(&self, surface: &Shape, &p: &DVec3, u: Vec2) -> Option<LightSample> {
        let mut sample = match (surface, &self.triangles) {
            (Shape::Mesh(mesh), Some((triangles, pdfs))) => {
                let (face, x) = triangles.sample(u.x);
                let b = warp::square_to_triangle(Vec2::new(x, u.y));
                let end = mesh.point(face as u32, b.as_dvec3().to_array()).point;
                self.towards(p, pdfs[face], end, face as u32)?
            }
            (Shape::Mesh(_), None) => return None,
            (quadric, _) if self.both_sides => {
                let (pdf, end) = self.area.quadric_point(quadric, u);
                self.towards(p, pdf, end, 0)?
            }
            (quadric, _) => self.area.sample_quadric(quadric, &p, u)?,
        };
        let end = sample.end?.seen_from(p, sample.wi);
        sample.end = Some(End::Point(end));
        sample.radiance *= self.shade(surface, sample.on.primitive, &end);
        (!sample.radiance.is_black()).then_some(sample)
    }

    /// The sample that leads from `p` to a point that was found with this density.
    fn towards(&self, p: DVec3, pdf: AreaPdf, end: SurfacePoint, primitive: u32) -> Option<LightSample> {
        let behind = self.both_sides && (end.p - p).as_vec3().dot(end.n) > 0.0;
        let facing = SurfacePoint { n: if behind { -end.n } else { end.n }, ..end };
        let sample = self.area.towards(p, pdf, facing, primitive)?;
        Some(LightSample { end: Some(End::Point(end)), ..sample })
    }

    /// Density with which [`super::Light::sample`] finds the direction from `p` to the point `end` of this primitive.
    #[inline(never)]
    pub fn pdf(&self, surface: &Shape, &p: &DVec3, end: &SurfacePoint, primitive: u32) -> SolidAnglePdf {
        match (surface, &self.triangles) {
            (Shape::Mesh(_), Some((_, pdfs))) => AreaLight::seen_from(p, pdfs[primitive as usize], end),
            (Shape::Mesh(_), None) => SolidAnglePdf(0.0),
            (Shape::Cylinder(cylinder), _) if self.both_sides => {
                let pdf = Sector::ALL.pdf(cylinder, cylinder.project(end.p).normalize());
                AreaLight::seen_from(p, pdf, end)
            }
            (_, _) if self.both_sides => AreaLight::seen_from(p, self.area.uniform_pdf(), end),
            (quadric, _) => self.area.pdf(quadric, p, Vec3::ZERO, end),
        }
    }

    /// Radiance that leaves a point of this primitive in direction `w`.
    #[inline(never)]
    pub fn emitted(&self, surface: &Shape, primitive: u32, point: &SurfacePoint, &w: &Vec3) -> Rgb {
        let cos = point.n.dot(w);
        if cos > 0.0 || self.both_sides && cos < 0.0 {
            return self.area.radiance * self.shade(surface, primitive, point);
        }
        Rgb::BLACK
    }

    /// The texture at a point.
    fn shade(&self, surface: &Shape, primitive: u32, point: &SurfacePoint) -> Rgb {
        let Some(Coat { slide, uvs, values }) = &self.texture else { return Rgb::WHITE };
        let at = uvs.at(surface, primitive, point.p);
        let mesh = values.as_deref().zip(at.corners).map(|(values, (corners, weights))| MeshPoint {
            values,
            face: primitive,
            corners,
            weights,
        });
        slide.at(&TexturePoint { uv: at.uv, mesh, ahead: &[] })
    }
}

/// Well distributed points of the unit square (Hammersley).
fn point_set(count: usize) -> impl Iterator<Item = Vec2> {
    let inverse = |i: u32| f64::from(i.reverse_bits()) / (1_u64 << u32::BITS) as f64;
    (0..count as u32).map(move |i| Vec2::new(((f64::from(i) + 0.5) / count as f64) as f32, inverse(i) as f32))
}

fn luminance(colour: [f64; 3]) -> f64 {
    colour.iter().zip(Rgb::LUMINANCE).map(|(c, weight)| c * f64::from(weight)).sum()
}

/// The mean of colours with weights.
fn mean(colours: impl Iterator<Item = (Rgb, f64)>) -> [f64; 3] {
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for (colour, weight) in colours {
        let colour = colour.to_array();
        sum = [0, 1, 2].map(|c| sum[c] + weight * f64::from(colour[c]));
        total += weight;
    }
    sum.map(|s| s / total)
}
