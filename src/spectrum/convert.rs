//! From spectra, as scene files give them, to linear sRGB, as Mitsuba 3 does it in its rgb variants.
//!
//! A tabulated spectrum is integrated against the CIE 1931 observer; reflectances and indices of refraction are seen
//! under D65, so that a white one is (1, 1, 1); emission is taken as it is, so that an equal-energy one is the pinkish
//! (1.2048, 0.9483, 0.9089). The sums are Mitsuba's, sample for sample: a different quadrature would make the
//! same file a different picture.

use super::{Rgb, cie};

/// What a spectrum stands for, which decides how it becomes a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpectrumRole {
    /// A reflectance or another weight: seen under D65, at most one.
    Reflectance,
    /// Emitted radiance: not weighted, not bounded above.
    Emission,
    /// An index of refraction: seen under D65, not bounded above.
    Index,
}

/// Samples of the integral over wavelengths; Mitsuba's number.
const STEPS: usize = 1000;

/// What the sum of ȳ, times the width of the visible range over [`STEPS`], comes to; Mitsuba's number (a unit
/// equal-energy spectrum has the luminance 1).
const Y_INTEGRAL: f64 = 106.750_259_399_414_06;

/// The mean of D65's relative power under ȳ: dividing by it gives the illuminant the luminance 1; Mitsuba's number.
const D65_MEAN: f64 = 98.997_417_518_762_55;

/// CIE XYZ to linear sRGB: ITU-R BT.709 primaries, white D65, rounded to six decimals as Mitsuba and many others have
/// it.
const XYZ_TO_RGB: [[f64; 3]; 3] =
    [[3.240479, -1.537150, -0.498535], [-0.969256, 1.875991, 0.041556], [0.055648, -0.204043, 1.057311]];

/// Linear sRGB to CIE XYZ: the inverse, rounded to six decimals likewise.
const RGB_TO_XYZ: [[f64; 3]; 3] =
    [[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]];

/// CIE XYZ of a linear sRGB colour.
pub fn rgb_to_xyz(colour: Rgb) -> [f32; 3] {
    let [r, g, b] = colour.to_array().map(f64::from);
    RGB_TO_XYZ.map(|row| (row[0] * r + row[1] * g + row[2] * b) as f32)
}

/// A spectrum given by (wavelength in nm, value) pairs of ascending wavelength, linear between them and zero outside.
///
/// Also says whether the colour was outside the gamut and had to be clamped.
pub fn tabulated_to_rgb(samples: &[(f64, f64)], role: SpectrumRole) -> ([f64; 3], bool) {
    let mut xyz = [0.0; 3];
    let mut upper = 1;
    for step in 0..STEPS {
        let nm = cie::FIRST_NM + step as f64 / (STEPS - 1) as f64 * (cie::LAST_NM - cie::FIRST_NM);
        let Some(value) = interpolate(samples, nm, &mut upper) else {
            continue;
        };
        let light = if role == SpectrumRole::Emission { 1.0 } else { cie::d65(nm) / D65_MEAN };
        for (sum, bar) in xyz.iter_mut().zip(cie::observer(nm)) {
            *sum += bar * value * light;
        }
    }
    let width = (cie::LAST_NM - cie::FIRST_NM) / STEPS as f64;
    let rgb = xyz_to_rgb(xyz.map(|v| v * width / Y_INTEGRAL));
    let most = if role == SpectrumRole::Reflectance { 1.0 } else { f64::INFINITY };
    let clamped = rgb.map(|v| v.clamp(0.0, most));
    (clamped, clamped != rgb)
}

/// How much each wavelength, in nm, adds to the channels of a reflectance, in steps of one nanometre; of each channel all add
/// up to 1. Not clamped: some are negative.
pub fn reflectance_weights() -> Vec<(f64, [f64; 3])> {
    let count = (cie::LAST_NM - cie::FIRST_NM) as u32;
    let weight = |i: u32| {
        let nm = cie::FIRST_NM + f64::from(i);
        (nm, xyz_to_rgb(cie::observer(nm)).map(|bar| bar * cie::d65(nm)))
    };
    let mut weights: Vec<_> = (0..=count).map(weight).collect();
    let sum = weights.iter().fold([0.0; 3], |sum, (_, w)| std::array::from_fn(|c| sum[c] + w[c]));
    for (_, weight) in &mut weights {
        *weight = std::array::from_fn(|c| weight[c] / sum[c]);
    }
    weights
}

/// An emission spectrum that is the same for every wavelength.
pub fn equal_energy_to_rgb(value: f64) -> [f64; 3] {
    xyz_to_rgb([value; 3])
}

/// One channel of sRGB, in [0, 1], to linear (IEC 61966-2-1, 5.2).
pub fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
}

fn xyz_to_rgb(xyz: [f64; 3]) -> [f64; 3] {
    XYZ_TO_RGB.map(|row| row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2])
}

/// The value at `nm`; `upper` is where the last search ended, and only grows.
fn interpolate(samples: &[(f64, f64)], nm: f64, upper: &mut usize) -> Option<f64> {
    let (first, last) = (samples.first()?, samples.last()?);
    if samples.len() < 2 || !(nm >= first.0 && nm <= last.0) {
        return None;
    }
    while *upper + 1 < samples.len() && samples[*upper].0 <= nm {
        *upper += 1;
    }
    let ((w0, v0), (w1, v1)) = (samples[*upper - 1], samples[*upper]);
    Some(((w1 - nm) * v0 + (nm - w0) * v1) / (w1 - w0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest relative difference from Mitsuba 3.9.1 (which prints six digits).
    const TOLERANCE: f64 = 1e-5;

    fn assert_close(got: [f64; 3], want: [f64; 3]) {
        for (g, w) in got.into_iter().zip(want) {
            assert!((g - w).abs() <= TOLERANCE * w.abs(), "{got:?}, Mitsuba has {want:?}");
        }
    }

    #[test]
    fn tabulated_spectra_are_mitsuba_s_colours() {
        let peak = [(400.0, 0.1), (500.0, 0.9), (700.0, 0.2)];
        assert_close(tabulated_to_rgb(&peak, SpectrumRole::Reflectance).0, [0.367123, 0.793739, 0.508171]);
        let steep = [(400.0, 0.1), (500.0, 0.9), (700.0, 1.9)];
        assert!(tabulated_to_rgb(&steep, SpectrumRole::Reflectance).1, "clamped");
        let lamp = [(400.0, 0.0), (500.0, 8.0), (600.0, 15.6), (700.0, 18.4)];
        assert_close(tabulated_to_rgb(&lamp, SpectrumRole::Emission).0, [20.7108, 10.8546, 2.77115]);
        let index = [(400.0, 1.0), (600.0, 2.0), (700.0, 3.0)];
        assert_close(tabulated_to_rgb(&index, SpectrumRole::Index).0, [2.30642, 1.70653, 1.19784]);
        let flat = [(400.0, 1.0), (700.0, 1.0)];
        assert_close(tabulated_to_rgb(&flat, SpectrumRole::Reflectance).0, [0.995342, 0.999756, 0.994909]);
        assert_close(tabulated_to_rgb(&flat, SpectrumRole::Emission).0, [1.19969, 0.94952, 0.903443]);
        let wide = [(360.0, 1.0), (830.0, 1.0)];
        assert_close(tabulated_to_rgb(&wide, SpectrumRole::Emission).0, [1.20488, 0.948228, 0.909267]);
    }

    #[test]
    fn xyz_is_the_inverse_of_rgb() {
        for rgb in [Rgb::WHITE, Rgb::new(0.2, 0.7, 0.1), Rgb::new(30.0, 0.0, 4.0)] {
            let back = xyz_to_rgb(rgb_to_xyz(rgb).map(f64::from));
            for (b, v) in back.into_iter().zip(rgb.to_array()) {
                // Both matrices have six decimals.
                assert!((b - f64::from(v)).abs() <= 1e-5 * f64::from(rgb.max_component()), "{back:?}, not {rgb:?}");
            }
        }
    }

    #[test]
    fn uniform_emission_is_mitsuba_s_equal_energy_white() {
        assert_close(equal_energy_to_rgb(2.0), [2.40959, 1.89658, 1.81783]);
    }

    #[test]
    fn tables_that_say_nothing_are_black() {
        for samples in [&[][..], &[(500.0, 1.0)], &[(1.0, 1.0), (2.0, 1.0)]] {
            assert_eq!(tabulated_to_rgb(samples, SpectrumRole::Emission), ([0.0; 3], false));
        }
    }

    #[test]
    fn srgb_ends_are_fixed() {
        assert_eq!(srgb_to_linear(0.0), 0.0);
        assert!((srgb_to_linear(1.0) - 1.0).abs() < TOLERANCE);
        assert!((srgb_to_linear(0.5) - 0.214041).abs() < TOLERANCE);
    }
}
