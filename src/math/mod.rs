//! Numbers and geometry: floating-point bounds, rays, frames, boxes. Knows nothing of scenes.

pub mod bounds;
pub mod float;
pub mod frame;
pub mod quadrature;
pub mod ray;
pub mod simd;
