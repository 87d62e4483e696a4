//! How colour is represented: linear sRGB primaries (ITU-R BT.709, D65). The only place that knows.

mod rgb;

pub use rgb::Rgb;
