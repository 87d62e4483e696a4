//! Bsdfs by the names of Mitsuba's plugins and parameters, as the files of reference values have them.

use super::*;

/// A plugin's name and its parameters, from `NAME PARAMETER=NUMBER ...`.
pub(super) fn named(text: &str) -> (&str, impl Fn(&str) -> Option<f32>) {
    let mut words = text.split(' ');
    let plugin = words.next().unwrap();
    let parameters: Vec<(&str, f32)> = words
        .map(|word| {
            let (name, number) = word.split_once('=').unwrap();
            (name, number.parse().unwrap())
        })
        .collect();
    (plugin, move |name: &str| parameters.iter().find(|p| p.0 == name).map(|p| p.1))
}

/// One of the principled bsdfs.
pub(super) fn principled(text: &str, base_color: Rgb) -> Bsdf {
    let (plugin, parameters) = named(text);
    let or_0 = |name| parameters(name).unwrap_or(0.0);
    let eta = match (parameters("eta"), plugin) {
        (Some(eta), _) => eta,
        (None, "principledthin") => 1.5,
        (None, _) => Principled::eta_of_specular(parameters("specular").unwrap_or(0.5)),
    };
    let disney = Disney {
        base_color,
        roughness: parameters("roughness").unwrap_or(0.5),
        anisotropic: or_0("anisotropic"),
        spec_trans: or_0("spec_trans"),
        eta,
        spec_tint: or_0("spec_tint"),
        sheen: or_0("sheen"),
        sheen_tint: or_0("sheen_tint"),
        flatness: or_0("flatness"),
        regularized: false,
    };
    match plugin {
        "principled" => {
            let (clearcoat, clearcoat_gloss) = (or_0("clearcoat"), or_0("clearcoat_gloss"));
            Bsdf::Principled(Principled { disney, metallic: or_0("metallic"), clearcoat, clearcoat_gloss })
        }
        "principledthin" => Bsdf::PrincipledThin(PrincipledThin { disney, diff_trans: or_0("diff_trans") }),
        other => panic!("{other}"),
    }
}
