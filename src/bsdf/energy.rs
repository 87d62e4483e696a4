//! How much light microfacets give back after one scattering, tabulated, and what is added for the light that they scatter
//! several times.
//!
//! A lobe that counts one scattering loses what facets reflect to each other. With E(μ) the part that comes back of light
//! seen under the cosine μ, and Ē = 2∫E·μ dμ, the lobe (1−E(μo))·(1−E(μi)) / (π·(1−Ē)) returns just what is missing and is
//! reciprocal (Kulla and Conty 2017, *Revisiting Physically Based Shading at Imageworks*). Facets that absorb do so at every
//! scattering ([`several`]). A rough interface loses light on both sides; see [`Loss`].
//!
//! Tables are made when they are first asked for, once for a shape of the microfacets and an index of refraction, by the
//! functions that scatter, and are interpolated linearly.

use super::fresnel::{self, Contrast};
use super::microfacet::{Distribution, Microfacets};
use crate::math::float::{max, min, safe_sqrt, sqr};
use crate::math::quadrature::gauss_legendre;
use crate::sampling::warp::sin_cos_turns;
use crate::spectrum::Rgb;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use std::sync::{LazyLock, Mutex, OnceLock, PoisonError};

/// Nodes of a table in √α, from 0 to 1.
const ROUGHNESSES: usize = 24;

/// Nodes in √α of means over all directions.
const MEANS: usize = 64;

/// Where the nodes are at which a table knows the cosine of the angle of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Grid {
    /// Evenly spaced in x = μ·(1 + α)/(μ + α): for what facets hide from each other, which happens where μ is of the size
    /// of α, and is in terms of x much the same for all small α.
    Stretched,
    /// Evenly spaced in √μ: for what depends on the angle under which facets are seen, too, most of all near the horizon.
    Root,
}

impl Grid {
    const fn nodes(self) -> usize {
        match self {
            Self::Stretched => 32,
            Self::Root => 64,
        }
    }

    /// Where the cosine is in [0, 1] of the nodes.
    #[inline]
    fn of(self, alpha: f32, cos: f32) -> f32 {
        match self {
            Self::Stretched => cos * (1.0 + alpha) / (cos + alpha),
            Self::Root => cos.sqrt(),
        }
    }

    /// The cosine there.
    fn cos(self, alpha: f32, x: f32) -> f32 {
        match self {
            Self::Stretched => x * alpha / (1.0 + alpha - x),
            Self::Root => x * x,
        }
    }
}

/// Numbers that depend on the roughness and the angle of view.
#[derive(Debug)]
pub(super) struct Table<const N: usize> {
    grid: Grid,
    at: Vec<[f32; N]>,
}

/// Cosine-weighted means over the hemisphere of numbers that depend on the roughness and the angle of view.
#[derive(Debug)]
pub(super) struct Means<const N: usize>(Vec<[f32; N]>);

/// What is between two nodes: the first, and how far on.
#[derive(Clone, Copy)]
struct Between {
    first: usize,
    part: f32,
}

impl Between {
    /// `t` in [0, 1] among `nodes`; NaN counts as 0.
    #[inline]
    fn new(t: f32, nodes: usize) -> Self {
        let x = min(max(t, 0.0), 1.0) * (nodes - 1) as f32;
        let first = (x as usize).min(nodes - 2);
        Self { first, part: x - first as f32 }
    }

    #[inline]
    fn of<const N: usize>(self, a: &[f32; N], b: &[f32; N]) -> [f32; N] {
        std::array::from_fn(|k| a[k] + self.part * (b[k] - a[k]))
    }
}

impl<const N: usize> Table<N> {
    /// Tabulates `f(α, cosine)`.
    pub(super) fn new(grid: Grid, f: impl Fn(f32, f32) -> [f32; N]) -> Self {
        /// Stands for a cosine of 0, under which nothing is seen; over α, as that is what it is compared with.
        const LEAST: f32 = 1e-6;
        let nodes = grid.nodes();
        let mut at = Vec::with_capacity(ROUGHNESSES * nodes);
        for i in 0..ROUGHNESSES {
            let root = i as f32 / (ROUGHNESSES - 1) as f32;
            let alpha = max(root * root, Microfacets::MIN_ALPHA);
            for j in 0..nodes {
                let cos = grid.cos(alpha, j as f32 / (nodes - 1) as f32);
                at.push(f(alpha, min(max(cos, LEAST * alpha), 1.0)));
            }
        }
        Self { grid, at }
    }

    /// The numbers for a roughness α in [0, 1] seen under the cosine `cos` in [0, 1].
    #[inline]
    pub(super) fn at(&self, alpha: f32, cos: f32) -> [f32; N] {
        let nodes = self.grid.nodes();
        let (row, column) = (Between::new(alpha.sqrt(), ROUGHNESSES), Between::new(self.grid.of(alpha, cos), nodes));
        let in_row = |row: usize| {
            let row = &self.at[row * nodes + column.first..][..2];
            column.of(&row[0], &row[1])
        };
        row.of(&in_row(row.first), &in_row(row.first + 1))
    }
}

impl<const N: usize> Means<N> {
    /// Of `f(α, cosine)`. Given what is interpolated, so that what is added for a loss is the loss.
    pub(super) fn new(f: impl Fn(f32, f32) -> [f32; N]) -> Self {
        /// Nodes of the integral: twice as many as any table has.
        const ANGLES: usize = 128;
        let rule = gauss_legendre(ANGLES);
        let mean = |i: usize| {
            let root = i as f32 / (MEANS - 1) as f32;
            let alpha = max(root * root, Microfacets::MIN_ALPHA);
            let mut sum = [0.0f64; N];
            for &(mu, weight) in &rule {
                for (s, v) in sum.iter_mut().zip(f(alpha, mu as f32)) {
                    *s += 2.0 * weight * mu * f64::from(v);
                }
            }
            sum.map(|s| s as f32)
        };
        Self((0..MEANS).map(mean).collect())
    }

    /// Of a roughness α in [0, 1].
    #[inline]
    pub(super) fn at(&self, alpha: f32) -> [f32; N] {
        let row = Between::new(alpha.sqrt(), MEANS);
        row.of(&self.0[row.first], &self.0[row.first + 1])
    }
}

/// A rule for integrals over visible normals: nodes along the direction of view, and across it, where half is enough for
/// either side.
struct Rule {
    along: Vec<(f64, f64)>,
    across: Vec<(f64, f64)>,
}

/// For what changes smoothly with the normal.
static SMOOTH: LazyLock<Rule> = LazyLock::new(|| Rule { along: gauss_legendre(32), across: gauss_legendre(16) });

/// For what has an edge where facets begin to reflect everything.
static WITH_EDGE: LazyLock<Rule> = LazyLock::new(|| Rule { along: gauss_legendre(96), across: gauss_legendre(48) });

/// The mean of `f` over the microfacets' normals that are seen under the cosine `cos`; `f` gets the direction of view and the
/// normal, and counts times the masking that the density of normals is too small by (Beckmann's is approximate).
fn mean_over_normals<const N: usize>(
    facets: &Microfacets,
    cos: f32,
    rule: &Rule,
    f: impl Fn(Vec3, Vec3) -> [f32; N],
) -> [f32; N] {
    let Rule { along, across } = rule;
    let wo = seen_under(cos);
    let view = facets.view(wo);
    let mut sum = [0.0f64; N];
    for &(y, along) in along {
        for &(x, across) in across {
            let m = match facets.distribution() {
                // The azimuth from the direction of view, by half.
                Distribution::Ggx => facets.sample_visible(wo, Vec2::new(0.5 * x as f32, y as f32)),
                Distribution::Beckmann => facets.sample_visible(wo, Vec2::new(y as f32, 0.5 * x as f32)),
            };
            for (s, v) in sum.iter_mut().zip(f(wo, m)) {
                *s += along * across * f64::from(v);
            }
        }
    }
    sum.map(|s| s as f32 * (view.masking / view.visible))
}

/// A direction of this cosine in the plane of z and x.
fn seen_under(cos: f32) -> Vec3 {
    Vec3::new(safe_sqrt((1.0 - cos) * (1.0 + cos)), 0.0, cos)
}

/// How much of the light leaves facets that reflect everything by the normal `m` (G₁ of where it goes).
fn reflected(facets: &Microfacets, wo: Vec3, m: Vec3) -> f32 {
    let wi = 2.0 * wo.dot(m) * m - wo;
    if wi.z > 0.0 { facets.g1(wi, m) } else { 0.0 }
}

/// Microfacets that reflect everything.
#[derive(Debug)]
pub(super) struct Mirrors {
    returned: Table<1>,
    means: Means<1>,
}

impl Mirrors {
    /// The tables for facets of a shape.
    pub(super) fn of(distribution: Distribution) -> &'static Self {
        static GGX: LazyLock<Mirrors> = LazyLock::new(|| Mirrors::new(Distribution::Ggx));
        static BECKMANN: LazyLock<Mirrors> = LazyLock::new(|| Mirrors::new(Distribution::Beckmann));
        match distribution {
            Distribution::Ggx => &GGX,
            Distribution::Beckmann => &BECKMANN,
        }
    }

    fn new(distribution: Distribution) -> Self {
        let returned = Table::new(Grid::Stretched, |alpha, cos| {
            let facets = Microfacets::new(distribution, alpha, alpha);
            mean_over_normals(&facets, cos, &SMOOTH, |wo, m| [reflected(&facets, wo, m)])
        });
        let means = Means::new(|alpha, cos| returned.at(alpha, cos));
        Self { returned, means }
    }

    /// What comes back seen under the cosine `cos`, E.
    #[inline]
    pub(super) fn returned(&self, alpha: f32, cos: f32) -> f32 {
        min(self.returned.at(alpha, cos)[0], 1.0)
    }

    /// The cosine-weighted mean of that over the hemisphere, Ē.
    #[inline]
    pub(super) fn mean_returned(&self, alpha: f32) -> f32 {
        min(self.means.at(alpha)[0], 1.0)
    }
}

/// The mean of `g(cosine)` over what facets reflect that reflect everything.
fn mean_part(distribution: Distribution, g: impl Fn(f32) -> f32) -> Table<1> {
    Table::new(Grid::Root, |alpha, cos| {
        let facets = Microfacets::new(distribution, alpha, alpha);
        let [all, part] = mean_over_normals(&facets, cos, &SMOOTH, |wo, m| {
            let back = reflected(&facets, wo, m);
            [back, back * g(min(wo.dot(m), 1.0))]
        });
        [part / all]
    })
}

/// What a rough interface between dielectrics loses at one scattering, seen from one of its sides.
///
/// Its reflectance may be any combination of 1 and g of [`Contrast`], where light is not totally reflected.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loss {
    /// Of what is totally reflected.
    total: f32,
    /// Elsewhere, if everything was reflected; if g of it was; if everything was refracted; if 1 − g of it was.
    reflected: f32,
    reflected_g: f32,
    refracted: f32,
    refracted_g: f32,
}

impl Loss {
    /// Altogether, where the reflectance is r₀ + r₁·g.
    #[inline]
    pub(super) fn of(&self, [r0, r1]: [f32; 2]) -> f32 {
        let reflected = r0 * self.reflected + r1 * self.reflected_g;
        // 1 − r₀ − r₁·g = (1 − r₀ − r₁) + r₁·(1 − g).
        let refracted = (1.0 - r0 - r1) * self.refracted + r1 * self.refracted_g;
        max(self.total + reflected + refracted, 0.0)
    }

    /// Altogether, where the interface is a bare one of this index.
    #[inline]
    pub(super) fn bare(&self, eta: f32) -> f32 {
        let normal = Contrast::new(eta).normal;
        min(self.of([normal, 1.0 - normal]), 1.0)
    }

    #[inline]
    fn from([total, reflected, reflected_g, refracted, refracted_g]: [f32; 5]) -> Self {
        Self { total, reflected, reflected_g, refracted, refracted_g }
    }
}

/// What a rough interface reflects at one scattering.
#[derive(Clone, Copy, Debug)]
pub(super) struct Returned {
    /// If all of it is reflected, E.
    pub(super) all: f32,
    /// If g of it is.
    pub(super) part: f32,
}

/// A rough interface between dielectrics.
#[derive(Debug)]
pub(super) struct Interface {
    distribution: Distribution,
    eta: f32,
    /// The mean of g over what is reflected outside, and what that comes to over all directions.
    part: Table<1>,
    mean_part: Means<1>,
    /// The mean of g over the hemisphere, of a smooth interface seen from outside.
    pub(super) smooth: f32,
    /// What is lost outside and inside.
    lost: [OnceLock<(Table<5>, Means<5>)>; 2],
}

impl PartialEq for Interface {
    fn eq(&self, other: &Self) -> bool {
        self.distribution == other.distribution && self.eta.to_bits() == other.eta.to_bits()
    }
}

impl Interface {
    /// The tables for facets of a shape and an index of refraction inside relative to outside: made once, and kept to the
    /// end of the process.
    pub(super) fn of(distribution: Distribution, eta: f32) -> &'static Self {
        static ALL: Mutex<Vec<&'static Interface>> = Mutex::new(Vec::new());
        // What a thread that panicked has left there is whole.
        let mut all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = all.iter().find(|i| i.distribution == distribution && i.eta.to_bits() == eta.to_bits()) {
            return known;
        }
        let made: &'static Self = Box::leak(Box::new(Self::new(distribution, eta)));
        all.push(made);
        made
    }

    fn new(distribution: Distribution, eta: f32) -> Self {
        /// Nodes of the mean over directions.
        const DIRECTIONS: usize = 256;
        let contrast = Contrast::new(eta);
        let g = |cos: f32| contrast.part(fresnel::dielectric(cos, eta).reflectance);
        let rule = gauss_legendre(DIRECTIONS);
        let smooth = rule.iter().map(|&(mu, w)| 2.0 * w * mu * f64::from(g(mu as f32))).sum::<f64>() as f32;
        let part = mean_part(distribution, g);
        let mirrors = Mirrors::of(distribution);
        let mean_part = Means::new(|alpha, cos| [mirrors.returned(alpha, cos) * part.at(alpha, cos)[0]]);
        Self { distribution, eta, part, mean_part, smooth, lost: [OnceLock::new(), OnceLock::new()] }
    }

    /// What comes back on the outside, seen under the cosine `cos`: all of what is reflected, and of the part g.
    #[inline]
    pub(super) fn returned(&self, alpha: f32, cos: f32) -> Returned {
        let all = Mirrors::of(self.distribution).returned(alpha, cos);
        Returned { all, part: all * self.part.at(alpha, cos)[0] }
    }

    /// The cosine-weighted means of that over the hemisphere.
    #[inline]
    pub(super) fn mean_returned(&self, alpha: f32) -> Returned {
        Returned { all: Mirrors::of(self.distribution).mean_returned(alpha), part: self.mean_part.at(alpha)[0] }
    }

    /// What is lost, seen under the cosine `cos` from `outside` or from inside.
    #[inline]
    pub(super) fn lost(&self, outside: bool, alpha: f32, cos: f32) -> Loss {
        Loss::from(self.losses(outside).0.at(alpha, cos))
    }

    /// The cosine-weighted mean of that over the hemisphere.
    #[inline]
    pub(super) fn mean_lost(&self, outside: bool, alpha: f32) -> Loss {
        Loss::from(self.losses(outside).1.at(alpha))
    }

    /// The mean transmittance of the smooth interface over the hemisphere outside.
    pub(super) fn through(&self) -> f32 {
        let normal = Contrast::new(self.eta).normal;
        1.0 - (normal + (1.0 - normal) * self.smooth)
    }

    /// Which part of what one scattering loses goes to the other side, seen from `outside` or inside, where all over the
    /// hemisphere `lost` are lost on this side and on the other, and `through` is transmitted by the smooth interface from
    /// outside.
    ///
    /// With the mean transmittances T̄₁ = η²·T̄₂ the part T̄·min(1, lost there / lost here) makes both ways the same.
    pub(super) fn crosses(&self, outside: bool, lost: [f32; 2], through: f32) -> f32 {
        let through = if outside { through } else { through / sqr(self.eta) };
        let [here, there] = lost;
        through * if here > there { there / here } else { 1.0 }
    }

    #[inline]
    fn losses(&self, outside: bool) -> &(Table<5>, Means<5>) {
        self.lost[usize::from(!outside)].get_or_init(|| {
            let table = self.loss(outside);
            let means = Means::new(|alpha, cos| table.at(alpha, cos));
            (table, means)
        })
    }

    fn loss(&self, outside: bool) -> Table<5> {
        let contrast = Contrast::new(self.eta);
        let eta = if outside { self.eta } else { 1.0 / self.eta };
        let rule: &Rule = if eta < 1.0 { &WITH_EDGE } else { &SMOOTH };
        Table::new(Grid::Stretched, |alpha, cos| {
            let facets = Microfacets::new(self.distribution, alpha, alpha);
            let seen = facets.view(seen_under(cos));
            // Over the factor that the mean is multiplied by.
            let everything = seen.visible / seen.masking;
            mean_over_normals(&facets, cos, rule, |wo, m| {
                let cos = min(wo.dot(m), 1.0);
                let interface = fresnel::dielectric(cos, eta);
                let back = everything - reflected(&facets, wo, m);
                if interface.transmittance == 0.0 {
                    return [back, 0.0, 0.0, 0.0, 0.0];
                }
                let wi = (cos / eta - interface.cos_t) * m - wo / eta;
                let through = everything - if wi.z < 0.0 { facets.g1(wi, m) } else { 0.0 };
                let g = contrast.part(interface.reflectance);
                [0.0, back, back * g, through, through * (1.0 - g)]
            })
        })
    }
}

/// What comes back of light that is scattered several times by facets of mean reflectance F̄, over what is missing after one
/// scattering: F̄²·Ē / (1 − F̄·(1 − Ē)), a geometric series (Hill 2018, *A Multi-Faceted Exploration*, part 3).
#[inline]
pub(super) fn several(mean_reflectance: Rgb, mean_returned: f32) -> Rgb {
    mean_reflectance.map(|f| f * f * mean_returned / (1.0 - f * (1.0 - mean_returned)))
}

/// The lobe of what is missing after one scattering, (1−E(μo))·(1−E(μi)) / (π·(1−Ē)), times π; 0 where nothing is missing.
#[inline]
pub(super) fn missing(lost_o: f32, lost_i: f32, mean_lost: f32) -> f32 {
    // The larger quotient may be large, the product is not: what is lost grows from the normal to the horizon.
    if mean_lost > 0.0 { lost_o * (lost_i / mean_lost) } else { 0.0 }
}

/// Roughness for the tables of microfacets, which end at 1.
#[inline]
pub(super) fn tabulated(facets: &Microfacets) -> f32 {
    min(facets.smallest_alpha(), 1.0)
}

/// Directions for what is missing after one scattering: facets hide each other most near the horizon, the more so the
/// smoother they are. Of cosine μ with the density 2μ / ((μ² + α²)·ln(1 + 1/α²)), which falls off as the loss does.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    alpha2: f32,
    log: f32,
}

impl Spread {
    /// For facets of roughness α.
    #[inline]
    pub(super) fn new(alpha: f32) -> Self {
        let alpha2 = sqr(alpha);
        Self { alpha2, log: libm::log1pf(1.0 / alpha2) }
    }

    /// A direction above the surface.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> Vec3 {
        let cos2 = min(self.alpha2 * libm::expm1f(u.y * self.log), 1.0);
        let (sin, cos) = sin_cos_turns(u.x);
        let r = safe_sqrt(1.0 - cos2);
        Vec3::new(r * cos, r * sin, cos2.sqrt())
    }

    /// Density of [`Self::sample`] per solid angle, of `w` above the surface.
    #[inline]
    pub(super) fn pdf(&self, w: Vec3) -> f32 {
        w.z / (PI * (sqr(w.z) + self.alpha2) * self.log)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_what_facets_return() {
        /// Largest error of a table, of albedos up to 1; see the docs of the module.
        const ERROR: f32 = 1e-3;
        let fine = Rule { along: gauss_legendre(256), across: gauss_legendre(128) };
        for distribution in [Distribution::Ggx, Distribution::Beckmann] {
            let mirrors = Mirrors::of(distribution);
            for alpha in [0.0025f32, 0.01, 0.04, 0.16, 0.49, 1.0] {
                let facets = Microfacets::new(distribution, alpha, alpha);
                for x in [0.05f32, 0.2, 0.5, 0.8, 0.95] {
                    let cos = Grid::Stretched.cos(alpha, x);
                    let [exact] = mean_over_normals(&facets, cos, &fine, |wo, m| [reflected(&facets, wo, m)]);
                    let table = mirrors.returned(alpha, cos);
                    assert!((table - exact).abs() < ERROR, "{distribution:?} {alpha} {cos}: {table}, not {exact}");
                }
            }
        }
    }
}
