//! Hits that are looked at ahead of their turn, stage by stage, so that what they need is fetched for many at once.
//!
//! A point of a textured surface takes a chain of looks into memory, each of which tells where the next one is: the face,
//! its vertices with their normals and texture coordinates, the pixels. In a scene that is larger than the caches each waits
//! for the whole way to memory. A processor goes on while it waits, but not as far as the next path; looks that depend on
//! nothing but a list of hits it has under way at the same time.

use super::Scene;
use crate::accel::Hit;
use crate::facts::{Feature, has};
use crate::material::Material;
use crate::math::ray::Ray;
use crate::shape::Shape;
use crate::shape::surface::ShapePoint;
use crate::shape::uv::UvPoint;
use crate::texture::Lookup;
use std::hint::black_box;

/// How many hits are looked at together: some ten lines of a cache each, which the first cache still holds when it is their
/// turn.
pub const AHEAD: usize = 32;

/// Where a ray meets a surface whose material is worked out at each point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    pub(super) shape: ShapePoint,
    pub(super) at: UvPoint,
    /// The first of its lookups among those of all, and the first of the next one's.
    lookups: (u32, u32),
}

/// A point that was looked at ahead, and the lookups in textures there.
#[derive(Clone, Copy, Debug)]
pub struct LookedAt<'a> {
    pub(super) met: &'a Met,
    pub(super) lookups: &'a [Lookup],
}

/// What looking ahead found.
#[derive(Debug, Default)]
pub struct Ahead {
    met: Vec<Option<Met>>,
    /// Lookups of all, one after the other.
    lookups: Vec<Lookup>,
}

impl<'a> LookedAt<'a> {
    /// Where it is.
    pub fn point(&self) -> &'a ShapePoint {
        &self.met.shape
    }
}

impl Ahead {
    /// Where hit number `index` of those looked at is, unless its material is the same everywhere.
    #[inline]
    pub fn met(&self, index: usize) -> Option<LookedAt<'_>> {
        let met = self.met.get(index)?.as_ref()?;
        Some(LookedAt { met, lookups: &self.lookups[met.lookups.0 as usize..met.lookups.1 as usize] })
    }
}

impl Scene {
    /// Whether it pays to look ahead.
    pub fn looks_ahead(&self) -> bool {
        has(Feature::Textures, self.features.textures > 0)
    }

    /// Looks at what the rays `ray(0)`, `ray(1)`, … meet, in place of what `ahead` holds.
    #[inline(never)]
    pub fn look_ahead<'r>(&self, hits: &[Hit], ray: impl Fn(usize) -> &'r Ray, ahead: &mut Ahead) {
        let Ahead { met, lookups } = ahead;
        // What is read is not wanted, but to have been read.
        let mut bits = 0;
        for hit in hits {
            if let Some(Shape::Mesh(mesh)) = self.shapes.get(hit.shape as usize) {
                bits ^= mesh.touch_face(hit.primitive);
            }
        }
        for hit in hits {
            if let Some(Shape::Mesh(mesh)) = self.shapes.get(hit.shape as usize) {
                bits ^= mesh.touch_vertices(hit.primitive);
                if let Some(uvs) = self.appearances[hit.shape as usize].uvs {
                    bits ^= self.uvs[uvs as usize].touch(mesh.faces[hit.primitive as usize]);
                }
            }
        }
        met.clear();
        lookups.clear();
        met.extend(hits.iter().enumerate().map(|(i, hit)| {
            let appearance = self.appearances.get(hit.shape as usize)?;
            let Material::Varying(graph) = &self.materials[appearance.material as usize] else { return None };
            let met = self.meet(ray(i), *hit);
            let start = lookups.len() as u32;
            graph.find_lookups(&self.textures, &self.texture_point(*appearance, hit.primitive, &met.at, &[]), lookups);
            Some(Met { lookups: (start, lookups.len() as u32), ..met })
        }));
        for lookup in lookups {
            bits ^= self.textures.read(lookup);
        }
        black_box(bits);
    }

    /// Where `ray` meets the primitive, which it does.
    #[inline]
    pub(super) fn meet(&self, ray: &Ray, hit: Hit) -> Met {
        let appearance = &self.appearances[hit.shape as usize];
        let shape = &self.shapes[hit.shape as usize];
        let (point, b) = match shape {
            Shape::Mesh(mesh) => {
                let (point, b) = mesh.meet_at(ray, hit.primitive);
                (point, Some(b))
            }
            other => (other.meet(ray, hit.primitive), None),
        };
        let at = match appearance.uvs {
            Some(uvs) => {
                self.uvs[uvs as usize].at_known(shape, hit.primitive, (point.point.p, b), appearance.along_uvs)
            }
            None => UvPoint::default(),
        };
        Met { shape: point, at, lookups: (0, 0) }
    }
}
