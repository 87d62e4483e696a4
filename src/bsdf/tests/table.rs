//! The configurations that the laws are tested for.

use super::*;

/// One configuration.
pub(super) struct Row {
    pub(super) name: String,
    pub(super) bsdf: Bsdf,
    /// Index of refraction below relative to above; 1 if nothing gets there.
    pub(super) eta: f32,
    /// How far a sample's weight may exceed 1. Only Beckmann's masking, which is approximated in the value but not in the
    /// density, may, by the error of the approximation.
    pub(super) gain: f32,
}

const METAL: (Rgb, Rgb) = (Rgb::new(0.2, 0.9, 1.4), Rgb::new(3.9, 2.4, 1.6));

/// Nearly a mirror, to as rough as can be; then anisotropic both ways.
const ALPHAS: [(f32, f32); 8] =
    [(1e-3, 1e-3), (0.02, 0.02), (0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.05, 0.4), (0.6, 0.1), (2e-3, 0.2)];

/// Into glass and out of it, hardly any contrast, diamond.
const ETAS: [f32; 4] = [1.5, 1.0 / 1.5, 1.05, 2.4];

/// Whether glass of this index and roughness is in the table: all roughnesses at the first index, narrow and wide lobes at
/// the others.
fn is_tested(eta: f32, alphas: (f32, f32)) -> bool {
    eta == ETAS[0] || [ALPHAS[0], ALPHAS[4], ALPHAS[5]].contains(&alphas)
}

pub(super) fn metal(distribution: Distribution, (u, v): (f32, f32)) -> Bsdf {
    let facets = Microfacets::new(distribution, u, v);
    Bsdf::RoughConductor(RoughConductor::new(facets, METAL.0, METAL.1, Rgb::WHITE))
}

pub(super) fn glass(distribution: Distribution, (u, v): (f32, f32), eta: f32) -> Bsdf {
    RoughDielectric::bsdf(Microfacets::new(distribution, u, v), eta, Rgb::WHITE, Rgb::splat(0.9))
}

pub(super) fn table() -> Vec<Row> {
    let row = |name: &str, bsdf, eta| Row { name: name.into(), bsdf, eta, gain: 0.0 };
    let mut rows = vec![
        row("diffuse", Bsdf::Diffuse(Diffuse { reflectance: Rgb::new(0.9, 0.5, 0.1) }), 1.0),
        row("mirror", Bsdf::Conductor(Conductor { eta: METAL.0, k: METAL.1, reflectance: Rgb::WHITE }), 1.0),
    ];
    for eta in ETAS {
        let bsdf = Bsdf::Dielectric(Dielectric::new(eta, Rgb::WHITE, Rgb::splat(0.9)));
        rows.push(row(&format!("smooth dielectric {eta}"), bsdf, eta));
    }
    for (distribution, gain) in [(Distribution::Ggx, 0.0), (Distribution::Beckmann, 0.0036)] {
        for alphas in ALPHAS {
            let name = format!("{distribution:?} {alphas:?}");
            rows.push(Row { gain, ..row(&format!("metal {name}"), metal(distribution, alphas), 1.0) });
            for eta in ETAS.into_iter().filter(|&eta| is_tested(eta, alphas)) {
                let bsdf = glass(distribution, alphas, eta);
                rows.push(Row { gain, ..row(&format!("glass {eta} {name}"), bsdf, eta) });
            }
        }
    }
    rows
}

/// Directions from normal incidence to nearly grazing, from below, too, if `both`.
pub(super) fn directions(both: bool) -> impl Iterator<Item = Vec3> {
    let above = [1.0f32, 0.8, 0.4, 0.1, 0.01].into_iter().map(|z| {
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * 0.6, r * 0.8, z)
    });
    above.flat_map(move |w| [Some(w), both.then_some(-w)]).flatten()
}

/// Directions where numbers end.
pub(super) fn edge_directions() -> impl Iterator<Item = Vec3> {
    [1.0f32, 0.5, 1e-4, 1e-7, 1e-20, 1e-38, 0.0].into_iter().flat_map(|z| {
        let r = (1.0 - z * z).sqrt();
        [-z, z]
            .into_iter()
            .flat_map(move |z| [(r, 0.0), (-r, 0.0), (0.0, r), (0.6 * r, -0.8 * r)].map(|(x, y)| Vec3::new(x, y, z)))
    })
}

/// Bsdfs with parameters at the ends of their ranges.
pub(super) fn extremes() -> Vec<(String, Bsdf)> {
    let mut all = Vec::new();
    for distribution in [Distribution::Ggx, Distribution::Beckmann] {
        for alphas in [(1e-5, 1e-5), (1e-4, 1e-2), (1e-2, 1e-2), (1.0, 1.0), (10.0, 1e-5), (1e6, 1e6)] {
            let facets = Microfacets::new(distribution, alphas.0, alphas.1);
            for k in [0.0, 10.0] {
                for eta in [0.0, 1.0, 4.0] {
                    let bsdf = RoughConductor::new(facets, Rgb::splat(eta), Rgb::splat(k), Rgb::WHITE);
                    all.push((format!("{facets:?} η {eta} k {k}"), Bsdf::RoughConductor(bsdf)));
                }
            }
            for eta in [0.25, 1.0 - 1e-7, 1.0, 1.0 + 1e-7, 1.0 + 1e-4, 1.000277, 4.0] {
                all.push((format!("{facets:?} η {eta}"), glass(distribution, alphas, eta)));
                all.push((format!("η {eta}"), Bsdf::Dielectric(Dielectric::new(eta, Rgb::WHITE, Rgb::WHITE))));
            }
        }
    }
    for (eta, k) in [(0.0, 0.0), (1.0, 0.0), (0.0, 10.0), (4.0, 10.0)] {
        let (eta, k) = (Rgb::splat(eta), Rgb::splat(k));
        all.push((format!("{eta:?} {k:?}"), Bsdf::Conductor(Conductor { eta, k, reflectance: Rgb::WHITE })));
    }
    all.push(("black".into(), Bsdf::Diffuse(Diffuse { reflectance: Rgb::BLACK })));
    all
}
