//! Neighbours lend each other what their paths found: path reuse within a pixel's surroundings.
//!
//! # What is shared
//!
//! The paths of one sample of a few neighbouring pixels leave their first surfaces at points xₖ and meet others at yₖ. Light
//! that yⱼ scatters, all that path j goes on to find there, is an estimate R(yⱼ) of the radiance that leaves yⱼ; and where yⱼ
//! scatters alike in all directions, it leaves towards the other xᵢ, too. So each pixel's indirect light is estimated by
//! all the paths of its group, for the price of the rays that tell whether xᵢ sees yⱼ (Bekaert, Sbert and Halton 2002,
//! *Accelerating Path Tracing by Re-Using Paths*). With the balance heuristic over all that could have found yⱼ,
//!
//! Lᵢ = Σⱼ f(xᵢ, yⱼ)·G(xᵢ, yⱼ)·R(yⱼ) / Σₖ pₖ(yⱼ), pₖ(y) = pₖ(ω)·|cos θ_y|/|xₖ − y|² where xₖ sees y, else 0,
//!
//! f with its cosine at x, G = |cos θ_y|/|x − y|² where they see each other. The sum of weights is 1 for every y, so the
//! expected value is that of the path alone, whatever the neighbours are; the noise of neighbours is alike, but less.
//!
//! Where y reflects but is not diffuse, R depends on who looks: [`apart`] has what is shared then.
//!
//! What stays a path's own: light that it samples at x or runs into at y, and everything where x scatters by a delta lobe
//! or y does, or lets light through.
//!
//! Who shares with whom is the business of [`group`]; whether it pays, of [`super::trial`].

mod apart;
mod group;

pub use group::PathReuse;
pub(super) use group::{BLOCK, Group, grouped_ids};

use super::path_state::{PathState, Segment};
use super::wave::{RayCounts, Walker, with_avx2};
use crate::accel::Hit;
use crate::bsdf::Bsdf;
use crate::material::{Layer, Scatter};
use crate::math::ray::Ray;
use crate::scene::Surface;
use crate::shape::offset::SurfacePoint;
use crate::spectrum::Rgb;
use apart::Apart;
use glam::{DVec3, Vec3};
use std::ops::Range;
use std::time::Instant;

/// Most members of a group.
const BLOCK_PIXELS: usize = (BLOCK * BLOCK) as usize;

/// A second vertex that others may use.
#[derive(Clone, Copy, Debug)]
struct Joint {
    /// The point.
    point: SurfacePoint,
    /// What it lies on.
    hit: Hit,
    /// The normals, geometric and shading, on the side that is seen.
    sides: [Vec3; 2],
    /// Density with which the path itself finds the point, with respect to area.
    density: f64,
    /// Index of what arrives there, if what leaves is not alike in all directions.
    apart: Option<u32>,
    /// Radiance of the path up to here; once the path has ended, what it found beyond, per unit of what it carries.
    radiance: Rgb,
}

impl Joint {
    /// The direction to it and |cos|/distance² there; `None` from behind.
    #[inline(always)]
    fn seen_from(&self, p: DVec3) -> Option<(Vec3, f64)> {
        let to = self.point.p - p;
        let distance_squared = to.length_squared();
        let wi = (to / distance_squared.sqrt()).as_vec3();
        let [cos, shading] = self.sides.map(|n| -n.dot(wi));
        (cos > 0.0 && shading > 0.0).then(|| (wi, f64::from(cos) / distance_squared))
    }
}

/// How a first vertex sees another path's joint.
#[derive(Clone, Copy, Debug)]
struct Link {
    /// Indices of the paths.
    from: usize,
    to: usize,
    /// The direction, from the first vertex to the joint.
    wi: Vec3,
    /// f·|cos| at the first vertex.
    f: Rgb,
    /// |cos|/distance² at the joint.
    geometry: f64,
    /// Density with which the first vertex finds the joint, with respect to area.
    density: f64,
}

/// What a wave needs for sharing.
#[derive(Default)]
pub(super) struct Reuse {
    /// The first rays of all paths and what they met.
    first: Vec<(Ray, Hit)>,
    /// Of all paths.
    joints: Vec<Option<Joint>>,
    /// What arrives at joints that do not scatter alike in all directions, in the order of paths.
    apart: Vec<Apart>,
    links: Vec<Link>,
    rays: Vec<Ray>,
    ends: Vec<[Hit; 2]>,
    occluded: Vec<bool>,
    /// Paths of a group whose joints have something to share.
    targets: Vec<usize>,
    /// Links of a group that nothing hides, by joint, and where in these those of each member's begin.
    free: Vec<u32>,
    starts: Vec<usize>,
    /// What a joint scatters along its links, if that depends on the direction: of the light that its path sampled there or met
    /// next, and of what it found beyond.
    scattered: Vec<[Rgb; 2]>,
}

impl Reuse {
    /// Starts with the paths of a wave and what their camera rays met.
    pub(super) fn start(&mut self, paths: &[PathState], hits: &[Hit]) {
        self.first.clear();
        self.first.extend(paths.iter().zip(hits).map(|(path, hit)| (path.ray, *hit)));
        self.joints.clear();
        self.joints.resize(paths.len(), None);
        self.apart.clear();
    }

    /// What path `index` finds from now on counts for others, too, if the surface reflects to all sides; `hit` is its second. Whether that is
    /// so, and whether what it finds is kept apart by direction.
    #[inline(never)]
    pub(super) fn join(&mut self, index: usize, path: &mut PathState, surface: &Surface<'_>, hit: Hit) -> (bool, bool) {
        const ALONE: (bool, bool) = (false, false);
        let Segment::Smooth { pdf, from, .. } = path.segment else { return ALONE };
        let alike = matches!(surface.bsdf, Scatter::One(Bsdf::Diffuse(_)));
        if !(alike || surface.bsdf.scatters_everywhere()) {
            return ALONE;
        }
        let towards = |n: Vec3| if n.dot(surface.wo) < 0.0 { -n } else { n };
        let sides = [towards(surface.point.n), towards(surface.frame.n)];
        let mut joint = Joint { point: surface.point, hit, sides, density: 0.0, apart: None, radiance: path.radiance };
        let Some((_, geometry)) = joint.seen_from(from) else { return ALONE };
        joint.density = f64::from(pdf.0) * geometry;
        if !alike {
            joint.apart = Some(self.apart.len() as u32);
            self.apart.push(Apart::new(index as u32, path));
        }
        self.joints[index] = Some(joint);
        path.carried = path.throughput;
        path.throughput = Rgb::WHITE;
        path.radiance = Rgb::BLACK;
        (true, !alike)
    }

    /// Before it is known which light samples of vertex `vertex` (counted from 0) are visible: `samples` are their paths and
    /// directions.
    pub(super) fn sampled(&mut self, vertex: u32, paths: &mut [PathState], samples: impl Iterator<Item = (u32, Vec3)>) {
        match vertex {
            1 => apart::look_for_lights(&mut self.apart, samples),
            2 => apart::take_met(&mut self.apart, paths),
            _ => {}
        }
    }

    /// After the vertex.
    pub(super) fn passed(&mut self, vertex: u32, paths: &mut [PathState]) {
        if vertex == 1 {
            apart::part(&mut self.apart, paths);
        }
    }
}

impl Walker<'_> {
    /// Gives every path what the paths of its group have found for it.
    #[inline(never)]
    pub(super) fn share(
        &self,
        reuse: &mut Reuse,
        paths: &mut [PathState],
        layers: &mut Vec<Layer>,
        counts: &mut RayCounts,
    ) {
        apart::meet(&mut reuse.apart, paths);
        for (joint, path) in reuse.joints.iter_mut().zip(&mut *paths) {
            if let Some(joint) = joint {
                std::mem::swap(&mut joint.radiance, &mut path.radiance);
            }
        }
        let mut start = 0;
        while start < paths.len() {
            let of = |path: &PathState| Group::of(path.id, self.limits.reuse);
            let group = of(&paths[start]);
            let members = paths[start..].iter().take_while(|path| of(path) == group).count();
            self.share_in(reuse, start..start + members, paths, layers, counts);
            start += members;
        }
    }

    /// The same within a group.
    fn share_in(
        &self,
        reuse: &mut Reuse,
        members: Range<usize>,
        paths: &mut [PathState],
        layers: &mut Vec<Layer>,
        counts: &mut RayCounts,
    ) {
        let found = |to: &usize| reuse.joints[*to].as_ref().is_some_and(|joint| !joint.radiance.is_black());
        reuse.targets.clear();
        reuse.targets.extend(members.clone().filter(found));
        if reuse.targets.is_empty() {
            return;
        }
        with_avx2(
            self.level,
            #[inline(always)]
            || self.link(reuse, members.clone(), layers),
        );
        counts.shadow += reuse.rays.len() as u64;
        reuse.occluded.resize(reuse.rays.len(), false);
        let now = Instant::now();
        self.scene.accel.occluded_between(&reuse.rays, &reuse.ends, &mut reuse.occluded);
        counts.time += now.elapsed();
        reuse.sort(&members);
        let Reuse { joints, apart, links, free, starts, targets, scattered, .. } = reuse;
        for &to in &*targets {
            let Some(joint) = &joints[to] else { continue };
            let place = to - members.start;
            let free = free[starts[place]..starts[place + 1]].iter().map(|&link| &links[link as usize]);
            match joint.apart {
                Some(index) => self.give((joint, &apart[index as usize]), free, scattered, paths, layers),
                None => give_alike(joint, to, free, paths),
            }
        }
    }

    /// Finds the ways from the first vertices of a group to the joints of its other paths.
    #[inline(always)]
    fn link(&self, reuse: &mut Reuse, members: Range<usize>, layers: &mut Vec<Layer>) {
        let Reuse { first, joints, targets, links, rays, ends, .. } = reuse;
        links.clear();
        rays.clear();
        ends.clear();
        for from in members {
            let (ray, hit) = first[from];
            if !hit.is_some() || targets[..] == [from] {
                continue;
            }
            let surface = self.scene.surface(&ray, hit, layers);
            if !surface.bsdf.lobes().smooth {
                continue;
            }
            let wo = surface.frame.to_local(surface.wo);
            for &to in targets.iter().filter(|&&to| to != from) {
                let Some(joint) = &joints[to] else { continue };
                let Some((wi, geometry)) = joint.seen_from(surface.p()) else { continue };
                let (f, pdf) = surface.bsdf.eval_pdf(wo, surface.frame.to_local(wi));
                // Its own path would have ended, so that it does not find the joint, whatever the density.
                if f.is_black() {
                    continue;
                }
                let density = f64::from(pdf.0) * geometry;
                links.push(Link { from, to, wi, f, geometry, density });
                rays.push(surface.ray_to(wi, &joint.point));
                ends.push([hit, joint.hit]);
            }
        }
    }
}

impl Reuse {
    /// Puts the links of a group that nothing hides in the order of their joints.
    fn sort(&mut self, members: &Range<usize>) {
        let Self { links, occluded, free, starts, .. } = self;
        let visible = || links.iter().zip(&*occluded).enumerate().filter(|(_, (_, occluded))| !**occluded);
        let place = |link: &Link| link.to - members.start;
        starts.clear();
        starts.resize(members.len() + 1, 0);
        visible().for_each(|(_, (link, _))| starts[place(link) + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        free.resize(starts[members.len()], 0);
        let mut next = [0; BLOCK_PIXELS];
        next[..members.len()].copy_from_slice(&starts[..members.len()]);
        for (index, (link, _)) in visible() {
            free[next[place(link)]] = index as u32;
            next[place(link)] += 1;
        }
    }
}

/// Gives what was found beyond a joint of path `to` that scatters alike in all directions to its own path, and to those who see it
/// by `links`.
fn give_alike<'a>(joint: &Joint, to: usize, links: impl Iterator<Item = &'a Link> + Clone, paths: &mut [PathState]) {
    let found = joint.radiance;
    let density = joint.density + links.clone().map(|link| link.density).sum::<f64>();
    let own = (joint.density / density) as f32;
    let carried = paths[to].carried;
    paths[to].radiance += carried * found * own;
    for link in links {
        paths[link.from].radiance += link.f * found * (link.geometry / density) as f32;
    }
}
