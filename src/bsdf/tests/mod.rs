//! The laws that every bsdf obeys, for a table of configurations; and that they catch a bsdf which breaks one.

mod albedo;
mod falsified;
mod gltf;
mod mitsuba;
mod named;
mod set;

use super::*;
use crate::check::laws::law as laws;
use crate::check::laws::table::{self, Energy, Row, directions, table};
use crate::check::laws::{Subject, uniform};
use crate::sampler::{Sampler, SamplerKind};

/// The seed of all samples, as `snell check --bsdf` has it by default.
const SEED: u64 = 0;

fn all_laws_hold(law: impl Fn(&Row, Vec3) -> Result<(), String>) {
    let mut failures = Vec::new();
    for row in table() {
        for wo in directions(row.bsdf.lobes().transmits) {
            if let Err(failure) = law(row, wo) {
                failures.push(format!("{}, wo {wo}: {failure}", row.name));
            }
        }
    }
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}

/// Hypothesis of each test: samples have the stated density. 5·10⁴ samples a test; the family is every row with a density
/// times its directions, however the tests below share it, with a false-alarm rate of 1 % altogether; the seed is fixed.
fn samples_follow_the_density(of: impl Fn(&str, Vec3) -> bool) {
    let rows = table().iter().filter(|row| row.bsdf.lobes().smooth);
    let tests = rows.map(|row| directions(row.bsdf.lobes().transmits).count()).sum();
    all_laws_hold(|row, wo| {
        let asked = row.bsdf.lobes().smooth && of(&row.name, wo);
        if asked { laws::density(&row.bsdf, wo, (tests, SEED)) } else { Ok(()) }
    });
}

#[test]
fn samples_of_ggx_follow_the_density() {
    samples_follow_the_density(|name, _| name.contains("Ggx") && !name.contains("several"));
}

#[test]
fn samples_of_beckmann_follow_the_density() {
    samples_follow_the_density(|name, _| name.contains("Beckmann") && !name.contains("several"));
}

#[test]
fn samples_of_principled_bsdfs_follow_the_density() {
    samples_follow_the_density(|name, _| name.contains("principled"));
}

/// Its density is a sum of many, which takes minutes to integrate: rows that differ from others by numbers only are left out,
/// and all directions but one that is steep and one that grazes.
#[test]
fn samples_of_gltf_follow_the_density() {
    const LIKE_OTHERS: [&str; 5] = ["gold", "dense", "tinted", "half glass", "film on metal"];
    samples_follow_the_density(|name, wo| {
        let asked = wo.z.abs() == 0.8 || wo.z.abs() == 0.1;
        asked && name.contains("glTF") && !LIKE_OTHERS.iter().any(|like| name.contains(like))
    });
}

#[test]
fn samples_of_several_scatterings_follow_the_density() {
    samples_follow_the_density(|name, _| name.contains("several"));
}

#[test]
fn samples_of_all_others_follow_the_density() {
    let apart = ["Ggx", "Beckmann", "principled", "glTF"];
    samples_follow_the_density(|name, _| !apart.into_iter().any(|other| name.contains(other)));
}

#[test]
fn weights_are_value_over_density() {
    all_laws_hold(|row, wo| laws::weight(&row.bsdf, wo, SEED));
}

#[test]
fn no_energy_comes_out_of_nothing() {
    all_laws_hold(|row, wo| match row.energy {
        Energy::Sample(gain) => laws::energy(&row.bsdf, wo, gain, SEED),
        Energy::Mean(most) => laws::albedo(&row.bsdf, wo, most, SEED),
    });
}

#[test]
fn values_are_reciprocal() {
    all_laws_hold(|row, wo| laws::reciprocity(&row.bsdf, wo, row.eta, row.exempt, SEED));
}

#[test]
fn one_sided_bsdfs_are_black_from_behind_and_let_nothing_through() {
    for row in table().iter().filter(|row| !row.bsdf.lobes().transmits) {
        for w in directions(false) {
            for (wo, wi) in [(-w, w), (w, -w), (-w, -w)] {
                assert_eq!(row.bsdf.eval_pdf(wo, wi), NOTHING, "{}", row.name);
            }
            assert!((0..10).all(|i| row.bsdf.sample(-w, uniform(1, i)).is_none()), "{}", row.name);
        }
    }
}

#[test]
fn edges_of_the_parameters_stay_finite() {
    for (name, bsdf) in table::extremes() {
        for wo in table::edge_directions() {
            laws::edges(&bsdf, wo, SEED).unwrap_or_else(|failure| panic!("{name}, wo {wo}: {failure}"));
        }
    }
}

/// All laws but that of densities hold at the ends of parameters, too, seen from one direction each; `snell check --bsdf --long` asks
/// all laws, from all directions.
#[test]
fn laws_hold_at_the_edges_of_the_parameters() {
    for (i, row) in table::edges().iter().enumerate() {
        let all: Vec<Vec3> = directions(row.bsdf.lobes().transmits).collect();
        let wo = all[i % all.len()];
        let Energy::Sample(gain) = row.energy else { continue };
        let laws = [laws::weight(&row.bsdf, wo, SEED), laws::energy(&row.bsdf, wo, gain, SEED)];
        let all = laws.into_iter().chain([laws::reciprocity(&row.bsdf, wo, row.eta, row.exempt, SEED)]);
        all.for_each(|law| law.unwrap_or_else(|failure| panic!("{}, wo {wo}: {failure}", row.name)));
    }
}

#[test]
fn an_interface_without_contrast_is_not_there() {
    // Equal indices: everything goes straight on, for a smooth interface, a rough one, a pane and nothing.
    let facets = Microfacets::new(Distribution::Ggx, 0.3, 0.3);
    let smooth = Bsdf::Dielectric(Dielectric::new(1.0, Rgb::WHITE, Rgb::WHITE));
    let pane = Bsdf::ThinDielectric(ThinDielectric::new(1.0, Rgb::WHITE, Rgb::WHITE));
    let rough = RoughDielectric::bsdf(facets, 1.0, Rgb::WHITE, Rgb::WHITE);
    for bsdf in [smooth, rough, pane, Bsdf::Null(Null)] {
        for wo in directions(true) {
            let s = bsdf.sample(wo, uniform(2, 7)).unwrap();
            assert!((s.wi + wo).length() < 1e-6 && s.weight == Rgb::WHITE && s.pdf.is_none(), "{s:?}");
        }
    }
}

/// The mean of what delta samples weigh is the reflectance that is told of their lobe, but for one or two strata of the numbers that
/// choose lobes, and they go where it is said to be.
#[test]
fn mirrors_reflect_what_their_samples_do() {
    const SAMPLES: u32 = 1024;
    let sampler = Sampler { kind: SamplerKind::Stratified { samples: SAMPLES }, seed: 5 };
    let mut told = 0;
    for row in table() {
        for wo in directions(true) {
            let Some(Rgb(mirror)) = row.bsdf.mirror(wo) else { continue };
            let (mut sum, mut most) = (Vec3::ZERO, 0.0);
            for sample in (0..SAMPLES).filter_map(|i| row.bsdf.sample(wo, sampler.stream(0, 0, i).bsdf(0))) {
                if sample.pdf.is_none() && sample.wi.z * wo.z > 0.0 {
                    assert_eq!(sample.wi, Vec3::new(-wo.x, -wo.y, wo.z), "{}", row.name);
                    sum += sample.weight.0;
                    most = f32::max(most, sample.weight.max_component());
                }
            }
            let off = (sum / SAMPLES as f32 - mirror).abs().max_element();
            assert!(off <= 2.0 * most / SAMPLES as f32, "{}, wo {wo}: {mirror}, off by {off}", row.name);
            told += 1;
        }
    }
    assert!(told > 20, "{told}");
}

/// What is told of a lobe are numbers that a light can be chosen by; and within it more is scattered than beside it.
#[test]
fn glossy_lobes_are_where_most_is_scattered() {
    let mut told = 0;
    for row in table() {
        for wo in directions(true) {
            let Some(Gloss { alpha_squared, share }) = row.bsdf.gloss(&wo) else { continue };
            assert!(alpha_squared > 0.0 && alpha_squared.is_finite(), "{}, wo {wo}: {alpha_squared}", row.name);
            assert!((0.0..=1.0).contains(&share), "{}, wo {wo}: {share}", row.name);
            // Where microfacets mask each other the maximum lies elsewhere.
            if wo.z > 0.5 && share > 0.1 && alpha_squared < 0.01 {
                let scattered = |wi: Vec3| row.bsdf.eval_pdf(wo, wi).0.luminance() / wi.z;
                let inside = scattered(Vec3::new(-wo.x, -wo.y, wo.z));
                let outside = scattered(Vec3::new(wo.y, wo.x + 0.8, wo.z).normalize());
                assert!(inside > outside, "{}, wo {wo}: {inside} {outside}", row.name);
                told += 1;
            }
        }
    }
    assert!(told > 10, "{told}");
}
