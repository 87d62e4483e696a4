//! The mathematics of sampling: warps with their densities, discrete distributions, multiple importance sampling.

pub mod distribution;
pub mod mis;
pub mod pdf;
pub mod warp;
