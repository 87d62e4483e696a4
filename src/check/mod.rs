//! Checks of what is installed against slow and certain answers.

pub mod accel;
pub mod meshes;
pub mod random;
pub mod rays;
mod shapes;
