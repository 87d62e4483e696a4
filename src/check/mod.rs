//! Checks of what is installed against slow and certain answers.

pub mod accel;
pub mod laws;
pub mod lights;
pub mod meshes;
pub mod random;
pub mod rays;
pub mod rooms;
pub mod scenes;
mod shapes;
pub mod spawn;
