//! Materials that are worked out at each point of a surface.

use super::layer::{self, Layer, Perturbation};
use crate::bsdf::{Bsdf, Parameter};
use crate::facts::{Feature, has};
use crate::math::float::{max, min, sqr};
use crate::math::frame::Frame;
use crate::spectrum::Rgb;
use crate::texture::{Lookup, TexturePoint, Textures};
use glam::{Vec2, Vec3};

/// How bsdfs are combined. A node refers only to those before it; the last one is the material.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    /// Every texture that a node names, each once.
    textures: Vec<u32>,
}

/// A part of a material. Nodes are referred to by their index in the graph, textures by theirs in the scene.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "there are few, and they are read at every vertex")]
pub enum Node {
    /// A bsdf with the textures of parameters that vary.
    Leaf {
        /// With the parameters that do not.
        bsdf: Bsdf,
        /// Those that do.
        varying: Vec<(Parameter, u32)>,
        /// Where the normal of its coat comes from, if that is not the surface's.
        coat_normal: Option<NormalSource>,
    },
    /// A node for each side.
    TwoSided {
        /// Seen from the front.
        front: u32,
        /// Seen from the back, which it takes for a front.
        back: u32,
    },
    /// A weighted mean.
    Blend {
        /// Counts 1 − weight, ...
        first: u32,
        /// ... and weight.
        second: u32,
        /// The weight.
        weight: Number,
    },
    /// A node with holes, through which light goes straight.
    Mask {
        /// The node.
        nested: u32,
        /// The part that is not a hole.
        opacity: Number,
    },
    /// A node with another normal.
    Perturbed {
        /// The node.
        nested: u32,
        /// Where the normal comes from.
        normal: NormalSource,
        /// What happens where it disagrees with the base normal about who sees whom.
        terminator: Terminator,
    },
}

/// What happens where a perturbed normal looks elsewhere than its base normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terminator {
    /// Light from behind either is cut off.
    Cut {
        /// Whether a normal that looks away from the viewer is turned round the base normal (as Schüssler et al. 2017,
        /// *Microfacet-based Normal Mapping for Robust Monte Carlo Path Tracing*, do with the half of their microsurface).
        flip_invalid: bool,
        /// Whether light fades out towards the terminator of the base normal.
        shadowing: bool,
    },
    /// The normal is bent towards the base normal until a mirror would show the viewer what is above the surface; light from
    /// behind either is cut off.
    Bend,
}

/// A number in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// The same everywhere.
    Constant(f32),
    /// What a texture gives where a number is asked for.
    Texture(u32),
}

/// Where a normal comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalSource {
    /// From the channels of a texture, as (n + 1)/2.
    Map {
        /// The texture.
        texture: u32,
        /// A factor on the components along the surface.
        scale: f32,
    },
    /// From a height above the surface.
    Bump {
        /// The texture.
        height: u32,
        /// A factor on its luminance that makes it a length in the compiled scene's unit.
        scale: f32,
    },
}

/// Where on a surface, and seen from where.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// Where textures are asked.
    pub point: TexturePoint<'a>,
    /// Direction to the viewer in the shading frame.
    pub wo: Vec3,
    /// ∂p/∂u and ∂p/∂v in the shading frame, in the compiled scene's unit of length.
    pub dp: [Vec3; 2],
    /// Whether the second axis of a normal map is the negative of the shading frame's.
    pub mirrored: bool,
}

impl Node {
    /// The textures that it names.
    fn textures(&self) -> Vec<u32> {
        let of_normal = |normal: &NormalSource| match *normal {
            NormalSource::Map { texture, .. } | NormalSource::Bump { height: texture, .. } => texture,
        };
        match self {
            Self::Leaf { varying, coat_normal, .. } => {
                varying.iter().map(|(_, texture)| *texture).chain(coat_normal.iter().map(of_normal)).collect()
            }
            Self::Blend { weight: Number::Texture(index), .. } | Self::Mask { opacity: Number::Texture(index), .. } => {
                vec![*index]
            }
            Self::Perturbed { normal, .. } => vec![of_normal(normal)],
            Self::TwoSided { .. } | Self::Blend { .. } | Self::Mask { .. } => Vec::new(),
        }
    }
}

impl Number {
    fn at(self, textures: &Textures, point: &TexturePoint<'_>) -> f32 {
        match self {
            Self::Constant(value) => value,
            // NaN becomes 0.
            Self::Texture(index) => min(max(textures.number(index, point), 0.0), 1.0),
        }
    }
}

impl Graph {
    /// From nodes, at least one, each of which refers only to those before it; the last is the material.
    pub fn new(nodes: Vec<Node>) -> Self {
        let mut textures: Vec<u32> = nodes.iter().flat_map(Node::textures).collect();
        textures.sort_unstable();
        textures.dedup();
        Self { nodes, textures }
    }

    /// Adds the lookups that [`Self::resolve`] will make at a point.
    #[inline]
    pub fn find_lookups(&self, textures: &Textures, point: &TexturePoint<'_>, lookups: &mut Vec<Lookup>) {
        for &index in &self.textures {
            textures.find_lookup(index, point, lookups);
        }
    }

    /// Whether it has holes.
    pub fn has_masks(&self) -> bool {
        self.nodes.iter().any(|node| matches!(node, Node::Mask { .. }))
    }

    /// The same of rougher twins ([`Bsdf::regularized`]).
    pub fn regularized(&self) -> Self {
        let mut twin = self.clone();
        for node in &mut twin.nodes {
            if let Node::Leaf { bsdf, .. } = node {
                *bsdf = bsdf.clone().regularized();
            }
        }
        twin
    }

    /// Every bsdf in it.
    pub fn bsdfs(&self) -> impl Iterator<Item = &Bsdf> {
        /// What a mask has besides.
        const NULL: Bsdf = Bsdf::Null(crate::bsdf::Null);
        self.nodes.iter().filter_map(|node| match node {
            Node::Leaf { bsdf, .. } => Some(bsdf),
            Node::Mask { .. } => Some(&NULL),
            Node::TwoSided { .. } | Node::Blend { .. } | Node::Perturbed { .. } => None,
        })
    }

    /// The layers of the material at a place, in place of what `layers` holds.
    pub fn resolve(&self, textures: &Textures, place: &Place<'_>, layers: &mut Vec<Layer>) {
        layers.clear();
        if let Some(root) = self.nodes.len().checked_sub(1) {
            Resolver { graph: self, textures, place, layers }.node(root as u32, 1.0, None);
            if layers.len() > 1 {
                layer::set_chances(layers, place.wo);
            }
        }
    }
}

/// Works a graph out.
struct Resolver<'a> {
    graph: &'a Graph,
    textures: &'a Textures,
    place: &'a Place<'a>,
    layers: &'a mut Vec<Layer>,
}

impl Resolver<'_> {
    fn node(&mut self, index: u32, weight: f32, perturbation: Option<Perturbation>) {
        if !(weight > 0.0) {
            return;
        }
        let node = &self.graph.nodes[index as usize];
        has(Feature::Masks, matches!(node, Node::Mask { .. }));
        match node {
            Node::Leaf { bsdf, varying, coat_normal } => self.leaf(bsdf, varying, *coat_normal, weight, perturbation),
            &Node::TwoSided { front, back } => match own(perturbation.as_ref(), self.place.wo).z < 0.0 {
                false => self.node(front, weight, perturbation),
                true => self.node(back, weight, Some(mirrored(perturbation))),
            },
            &Node::Blend { first, second, weight: part } => {
                let part = part.at(self.textures, &self.place.point);
                self.node(first, weight * (1.0 - part), perturbation);
                self.node(second, weight * part, perturbation);
            }
            &Node::Mask { nested, opacity } => {
                let opacity = opacity.at(self.textures, &self.place.point);
                self.node(nested, weight * opacity, perturbation);
                if opacity < 1.0 {
                    let weight = weight * (1.0 - opacity);
                    let bsdf = Bsdf::Null(crate::bsdf::Null);
                    self.layers.push(Layer { weight, chance: weight, bsdf, perturbation: None });
                }
            }
            &Node::Perturbed { nested, normal, terminator } => {
                let own = self.perturbed(normal, terminator, perturbation);
                self.node(nested, weight, Some(own));
            }
        }
    }

    /// A bsdf with the numbers of the place.
    fn leaf(
        &mut self,
        bsdf: &Bsdf,
        varying: &[(Parameter, u32)],
        coat_normal: Option<NormalSource>,
        weight: f32,
        perturbation: Option<Perturbation>,
    ) {
        let coated = matches!(bsdf, Bsdf::Gltf(_)) && (perturbation.is_some() || coat_normal.is_some());
        let coat = coated.then(|| self.coat(coat_normal, perturbation.as_ref()));
        let (textures, place) = (self.textures, self.place);
        let numbers = varying.iter().map(|&(parameter, texture)| match parameter.is_colour() {
            true => (parameter, textures.colour(texture, &place.point)),
            false => (parameter, Rgb::splat(textures.number(texture, &place.point))),
        });
        let layers = &mut *self.layers;
        bsdf.varied(
            numbers,
            own(perturbation.as_ref(), place.wo),
            #[inline(always)]
            |mut bsdf| {
                if let (Bsdf::Gltf(gltf), Some(n)) = (&mut bsdf, coat) {
                    gltf.set_coat_normal(n);
                }
                layers.push(Layer { weight, chance: weight, bsdf, perturbation });
            },
        );
    }

    /// The normal of a coat in its layer's frame: it follows the surface or a map of its own, not the base's normal.
    fn coat(&self, normal: Option<NormalSource>, perturbation: Option<&Perturbation>) -> Vec3 {
        let n = normal.map_or(Vec3::Z, |map| bent(self.mapped(map, None).normalize_or(Vec3::Z), self.place.wo));
        own(perturbation, n * perturbation.map_or(1.0, |p| p.base))
    }

    /// A normal in the frame `outer`, of any length.
    fn mapped(&self, normal: NormalSource, outer: Option<&Perturbation>) -> Vec3 {
        match normal {
            NormalSource::Map { texture, scale } => {
                let n = self.textures.colour(texture, &self.place.point).0 * 2.0 - 1.0;
                n * Vec3::new(scale, if self.place.mirrored { -scale } else { scale }, 1.0)
            }
            NormalSource::Bump { height, scale } => {
                let gradient = self.textures.gradient(height, &self.place.point) * scale;
                bumped(self.place.dp.map(|dp| own(outer, dp)), gradient)
            }
        }
    }

    /// The frame of a perturbed normal, above `outer`.
    fn perturbed(&self, normal: NormalSource, terminator: Terminator, outer: Option<Perturbation>) -> Perturbation {
        let wo = own(outer.as_ref(), self.place.wo);
        let mut n = self.mapped(normal, outer.as_ref());
        // As given, if only the signs of cosines decide what becomes of it.
        let given = match (&outer, terminator) {
            (Some(Perturbation { is_own: true, .. }), _) | (_, Terminator::Bend) => Vec3::ZERO,
            (outer, Terminator::Cut { .. }) => outer.as_ref().map_or(n, |outer| outer.frame.to_world(n)),
        };
        let (flip_invalid, shadowing) = match terminator {
            Terminator::Cut { flip_invalid, shadowing } => (flip_invalid, shadowing),
            Terminator::Bend => (false, false),
        };
        if flip_invalid && wo.z * wo.dot(n) <= 0.0 {
            n = Vec3::new(-n.x, -n.y, n.z);
        }
        let mut n = n.normalize_or(Vec3::Z);
        if terminator == Terminator::Bend {
            n = bent(n, wo);
        }
        let frame = Frame::from_tangent(n, Vec3::X);
        /// The roughness that the shadowing function gives a perturbation: α² = tan²/8, at most 1 (Estevez et al. 2019,
        /// their equation for the slope's variance).
        const SLOPE_VARIANCE: f32 = 0.125;
        let fade = if shadowing { (SLOPE_VARIANCE * (sqr(n.x) + sqr(n.y)) / sqr(n.z)).min(1.0) } else { 0.0 };
        match outer {
            None => Perturbation { frame, base: 1.0, is_own: true, given, fade },
            Some(outer) => {
                let [s, t, n] = [frame.s, frame.t, frame.n].map(|axis| outer.frame.to_world(axis));
                Perturbation { frame: Frame { s, t, n }, is_own: true, given, fade, ..outer }
            }
        }
    }
}

/// A direction of the shading frame in a layer's own.
fn own(perturbation: Option<&Perturbation>, w: Vec3) -> Vec3 {
    perturbation.map_or(w, |p| p.frame.to_local(w))
}

/// The same seen from behind: z is the other way, x and y stay.
fn mirrored(perturbation: Option<Perturbation>) -> Perturbation {
    match perturbation {
        None => Perturbation {
            frame: Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::NEG_Z },
            base: -1.0,
            is_own: false,
            given: Vec3::NEG_Z,
            fade: 0.0,
        },
        Some(p) => Perturbation { frame: Frame { n: -p.frame.n, ..p.frame }, base: -p.base, ..p },
    }
}

/// The normal nearest to `n` that mirrors `wo` to its own side of the surface z = 0, where `n` does not (Keller et al. 2017,
/// *The Iray Light Transport Simulation and Rendering System*): the mirrored direction is pulled up to the horizon, and the
/// normal is in the middle.
fn bent(n: Vec3, wo: Vec3) -> Vec3 {
    /// How high above the horizon, as a sine: about a degree, so that of a glossy lobe half is not cut off all the same.
    const LEAST: f32 = 0.02;
    let side = if wo.z < 0.0 { -1.0 } else { 1.0 };
    let facing = n * side;
    let mirrored = facing * (2.0 * wo.dot(facing)) - wo;
    if mirrored.z * side >= LEAST {
        return n;
    }
    let Some(horizon) = mirrored.truncate().try_normalize() else { return Vec3::Z };
    let pulled = horizon.extend(LEAST * side).normalize();
    (wo + pulled).normalize_or(Vec3::Z * side) * side
}

/// The normal of a surface that is raised along +z by a height of this gradient with respect to (u, v) (Blinn 1978,
/// *Simulation of Wrinkled Surfaces*), `dp` being ∂p/∂u and ∂p/∂v in the frame of the normal.
fn bumped(dp: [Vec3; 2], gradient: Vec2) -> Vec3 {
    // The derivatives in the plane of the shading normal, raised.
    let [du, dv] = [(dp[0], gradient.x), (dp[1], gradient.y)].map(|(d, rise)| Vec3::new(d.x, d.y, rise));
    let n = du.cross(dv);
    // Where (u, v) is left-handed, or seen from behind, the product points down.
    if n.z < 0.0 { -n } else { n }
}
