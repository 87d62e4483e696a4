//! The albedos of the layers of [`super::Gltf`]: how much each lets pass, and what is scattered evenly.

use super::Gltf;
use super::energy::{Interface, missing, several};
use super::fresnel::Contrast;
use super::microfacet::{Distribution, Microfacets};
use super::sheen::Sheen;
use crate::math::float::{max, min, sqr};
use crate::spectrum::Rgb;
use std::sync::LazyLock;

/// The tables of the coat.
static COAT: LazyLock<&'static Interface> = LazyLock::new(|| Interface::of(Distribution::Ggx, Layers::COAT_IOR));

/// Roughnesses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Layers {
    pub(super) alpha: f32,
    pub(super) coat_alpha: f32,
    pub(super) sheen: Sheen,
    /// The dielectric's reflectance is r₀ + r₁·g, in its brightest channel and without film.
    fresnel: [f32; 2],
}

/// What depends on no direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Means {
    /// Of the base's reflection: what one scattering loses, and what comes back of it from metal and dielectric.
    lost: f32,
    metal: Rgb,
    dielectric: Rgb,
    /// Under the dielectric's reflection.
    below: f32,
    /// What the refracting base loses at one scattering outside and inside, and which part of it then goes to the other side.
    crossing: [f32; 2],
    crosses: [f32; 2],
    /// Of the coat: what one scattering loses, what comes back of it, and how often it is one scattering that is sampled.
    coat_lost: f32,
    pub(super) coat_several: f32,
    pub(super) coat_once: f32,
}

/// What depends on one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// What coat and sheen let pass.
    pub(super) coat: f32,
    pub(super) sheen: f32,
    /// Albedo of white sheen.
    pub(super) sheen_albedo: f32,
    /// What one scattering by the coat, by the base's reflection, and by the refracting base loses.
    coat_lost: f32,
    lost: f32,
    crossing: f32,
    /// What gets below the dielectric's reflection, without and with film.
    below: f32,
    below_film: f32,
}

impl Gltf {
    /// See [`super::Bsdf::regularized`]. Sheen is wide anyway, and a window stays one.
    pub(super) fn regularized(mut self) -> Self {
        self.regularized = true;
        self.follow();
        self
    }

    /// Roughness of the base. A smooth base has the smallest roughness that directions in f32 can tell anything about.
    #[inline]
    pub(super) fn alpha(&self) -> f32 {
        let alpha = self.alpha_of(self.is.roughness);
        if self.refracts() { max(alpha, Self::LEAST_CONTRAST / (self.is.ior - 1.0).abs()) } else { alpha }
    }

    /// The α of facets of this roughness.
    #[inline]
    fn alpha_of(&self, roughness: f32) -> f32 {
        let alpha = max(sqr(roughness), Microfacets::MIN_ALPHA);
        if self.regularized { Microfacets::regularized_alpha(alpha) } else { alpha }
    }

    /// See [`super::Bsdf::scatters_everywhere`]. A coat is narrow.
    pub(super) fn scatters_everywhere(&self) -> bool {
        let alpha = sqr(self.is.roughness);
        let is_bare = !(self.is.clearcoat > 0.0) && !self.lobes().transmits;
        is_bare && Microfacets::new(Distribution::Ggx, alpha, alpha).scatters_everywhere(false)
    }
}

impl Layers {
    /// The coat's index of refraction, by its extension.
    pub(super) const COAT_IOR: f32 = 1.5;

    #[inline]
    pub(super) fn new(gltf: &Gltf) -> Self {
        let (is, normal) = (&gltf.is, gltf.dielectric_normal().max_component());
        Self {
            alpha: gltf.alpha(),
            coat_alpha: gltf.alpha_of(is.clearcoat_roughness),
            sheen: Sheen::new(is.sheen_roughness),
            fresnel: [is.specular * normal, is.specular * (1.0 - normal)],
        }
    }
}

impl Means {
    pub(super) fn new(gltf: &Gltf, layers: &Layers) -> Self {
        let (is, tables) = (&gltf.is, gltf.tables);
        let returned = tables.mean_returned(layers.alpha);
        let lost = max(1.0 - returned.all, 0.0);
        let [r0, r1] = layers.fresnel;
        // Of a window nothing is reflected, rounding errors included.
        let reflected = if gltf.is_window() { 0.0 } else { max(r0 + r1 * tables.smooth, 0.0) };
        let dielectric = several(Rgb::splat(reflected), returned.all);
        let below = 1.0 - (r0 * returned.all + r1 * returned.part + lost * dielectric.0.x);
        let mut means = Self {
            lost,
            metal: if is.metallic > 0.0 { several(gltf.mean_metal(), returned.all) } else { Rgb::BLACK },
            dielectric,
            below: max(below, 0.0),
            crossing: [0.0; 2],
            crosses: [0.0; 2],
            coat_lost: 0.0,
            coat_several: 0.0,
            coat_once: 1.0,
        };
        if gltf.refracts() {
            means.cross(gltf, layers);
        }
        if is.clearcoat > 0.0 {
            means.coat(layers);
        }
        means
    }

    /// What is refracted.
    fn cross(&mut self, gltf: &Gltf, layers: &Layers) {
        let tables = gltf.tables;
        let [outside, inside] = [true, false].map(|outside| tables.mean_lost(outside, layers.alpha).of(layers.fresnel));
        let [r0, r1] = layers.fresnel;
        let through = 1.0 - max(r0 + r1 * tables.smooth, 0.0);
        self.crossing = [outside, inside];
        self.crosses =
            [tables.crosses(true, [outside, inside], through), tables.crosses(false, [inside, outside], through)];
    }

    fn coat(&mut self, layers: &Layers) {
        let returned = COAT.mean_returned(layers.coat_alpha);
        let normal = Contrast::new(Layers::COAT_IOR).normal;
        self.coat_lost = max(1.0 - returned.all, 0.0);
        let mean = normal + (1.0 - normal) * COAT.smooth;
        self.coat_several = several(Rgb::splat(mean), returned.all).0.x;
        let (once, often) = (mean * returned.all, self.coat_several * self.coat_lost);
        self.coat_once = once / (once + often);
    }

    /// Albedos of what is diffuse, and of what facets scatter several times to the viewer's side and to the other, seen so;
    /// with what is above.
    pub(super) fn even_albedos(&self, gltf: &Gltf, outside: bool, seen: &Seen) -> [Rgb; 3] {
        let above = seen.coat * seen.sheen;
        let is = &gltf.is;
        let glass = gltf.glass();
        let [mut diffuse, mut up, mut down] = [Rgb::BLACK; 3];
        if outside {
            let opaque = if gltf.refracts() { (1.0 - is.metallic) - glass } else { 1.0 - is.metallic };
            up += (self.metal * is.metallic + self.dielectric * opaque) * seen.lost;
            diffuse += is.base_color * (self.diffuse(gltf) * seen.below);
        }
        if gltf.refracts() {
            let crosses = self.crosses[usize::from(!outside)];
            up += Rgb::splat(glass * (1.0 - crosses) * seen.crossing);
            down += is.base_color * (glass * crosses * seen.crossing);
        } else if !is.solid {
            down += is.base_color * (glass * (1.0 - self.dielectric.0.x) * seen.lost);
        }
        [diffuse, up, down].map(|albedo| albedo * above)
    }

    /// Weight of what is diffuse.
    #[inline]
    fn diffuse(&self, gltf: &Gltf) -> f32 {
        (1.0 - gltf.is.metallic) * (1.0 - gltf.is.transmission)
    }

    /// What is scattered evenly on the viewer's side, below coat and sheen: times cos θi / π it is the value.
    pub(super) fn even_up(&self, gltf: &Gltf, outside: bool, o: &Seen, i: &Seen) -> Rgb {
        let is = &gltf.is;
        let glass = gltf.glass();
        let mut up = Rgb::BLACK;
        if outside {
            let opaque = if gltf.refracts() { (1.0 - is.metallic) - glass } else { 1.0 - is.metallic };
            let lobe = missing(o.lost, i.lost, self.lost);
            up += (self.metal * is.metallic + self.dielectric * opaque) * lobe;
            let diffuse = self.diffuse(gltf);
            if diffuse > 0.0 {
                let film = is.iridescence;
                let bare = missing(o.below, i.below, self.below) * (1.0 - film);
                up += is.base_color * (diffuse * (bare + film * min(o.below_film, i.below_film)));
            }
        }
        if gltf.refracts() {
            let side = usize::from(!outside);
            let lobe = missing(o.crossing, i.crossing, self.crossing[side]);
            up += Rgb::splat(glass * (1.0 - self.crosses[side]) * lobe);
        }
        up
    }

    /// The same on the other side, where `i` is seen; but for the compression of radiance.
    pub(super) fn even_down(&self, gltf: &Gltf, outside: bool, o: &Seen, i: &Seen) -> Rgb {
        let glass = gltf.glass();
        if gltf.refracts() {
            let side = usize::from(!outside);
            let lobe = missing(o.crossing, i.crossing, self.crossing[1 - side]);
            gltf.is.base_color * (glass * self.crosses[side] * lobe)
        } else if !gltf.is.solid {
            let lobe = missing(o.lost, i.lost, self.lost);
            gltf.is.base_color * (glass * (1.0 - self.dielectric.0.x) * lobe)
        } else {
            Rgb::BLACK
        }
    }
}

impl Seen {
    /// Under the cosines `cos` to the normal and `coat_cos` to that of the coat, from `outside` or inside.
    pub(super) fn new(gltf: &Gltf, layers: &Layers, means: &Means, outside: bool, [cos, coat_cos]: [f32; 2]) -> Self {
        let is = &gltf.is;
        let mut seen = Self {
            coat: 1.0,
            sheen: 1.0,
            sheen_albedo: 0.0,
            coat_lost: 0.0,
            lost: 0.0,
            crossing: 0.0,
            below: 0.0,
            below_film: 0.0,
        };
        if gltf.refracts() {
            seen.crossing = gltf.tables.lost(outside, layers.alpha, cos).of(layers.fresnel);
        }
        if !outside {
            return seen;
        }
        let returned = gltf.tables.returned(layers.alpha, cos);
        seen.lost = 1.0 - returned.all;
        let [r0, r1] = layers.fresnel;
        let several = seen.lost * means.dielectric.0.x;
        seen.below = max(1.0 - (r0 * returned.all + r1 * returned.part + several), 0.0);
        if is.iridescence > 0.0 {
            let film = gltf.film().reflectance(cos, gltf.dielectric_normal()).max_component();
            seen.below_film = max(1.0 - (is.specular * film * returned.all + several), 0.0);
        }
        if !is.sheen_color.is_black() {
            seen.sheen_albedo = layers.sheen.albedo(cos);
            seen.sheen = max(1.0 - is.sheen_color.max_component() * seen.sheen_albedo, 0.0);
        }
        if is.clearcoat > 0.0 {
            let returned = COAT.returned(layers.coat_alpha, coat_cos);
            seen.coat_lost = 1.0 - returned.all;
            let normal = Contrast::new(Layers::COAT_IOR).normal;
            let albedo = normal * returned.all + (1.0 - normal) * returned.part + seen.coat_lost * means.coat_several;
            seen.coat = max(1.0 - is.clearcoat * albedo, 0.0);
        }
        seen
    }

    /// What the coat scatters several times between this direction and `other`.
    pub(super) fn coat_missing(&self, other: &Self, means: &Means) -> f32 {
        missing(self.coat_lost, other.coat_lost, means.coat_lost)
    }
}
