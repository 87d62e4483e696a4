//! Wavefront MTL materials, parsed by `tobj`, as bsdfs. Read only where a mesh is shown by itself: Mitsuba ignores them.

use super::source::MAX_TEXT_BYTES;
use crate::description::{BsdfKind, MicrofacetDistribution, Microfacets};
use crate::error::{Error, Position, Result, Span};
use crate::files::Files;
use crate::spectrum::Rgb;
use std::path::Path;

/// What a material is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Material {
    pub(crate) name: String,
    /// Its bsdf, seen from the front.
    pub(crate) kind: BsdfKind,
    /// Radiance that it emits, if any.
    pub(crate) emission: Option<Rgb>,
    /// Whether it names a texture.
    pub(crate) has_texture: bool,
}

/// Reflectance where a material gives none.
pub(crate) const GREY: f32 = 0.5;

/// Index of refraction of glass that gives none.
const GLASS_IOR: f64 = 1.5;

/// Roughness below which nothing is made: the exponents of mirrors are infinite in spirit and 1000 by the format.
const MIN_ALPHA: f64 = 1e-3;

/// Reads the materials of a library.
pub(crate) fn read(files: &Files, path: &Path) -> Result<Vec<Material>> {
    let bytes = files.read(path, MAX_TEXT_BYTES).map_err(|e| Error::file(path, e))?;
    let text = String::from_utf8_lossy(&bytes);
    if let Some((line, key)) = short_colour(&text) {
        let at = Span { file: path.into(), position: Position::Line(u32::try_from(line).unwrap_or(u32::MAX)) };
        return Err(Error::scene(&at, format!("expected three numbers after '{key}'")));
    }
    let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes())
        .map_err(|e| Error::file(path, format!("cannot read materials: {e}")))?;
    Ok(materials.into_iter().map(material).collect())
}

/// The first colour of less than three numbers, of which the parser would make a panic, and its line.
fn short_colour(text: &str) -> Option<(usize, &str)> {
    const COLOURS: [&str; 4] = ["Ka", "Kd", "Ks", "Ke"];
    // As the parser takes lines.
    text.lines().enumerate().find_map(|(i, line)| {
        let mut words = line.split_whitespace();
        let key = words.next().filter(|key| COLOURS.contains(key))?;
        (words.count() < 3).then_some((i + 1, key))
    })
}

fn colour(channels: Option<[f64; 3]>) -> Option<Rgb> {
    let [r, g, b] = channels?.map(|v| v as f32);
    Some(Rgb::new(r, g, b)).filter(|c| c.is_finite()).map(|c| c.map(|v| v.max(0.0)))
}

fn material(m: tobj::Material) -> Material {
    let reflectance = |channels| colour(channels).map(|c| c.map(|v| v.min(1.0)));
    let (diffuse, specular) = (reflectance(m.diffuse), reflectance(m.specular));
    let textures = [&m.diffuse_texture, &m.specular_texture, &m.normal_texture, &m.dissolve_texture];
    Material {
        kind: kind(&m, diffuse.unwrap_or(Rgb::splat(GREY)), specular.unwrap_or(Rgb::BLACK)),
        emission: colour(m.emissive).filter(|e| !e.is_black()),
        has_texture: textures.into_iter().any(Option::is_some),
        name: m.name,
    }
}

/// The format's materials are Phong's, which are no bsdfs. What lets light through (`d` below one, or a model with
/// refraction) becomes glass, what reflects more by `Ks` than by `Kd` rough metal, all else diffuse.
fn kind(m: &tobj::Material, diffuse: Rgb, specular: Rgb) -> BsdfKind {
    /// The models of the format with refraction.
    const REFRACTING: [u8; 4] = [4, 6, 7, 9];
    let refracts = m.illumination_model.is_some_and(|model| REFRACTING.contains(&model));
    if refracts || m.dissolve.is_some_and(|d| d < 1.0) {
        let int_ior = m.optical_density.filter(|n| *n > 1.0 && n.is_finite()).unwrap_or(GLASS_IOR);
        return BsdfKind::Dielectric {
            int_ior,
            ext_ior: 1.0,
            specular_reflectance: Rgb::WHITE,
            specular_transmittance: Rgb::WHITE,
        };
    }
    if specular.luminance() <= diffuse.luminance() {
        return BsdfKind::Diffuse { reflectance: diffuse };
    }
    // The roughness whose Beckmann lobe is as wide as Phong's of this exponent (Walter et al. 2007, section 5.2).
    let exponent = m.shininess.filter(|n| *n >= 0.0).unwrap_or(0.0);
    let alpha = (2.0 / (exponent + 2.0)).sqrt().max(MIN_ALPHA);
    rough_metal(alpha, specular)
}

/// Metal that reflects everything but for its colour.
fn rough_metal(alpha: f64, specular_reflectance: Rgb) -> BsdfKind {
    let distribution = MicrofacetDistribution::Beckmann;
    let facets = Microfacets { distribution, alpha_u: alpha, alpha_v: alpha, multiple_scattering: false };
    BsdfKind::RoughConductor { facets, eta: Rgb::BLACK, k: Rgb::WHITE, specular_reflectance }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind_of(text: &str) -> Material {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.mtl");
        std::fs::write(&path, format!("newmtl m\n{text}")).unwrap();
        read(&Files::default(), &path).unwrap().remove(0)
    }

    #[test]
    fn phong_becomes_the_nearest_bsdf() {
        let diffuse = |v: [f32; 3]| BsdfKind::Diffuse { reflectance: Rgb::new(v[0], v[1], v[2]) };
        assert_eq!(kind_of("").kind, diffuse([0.5; 3]));
        assert_eq!(kind_of("Kd 0.1 0.2 1.5\nKs 0 0 0\n").kind, diffuse([0.1, 0.2, 1.0]));
        assert_eq!(kind_of("Kd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nNs 250\n").kind, diffuse([0.8; 3]));
        let metal = kind_of("Kd 0 0 0\nKs 1 0.8 0.2\nNs 198\n").kind;
        assert_eq!(metal, rough_metal(0.1, Rgb::new(1.0, 0.8, 0.2)));
        for (text, ior) in [("d 0.1\nNi 1.33\n", 1.33), ("illum 7\n", 1.5), ("illum 4\nNi 1.0\n", 1.5)] {
            assert!(matches!(kind_of(text).kind, BsdfKind::Dielectric { int_ior, .. } if int_ior == ior), "{text}");
        }
    }

    #[test]
    fn colours_of_less_than_three_numbers_are_refused() {
        let fault = |text: &str| {
            let files = Files::held([("m.mtl".into(), text.as_bytes().to_vec())]);
            read(&files, Path::new("m.mtl")).unwrap_err().to_string()
        };
        assert_eq!(fault("newmtl a\nKd 1 1 1\n Ks 0.98 0.1\n"), "m.mtl:3: expected three numbers after 'Ks'");
        assert_eq!(fault("Ke\n"), "m.mtl:1: expected three numbers after 'Ke'");
        assert!(fault("newmtl a\nNs x\n").contains("m.mtl: cannot read materials: "));
    }

    #[test]
    fn emission_and_textures_are_noted() {
        let m = kind_of("Kd 1 1 1\nKe 4 3 2\nmap_Kd wood.png\n");
        assert_eq!((m.emission, m.has_texture), (Some(Rgb::new(4.0, 3.0, 2.0)), true));
        let m = kind_of("Ke 0 0 0\n");
        assert_eq!((m.emission, m.has_texture), (None, false));
    }
}
