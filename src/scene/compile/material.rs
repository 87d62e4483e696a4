//! Materials.

use crate::bsdf::{
    Bsdf, Conductor, Dielectric, Diffuse, Disney, Distribution, Gltf, GltfParameters, Microfacets, Null, OrenNayar,
    Plastic, Principled, PrincipledThin, RoughConductor, RoughDielectric, RoughPlastic, ThinDielectric,
};
use crate::description::{self, BsdfId, BsdfKind, MicrofacetDistribution, SceneDescription, Varying};
use crate::error::{Error, Result, Span};
use crate::material::{Graph, Material, Node, NormalSource, Number, Sides, Terminator};
use crate::math::float::saturate_to_f32;
use crate::spectrum::Rgb;
use crate::texture::{TexturePoint, Textures};
use glam::Vec2;
use std::collections::HashMap;

/// The materials compiled so far.
#[derive(Default)]
pub(super) struct Materials {
    pub(super) all: Vec<Material>,
    /// See [`crate::scene::Scene::absorption`].
    insides: Vec<Option<Rgb>>,
    indices: HashMap<BsdfId, u32>,
}

impl Materials {
    /// Index of the material for a bsdf of the description, compiled once; `textures` and `unit` are those of the compiled
    /// scene.
    pub(super) fn index(
        &mut self,
        description: &SceneDescription,
        id: BsdfId,
        (textures, unit): (&Textures, f64),
    ) -> Result<u32> {
        if let Some(&index) = self.indices.get(&id) {
            return Ok(index);
        }
        let material = match sides(description, textures, id)? {
            Some(sides) => Material::Plain(sides),
            None => {
                let mut builder = Builder { description, textures, unit, nodes: Vec::new() };
                builder.node(id)?;
                Material::Varying(Graph::new(builder.nodes))
            }
        };
        let index = self.all.len() as u32;
        self.all.push(material);
        self.insides.push(inside(description, id).map(|volume| absorption(volume, unit)));
        self.indices.insert(id, index);
        Ok(index)
    }

    /// Whether anything absorbs.
    pub(super) fn absorbs(&self) -> bool {
        self.insides.iter().flatten().any(|absorption| !absorption.is_black())
    }

    /// What is inside of surfaces of each material; nothing if nothing absorbs.
    pub(super) fn absorption(&mut self) -> Vec<Option<Rgb>> {
        if self.absorbs() { std::mem::take(&mut self.insides) } else { Vec::new() }
    }
}

/// What is inside of a surface with this bsdf; nothing if no light gets there.
fn inside(description: &SceneDescription, id: BsdfId) -> Option<description::Volume> {
    let bsdf = &description.bsdfs[id.0];
    match bsdf.kind {
        BsdfKind::Gltf(gltf) if gltf.transmission > 0.0 => gltf.volume,
        _ => bsdf.parts().into_iter().find_map(|part| inside(description, part)),
    }
}

/// The absorption coefficient per unit of length of the compiled scene, which has `unit` of them for one of the file's.
fn absorption(volume: description::Volume, unit: f64) -> Rgb {
    let distance = volume.attenuation_distance * unit;
    volume.attenuation_color.map(|left| saturate_to_f32((-libm::log(f64::from(left)) / distance).max(0.0)))
}

/// An error unless bsdfs refer to bsdfs and textures that are there, and none to itself, be it through others.
pub(super) fn check(description: &SceneDescription) -> Result<()> {
    let bsdfs = &description.bsdfs;
    for bsdf in bsdfs {
        // What it is made of, layer by layer: as deep as there are bsdfs only if there is a circle.
        let mut layer = bsdf.parts();
        for _ in bsdfs {
            if layer.is_empty() {
                break;
            }
            if layer.iter().any(|part| part.0 >= bsdfs.len()) {
                return Err(Error::scene(&bsdf.at, "the bsdf refers to another that is not there"));
            }
            layer = layer.iter().flat_map(|part| bsdfs[part.0].parts()).collect();
            layer.sort_unstable_by_key(|part| part.0);
            layer.dedup();
        }
        if !layer.is_empty() {
            return Err(Error::scene(&bsdf.at, "a bsdf cannot be made of itself"));
        }
        if bsdf.asked_textures().iter().any(|texture| texture.0 >= description.textures.len()) {
            return Err(Error::scene(&bsdf.at, "the bsdf refers to a texture that is not there"));
        }
    }
    Ok(())
}

/// What needs no working out at each point: a bsdf, or two sides, without textures.
fn sides(description: &SceneDescription, textures: &Textures, id: BsdfId) -> Result<Option<Sides>> {
    let plain = |id: BsdfId| {
        let bsdf = &description.bsdfs[id.0];
        let varies = bsdf.asked_textures().iter().any(|id| description.textures[id.0].is_varying());
        let has_normal = matches!(bsdf.kind, BsdfKind::Gltf(gltf) if gltf.coat_normal.is_some());
        if varies || has_normal { None } else { leaf_with_constants(bsdf, description, textures) }
    };
    let BsdfKind::TwoSided { front, back } = description.bsdfs[id.0].kind else {
        return Ok(plain(id).map(|front| Sides { front, back: None }));
    };
    let (Some(front), Some(back)) = (plain(front), plain(back)) else { return Ok(None) };
    let at = &description.bsdfs[id.0].at;
    check_side(&front, at)?;
    if !matches!(back, Bsdf::Null(_)) {
        check_side(&back, at)?;
    }
    Ok(Some(Sides { front, back: Some(back) }))
}

/// A bsdf that is no combination of others, with the numbers of its textures that are the same everywhere.
fn leaf_with_constants(bsdf: &description::Bsdf, description: &SceneDescription, textures: &Textures) -> Option<Bsdf> {
    let mut compiled = leaf(&bsdf.kind)?;
    let anywhere = TexturePoint::new(Vec2::ZERO);
    for &(parameter, id) in bsdf.varying.iter().filter(|(_, id)| !description.textures[id.0].is_varying()) {
        let index = id.0 as u32;
        compiled.set(
            parameter,
            match parameter.is_colour() {
                true => textures.colour(index, &anywhere),
                false => Rgb::splat(textures.number(index, &anywhere)),
            },
        );
    }
    Some(compiled)
}

/// A side of a two-sided bsdf: anything that reflects only. (A back may be nothing at all, too: the surface then has none.)
fn check_side(bsdf: &Bsdf, at: &Span) -> Result<()> {
    if bsdf.lobes().transmits {
        return Err(Error::scene(at, "a two-sided bsdf cannot have a side that transmits light"));
    }
    Ok(())
}

/// Makes a graph.
struct Builder<'a> {
    description: &'a SceneDescription,
    textures: &'a Textures,
    unit: f64,
    nodes: Vec<Node>,
}

impl Builder<'_> {
    /// Adds a bsdf after those that it refers to.
    fn node(&mut self, id: BsdfId) -> Result<u32> {
        let bsdf = &self.description.bsdfs[id.0];
        let node = match bsdf.kind {
            BsdfKind::TwoSided { front, back } => {
                let first = self.nodes.len();
                let (front, back) = (self.node(front)?, self.node(back)?);
                let has_back = !matches!(self.nodes[back as usize], Node::Leaf { bsdf: Bsdf::Null(_), .. });
                let last = if has_back { back } else { front };
                for node in &self.nodes[first..=last as usize] {
                    match node {
                        Node::Leaf { bsdf: side, .. } => check_side(side, &bsdf.at)?,
                        Node::TwoSided { .. } => {
                            return Err(Error::scene(&bsdf.at, "two-sided bsdfs cannot be nested"));
                        }
                        Node::Mask { .. } => {
                            let message = "a two-sided bsdf cannot have a side that transmits light";
                            return Err(Error::scene(&bsdf.at, message));
                        }
                        Node::Blend { .. } | Node::Perturbed { .. } => {}
                    }
                }
                Node::TwoSided { front, back }
            }
            BsdfKind::Blend { first, second, weight } => {
                Node::Blend { first: self.node(first)?, second: self.node(second)?, weight: number(weight) }
            }
            BsdfKind::Mask { nested, opacity } => Node::Mask { nested: self.node(nested)?, opacity: number(opacity) },
            BsdfKind::Perturbed { nested, normal, terminator } => {
                let nested = self.node(nested)?;
                Node::Perturbed { nested, normal: self.normal(normal), terminator: self::terminator(terminator) }
            }
            ref kind => {
                let varies = |(_, id): &&(_, description::TextureId)| self.description.textures[id.0].is_varying();
                let varying = bsdf.varying.iter().filter(varies).map(|&(p, texture)| (p, texture.0 as u32)).collect();
                // Everything that is not a combination is a leaf.
                let compiled = leaf_with_constants(bsdf, self.description, self.textures);
                let bsdf = compiled.ok_or_else(|| Error::scene(&bsdf.at, "this cannot be a part of a bsdf"))?;
                let coat_normal = if let BsdfKind::Gltf(gltf) = kind { gltf.coat_normal } else { None };
                Node::Leaf { bsdf, varying, coat_normal: coat_normal.map(|normal| self.normal(normal)) }
            }
        };
        self.nodes.push(node);
        Ok((self.nodes.len() - 1) as u32)
    }

    fn normal(&self, normal: description::NormalSource) -> NormalSource {
        match normal {
            description::NormalSource::Map { texture, scale } => {
                NormalSource::Map { texture: texture.0 as u32, scale: scale as f32 }
            }
            description::NormalSource::Bump { height, scale } => {
                NormalSource::Bump { height: height.0 as u32, scale: (scale * self.unit) as f32 }
            }
        }
    }
}

fn terminator(terminator: description::Terminator) -> Terminator {
    match terminator {
        description::Terminator::Cut { flip_invalid, shadowing } => Terminator::Cut { flip_invalid, shadowing },
        description::Terminator::Bend => Terminator::Bend,
    }
}

fn number(v: Varying) -> Number {
    match v {
        Varying::Constant(value) => Number::Constant(value.clamp(0.0, 1.0) as f32),
        Varying::Texture(id) => Number::Texture(id.0 as u32),
    }
}

/// A bsdf that is no combination of others; `None` for those that are.
fn leaf(kind: &BsdfKind) -> Option<Bsdf> {
    let bsdf = scattering_once(kind)?;
    let several = match kind {
        BsdfKind::RoughConductor { facets, .. }
        | BsdfKind::RoughDielectric { facets, .. }
        | BsdfKind::RoughPlastic { facets, .. } => facets.multiple_scattering,
        _ => false,
    };
    Some(if several { bsdf.with_multiple_scattering() } else { bsdf })
}

/// The same, without what microfacets scatter several times.
fn scattering_once(kind: &BsdfKind) -> Option<Bsdf> {
    Some(match *kind {
        BsdfKind::Diffuse { reflectance } => Bsdf::Diffuse(Diffuse { reflectance }),
        BsdfKind::Conductor { eta, k, specular_reflectance } => {
            Bsdf::Conductor(Conductor { eta, k, reflectance: specular_reflectance })
        }
        BsdfKind::RoughConductor { facets, eta, k, specular_reflectance } => {
            Bsdf::RoughConductor(RoughConductor::new(microfacets(facets), eta, k, specular_reflectance))
        }
        BsdfKind::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            Bsdf::Dielectric(Dielectric::new((int_ior / ext_ior) as f32, specular_reflectance, specular_transmittance))
        }
        BsdfKind::RoughDielectric { facets, int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            let eta = (int_ior / ext_ior) as f32;
            RoughDielectric::bsdf(microfacets(facets), eta, specular_reflectance, specular_transmittance)
        }
        BsdfKind::ThinDielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            let eta = (int_ior / ext_ior) as f32;
            Bsdf::ThinDielectric(ThinDielectric::new(eta, specular_reflectance, specular_transmittance))
        }
        BsdfKind::Plastic(p) => {
            let eta = (p.int_ior / p.ext_ior) as f32;
            Bsdf::Plastic(Plastic::new(eta, p.diffuse_reflectance, p.specular_reflectance, p.nonlinear))
        }
        BsdfKind::RoughPlastic { facets, plastic: p } => {
            let (facets, eta) = (microfacets(facets), (p.int_ior / p.ext_ior) as f32);
            let (diffuse, specular) = (p.diffuse_reflectance, p.specular_reflectance);
            Bsdf::RoughPlastic(RoughPlastic::new(facets, eta, diffuse, specular, p.nonlinear))
        }
        BsdfKind::Principled { shared, metallic, clearcoat, clearcoat_gloss } => Bsdf::Principled(Principled {
            disney: disney(shared),
            metallic: metallic as f32,
            clearcoat: clearcoat as f32,
            clearcoat_gloss: clearcoat_gloss as f32,
        }),
        BsdfKind::PrincipledThin { shared, diff_trans } => {
            Bsdf::PrincipledThin(PrincipledThin { disney: disney(shared), diff_trans: diff_trans as f32 })
        }
        BsdfKind::OrenNayar { reflectance, roughness } => {
            Bsdf::OrenNayar(OrenNayar { reflectance, roughness: roughness as f32 })
        }
        BsdfKind::Gltf(gltf) => Bsdf::Gltf(Gltf::new(gltf_parameters(gltf))),
        BsdfKind::Null => Bsdf::Null(Null),
        BsdfKind::TwoSided { .. } | BsdfKind::Blend { .. } | BsdfKind::Mask { .. } | BsdfKind::Perturbed { .. } => {
            return None;
        }
    })
}

fn gltf_parameters(gltf: description::Gltf) -> GltfParameters {
    GltfParameters {
        base_color: gltf.base_color,
        metallic: gltf.metallic as f32,
        roughness: gltf.roughness as f32,
        ior: gltf.ior as f32,
        specular: gltf.specular as f32,
        specular_color: gltf.specular_color,
        transmission: gltf.transmission as f32,
        solid: gltf.volume.is_some(),
        clearcoat: gltf.clearcoat as f32,
        clearcoat_roughness: gltf.clearcoat_roughness as f32,
        sheen_color: gltf.sheen_color,
        sheen_roughness: gltf.sheen_roughness as f32,
        iridescence: gltf.iridescence as f32,
        iridescence_ior: gltf.iridescence_ior as f32,
        iridescence_thickness: gltf.iridescence_thickness as f32,
    }
}

fn disney(shared: description::PrincipledShared) -> Disney {
    Disney {
        base_color: shared.base_color,
        roughness: shared.roughness as f32,
        anisotropic: shared.anisotropic as f32,
        spec_trans: shared.spec_trans as f32,
        eta: shared.eta as f32,
        spec_tint: shared.spec_tint as f32,
        sheen: shared.sheen as f32,
        sheen_tint: shared.sheen_tint as f32,
        flatness: shared.flatness as f32,
        regularized: false,
    }
}

fn microfacets(facets: description::Microfacets) -> Microfacets {
    let distribution = match facets.distribution {
        MicrofacetDistribution::Beckmann => Distribution::Beckmann,
        MicrofacetDistribution::Ggx => Distribution::Ggx,
    };
    Microfacets::new(distribution, facets.alpha_u as f32, facets.alpha_v as f32)
}
