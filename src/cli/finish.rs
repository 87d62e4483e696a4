//! From a film to files: the pictures that `render` and `merge` write, and what they say of themselves.

use super::aov::Channels;
use crate::error::Error;
use crate::error_estimate::{Estimates, PictureError};
use crate::film::Film;
use crate::image::{
    ComponentFormat, Crop, Layers, Metadata, OutputFile, Picture, PixelFormat, Plane, WriteOptions, sums_file,
};
use crate::render::{Ended, Rendered, State};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What is made of a film, whoever filled it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Finish {
    /// Size of the whole picture.
    pub(super) full_size: (u32, u32),
    /// The part of it that the film has.
    pub(super) crop: Crop,
    /// How colours are stored.
    pub(super) pixel_format: PixelFormat,
    /// In which type.
    pub(super) component_format: ComponentFormat,
    /// What goes beside the picture.
    pub(super) channels: Channels,
    /// What a file says of the render, by the names of its attributes: whatever is known before the render.
    pub(super) about: BTreeMap<String, String>,
}

/// What a render came to, for the files' metadata.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    /// Samples per pixel.
    pub(super) samples: f64,
    /// Wall time.
    pub(super) seconds: f64,
    /// Samples left out.
    pub(super) non_finite: u64,
    pub(super) oversized: u64,
    /// Whether it ended by itself.
    pub(super) complete: bool,
    /// Why it ended, if that is known.
    pub(super) ended: Option<Ended>,
    /// What is known of its error, and with which confidence.
    pub(super) error: Option<(PictureError, f64)>,
}

/// Why a render ended, in a word.
pub(super) fn ended_text(ended: Ended) -> &'static str {
    match ended {
        Ended::Samples => "samples",
        Ended::Time => "time",
        Ended::Error => "error",
        Ended::Stopped => "interrupted",
    }
}

impl Outcome {
    /// That of a render so far, which takes samples in so many pixels.
    pub(super) fn new(state: &State, complete: bool, pixels: u64) -> Self {
        let dropped = state.film.dropped();
        Self {
            samples: state.done.samples as f64 / pixels as f64,
            seconds: state.time.as_secs_f64(),
            non_finite: dropped.non_finite(),
            oversized: dropped.oversized,
            complete,
            ended: None,
            error: None,
        }
    }

    /// That of a render that has ended, with what is known of its error and how certain that is.
    pub(super) fn of(rendered: &Rendered, pixels: u64, error: Option<(PictureError, f64)>) -> Self {
        Self {
            samples: rendered.samples as f64 / pixels as f64,
            seconds: rendered.time.as_secs_f64(),
            non_finite: rendered.dropped.non_finite(),
            oversized: rendered.dropped.oversized,
            complete: rendered.is_complete(),
            ended: Some(rendered.ended),
            error,
        }
    }

    /// That of two parts together.
    pub(super) fn and(self, o: &Self) -> Self {
        Self {
            samples: self.samples + o.samples,
            seconds: self.seconds + o.seconds,
            non_finite: self.non_finite.saturating_add(o.non_finite),
            oversized: self.oversized.saturating_add(o.oversized),
            complete: self.complete && o.complete,
            ended: None,
            error: None,
        }
    }
}

impl Finish {
    /// The same for a file that is not looked at: without what goes beside the picture.
    pub(super) fn picture_only(&self) -> Self {
        let pixel_format = self.pixel_format.without_alpha();
        Self { channels: Channels::default(), pixel_format, ..self.clone() }
    }

    /// What the files say of themselves.
    fn metadata(&self, outcome: &Outcome) -> Metadata {
        let mut numbers = vec![
            ("snell.samples", outcome.samples),
            ("snell.seconds", outcome.seconds),
            ("snell.nonFiniteSamples", outcome.non_finite as f64),
            ("snell.oversizedSamples", outcome.oversized as f64),
        ];
        if let Some((PictureError { error, interval, tail, .. }, confidence)) = outcome.error {
            numbers.extend([
                ("snell.estimatedError", error),
                ("snell.estimatedErrorLow", interval.low),
                ("snell.estimatedErrorHigh", interval.high),
                ("snell.confidence", confidence),
                ("snell.tailIndex", tail),
            ]);
        }
        let complete = ("snell.complete".to_owned(), if outcome.complete { "yes" } else { "no" }.to_owned());
        let ended = outcome.ended.map(|ended| ("snell.endedBy".to_owned(), ended_text(ended).to_owned()));
        let texts = self.about.iter().map(|(name, text)| (name.clone(), text.clone())).chain([complete]).chain(ended);
        Metadata { numbers, texts: texts.collect() }
    }

    /// Develops the film, of whose error so much is known, and hands everything to `write`: for a picture, or with the sums and the record of a render that are
    /// to be put together with others.
    pub(super) fn develop<T>(
        &self,
        (film, estimates): (&Film, Option<&Estimates>),
        outcome: &Outcome,
        exposure: f32,
        sealed: Option<(String, Vec<Plane>)>,
        write: impl FnOnce(Layers<'_>, &WriteOptions) -> T,
    ) -> T {
        let (picture, alpha): (Picture, _) = (film.develop(), self.channels.alpha(film));
        let mut planes = self.channels.planes(film, &picture, estimates);
        let mut metadata = self.metadata(outcome);
        if let Some((record, sums)) = sealed {
            planes.extend(sums);
            sums_file::seal(&mut metadata, &record, &planes);
        }
        let options = WriteOptions {
            full_size: self.full_size,
            crop: self.crop,
            component_format: self.component_format,
            exposure,
            metadata,
        };
        let layers = Layers { picture: &picture, format: self.pixel_format, alpha: alpha.as_deref(), planes: &planes };
        write(layers, &options)
    }
}

/// Writes every picture that can be written, and adds to `failures` what is wrong with the others. Returns how many values
/// did not fit their files' type and were clamped.
pub(super) fn write(
    layers: Layers<'_>,
    options: &WriteOptions,
    outputs: Vec<OutputFile>,
    say: &dyn Fn(std::fmt::Arguments<'_>),
    failures: &mut Vec<Error>,
) -> u64 {
    let mut all_clamped = 0;
    for output in outputs {
        let path = output.path().to_owned();
        match output.write(layers, options) {
            Ok(clamped) => {
                if clamped > 0 {
                    let largest = ComponentFormat::MAX_HALF;
                    let name = path.display();
                    say(format_args!(
                        "warning: {name}: {clamped} values were too large for half floats, and are {largest} now"
                    ));
                }
                all_clamped += clamped;
                say(format_args!("wrote {}", path.display()));
            }
            Err(error) => failures.push(error),
        }
    }
    all_clamped
}

/// The last of the failures, when the others are printed.
pub(super) fn last_of(mut failures: Vec<Error>) -> Result<(), Error> {
    let Some(last) = failures.pop() else { return Ok(()) };
    for error in failures {
        super::print_error(&error);
    }
    Err(last)
}
