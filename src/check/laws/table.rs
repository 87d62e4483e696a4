//! The configurations of bsdfs that the laws are tested for.

use crate::bsdf::*;
use crate::spectrum::Rgb;
use glam::Vec3;
use std::sync::LazyLock;

/// One configuration.
pub(crate) struct Row {
    pub(crate) name: String,
    pub(crate) bsdf: Bsdf,
    /// Index of refraction below relative to above; 1 if nothing gets there.
    pub(crate) eta: f32,
    pub(crate) energy: Energy,
    /// Pairs of directions for which reciprocity is not asked. Only the thin principled bsdf, which as Mitsuba has it blocks
    /// some ways in one direction only, has such.
    pub(crate) exempt: fn(Vec3, Vec3) -> bool,
    /// Whether directions in f32 resolve its lobes as seen from here, which the density's law asks for.
    pub(crate) resolved: fn(Vec3) -> bool,
}

/// How much may come back.
#[derive(Clone, Copy)]
pub(crate) enum Energy {
    /// No sample's weight exceeds 1 by more than this. Only Beckmann's masking, which is approximated in the value but not
    /// in the density, may, by the error of the approximation.
    Sample(f32),
    /// The mean of the weights does not exceed this: for bsdfs whose samples are from one of several lobes.
    Mean(f32),
}

const METAL: (Rgb, Rgb) = (Rgb::new(0.2, 0.9, 1.4), Rgb::new(3.9, 2.4, 1.6));

/// Nearly a mirror, to as rough as can be; then anisotropic both ways.
const ALPHAS: [(f32, f32); 8] =
    [(1e-3, 1e-3), (0.02, 0.02), (0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.05, 0.4), (0.6, 0.1), (2e-3, 0.2)];

/// Those of [`edges`].
const EDGE_ALPHAS: [(f32, f32); 5] = [(1e-5, 1e-5), (1e-4, 1e-4), (1e-3, 1.0), (1.0, 1e-3), (1.0, 1.0)];

/// Into glass and out of it, hardly any contrast, diamond.
const ETAS: [f32; 4] = [1.5, 1.0 / 1.5, 1.05, 2.4];

/// Whether glass of this index and roughness is in the table: all roughnesses at the first index, narrow and wide lobes at
/// the others.
fn is_tested(eta: f32, alphas: (f32, f32)) -> bool {
    eta == ETAS[0] || [ALPHAS[0], ALPHAS[4], ALPHAS[5]].contains(&alphas)
}

pub(crate) fn metal(distribution: Distribution, (u, v): (f32, f32)) -> Bsdf {
    let facets = Microfacets::new(distribution, u, v);
    Bsdf::RoughConductor(RoughConductor::new(facets, METAL.0, METAL.1, Rgb::WHITE))
}

pub(crate) fn glass(distribution: Distribution, (u, v): (f32, f32), eta: f32) -> Bsdf {
    RoughDielectric::bsdf(Microfacets::new(distribution, u, v), eta, Rgb::WHITE, Rgb::splat(0.9))
}

pub(crate) fn table() -> &'static [Row] {
    static TABLE: LazyLock<Vec<Row>> = LazyLock::new(|| {
        let mut rows = interfaces();
        rows.extend(rough_diffuse());
        rows.extend(plastics());
        rows.extend(principled());
        rows.extend(thin());
        rows.extend(super::gltf::rows());
        rows.extend(super::gltf::compensated_rows());
        rows.extend(regularized(&rows));
        rows
    });
    &TABLE
}

/// Configurations where numbers end: nearly smooth, a thousand times as rough one way as the other, hardly any contrast,
/// the least and largest indices, metal that absorbs nothing or all but everything.
pub(crate) fn edges() -> &'static [Row] {
    static EDGES: LazyLock<Vec<Row>> = LazyLock::new(edge_rows);
    &EDGES
}

fn edge_rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for (distribution, gain) in [(Distribution::Ggx, 0.0), (Distribution::Beckmann, 0.0036)] {
        let mut add = |name: String, bsdf: Bsdf, eta: f32| {
            rows.push(Row { energy: Energy::Sample(gain), ..row(&format!("{name} {distribution:?}"), bsdf, eta) });
        };
        for alphas in EDGE_ALPHAS {
            let facets = Microfacets::new(distribution, alphas.0, alphas.1);
            for (eta, k) in [(0.0, 0.0), (0.0, 10.0), (4.0, 0.0), (4.0, 10.0), (1.0, 1e-3)] {
                let metal = RoughConductor::new(facets, Rgb::splat(eta), Rgb::splat(k), Rgb::WHITE);
                add(format!("metal {alphas:?} η {eta} k {k}"), Bsdf::RoughConductor(metal), 1.0);
            }
            for eta in [0.25, 1.0 - 1e-7, 1.0 + 1e-7, 1.0 + 1e-4, 4.0] {
                add(format!("glass {alphas:?} η {eta}"), glass(distribution, alphas, eta), eta);
            }
        }
    }
    rows
}

pub(crate) fn row(name: &str, bsdf: Bsdf, eta: f32) -> Row {
    Row { name: name.into(), bsdf, eta, energy: Energy::Sample(0.0), exempt: |_, _| false, resolved: |_| true }
}

/// Of one lobe each, or of two of which each gives back what it gets.
fn interfaces() -> Vec<Row> {
    let mut rows = vec![
        row("diffuse", Bsdf::Diffuse(Diffuse { reflectance: Rgb::new(0.9, 0.5, 0.1) }), 1.0),
        row("mirror", Bsdf::Conductor(Conductor { eta: METAL.0, k: METAL.1, reflectance: Rgb::WHITE }), 1.0),
        row("null", Bsdf::Null(Null), 1.0),
    ];
    for eta in ETAS {
        let bsdf = Bsdf::Dielectric(Dielectric::new(eta, Rgb::WHITE, Rgb::splat(0.9)));
        rows.push(row(&format!("smooth dielectric {eta}"), bsdf, eta));
        let bsdf = Bsdf::ThinDielectric(ThinDielectric::new(eta, Rgb::WHITE, Rgb::splat(0.9)));
        rows.push(row(&format!("pane {eta}"), bsdf, 1.0));
    }
    for (distribution, gain) in [(Distribution::Ggx, 0.0), (Distribution::Beckmann, 0.0036)] {
        let energy = Energy::Sample(gain);
        for alphas in ALPHAS {
            let name = format!("{distribution:?} {alphas:?}");
            rows.push(Row { energy, ..row(&format!("metal {name}"), metal(distribution, alphas), 1.0) });
            for eta in ETAS.into_iter().filter(|&eta| is_tested(eta, alphas)) {
                let bsdf = glass(distribution, alphas, eta);
                rows.push(Row { energy, ..row(&format!("glass {eta} {name}"), bsdf, eta) });
            }
        }
    }
    rows
}

/// The rougher twins of what is smooth, and of some that are not: they obey what their originals obey.
fn regularized(rows: &[Row]) -> Vec<Row> {
    const BEGIN: [&str; 9] = [
        "mirror",
        "smooth dielectric",
        "pane",
        "metal Beckmann (0.05, 0.4)",
        "glass 1.5 Ggx (0.02, 0.02)",
        "plastic 1.5 Rgb(Vec3(1",
        "plastic 2.4 Rgb(Vec3(1",
        "plastic 0.6666667 Rgb(Vec3(1",
        "plastic 1.5 Ggx 0.1 ",
    ];
    const NAMES: [&str; 12] = [
        "principled white 0.03",
        "principled metal 0.03",
        "principled coat 1 0.03",
        "principled glass 1.5 0.03",
        "principled mixed 0.03",
        "thin principled white 0.03",
        "thin principled pane 1.5 0.03",
        "thin principled mixed 0.03",
        "glTF white 0.001",
        "glTF glass 0.001",
        "glTF coated 0.3",
        "glTF mixed solid 0.3",
    ];
    let is_wanted = |name: &str| NAMES.contains(&name) || BEGIN.iter().any(|start| name.starts_with(start));
    let twin =
        |row: &Row| Row { name: format!("regularized {}", row.name), bsdf: row.bsdf.clone().regularized(), ..*row };
    rows.iter().filter(|row| is_wanted(&row.name)).map(twin).collect()
}

fn rough_diffuse() -> Vec<Row> {
    let mut rows = Vec::new();
    for roughness in [0.0, 1e-3, 0.3, 1.0] {
        for reflectance in [Rgb::WHITE, Rgb::new(0.9, 0.5, 0.1)] {
            let bsdf = Bsdf::OrenNayar(OrenNayar { reflectance, roughness });
            let name = format!("Oren-Nayar {roughness} {reflectance:?}");
            // Energy is preserved up to the fit of the albedo.
            rows.push(Row { energy: Energy::Mean(1.001), ..row(&name, bsdf, 1.0) });
        }
    }
    rows
}

fn plastics() -> Vec<Row> {
    // The reflectance inside a smooth coat is a fit; white plastic of the largest index returns 2.8 % too much.
    let smooth = |eta: f32| Energy::Mean(if eta > 2.0 { 1.028 } else { 1.0012 });
    let energy = Energy::Mean(1.0);
    let mut rows = Vec::new();
    for nonlinear in [false, true] {
        for eta in ETAS {
            for diffuse in [Rgb::WHITE, Rgb::new(0.9, 0.5, 0.1)] {
                let bsdf = Bsdf::Plastic(Plastic::new(eta, diffuse, Rgb::WHITE, nonlinear));
                let name = format!("plastic {eta} {diffuse:?} {nonlinear}");
                rows.push(Row { energy: smooth(eta), ..row(&name, bsdf, 1.0) });
            }
        }
        for distribution in [Distribution::Ggx, Distribution::Beckmann] {
            for (alpha, eta) in [(1e-3, 1.5), (0.1, 1.5), (0.4, 1.5), (1.0, 1.5), (0.1, 2.4), (0.4, 1.0 / 1.5)] {
                let facets = Microfacets::new(distribution, alpha, alpha);
                let bsdf = Bsdf::RoughPlastic(RoughPlastic::new(facets, eta, Rgb::WHITE, Rgb::WHITE, nonlinear));
                let name = format!("plastic {eta} {distribution:?} {alpha} {nonlinear}");
                rows.push(Row { energy, ..row(&name, bsdf, 1.0) });
            }
        }
    }
    rows
}

/// Nearly smooth (its α is the smallest there is), in between, as rough as can be.
const ROUGHNESSES: [f32; 3] = [0.03, 0.3, 1.0];

/// A base with every number different.
fn mixed(roughness: f32) -> Disney {
    Disney {
        base_color: Rgb::new(0.9, 0.5, 0.1),
        roughness,
        anisotropic: 0.8,
        spec_trans: 0.3,
        eta: 1.5,
        spec_tint: 0.4,
        sheen: 0.5,
        sheen_tint: 0.6,
        flatness: 0.7,
        regularized: false,
    }
}

/// The albedos that the rows list are what Mitsuba's definition gives back of white light, at most over the directions of
/// view, of roughness 0.03, 0.3 and 1. Above 1 the model creates energy: specular reflection is added to a diffuse part that does not
/// know of it (white, by up to 59 %, at grazing angles), flattened reflection is brighter there (by up to 66 %), and sheen and
/// coat come on top. What transmits or is metal loses energy, as rough glass and metal do.
fn principled() -> Vec<Row> {
    let mut rows = Vec::new();
    for (i, roughness) in ROUGHNESSES.into_iter().enumerate() {
        let white = Disney { base_color: Rgb::WHITE, roughness, ..Disney::default() };
        let solid = |disney| Principled { disney, ..Principled::default() };
        let mut add = |name: &str, bsdf: Principled, most: [f32; 3]| {
            let (name, energy) = (format!("principled {name} {roughness}"), Energy::Mean(most[i]));
            rows.push(Row { energy, ..row(&name, Bsdf::Principled(bsdf), bsdf.disney.eta) });
        };
        add("white", solid(white), [1.48, 1.22, 1.59]);
        add("flat", solid(Disney { flatness: 1.0, ..white }), [1.66, 1.52, 1.56]);
        add("sheen", solid(Disney { sheen: 1.0, ..white }), [1.57, 1.28, 1.68]);
        add("metal", Principled { metallic: 1.0, ..solid(white) }, [1.0; 3]);
        for clearcoat_gloss in [0.0, 1.0] {
            let coated = Principled { clearcoat: 1.0, clearcoat_gloss, ..solid(white) };
            add(&format!("coat {clearcoat_gloss}"), coated, [1.48, 1.22, 1.59]);
        }
        for eta in [1.5, 1.0 / 1.5] {
            let glass = Disney { spec_trans: 1.0, eta, ..white };
            add(&format!("glass {eta}"), solid(glass), [1.0; 3]);
        }
        let mixed = Principled { metallic: 0.3, clearcoat: 0.5, clearcoat_gloss: 0.4, disney: mixed(roughness) };
        add("mixed", mixed, [1.3, 1.1, 1.0]);
    }
    rows
}

/// Whether the thin bsdf's facet blocks exactly one of the two ways between `wo` and `wi` on the other side.
fn blocks_one_way(wo: Vec3, wi: Vec3) -> bool {
    let blocks = |wo: Vec3, wi: Vec3| wi.dot(wo + wi * Vec3::new(1.0, 1.0, -1.0)) >= 0.0;
    wo.z * wi.z < 0.0 && blocks(wo, wi) != blocks(wi, wo)
}

/// See [`principled`]. Panes of less index than their surroundings transmit by smoother facets than those that reflect, and
/// give back up to 15 % too much.
fn thin() -> Vec<Row> {
    let mut rows = Vec::new();
    for (i, roughness) in ROUGHNESSES.into_iter().enumerate() {
        let white = Disney { base_color: Rgb::WHITE, roughness, ..Disney::default() };
        let mut add = |name: &str, disney: Disney, diff_trans: f32, most: [f32; 3]| {
            let (name, energy) = (format!("thin principled {name} {roughness}"), Energy::Mean(most[i]));
            let bsdf = Bsdf::PrincipledThin(PrincipledThin { disney, diff_trans });
            rows.push(Row { energy, exempt: blocks_one_way, ..row(&name, bsdf, 1.0) });
        };
        add("white", white, 0.0, [1.0, 1.0, 1.54]);
        add("through", white, 2.0, [1.0; 3]);
        for eta in [1.5, 1.0 / 1.5] {
            let most = if eta < 1.0 { [1.0, 1.15, 1.0] } else { [1.0; 3] };
            add(&format!("pane {eta}"), Disney { spec_trans: 1.0, eta, ..white }, 0.0, most);
        }
        add("mixed", mixed(roughness), 0.6, [1.0, 1.0, 1.03]);
    }
    rows
}

/// Directions from normal incidence to nearly grazing, from below, too, if `both`.
pub(crate) fn directions(both: bool) -> impl Iterator<Item = Vec3> {
    let above = [1.0f32, 0.8, 0.4, 0.1, 0.01].into_iter().map(|z| {
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * 0.6, r * 0.8, z)
    });
    above.flat_map(move |w| [Some(w), both.then_some(-w)]).flatten()
}

/// Directions where numbers end.
pub(crate) fn edge_directions() -> impl Iterator<Item = Vec3> {
    [1.0f32, 0.5, 1e-4, 1e-7, 1e-20, 1e-38, 0.0].into_iter().flat_map(|z| {
        let r = (1.0 - z * z).sqrt();
        [-z, z]
            .into_iter()
            .flat_map(move |z| [(r, 0.0), (-r, 0.0), (0.0, r), (0.6 * r, -0.8 * r)].map(|(x, y)| Vec3::new(x, y, z)))
    })
}

/// Bsdfs with parameters at the ends of their ranges.
pub(crate) fn extremes() -> Vec<(String, Bsdf)> {
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
    all.push(("null".into(), Bsdf::Null(Null)));
    for (c, roughness) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1e-20), (1.0, 1.0)] {
        let bsdf = OrenNayar { reflectance: Rgb::splat(c), roughness };
        all.push((format!("{bsdf:?}"), Bsdf::OrenNayar(bsdf)));
    }
    all.extend(extreme_plastics());
    all.extend(extreme_principled());
    all.extend(super::gltf::extremes());
    all
}

fn extreme_plastics() -> Vec<(String, Bsdf)> {
    let mut all = Vec::new();
    for eta in [0.25, 1.0 - 1e-7, 1.0, 1.0 + 1e-7, 4.0, 100.0] {
        all.push((format!("pane {eta}"), Bsdf::ThinDielectric(ThinDielectric::new(eta, Rgb::WHITE, Rgb::WHITE))));
        for (diffuse, specular) in [(1.0, 1.0), (0.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
            let (diffuse, specular) = (Rgb::splat(diffuse), Rgb::splat(specular));
            let bsdf = Bsdf::Plastic(Plastic::new(eta, diffuse, specular, true));
            all.push((format!("plastic {eta} {diffuse:?} {specular:?}"), bsdf));
        }
    }
    for distribution in [Distribution::Ggx, Distribution::Beckmann] {
        for (alpha, eta) in [(1e-5, 0.25), (1e-5, 4.0), (1.0, 1.0 + 1e-7), (1e6, 100.0)] {
            let facets = Microfacets::new(distribution, alpha, alpha);
            for diffuse in [Rgb::WHITE, Rgb::BLACK] {
                let bsdf = Bsdf::RoughPlastic(RoughPlastic::new(facets, eta, diffuse, Rgb::WHITE, false));
                all.push((format!("plastic {facets:?} {eta} {diffuse:?}"), bsdf));
            }
        }
    }
    all
}

fn extreme_principled() -> Vec<(String, Bsdf)> {
    let mut all = Vec::new();
    // Corners of the parameters' ranges, a bit each: a fifth of them, among which every two bits have every two values.
    for corner in (0..1u32 << 11).step_by(5) {
        let bit = |i: u32| (corner >> i & 1) as f32;
        let eta = [0.25, 1.0 - 1e-7, 1.0, 1.0 + 1e-7, 1.5, 4.0, 100.0][(corner % 7) as usize];
        let disney = Disney {
            base_color: Rgb::splat(bit(0)),
            roughness: bit(1),
            anisotropic: bit(2),
            spec_trans: bit(3),
            eta,
            spec_tint: bit(4),
            sheen: bit(5),
            sheen_tint: bit(6),
            flatness: bit(7),
            regularized: false,
        };
        let solid = Principled { disney, metallic: bit(8), clearcoat: bit(9), clearcoat_gloss: bit(10) };
        all.push((format!("{solid:?}"), Bsdf::Principled(solid)));
        let thin = PrincipledThin { disney, diff_trans: 2.0 * bit(8) };
        if corner >> 9 == 0 {
            all.push((format!("{thin:?}"), Bsdf::PrincipledThin(thin)));
        }
    }
    all
}
