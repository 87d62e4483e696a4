//! Joints whose light depends on who looks: what arrives there is kept apart from how it is scattered.
//!
//! # What leaves a joint
//!
//! Path j keeps of its joint y two directions and what arrives from each, per unit of f: from w_l, where it sampled a light,
//! A_l = L·m_l/p_l; from w_c, where it went on, what it met at its next vertex, A_m = L·m_c/(p·q), and what it found beyond that,
//! A_b = (…)/(p·q). p is its own density of w_c, q the chance of surviving roulette, m_l and m_c are its own weights of the two ways to
//! find a light, which add up to 1 for each direction. With fᵢ(w) = f(wᵢ, w)·|cos θ|, wᵢ towards xᵢ, there leaves towards xᵢ
//!
//! near: fᵢ(w_l)·A_l + fᵢ(w_c)·A_m, weighted by pⱼ(y)/Σₖ pₖ(y) as where y is diffuse;
//! far: fᵢ(w_c)·A_b, weighted by pⱼ(y)·f̄ⱼ(w_c)/Σₖ pₖ(y)·f̄ₖ(w_c), f̄ the mean over channels.
//!
//! Both are weights over who finds y, functions of y (and w) that add up to 1, so that the expectation is that of the path alone. With
//! the second no one gets more than a moderate multiple of what its own path would have found, however narrow f is:
//! fᵢ/(p·Σₖ pₖ·f̄ₖ)·pⱼ·f̄ⱼ ≤ (f̄ⱼ/p)·(fᵢ/f̄ᵢ)·pⱼ(y)/pᵢ(y) for its density of y, and f̄ⱼ/p is about an albedo. (The density p itself would do
//! as well but for layers, whose chances follow the viewer.) The first is what m_l and m_c ask for, as they are j's own; they
//! bound A_m by L/(2·p_l).
//!
//! What a path found by a delta lobe of y is its own: nobody else's direction leads there.
//!
//! # Which surfaces
//!
//! Path j must find all that xᵢ would see: fⱼ is nowhere zero where fᵢ is not. Bsdfs answer for that
//! ([`crate::bsdf::Bsdf::scatters_everywhere`]). And y must be the same surface for both
//! ([`crate::material::Scatter::is_alike`]): normals that are turned to the viewer may not be. As that is a matter of y and of a
//! viewer alone, viewers of y fall into classes, and only those of one class share.

use super::{Joint, Link};
use crate::integrator::path_state::{PathState, Segment};
use crate::integrator::wave::Walker;
use crate::material::Layer;
use crate::math::ray::Ray;
use crate::spectrum::Rgb;
use glam::Vec3;

/// What arrives at a joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Apart {
    /// Whose joint.
    path: u32,
    /// The ray that found it.
    ray: Ray,
    /// What the path carried when it got there.
    carried: Rgb,
    /// Towards the sampled light.
    to_light: Vec3,
    /// Where the path went on.
    onwards: Vec3,
    /// f/(p·q) along the path, of the direction in which it went on.
    scattered: Rgb,
    /// What the path found, per unit of what it carried: by the light sample, at the next vertex, and beyond.
    light: Rgb,
    met: Rgb,
    beyond: Rgb,
    /// Whether it went on by a delta lobe, and what it found so.
    by_delta: bool,
    own: Rgb,
}

impl Apart {
    /// Of a path at its second vertex.
    pub(super) fn new(path: u32, state: &PathState) -> Self {
        let [to_light, onwards] = [Vec3::Z; 2];
        let [scattered, light, met, beyond, own] = [Rgb::BLACK; 5];
        let (ray, carried, by_delta) = (state.ray, state.throughput, false);
        Self { path, ray, carried, to_light, onwards, scattered, light, met, beyond, by_delta, own }
    }
}

/// Keeps the directions in which lights were sampled at second vertices, as (path, direction of any length).
pub(super) fn look_for_lights(all: &mut [Apart], samples: impl Iterator<Item = (u32, Vec3)>) {
    // Both are in the order of paths.
    let mut all = all.iter_mut().peekable();
    for (path, direction) in samples {
        while all.next_if(|apart| apart.path < path).is_some() {}
        if let Some(apart) = all.next_if(|apart| apart.path == path) {
            apart.to_light = direction.normalize();
        }
    }
}

/// Takes what paths have found by sampling lights at second vertices, and what scatters them on from there.
pub(super) fn part(all: &mut [Apart], paths: &mut [PathState]) {
    for apart in all {
        let path = &mut paths[apart.path as usize];
        apart.light = std::mem::replace(&mut path.radiance, Rgb::BLACK);
        if path.alive {
            apart.onwards = path.ray.d;
            apart.by_delta = !matches!(path.segment, Segment::Smooth { .. });
            apart.scattered = std::mem::replace(&mut path.throughput, Rgb::WHITE);
            path.carried *= apart.scattered;
        }
    }
}

/// Takes what paths have met at their third vertices.
pub(super) fn take_met(all: &mut [Apart], paths: &mut [PathState]) {
    for apart in all {
        let met = std::mem::replace(&mut paths[apart.path as usize].radiance, Rgb::BLACK);
        *if apart.by_delta { &mut apart.own } else { &mut apart.met } = apart.scattered * met;
    }
}

/// Takes what paths that have ended found beyond, and puts it together.
pub(super) fn meet(all: &mut [Apart], paths: &mut [PathState]) {
    for apart in all {
        let path = &mut paths[apart.path as usize];
        *if apart.by_delta { &mut apart.own } else { &mut apart.beyond } += apart.scattered * path.radiance;
        path.radiance = apart.light + apart.met + apart.beyond + apart.own;
        path.carried = apart.carried;
    }
}

/// a/b where b is not zero, else 0.
fn quotient(a: Rgb, b: Rgb) -> Rgb {
    let [a, b] = [a.to_array(), b.to_array()];
    let [x, y, z] = std::array::from_fn(|c| if b[c] > 0.0 { a[c] / b[c] } else { 0.0 });
    Rgb::new(x, y, z)
}

impl Walker<'_> {
    /// Gives what was found beyond a joint to its own path, and to those who see it by the links `free`.
    #[inline(never)]
    pub(super) fn give<'l>(
        &self,
        (joint, apart): (&Joint, &Apart),
        free: impl Iterator<Item = &'l Link> + Clone,
        scattered: &mut Vec<[Rgb; 2]>,
        paths: &mut [PathState],
        layers: &mut Vec<Layer>,
    ) {
        // Whoever finds a joint has been scattered before.
        let surface = match self.scene.regularizes() {
            false => self.scene.surface(&apart.ray, joint.hit, layers),
            true => self.scene.rougher_surface(&apart.ray, joint.hit, None, layers),
        };
        let [own, to_light, onwards] = [surface.wo, apart.to_light, apart.onwards].map(|w| surface.frame.to_local(w));
        let scatter = |wo: Vec3, wi: Vec3, arrives: Rgb| match arrives.is_black() {
            true => Rgb::BLACK,
            false => surface.bsdf.eval_pdf(wo, wi).0,
        };
        let to_own = scatter(own, onwards, apart.met + apart.beyond);
        let light = quotient(apart.light, scatter(own, to_light, apart.light));
        let [met, beyond] = [apart.met, apart.beyond].map(|scattered| quotient(scattered, to_own));
        let (mut density, mut of_both) = (joint.density, joint.density * f64::from(to_own.mean()));
        scattered.clear();
        for link in free.clone() {
            let wo = surface.frame.to_local(-link.wi);
            if !surface.bsdf.is_alike(own, wo) {
                scattered.push([Rgb::BLACK; 2]);
                continue;
            }
            let f = scatter(wo, onwards, met + beyond);
            scattered.push([scatter(wo, to_light, light) * light + f * met, f * beyond]);
            density += link.density;
            of_both += link.density * f64::from(f.mean());
        }
        let near = 1.0 / density;
        // Where nothing is scattered there, nothing was found beyond.
        let far = if apart.beyond.is_black() { 0.0 } else { f64::from(to_own.mean()) / of_both };
        let [to_near, to_far] = [near, far].map(|per| (joint.density * per) as f32);
        let path = &mut paths[apart.path as usize];
        path.radiance += path.carried * ((apart.light + apart.met) * to_near + apart.beyond * to_far + apart.own);
        for (link, [of_near, of_far]) in free.zip(&*scattered) {
            let [near, far] = [near, far].map(|per| (link.geometry * per) as f32);
            paths[link.from].radiance += link.f * (*of_near * near + *of_far * far);
        }
    }
}
