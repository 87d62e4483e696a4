//! Multiple importance sampling (Veach 1997, *Robust Monte Carlo Methods for Light Transport Simulation*, chapter 9).

use super::pdf::SolidAnglePdf;

/// Weight of a sample drawn by `own` where `other` could have drawn it too, one sample from each:
/// p² / (p² + q²), the power heuristic with β = 2 (Veach 1997, section 9.2.3). In [0, 1]; the weights of both
/// techniques add to one. Zero where `own` is zero.
#[inline]
pub fn power_heuristic(own: SolidAnglePdf, other: SolidAnglePdf) -> f32 {
    // A zero density cannot have drawn the sample; a NaN falls here too. As a ratio, so that no square overflows.
    if own.0 > 0.0 {
        let r = other.0 / own.0;
        1.0 / (1.0 + r * r)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_both_techniques_add_to_one_over_all_magnitudes() {
        for i in -30..=30 {
            for j in -30..=30 {
                let (p, q) = (SolidAnglePdf(10f32.powi(i)), SolidAnglePdf(10f32.powi(j)));
                let sum = power_heuristic(p, q) + power_heuristic(q, p);
                assert!((sum - 1.0).abs() <= 4.0 * f32::EPSILON, "p {p:?} q {q:?}: {sum}");
            }
        }
        assert_eq!(power_heuristic(SolidAnglePdf(1.0), SolidAnglePdf(0.0)), 1.0);
        assert_eq!(power_heuristic(SolidAnglePdf(0.0), SolidAnglePdf(1.0)), 0.0);
        assert_eq!(power_heuristic(SolidAnglePdf(1.0), SolidAnglePdf(f32::INFINITY)), 0.0);
    }
}
