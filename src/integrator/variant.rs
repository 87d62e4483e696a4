//! What a scene may have, as far as the loop over paths is compiled for it.
//!
//! Each flag that is here doubles the copies of the loop; what costs a scene without it less than a hundredth or two is no flag, but
//! asked for where it matters (docs/benchmarks.md, "What absent features cost"). A variant computes the same bits as every other
//! that fits the scene.

use crate::scene::Scene;

/// The facts that a variant takes for granted where they are false.
pub trait Variant {
    /// Materials may be worked out at each point, depend on tangents, let light through or absorb it, or become rougher.
    const ANY_MATERIALS: bool;

    /// There may be several lights, and skies.
    const ANY_LIGHTS: bool;
}

/// A variant by its flags: any materials, any lights.
pub struct Of<const MATERIALS: bool, const LIGHTS: bool>;

impl<const MATERIALS: bool, const LIGHTS: bool> Variant for Of<MATERIALS, LIGHTS> {
    const ANY_MATERIALS: bool = MATERIALS;
    const ANY_LIGHTS: bool = LIGHTS;
}

/// Fits every scene.
pub type Any = Of<true, true>;

/// Whether a scene needs the variants of any materials, and those of any lights.
pub fn needs(scene: &Scene) -> (bool, bool) {
    let f = &scene.features;
    let varies = f.varying_materials > 0 || f.anisotropy || scene.regularizes();
    let materials = varies || f.transmission || f.volumes;
    (materials, f.lights() > 1 || f.infinite_lights > 0)
}
