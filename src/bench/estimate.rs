//! The error of pictures against a reference, and whether the reference is good enough to measure it.
//!
//! With weights w = 1/(r² + 0.01) a picture's error is mean(w(x − r)²). Its expectation is that of a perfect reference plus
//! the reference's own error mean(w·Var r), which is subtracted where it is known.
//!
//! Pictures of different seeds are independent, but share the reference: mean(w(xᵢ − r)(xⱼ − r)) over pairs i ≠ j has the
//! expectation of the reference's squared error, and of whatever makes the pictures' own expectation another. This checks
//! what is said of the reference, and stands in where nothing is.

use crate::image::Picture;
use crate::spectrum::Rgb;

/// What is added to r²: see [`crate::image::compare`].
const FLOOR: f64 = 0.01;

/// A reference must be so many times better than what it measures.
pub const LEAST_RATIO: f64 = 10.0;

/// Standard errors by which pictures must miss a reference before it is blamed: reconstruction filters make neighbours alike,
/// which the standard error does not know, and which is worth a factor of less than two.
const SIGNIFICANT: f64 = 5.0;

/// What pictures are measured against.
pub struct Reference {
    picture: Picture,
    /// mean(w·Var r), if the variance is known.
    own_error: Option<f64>,
}

impl Reference {
    /// A picture and, if it is known, the variance of its pixels, of the same size.
    pub fn new(picture: Picture, variance: Option<&Picture>) -> Self {
        let own_error = variance.map(|variance| {
            mean(picture.pixels().iter().zip(variance.pixels()).map(|(&r, v)| {
                let v = v.to_array().map(f64::from);
                let w = weights(r);
                (0..3).map(|c| w[c] * v[c]).sum::<f64>() / 3.0
            }))
        });
        Self { picture, own_error }
    }

    /// The mean of two independent pictures of equal quality, whose difference tells how far it is from the truth:
    /// Var((a + b)/2) is the expectation of (a − b)²/4.
    pub fn of_halves(a: &Picture, b: &Picture) -> Self {
        let (mut picture, mut variance) = (a.clone(), a.clone());
        for y in 0..a.height() {
            for x in 0..a.width() {
                let (a, b) = (a.get(x, y).0, b.get(x, y).0);
                picture.set(x, y, Rgb(0.5 * (a + b)));
                variance.set(x, y, Rgb(0.25 * (a - b) * (a - b)));
            }
        }
        Self::new(picture, Some(&variance))
    }

    /// The picture.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// Its own error, if it is known.
    pub fn own_error(&self) -> Option<f64> {
        self.own_error
    }

    /// The error of a picture of the same size, the reference's own subtracted if it is known.
    pub fn error_of(&self, picture: &Picture) -> f64 {
        let squares = differences(picture, &self.picture).map(|(w, d)| (0..3).map(|c| w[c] * d[c] * d[c]).sum::<f64>());
        mean(squares) / 3.0 - self.own_error.unwrap_or(0.0)
    }
}

/// 1/(r² + 0.01) of each channel; 0 for what is not finite, which is thus left out.
pub(super) fn weights(r: Rgb) -> [f64; 3] {
    if !r.is_finite() {
        return [0.0; 3];
    }
    r.to_array().map(|r| 1.0 / (f64::from(r) * f64::from(r) + FLOOR))
}

/// Weights and differences of each pixel; those that are not finite are left out.
fn differences<'a>(picture: &'a Picture, reference: &'a Picture) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + 'a {
    picture.pixels().iter().zip(reference.pixels()).map(|(&x, &r)| {
        if !x.is_finite() || !r.is_finite() {
            return ([0.0; 3], [0.0; 3]);
        }
        let (x, own) = (x.to_array(), r.to_array());
        (weights(r), std::array::from_fn(|c| f64::from(x[c]) - f64::from(own[c])))
    })
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_u64);
    for value in values {
        sum += value;
        count += 1;
    }
    sum / count.max(1) as f64
}

/// Sums over pictures of the same kind with different seeds.
#[derive(Clone, Debug, Default)]
pub struct Errors {
    pictures: u32,
    /// Of each pixel: Σ√w(x − r) by channel, and Σw(x − r)² over channels.
    sums: Vec<([f64; 3], f64)>,
}

/// What all pictures have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shared {
    /// Their mean squared error that is not independent: the reference's, and their own bias.
    pub error: f64,
    /// Standard error that it would have if there were none: by the noise of the pictures.
    pub deviation: f64,
}

impl Errors {
    /// Counts a picture.
    pub fn add(&mut self, picture: &Picture, reference: &Reference) {
        self.sums.resize(picture.pixels().len(), ([0.0; 3], 0.0));
        self.pictures += 1;
        for ((sum, squares), (w, d)) in self.sums.iter_mut().zip(differences(picture, &reference.picture)) {
            for c in 0..3 {
                sum[c] += w[c].sqrt() * d[c];
                *squares += w[c] * d[c] * d[c];
            }
        }
    }

    /// Root of the mean over pictures and channels of the relative squared error of each pixel, row by row.
    pub fn map(&self) -> Vec<f32> {
        let count = 3.0 * f64::from(self.pictures.max(1));
        self.sums.iter().map(|(_, squares)| (squares / count).sqrt() as f32).collect()
    }

    /// The mean over pairs of pictures of the product of their errors; `None` for fewer than two pictures.
    pub fn shared(&self) -> Option<Shared> {
        if self.pictures < 2 || self.sums.is_empty() {
            return None;
        }
        let pairs = f64::from(self.pictures) * f64::from(self.pictures - 1);
        let n = f64::from(self.pictures);
        let (mut products, mut noise) = (0.0, 0.0);
        for (sum, squares) in &self.sums {
            let of_sum = sum.iter().map(|s| s * s).sum::<f64>();
            products += (of_sum - squares) / pairs;
            // The variance of one picture's error there, by the pictures' difference from their mean.
            let variance = (squares - of_sum / n) / (n - 1.0);
            // Of the mean of n(n − 1)/2 products of two such errors, channels being alike at worst.
            noise += 2.0 * variance * variance / pairs;
        }
        let values = 3.0 * self.sums.len() as f64;
        let (error, deviation) = (products / values, noise.sqrt() / values);
        Some(Shared { error, deviation })
    }
}

/// Whether a reference can measure an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// It is good enough; its own error is this.
    Fine(f64),
    /// Its own error, this, is more than a tenth of what it is to measure.
    TooNoisy(f64),
    /// The pictures have this error in common, which is more than a tenth and more than the reference's noise explains.
    Biased(f64),
}

impl Verdict {
    /// On a mean error of `measured` over pictures with these sums. `None` where nothing is known of the reference and there
    /// is but one picture.
    pub fn of(measured: f64, reference: &Reference, errors: &Errors) -> Option<Self> {
        let shared = errors.shared();
        let Some(own) = reference.own_error else {
            let own = shared?.error.max(0.0);
            return Some(if own * LEAST_RATIO <= measured { Self::Fine(own) } else { Self::TooNoisy(own) });
        };
        if let Some(Shared { error, deviation }) = shared
            && error - SIGNIFICANT * deviation > own
            && error * LEAST_RATIO > measured + own
        {
            return Some(Self::Biased(error));
        }
        Some(if own * LEAST_RATIO <= measured { Self::Fine(own) } else { Self::TooNoisy(own) })
    }

    /// The reference's own error, as far as it is known.
    pub fn own_error(self) -> f64 {
        match self {
            Self::Fine(own) | Self::TooNoisy(own) | Self::Biased(own) => own,
        }
    }

    /// Whether the measurement counts.
    pub fn accepts(self) -> bool {
        matches!(self, Self::Fine(_))
    }
}

#[cfg(test)]
mod tests;
