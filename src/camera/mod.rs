//! Cameras: from a point of the film to a ray.

mod perspective;

pub use perspective::{Perspective, Pinhole};
