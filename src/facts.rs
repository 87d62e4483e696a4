//! Which features the code has: all, but in a build that measures what the absence of one costs.
//!
//! `SNELL_WITHOUT=instances cargo build --release` makes a snell without the code of a feature ([`Feature::NAMES`]; several with
//! commas between), which refuses scenes that have it. What the usual build takes more on a scene without it is the price of a
//! feature that is not used. `scripts/absence` builds them all and prints the table.
//!
//! All places in hot loops that ask for a feature do it by [`has`], and this file is the only one that knows of such builds.

/// What a scene or a render may have, and most have not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Materials and lights that are worked out at each point: by textures, normal maps, blends, masks.
    Textures,
    /// Masks.
    Masks,
    /// Tangents along which a surface is anisotropic.
    Tangents,
    /// Vertex normals.
    Normals,
    /// Bsdfs that let light through.
    Transmission,
    /// What absorbs light inside of it.
    Volumes,
    /// More than one light.
    LightChoice,
    /// Light from infinitely far away that paths can run into.
    Environment,
    /// Placed groups.
    Instances,
    /// Spheres, disks and cylinders.
    Quadrics,
    /// A lens.
    Lens,
    /// Quantities beside radiance.
    Aovs,
    /// Lights that have a size, so that paths can run into them and samples of light must be weighed against that.
    Mis,
    /// Paths that share what they find.
    Sharing,
    /// Several light samples at the first vertex.
    Candidates,
}

impl Feature {
    /// All of them, with what they are called in `SNELL_WITHOUT`.
    pub const NAMES: [(Self, &str); 15] = [
        (Self::Textures, "textures"),
        (Self::Masks, "masks"),
        (Self::Tangents, "tangents"),
        (Self::Normals, "normals"),
        (Self::Transmission, "transmission"),
        (Self::Volumes, "volumes"),
        (Self::LightChoice, "light-choice"),
        (Self::Environment, "environment"),
        (Self::Instances, "instances"),
        (Self::Quadrics, "quadrics"),
        (Self::Lens, "lens"),
        (Self::Aovs, "aovs"),
        (Self::Mis, "mis"),
        (Self::Sharing, "sharing"),
        (Self::Candidates, "candidates"),
    ];

    /// Whether this build has its code.
    pub const fn is_built(self) -> bool {
        match self {
            Self::Textures => !cfg!(snell_without = "textures"),
            Self::Masks => !cfg!(snell_without = "masks"),
            Self::Tangents => !cfg!(snell_without = "tangents"),
            Self::Normals => !cfg!(snell_without = "normals"),
            Self::Transmission => !cfg!(snell_without = "transmission"),
            Self::Volumes => !cfg!(snell_without = "volumes"),
            Self::LightChoice => !cfg!(snell_without = "light-choice"),
            Self::Environment => !cfg!(snell_without = "environment"),
            Self::Instances => !cfg!(snell_without = "instances"),
            Self::Quadrics => !cfg!(snell_without = "quadrics"),
            Self::Lens => !cfg!(snell_without = "lens"),
            Self::Aovs => !cfg!(snell_without = "aovs"),
            Self::Mis => !cfg!(snell_without = "mis"),
            Self::Sharing => !cfg!(snell_without = "sharing"),
            Self::Candidates => !cfg!(snell_without = "candidates"),
        }
    }
}

/// Whether a feature is there, as `there` says. In a build without it the compiler is promised that it is not, so that what
/// follows from `there` goes, too: a `match` on what was looked at loses its arms.
#[inline(always)]
pub const fn has(feature: Feature, there: bool) -> bool {
    if feature.is_built() { there } else { promised_absent(there) }
}

#[cfg(not(snell_less))]
const fn promised_absent(_: bool) -> bool {
    false
}

/// See [`has`].
#[cfg(snell_less)]
#[inline(always)]
#[expect(unsafe_code, reason = "builds that measure, and are never used")]
const fn promised_absent(there: bool) -> bool {
    // SAFETY: `allow` has refused every scene and every render that has the feature.
    unsafe { std::hint::assert_unchecked(!there) };
    false
}

/// Stops a build without a feature that is `there` after all.
pub fn allow(feature: Feature, there: bool) {
    assert!(feature.is_built() || !there, "this build has no {feature:?}, which is asked for");
}
