//! How colour is represented: linear sRGB primaries (ITU-R BT.709, D65). The only place that knows.

pub mod cie;
mod convert;
mod rgb;

pub use convert::{
    SpectrumRole, equal_energy_to_rgb, reflectance_weights, rgb_to_xyz, srgb_to_linear, tabulated_to_rgb,
};
pub use rgb::Rgb;
