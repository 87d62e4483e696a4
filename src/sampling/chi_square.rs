//! The χ² test that samples follow the density they claim, over directions or over the unit square.
//!
//! The domain is mapped to a square; a k-d tree of cells is split where a pilot run of the sampler has many samples, so
//! that a lobe of a thousandth of a radian gets as many cells as a wide one; the density is integrated over each cell
//! adaptively, in f64. A density with mass where no samples fall leaves too little elsewhere, so nothing escapes the test
//! by lying outside the refined cells. Samples that the sampler declines (`None`) are a cell of their own, expected as
//! often as the density falls short of one.

#[cfg(test)]
use glam::Vec2;
use glam::{DVec2, Vec3};
use statrs::function::gamma::gamma_ur;
use std::f64::consts::TAU;

/// A cell is split while the pilot run has more samples in it.
const CELL_SAMPLES: usize = 48;
/// Most splits from the whole square to a cell: sides of 2⁻²², which is where directions in f32 end.
const CELL_DEPTH: u32 = 44;
/// Cells that expect fewer samples are pooled (Cochran 1954, *Some Methods for Strengthening the Common χ² Tests*).
const POOL: f64 = 5.0;
/// Error that the integral over a cell may have, in standard deviations of the cell's count: it then adds less than
/// 0.003 a cell to χ², whose standard deviation is √2 a cell.
const INTEGRAL_ERROR: f64 = 0.05;
/// Relative error that it may have in any case: below the noise of a density that is computed in f32 from directions with
/// seven digits, and far below the standard deviation of a count, which is some per cent.
const INTEGRAL_NOISE: f64 = 5e-4;
/// Most halvings of a cell's sides for its integral: what remains is the strip around a discontinuity.
const INTEGRAL_DEPTH: u32 = 8;
/// Most halvings around samples whose surroundings seem to have too little mass: a piece of a narrow lobe that reaches into a
/// large cell would fall between the points of the quadrature.
const SEARCH_DEPTH: u32 = 30;
/// They seem to where there is less mass than a cell's samples suggest, by so many standard deviations of their number: one
/// cell in fifteen is searched in vain.
const SUGGESTED_DEVIATIONS: f64 = 1.5;
/// Or less than this part of what they suggest: one or two samples do not suggest much.
const SUGGESTED_PART: f64 = 0.25;

/// What a test has found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    /// Probability that samples which follow the density deviate from it as much as these.
    pub(crate) p_value: f64,
    /// The density's integral over the domain.
    pub(crate) integral: f64,
    /// Share of the samples that the sampler declined.
    pub(crate) lost: f64,
    /// Degrees of freedom of χ².
    #[allow(dead_code, reason = "shown where a test fails")]
    pub(crate) freedom: f64,
}

/// The significance level of each of `tests` independent tests that together have the false-alarm rate `family`
/// (Šidák 1967).
pub(crate) fn sidak(family: f64, tests: usize) -> f64 {
    // 1 − (1 − p)^(1/n) without cancellation.
    -((-family).ln_1p() / tests as f64).exp_m1()
}

/// Tests whether `sample(0..samples)` has the density `pdf` per solid angle. Directions are unit vectors.
pub(crate) fn on_sphere(
    samples: u32,
    mut sample: impl FnMut(u32) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f64,
) -> Outcome {
    run(
        samples,
        |i| sample(i).map(sphere_to_square),
        |u| {
            let (w, area) = square_to_sphere(u);
            pdf(w) * area
        },
    )
}

/// Tests whether `sample(0..samples)` has the density `pdf` per area of the unit square.
#[cfg(test)]
pub(crate) fn on_square(
    samples: u32,
    mut sample: impl FnMut(u32) -> Option<Vec2>,
    pdf: impl Fn(Vec2) -> f64,
) -> Outcome {
    run(samples, |i| sample(i).map(Vec2::as_dvec2), |u| pdf(u.as_vec2()))
}

/// The upper hemisphere is the left half of the square, the lower one the right; along x runs √(1 − |z|), which resolves
/// narrow lobes around the poles, along y the azimuth.
fn sphere_to_square(w: Vec3) -> DVec2 {
    let w = w.as_dvec3().normalize();
    // 1 − |z| from x² + y², which keeps its digits at the poles.
    let t = ((w.x * w.x + w.y * w.y) / (1.0 + w.z.abs())).sqrt();
    let turn = (w.y.atan2(w.x) / TAU).rem_euclid(1.0);
    DVec2::new(0.5 * (t + f64::from(w.z < 0.0)), turn)
}

/// A direction, and the solid angle per area of the square there.
fn square_to_sphere(u: DVec2) -> (Vec3, f64) {
    let below = u.x >= 0.5;
    let t = 2.0 * u.x - f64::from(below);
    let (s, c) = (TAU * u.y).sin_cos();
    let r = t * (2.0 - t * t).sqrt();
    let z = if below { t * t - 1.0 } else { 1.0 - t * t };
    (Vec3::new((r * c) as f32, (r * s) as f32, z as f32), 4.0 * TAU * t)
}

/// A rectangle of the unit square.
#[derive(Clone, Copy, Debug)]
struct Cell {
    min: DVec2,
    max: DVec2,
}

impl Cell {
    const WHOLE: Self = Self { min: DVec2::ZERO, max: DVec2::ONE };

    fn halves(self, axis: usize) -> [Self; 2] {
        let middle = 0.5 * (self.min[axis] + self.max[axis]);
        let (mut low, mut high) = (self, self);
        low.max[axis] = middle;
        high.min[axis] = middle;
        [low, high]
    }

    fn contains(self, p: DVec2) -> bool {
        p.cmpge(self.min).all() && p.cmplt(self.max).all()
    }

    /// Where to look closer, and how deep that is: four quarters, or, if samples are found all along the cell but only in one
    /// half of its breadth, two halves: a lobe may touch the edge of a cell like a thread.
    fn parts(self, samples: &[DVec2], depth: Depth) -> (Vec<Self>, Depth) {
        let (low, high) = samples.iter().fold((self.max, self.min), |(l, h), &s| (l.min(s), h.max(s)));
        let spread = (high - low) / (self.max - self.min);
        let halvings = depth.halvings + 1;
        if samples.len() > 1 && spread.min_element() < 0.5 && spread.max_element() >= 0.5 {
            return (self.halves(usize::from(spread.y < spread.x)).to_vec(), Depth { halvings, ..depth });
        }
        let quarters = self.halves(0).into_iter().flat_map(|half| half.halves(1)).collect();
        (quarters, Depth { halvings, quarterings: depth.quarterings + 1 })
    }
}

/// How small a part of a cell is.
#[derive(Clone, Copy, Debug, Default)]
struct Depth {
    /// Times that both its sides have been halved.
    quarterings: u32,
    /// Times that at least one has been.
    halvings: u32,
}

/// A node of the tree: where it is split, or which cell it is.
enum Node {
    Split { axis: usize, at: f64, low: Box<Node>, high: Box<Node> },
    Leaf(usize),
}

impl Node {
    fn grow(cell: Cell, depth: u32, samples: &mut [DVec2], cells: &mut Vec<(Cell, Vec<DVec2>)>) -> Self {
        if samples.len() <= CELL_SAMPLES || depth == CELL_DEPTH {
            cells.push((cell, samples.to_vec()));
            return Self::Leaf(cells.len() - 1);
        }
        let axis = (depth % 2) as usize;
        let [low_cell, high_cell] = cell.halves(axis);
        let at = high_cell.min[axis];
        samples.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
        let (low, high) = samples.split_at_mut(samples.partition_point(|s| s[axis] < at));
        let low = Box::new(Self::grow(low_cell, depth + 1, low, cells));
        Self::Split { axis, at, low, high: Box::new(Self::grow(high_cell, depth + 1, high, cells)) }
    }

    fn find(&self, p: DVec2) -> usize {
        match self {
            Self::Leaf(cell) => *cell,
            Self::Split { axis, at, low, high } => if p[*axis] < *at { low } else { high }.find(p),
        }
    }
}

fn run(samples: u32, mut sample: impl FnMut(u32) -> Option<DVec2>, density: impl Fn(DVec2) -> f64) -> Outcome {
    let pilot = samples / 8;
    let mut seen: Vec<DVec2> = (0..pilot).filter_map(&mut sample).collect();
    let mut cells = Vec::new();
    let tree = Node::grow(Cell::WHOLE, 0, &mut seen, &mut cells);
    // The pilot has shaped the cells and so must not be counted in them.
    let count = samples - pilot;
    let (mut observed, mut lost) = (vec![0.0; cells.len()], 0.0);
    for i in pilot..samples {
        match sample(i) {
            Some(u) => {
                let cell = tree.find(u);
                observed[cell] += 1.0;
                cells[cell].1.push(u);
            }
            None => lost += 1.0,
        }
    }
    let n = f64::from(count);
    let integrator = Integrator { density, n, guides: f64::from(samples) };
    let cells = cells.into_iter().map(|(cell, guides)| n * integrator.integrate(cell, guides));
    let mut classes: Vec<(f64, f64)> = cells.zip(observed).collect();
    let integral = classes.iter().map(|c| c.0).sum::<f64>() / n;
    if lost > 0.0 {
        classes.push((n * (1.0 - integral).max(0.0), lost));
    }
    let (chi2, freedom) = statistic(classes);
    // NaN anywhere is the strongest rejection.
    let p_value = if chi2.is_finite() { gamma_ur(0.5 * freedom, (0.5 * chi2).max(f64::MIN_POSITIVE)) } else { 0.0 };
    Outcome { p_value, integral, lost: lost / n, freedom }
}

/// χ² and its degrees of freedom, from (expected, observed) of every class.
fn statistic(mut classes: Vec<(f64, f64)>) -> (f64, f64) {
    classes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut chi2, mut used, mut pool) = (0.0, 0.0, (0.0, 0.0));
    for (expected, observed) in classes {
        pool = (pool.0 + expected, pool.1 + observed);
        if pool.0 >= POOL {
            chi2 += (pool.1 - pool.0) * (pool.1 - pool.0) / pool.0;
            used += 1.0;
            pool = (0.0, 0.0);
        }
    }
    // What is left would be pooled with a larger class; it is so only where everything together expects too little.
    if pool.1 > 0.0 {
        chi2 += (pool.1 - pool.0) * (pool.1 - pool.0) / pool.0;
        used += 1.0;
    }
    (chi2, f64::max(used - 1.0, 1.0))
}

/// Integrates a density over cells, well enough for a test.
struct Integrator<F> {
    density: F,
    /// Samples that are tested.
    n: f64,
    /// Samples that say where to look.
    guides: f64,
}

impl<F: Fn(DVec2) -> f64> Integrator<F> {
    fn integrate(&self, cell: Cell, guides: Vec<DVec2>) -> f64 {
        self.refine(cell, quadrature(cell, &self.density), Depth::default(), false, guides)
    }

    /// The integral over a cell whose quadrature is `coarse`, and into which samples have fallen. (That they guide where to look closer does
    /// not change what is integrated; the tested ones do, too, since a thread of mass may have none of the pilot run.) Two levels in sequence must agree, of which
    /// the upper may have agreed `before`: that one level agrees with the next happens by chance.
    fn refine(&self, cell: Cell, coarse: f64, depth: Depth, before: bool, mut guides: Vec<DVec2>) -> f64 {
        let (parts, below) = cell.parts(&guides, depth);
        let parts: Vec<(Cell, f64)> = parts.into_iter().map(|p| (p, quadrature(p, &self.density))).collect();
        let fine: f64 = parts.iter().map(|p| p.1).sum();
        // Errors of parts have either sign, and add like their squares: each of four may have half the whole's.
        let scale = 0.5_f64.powi(depth.quarterings.cast_signed());
        let error = INTEGRAL_ERROR * f64::max(fine * self.n, 1.0).sqrt() / self.n * scale;
        let agrees = (fine - coarse).abs() <= error.max(INTEGRAL_NOISE * fine);
        let settled = (agrees && before) || depth.quarterings >= INTEGRAL_DEPTH;
        let seen = guides.len() as f64;
        let suggested = f64::max(seen - SUGGESTED_DEVIATIONS * seen.sqrt(), SUGGESTED_PART * seen);
        let suspicious = fine * self.guides < suggested;
        if (settled && !suspicious) || depth.halvings >= SEARCH_DEPTH || fine.is_nan() {
            return fine;
        }
        let mut sum = 0.0;
        for (part, value) in parts {
            let inside = guides.extract_if(.., |p| part.contains(*p)).collect();
            sum += self.refine(part, value, below, agrees, inside);
        }
        sum
    }
}

/// Gauss and Legendre's rule of four points along each side.
fn quadrature(cell: Cell, density: &impl Fn(DVec2) -> f64) -> f64 {
    const X: [f64; 2] = [0.339_981_043_584_856_26, 0.861_136_311_594_052_6];
    const W: [f64; 2] = [0.652_145_154_862_546_1, 0.347_854_845_137_453_85];
    let (middle, half) = (0.5 * (cell.min + cell.max), 0.5 * (cell.max - cell.min));
    let mut sum = 0.0;
    for i in 0..2 {
        for j in 0..2 {
            for sign in [DVec2::new(1.0, 1.0), DVec2::new(-1.0, 1.0), DVec2::new(1.0, -1.0), DVec2::new(-1.0, -1.0)] {
                sum += W[i] * W[j] * density(middle + half * sign * DVec2::new(X[i], X[j]));
            }
        }
    }
    sum * half.x * half.y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Sampler, SamplerKind};
    use crate::sampling::warp;

    const SAMPLES: u32 = 100_000;

    fn uniform(i: u32) -> Vec2 {
        Sampler { kind: SamplerKind::Independent, seed: 3 }.stream(0, 0, i).bsdf(0).direction()
    }

    /// A cone of half angle 1/1000 around a direction that no cell is aligned with.
    fn narrow(i: u32) -> Option<Vec3> {
        let axis = Vec3::new(0.48, -0.6, 0.64);
        Some(crate::math::frame::Frame::from_normal(axis).to_world(warp::square_to_uniform_cone(uniform(i), 5e-7)))
    }

    fn cone_pdf(w: Vec3, radius: f32) -> f64 {
        if w.distance(Vec3::new(0.48, -0.6, 0.64)) < radius {
            1.0 / (std::f64::consts::PI * f64::from(radius).powi(2))
        } else {
            0.0
        }
    }

    #[test]
    fn right_densities_are_accepted() {
        // Five tests with a family-wise false-alarm rate of 1 %.
        let level = sidak(0.01, 5);
        let hemisphere = |i| Some(warp::square_to_cosine_hemisphere(uniform(i)));
        let half = |i| hemisphere(i).filter(|w| w.x > 0.0);
        let outcomes =
            [
                on_sphere(SAMPLES, hemisphere, |w| warp::square_to_cosine_hemisphere_pdf(w).0.into()),
                on_sphere(SAMPLES, half, |w| {
                    if w.x > 0.0 { warp::square_to_cosine_hemisphere_pdf(w).0.into() } else { 0.0 }
                }),
                on_sphere(
                    SAMPLES,
                    |i| Some(warp::square_to_uniform_sphere(uniform(i))),
                    |_| 0.25 * std::f64::consts::FRAC_1_PI,
                ),
                on_sphere(SAMPLES, narrow, |w| cone_pdf(w, 1e-3)),
                on_square(SAMPLES, |i| Some(uniform(i) * uniform(i)), |u| f64::from(0.25 / (u.x * u.y).sqrt())),
            ];
        for (i, o) in outcomes.iter().enumerate() {
            assert!(o.p_value > level && o.freedom > 150.0, "{i}: {o:?}");
            assert!((o.integral + o.lost - 1.0).abs() < 0.01, "{i}: {o:?}");
        }
        assert!((outcomes[1].lost - 0.5).abs() < 0.01, "{:?}", outcomes[1]);
    }

    #[test]
    fn wrong_densities_are_rejected() {
        let hemisphere = |i| Some(warp::square_to_cosine_hemisphere(uniform(i)));
        let cosine = |w: Vec3| f64::from(w.z.max(0.0)) * std::f64::consts::FRAC_1_PI;
        let rejected = [
            // Uniform instead of cosine; a lean of 20 % to one side; 5 % too much everywhere; mass below the horizon;
            // NaN; a lobe of the right shape and the wrong width; half the samples lost without saying so.
            on_sphere(SAMPLES, hemisphere, |w| if w.z > 0.0 { 0.5 * std::f64::consts::FRAC_1_PI } else { 0.0 }),
            on_sphere(SAMPLES, hemisphere, |w| cosine(w) * (1.0 + 0.2 * f64::from(w.x))),
            on_sphere(SAMPLES, hemisphere, |w| 1.05 * cosine(w)),
            on_sphere(SAMPLES, hemisphere, |w| 0.95 * cosine(w) + 0.05 * cosine(-w)),
            on_sphere(SAMPLES, hemisphere, |_| f64::NAN),
            on_sphere(SAMPLES, narrow, |w| cone_pdf(w, 1.05e-3)),
            on_sphere(SAMPLES, |i| hemisphere(i).filter(|w| w.x > 0.0), cosine),
        ];
        for (i, o) in rejected.iter().enumerate() {
            assert!(o.p_value < 1e-6, "{i}: {o:?}");
        }
    }

    #[test]
    fn levels_of_a_family() {
        assert!((sidak(0.01, 1) - 0.01).abs() < 1e-15);
        assert!((1.0 - (1.0 - sidak(0.01, 100)).powi(100) - 0.01).abs() < 1e-12);
    }
}
