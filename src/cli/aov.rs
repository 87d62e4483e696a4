//! What is written beside the picture: by `--aov`, by the scene's integrators, by the film's pixel format.

use super::args::AovName;
use crate::description::{self, AovKind};
use crate::error::{Error, Result};
use crate::error_estimate::Estimates;
use crate::film::Film;
use crate::image::{Picture, PixelFormat, Plane, PlaneValues};
use crate::integrator::aov::{Aov, Aovs, Index, Number, Quantity};
use crate::math::float::saturate_to_f32;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// What a channel is made of.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
enum Source {
    /// A mean of the film, times two to the power of `exponent`, which a record keeps exactly; and whether it is a colour. If not
    /// all samples were looked at, also which mean is the part of those that were.
    Mean {
        index: usize,
        exponent: i32,
        is_colour: bool,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        part: Option<usize>,
    },
    /// A whole number of the film.
    Number(usize),
    /// The count of samples.
    Samples,
    /// A channel of the estimated error.
    Error(usize),
}

/// Everything beside the picture.
#[derive(Default)]
pub(super) struct Beside {
    /// What the render is to find out.
    pub(super) aovs: Aovs,
    /// What becomes of it.
    pub(super) channels: Channels,
}

/// What is made of all that a film keeps beside radiance.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Channels {
    /// Every channel by its name.
    named: Vec<(String, Source)>,
    /// Which mean of the film is alpha, if that is wanted.
    alpha: Option<usize>,
}

impl Channels {
    /// How much of each pixel is covered.
    pub(super) fn alpha(&self, film: &Film) -> Option<Vec<f32>> {
        self.alpha.map(|index| film.means(index).into_iter().map(saturate_to_f32).collect())
    }

    /// The channels beside the picture; of a picture of which no error is known, that is as large as the picture.
    pub(super) fn planes(&self, film: &Film, picture: &Picture, estimates: Option<&Estimates>) -> Vec<Plane> {
        let error = |channel: usize| match estimates {
            Some(estimates) => estimates.standard_errors(channel),
            None => picture.pixels().iter().map(|colour| colour.0[channel].abs()).collect(),
        };
        let plane = |(name, source): &(String, Source)| {
            let values = match *source {
                Source::Mean { index, exponent, is_colour, part } => {
                    let mut means = film.means(index);
                    if let Some(part) = part {
                        let parts = film.means(part);
                        means.iter_mut().zip(parts).for_each(|(mean, part)| *mean = of_part(*mean, part));
                    }
                    let value = |mean| saturate_to_f32(libm::ldexp(mean, exponent));
                    let values = means.into_iter().map(value).collect();
                    if is_colour { PlaneValues::Colour(values) } else { PlaneValues::Float(values) }
                }
                Source::Number(index) => PlaneValues::Whole(film.numbers(index)),
                Source::Samples => PlaneValues::Whole(film.sample_counts()),
                Source::Error(channel) => PlaneValues::Colour(error(channel)),
            };
            Plane { name: name.clone(), values }
        };
        self.named.iter().map(plane).collect()
    }

    /// Whether a film that keeps so many means and numbers has all that the channels are made of.
    pub(super) fn fit(&self, means: usize, numbers: usize) -> bool {
        let fits = |(_, source): &(String, Source)| match *source {
            Source::Mean { index, part, .. } => index < means && part.is_none_or(|part| part < means),
            Source::Number(index) => index < numbers,
            Source::Samples => true,
            Source::Error(channel) => channel < 3,
        };
        let mut seen = BTreeSet::new();
        let is_named = |name: &str| !name.is_empty() && name.chars().all(|c| c.is_ascii_graphic() || c == ' ');
        let are_named = self.names().all(|name| is_named(name) && seen.insert(name));
        are_named && self.alpha.is_none_or(|index| index < means) && self.named.iter().all(fits)
    }

    /// Whether alpha is among them.
    pub(super) fn has_alpha(&self) -> bool {
        self.alpha.is_some()
    }

    /// What the channels are called.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.named.iter().map(|(name, _)| name.as_str())
    }
}

impl Beside {
    /// All that `--aov` and the file's integrators ask for, and alpha if the `format` has it.
    ///
    /// Fails where two channels would have one name.
    pub(super) fn new(
        names: &[AovName],
        file: &[description::Aov],
        format: PixelFormat,
        scene: &Scene,
    ) -> Result<Self> {
        let mut beside = Self::default();
        for name in names {
            beside.add_named(*name, scene);
        }
        for aov in file {
            match index(aov.kind) {
                // As in Mitsuba, the first primitive is 0, and so is nothing; the first shape is 1.
                Some(index) => {
                    let first = u32::from(index == Index::Shape);
                    beside.add_number(&aov.names[0], Number { index, first });
                }
                None => beside.add_mean(&aov.names, Aov { quantity: quantity(aov.kind), squared: aov.squared }, scene),
            }
        }
        if format.has_alpha() {
            beside.channels.alpha = Some(beside.aovs.alpha());
        }
        let own = format.channels().iter().map(|(name, _)| *name).chain(format.has_alpha().then_some("A"));
        let mut seen = BTreeSet::new();
        if let Some(name) = own.chain(beside.channels.names()).find(|name| !seen.insert(*name)) {
            return Err(Error::Usage(format!("two channels of the picture would be called '{name}'")));
        }
        Ok(beside)
    }

    /// Says whether a sky that is seen counts for alpha.
    pub(super) fn tell(&mut self, sky_counts: bool) {
        self.aovs.sky_counts = sky_counts;
    }

    /// Has surfaces looked at for the first `count` samples of each pixel only, if that is not all of them.
    pub(super) fn look_at_first(&mut self, count: Option<u32>, samples: u32) {
        let Some(count) = count.filter(|count| *count < samples) else { return };
        let part = self.components();
        let mut starts = BTreeSet::new();
        let mut start = 0;
        for aov in &self.aovs.means {
            let next = start + aov.quantity.components();
            if aov.quantity.is_of_the_surface() {
                starts.extend(start..next);
            }
            start = next;
        }
        for (_, source) in &mut self.channels.named {
            if let Source::Mean { index, part: of, .. } = source
                && starts.contains(index)
            {
                *of = Some(part);
            }
        }
        if !starts.is_empty() {
            self.aovs.looked_at = count;
            self.aovs.means.push(Aov { quantity: Quantity::LookedAt, squared: false });
        }
    }

    /// Whether there are channels that only some formats can hold.
    pub(super) fn has_channels(&self) -> bool {
        !self.channels.named.is_empty()
    }

    /// Bytes that a pixel of the film takes for all this.
    pub(super) fn bytes(&self, scene: &Scene) -> u64 {
        if self.aovs.is_empty() { 0 } else { self.aovs.extras(scene).bytes() }
    }

    fn add_named(&mut self, name: AovName, scene: &Scene) {
        let (layer, ends, quantity) = match name {
            AovName::Albedo => ("albedo", ".R .G .B", Quantity::Albedo),
            AovName::Normal => ("N", ".X .Y .Z", Quantity::Normal),
            AovName::ShadingNormal => ("Ns", ".X .Y .Z", Quantity::ShadingNormal),
            AovName::Depth => ("Z", "", Quantity::Depth),
            AovName::Position => ("P", ".X .Y .Z", Quantity::Position),
            AovName::Uv => ("uv", ".U .V", Quantity::Uv),
            AovName::Primitive => return self.add_number("primitive", Number { index: Index::Primitive, first: 1 }),
            AovName::Shape => return self.add_number("shape", Number { index: Index::Shape, first: 1 }),
            AovName::Material => return self.add_number("material", Number { index: Index::Material, first: 1 }),
            AovName::Error => return self.add_error(),
            AovName::Samples => {
                self.aovs.sample_counts = true;
                return self.channels.named.push(("samples".into(), Source::Samples));
            }
        };
        let names: Vec<String> = ends.split(' ').map(|end| format!("{layer}{end}")).collect();
        self.add_mean(&names, Aov { quantity, squared: false }, scene);
    }

    fn add_mean(&mut self, names: &[String], aov: Aov, scene: &Scene) {
        let first = self.components();
        let is_colour = matches!(aov.quantity, Quantity::Albedo | Quantity::DiffuseReflectance | Quantity::Radiance);
        // The unit is a power of two, of which the fraction is ½.
        let exponent = libm::frexp(aov.unit(scene)).1 - 1;
        let source = |index| Source::Mean { index, exponent, is_colour: is_colour && !aov.squared, part: None };
        self.channels.named.extend(names.iter().zip(first..).map(|(name, index)| (name.clone(), source(index))));
        self.aovs.means.push(aov);
    }

    fn add_error(&mut self) {
        let channel = |(channel, end)| (format!("error.{end}"), Source::Error(channel));
        self.channels.named.extend(["R", "G", "B"].into_iter().enumerate().map(channel));
    }

    /// How many means the film is to keep so far.
    fn components(&self) -> usize {
        self.aovs.means.iter().map(|aov| aov.quantity.components()).sum()
    }

    fn add_number(&mut self, name: &str, number: Number) {
        self.channels.named.push((name.into(), Source::Number(self.aovs.numbers.len())));
        self.aovs.numbers.push(number);
    }
}

/// The mean over those samples that are so large a part of all, of which `mean` has the rest as zeros.
fn of_part(mean: f64, part: f64) -> f64 {
    if part == 0.0 { 0.0 } else { mean / part }
}

/// What a file's index counts.
fn index(kind: AovKind) -> Option<Index> {
    match kind {
        AovKind::PrimitiveIndex => Some(Index::Primitive),
        AovKind::ShapeIndex => Some(Index::Shape),
        _ => None,
    }
}

fn quantity(kind: AovKind) -> Quantity {
    match kind {
        AovKind::Albedo => Quantity::DiffuseReflectance,
        AovKind::Depth => Quantity::DepthFromNear,
        AovKind::Position => Quantity::Position,
        AovKind::Uv => Quantity::Uv,
        AovKind::GeometricNormal => Quantity::Normal,
        AovKind::ShadingNormal => Quantity::ShadingNormal,
        AovKind::Radiance => Quantity::Radiance,
        AovKind::Xyz => Quantity::Xyz,
        // Indices are no quantities, and do not come here.
        AovKind::Alpha | AovKind::PrimitiveIndex | AovKind::ShapeIndex => Quantity::Alpha,
    }
}
