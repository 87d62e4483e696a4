//! The system's Embree, through `ffi/embree_shim.h`. Triangles only; quadrics and what is placed go into hierarchies of our
//! own beside it.
//!
//! Embree's answer is a proposal: its robust mode decides in f32, and takes now and then the triangle that a ray starts
//! on for one that it meets (slivers mostly, whose normal has few right digits). So a hit near an end of the ray's
//! interval is computed again by [`crate::shape`], in f64, and where it is not in the interval after all, Embree is asked
//! for what comes behind. To look at an occluder, too, takes an occlusion filter that notes which it was: 3 to 5 %.
//!
//! # What is near
//!
//! Embree's distance is t = T/V, T = (v − o)·N, V = d·N, with the normal N = e₁ × e₂ made of edges of v − o. Let L be the
//! length of the longest edge and R = L + t·|d|, which no vertex of a triangle that is hit is farther from o than, and u
//! the unit roundoff. A vertex is off by √3·u·R, an edge by twice that and N by twice L times that, and 3·u·L² of its own:
//! 10·u·R·L together. T is off by R times this and 4·u·R·L² of its own, less than 14·u·R²·L; V by |d| times 14·u·R·L, which
//! counts t times, so t·V and (tmax − t)·V are off by less than 28·u·R²·L. The test against a moved edge changes the plane's
//! distance by no more than a vertex moved by 6·√3·u·R does, so T by 11·u·R·L². Where both exceed 64·u·R²·L
//! ([`DISTANCE_ROUNDINGS`]), the hit lies in the interval for certain; V, from Embree's normal, and t come with the hit.
//! That is nearly all hits but those on slivers, and their vertices need not be fetched.
#![allow(unsafe_code, reason = "calls the C shim; no other module may")]

#[rustfmt::skip]
#[allow(
    clippy::allow_attributes_without_reason,
    dead_code,
    missing_docs,
    non_camel_case_types,
    unreachable_pub,
    reason = "generated, and C has its own names"
)]
mod bindings;

use super::native::{Native, Nearest, TraversalStack};
use super::{Hit, Quality, Start};
use crate::error::{Error, Result};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::ray::Ray;
use crate::shape::{Shape, TriangleMesh};
use bindings::{rt_error, rt_hit, rt_ray};
use glam::Vec3;
use std::ffi::{CStr, c_char};
use std::mem::offset_of;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering};

/// How often a ray is traced again from behind a false hit. A ray that starts in the corner of many slivers can meet
/// some; each step passes all that lie in one plane.
const MAX_RETRACES: usize = 16;

/// Bound on the error of Embree's t·V, in unit roundoffs of R²·L: see the head.
const DISTANCE_ROUNDINGS: f32 = 64.0;

/// A retrace starts this factor behind Embree's distance: over the roundings of a quotient of two numbers that Embree
/// does not form in the same order when it compares with the start of the interval.
const BEHIND: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Rays in one call of the shim; its answers then stay in the first-level cache.
const CHUNK: usize = 64;

/// Readable floats after the last vertex: Embree loads each vertex as 16 bytes.
const PADDING: usize = 2;

// A `Ray` is handed to the shim as it is.
const _: () = {
    assert!(size_of::<Ray>() == size_of::<rt_ray>() && align_of::<Ray>() >= align_of::<rt_ray>());
    assert!(offset_of!(Ray, o) == offset_of!(rt_ray, o) && offset_of!(Ray, tmin) == offset_of!(rt_ray, tmin));
    assert!(offset_of!(Ray, d) == offset_of!(rt_ray, d) && offset_of!(Ray, tmax) == offset_of!(rt_ray, tmax));
    assert!(size_of::<Vec3>() == 12 && size_of::<[u32; 3]>() == 12);
    assert!(bindings::RT_NONE == Hit::NONE.shape && bindings::RT_NONE == Hit::NONE.primitive);
};

const NO_HIT: rt_hit = rt_hit { shape: bindings::RT_NONE, primitive: bindings::RT_NONE, t: 0.0, volume: 0.0 };

impl rt_hit {
    fn id(&self) -> Hit {
        Hit { shape: self.shape, primitive: self.primitive }
    }
}

/// By which arithmetic Embree meets triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmbreeMode {
    /// Its robust one, which loses few rays: what renders take.
    #[default]
    Robust,
    /// Its default, which is quicker, and loses rays at edges.
    Quick,
    /// The same in a tree of compressed nodes.
    Compact,
}

/// Embree for the triangles, our own for all else.
#[derive(Debug)]
pub(crate) struct Embree {
    /// `None` where the scene has no triangles. Borrows from `shapes`, so it is declared, and dropped, first.
    scene: Option<Scene>,
    /// Copies: positions with padding, no normals. Embree reads them, and so does the check of its hits.
    shapes: Vec<Shape>,
    /// Length of the longest edge of each shape.
    longest_edges: Vec<f32>,
    others: Native,
    mode: EmbreeMode,
    /// Hits of Embree that were none.
    false_hits: AtomicU64,
}

impl Embree {
    /// See [`super::Accel::build_embree`].
    pub(crate) fn build(shapes: &[Shape], threads: usize, quality: Quality, mode: EmbreeMode) -> Result<Self> {
        let shapes: Vec<Shape> = shapes.iter().map(copy).collect();
        let scene = if shapes.iter().any(|s| matches!(s, Shape::Mesh(mesh) if !mesh.faces.is_empty())) {
            // SAFETY: `shapes` is moved into the same struct and never changed; the vectors inside keep their address.
            Some(unsafe { Scene::build(&shapes, threads, (quality, mode), u64::MAX)? })
        } else {
            None
        };
        let others = Native::build_others(&shapes, quality);
        let longest_edges = shapes.iter().map(longest_edge).collect();
        Ok(Self { scene, shapes, longest_edges, others, mode, false_hits: AtomicU64::new(0) })
    }

    /// See [`super::Accel::closest_hits_from`].
    pub(crate) fn closest_hits(&self, rays: &[Ray], start: Start<'_>, hits: &mut [Hit]) {
        let Some(scene) = &self.scene else {
            return self.others.closest_hits(rays, start, hits);
        };
        let mut found = [NO_HIT; CHUNK];
        let mut nearest = [Nearest { t: 0.0, hit: Hit::NONE }; CHUNK];
        let mut stack = (!self.others.is_empty()).then(TraversalStack::new);
        for (chunk, (rays, hits)) in rays.chunks(CHUNK).zip(hits.chunks_mut(CHUNK)).enumerate() {
            scene.closest(rays, start.is_coherent(), &mut found);
            let starts = start.primitives().get(chunk * CHUNK..chunk * CHUNK + rays.len()).unwrap_or(&[]);
            let from = |i: usize| [starts.get(i).copied().unwrap_or(Hit::NONE), Hit::NONE];
            let Some(stack) = &mut stack else {
                for (i, ((ray, found), hit)) in rays.iter().zip(&found).zip(hits).enumerate() {
                    let is_sure = !found.id().is_some() || self.is_certain(ray, from(i), found);
                    *hit = if is_sure { found.id() } else { self.confirm_closest(scene, ray, from(i), *found).hit };
                }
                continue;
            };
            let nearest = &mut nearest[..rays.len()];
            for (i, ((ray, found), nearest)) in rays.iter().zip(&found).zip(&mut *nearest).enumerate() {
                *nearest = self.confirm_closest(scene, ray, from(i), *found);
            }
            self.others.improve_by_others(rays, starts, nearest, stack);
            hits.iter_mut().zip(nearest).for_each(|(hit, nearest)| *hit = nearest.hit);
        }
    }

    /// See [`super::Accel::occluded_between`]; `occluded` is false throughout.
    pub(crate) fn occluded(&self, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        if let Some(scene) = &self.scene {
            let mut found = [NO_HIT; CHUNK];
            for (chunk, (rays, occluded)) in rays.chunks(CHUNK).zip(occluded.chunks_mut(CHUNK)).enumerate() {
                scene.any(rays, &mut found);
                for (i, ((ray, found), occluded)) in rays.iter().zip(&found).zip(occluded).enumerate() {
                    let ends = || ends.get(chunk * CHUNK + i).copied().unwrap_or([Hit::NONE; 2]);
                    *occluded = found.id().is_some()
                        && (self.is_certain(ray, ends(), found)
                            || self.distance(ray, ends(), found).is_some()
                            || self.is_occluded(scene, ray, ends()));
                }
            }
        }
        if !self.others.is_empty() {
            self.others.occluded(rays, ends, occluded);
        }
    }

    /// Whether a hit lies in the ray's interval whatever Embree's rounding (see the head), and is on no triangle that the
    /// ray starts or ends on: a short segment within one of these, rounded, may well pierce it.
    #[inline]
    fn is_certain(&self, ray: &Ray, ends: [Hit; 2], found: &rt_hit) -> bool {
        let longest = self.longest_edges[found.shape as usize];
        let reach = longest + found.t * ray.d.length();
        let error = DISTANCE_ROUNDINGS * UNIT_ROUNDOFF * reach * reach * longest;
        (found.t - ray.tmin) * found.volume > error
            && (ray.tmax - found.t) * found.volume > error
            && !ends.contains(&found.id())
    }

    /// The distance of a hit by our own computation, if it is in the ray's interval and no triangle that the ray starts
    /// or ends on.
    #[inline]
    fn distance(&self, ray: &Ray, ends: [Hit; 2], found: &rt_hit) -> Option<f32> {
        if ends.contains(&found.id()) {
            return None;
        }
        let t = self.shapes[found.shape as usize].resolve_distance(found.primitive, ray);
        ray.contains(t).then_some(t as f32)
    }

    /// The first of Embree's hits that is one.
    #[inline]
    fn confirm_closest(&self, scene: &Scene, ray: &Ray, ends: [Hit; 2], mut found: rt_hit) -> Nearest {
        for _ in 0..MAX_RETRACES {
            if !found.id().is_some() {
                break;
            }
            if let Some(t) = self.distance(ray, ends, &found) {
                return Nearest { t, hit: found.id() };
            }
            found = self.behind(scene, ray, &found);
        }
        Nearest::none(ray)
    }

    /// What Embree finds behind a false hit.
    #[cold]
    fn behind(&self, scene: &Scene, ray: &Ray, false_hit: &rt_hit) -> rt_hit {
        self.false_hits.fetch_add(1, Ordering::Relaxed);
        let beyond = Ray { tmin: (false_hit.t * BEHIND).next_up(), ..*ray };
        let mut found = [NO_HIT];
        if beyond.tmin < beyond.tmax {
            scene.closest(&[beyond], false, &mut found);
        }
        found[0]
    }

    /// Whether a ray whose first occluder was a false hit has another.
    #[cold]
    fn is_occluded(&self, scene: &Scene, ray: &Ray, ends: [Hit; 2]) -> bool {
        self.false_hits.fetch_add(1, Ordering::Relaxed);
        let mut found = [NO_HIT];
        scene.closest(&[*ray], false, &mut found);
        self.confirm_closest(scene, ray, ends, found[0]).hit.is_some()
    }

    /// The shapes, without normals and with unused vertices at the end.
    pub(crate) fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// See [`super::Accel::embree_false_hits`].
    pub(crate) fn false_hits(&self) -> u64 {
        self.false_hits.load(Ordering::Relaxed)
    }

    /// See [`super::Accel::name`].
    pub(crate) fn name(&self) -> String {
        let version = self.scene.as_ref().map_or_else(header_version, Scene::library_version);
        let mode = match self.mode {
            EmbreeMode::Robust => "robust",
            EmbreeMode::Quick => "quick",
            EmbreeMode::Compact => "quick, compact",
        };
        format!("embree {version} ({mode})")
    }

    /// See [`super::Accel::memory_bytes`].
    pub(crate) fn memory_bytes(&self) -> u64 {
        let copies: usize = self.shapes.iter().map(copy_bytes).sum();
        self.scene.as_ref().map_or(0, Scene::memory_bytes) + copies as u64 + self.others.memory_bytes()
    }
}

/// A shape as [`Embree::shapes`] holds it.
fn copy(shape: &Shape) -> Shape {
    match shape {
        Shape::Mesh(mesh) => {
            let mut positions = Vec::with_capacity(mesh.positions.len() + PADDING);
            positions.extend_from_slice(&mesh.positions);
            positions.extend([Vec3::ZERO; PADDING]);
            Shape::Mesh(TriangleMesh {
                positions,
                faces: mesh.faces.clone(),
                flip: mesh.flip,
                ..TriangleMesh::default()
            })
        }
        quadric => quadric.clone(),
    }
}

/// The length of the longest edge, rounded up; 0 of what is no mesh.
fn longest_edge(shape: &Shape) -> f32 {
    let Shape::Mesh(mesh) = shape else { return 0.0 };
    let of_face = |face: u32| {
        let [a, b, c] = mesh.triangle(face).map(Vec3::as_dvec3);
        (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared())
    };
    ((0..mesh.faces.len() as u32).map(of_face).fold(0.0, f64::max).sqrt() as f32).next_up()
}

fn copy_bytes(shape: &Shape) -> usize {
    match shape {
        Shape::Mesh(mesh) => size_of_val(&*mesh.positions) + size_of_val(&*mesh.faces),
        Shape::Sphere(_) | Shape::Disk(_) | Shape::Cylinder(_) | Shape::Placed(_) => 0,
    }
}

/// A version of Embree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Version(u32);

impl Version {
    /// Major and minor: what must be the same in header and library, for Embree's structs grow between minor versions.
    fn series(self) -> u32 {
        self.0 / 100
    }
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}.{}", self.0 / 10000, self.0 / 100 % 100, self.0 % 100)
    }
}

fn header_version() -> Version {
    // SAFETY: takes and touches nothing.
    Version(unsafe { bindings::rt_header_version() })
}

/// A committed scene of Embree, on a device of its own.
#[derive(Debug)]
struct Scene(NonNull<bindings::rt_scene>);

// SAFETY: a scene is not tied to the thread that made it; Embree's API manual, chapter "Embree API": "all API calls are
// thread-safe", but for those on one object that change it, of which there are none after `build`.
unsafe impl Send for Scene {}
// SAFETY: as above; the manual on rtcIntersect1 and rtcOccluded1 of a committed scene: may be called from many threads.
unsafe impl Sync for Scene {}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: made by `rt_scene_new`, and freed nowhere else.
        unsafe { bindings::rt_scene_free(self.0.as_ptr()) }
    }
}

impl Scene {
    /// Builds over the meshes of `shapes`, whose index is the id of their hits, with at most so much memory.
    ///
    /// # Safety
    /// The vertices, of which [`PADDING`] at the end are unused, and the faces of `shapes` must stay where they are and
    /// as they are until the scene is dropped.
    unsafe fn build(
        shapes: &[Shape],
        threads: usize,
        (quality, mode): (Quality, EmbreeMode),
        memory: u64,
    ) -> Result<Self> {
        let mut error = rt_error { code: 0, text: [0; 252] };
        let threads = u32::try_from(threads).unwrap_or(0);
        // SAFETY: `error` is writable for the call.
        let scene = unsafe { bindings::rt_scene_new(threads, quality as u32, mode as u32, memory, &mut error) };
        let scene = Self(NonNull::new(scene).ok_or_else(|| failure("cannot be started", &error))?);
        let (header, library) = (header_version(), scene.library_version());
        if header.series() != library.series() {
            return Err(Error::Accelerator(format!(
                "this snell was compiled for Embree {header}, but the library found is {library}: build snell again, or \
                 use --accel native"
            )));
        }
        for (shape, mesh) in (0..).zip(shapes) {
            let Shape::Mesh(mesh) = mesh else { continue };
            if mesh.faces.is_empty() {
                continue;
            }
            // SAFETY: the scene is there; the caller keeps the buffers, whose lengths and padding are as stated.
            let added = unsafe {
                bindings::rt_scene_add_mesh(
                    scene.0.as_ptr(),
                    shape,
                    mesh.positions.as_ptr().cast(),
                    mesh.positions.len() - PADDING,
                    mesh.faces.as_ptr().cast(),
                    mesh.faces.len(),
                    &mut error,
                )
            };
            if !added {
                return Err(failure(&format!("refuses mesh {shape}"), &error));
            }
        }
        // SAFETY: the scene is there and nobody else has it.
        if !unsafe { bindings::rt_scene_commit(scene.0.as_ptr(), &mut error) } {
            return Err(failure("cannot build its hierarchy", &error));
        }
        Ok(scene)
    }

    /// Embree's closest hits of at most `found.len()` rays.
    #[inline]
    fn closest(&self, rays: &[Ray], coherent: bool, found: &mut [rt_hit]) {
        assert!(rays.len() <= found.len());
        let query = if coherent { bindings::rt_scene_closest_coherent } else { bindings::rt_scene_closest };
        // SAFETY: the scene is committed; `rays` are readable as rt_ray (asserted above) and `found` writable for as
        // many.
        unsafe { query(self.0.as_ptr(), rays.as_ptr().cast(), found.as_mut_ptr(), rays.len()) };
    }

    /// Some hit that Embree finds of each of at most `found.len()` rays.
    #[inline]
    fn any(&self, rays: &[Ray], found: &mut [rt_hit]) {
        assert!(rays.len() <= found.len());
        // SAFETY: as in `closest`.
        unsafe {
            bindings::rt_scene_any(self.0.as_ptr(), rays.as_ptr().cast(), found.as_mut_ptr(), rays.len());
        }
    }

    fn library_version(&self) -> Version {
        // SAFETY: the scene is there.
        Version(unsafe { bindings::rt_scene_library_version(self.0.as_ptr()) })
    }

    fn memory_bytes(&self) -> u64 {
        // SAFETY: the scene is there.
        unsafe { bindings::rt_scene_memory(self.0.as_ptr()) }
    }
}

/// What Embree says went wrong.
fn failure(what: &str, error: &rt_error) -> Error {
    // SAFETY: the shim ends the text with a 0 inside the array, and it is all 0 where the shim wrote nothing.
    let text = unsafe { CStr::from_ptr(error.text.as_ptr().cast::<c_char>()) };
    Error::Accelerator(format!("Embree {what}: {} (error {})", text.to_string_lossy(), error.code))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever Embree runs out of while it builds, it is an error, and nothing is left half-built.
    #[test]
    fn no_memory_is_an_error() {
        const SIDE: u32 = 100;
        let at = |i: u32| Vec3::new((i % SIDE) as f32, (i / SIDE) as f32, (i * i % 7) as f32);
        let faces = (0..SIDE * (SIDE - 1) - 1).map(|i| [i, i + 1, i + SIDE]).collect();
        let positions = (0..SIDE * SIDE).map(at).collect();
        let shapes = [copy(&Shape::Mesh(TriangleMesh { positions, faces, ..TriangleMesh::default() }))];
        // SAFETY: `shapes` outlives every scene, and has its padding by `copy`.
        let build = |memory| unsafe { Scene::build(&shapes, 2, (Quality::Medium, EmbreeMode::Robust), memory) };
        let whole = build(u64::MAX).unwrap().memory_bytes();
        assert!(whole > 0);
        for memory in [0, 1, whole / 100, whole / 10, whole / 2] {
            let error = build(memory).err().map(|e| e.to_string()).unwrap_or_default();
            assert!(error.starts_with("Embree ") && error.contains("emory"), "{memory} of {whole} bytes: '{error}'");
        }
        assert!(build(u64::MAX).is_ok());
    }
}
