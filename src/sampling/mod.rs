//! The mathematics of sampling: warps with their densities, discrete distributions, multiple importance sampling.

pub(crate) mod chi_square;
pub mod distribution;
pub mod mis;
pub mod pdf;
pub mod warp;

#[cfg(test)]
mod tests;
