//! snell: a physically based path tracer.
//!
//! ```text
//! scene file ─loader─▶ SceneDescription ─compile─▶ Scene ─render + integrator─▶ Film ─image─▶ EXR / PNG
//! ```
//!
//! Each module uses only modules of lower rows of the table in ARCHITECTURE.md.

pub mod accel;
pub mod bench;
pub mod bsdf;
pub mod camera;
pub mod check;
pub mod cli;
pub mod description;
pub mod error;
pub mod error_estimate;
pub mod facts;
pub mod files;
pub mod film;
pub mod image;
pub mod integrator;
pub mod light;
pub mod loader;
pub mod material;
pub mod math;
pub mod parameter;
pub mod render;
pub mod sampler;
pub mod sampling;
pub mod scene;
pub mod shape;
pub mod spectrum;
pub mod texture;
