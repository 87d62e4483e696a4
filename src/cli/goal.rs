//! When a render ends: what was asked for, whether that can be, and what came of it.

use super::args::{RenderArgs, SamplerName};
use super::{EXIT_FAILED, EXIT_INTERRUPTED};
use crate::error::{Error, Result};
use crate::error_estimate::PictureError;
use crate::render::adaptive::{FEWEST_SAMPLES, Limits};
use crate::render::{Ended, Rendered};
use crate::sampler::MOST_OF_RUN;
use std::fmt::Arguments;
use std::process::ExitCode;

/// An error where arguments contradict each other.
pub(super) fn check(args: &RenderArgs) -> Result<()> {
    let Some(name) = args.goal.names() else { return Ok(()) };
    if args.keep.shard.is_some() {
        return Err(Error::Usage(format!(
            "--shard needs a number of samples that is known before: it cannot go with {name}"
        )));
    }
    if args.goal.is_adaptive() {
        if !matches!(args.sampler, SamplerName::Sobol | SamplerName::Independent) {
            let sampler = args.sampler.text();
            return Err(Error::Usage(format!(
                "--sampler {sampler} is for a number of samples that is known before: with {name} expected sobol or \
                 independent"
            )));
        }
        if let Some(spp) = args.spp.filter(|&spp| spp < FEWEST_SAMPLES) {
            return Err(Error::Usage(format!(
                "--spp {spp}: with {name} expected at least {FEWEST_SAMPLES}, or nothing is known of the error"
            )));
        }
    } else if args.spp.is_none() && !matches!(args.sampler, SamplerName::Sobol | SamplerName::Independent) {
        let sampler = args.sampler.text();
        return Err(Error::Usage(format!(
            "--sampler {sampler} needs --spp beside {name}: a number to be well spread for"
        )));
    }
    Ok(())
}

/// The most samples per pixel, of which the file would take so many.
pub(super) fn samples(args: &RenderArgs, file: u32) -> u32 {
    let is_open = args.goal.time.is_some() || args.goal.target_error.is_some();
    args.spp.unwrap_or(if is_open { MOST_OF_RUN } else { file })
}

/// The limits of a render whose samples go where the error is; `None` where every pixel gets the same number.
pub(super) fn limits(args: &RenderArgs, samples: u32) -> Option<Limits> {
    let goal = &args.goal;
    goal.is_adaptive().then(|| Limits {
        samples: (samples < MOST_OF_RUN).then_some(samples.max(FEWEST_SAMPLES)),
        time: goal.time,
        error: goal.target_error,
        confidence: goal.confidence,
    })
}

/// The target error, for the record of a checkpoint.
pub(super) fn target(args: &RenderArgs) -> Option<String> {
    args.goal.target_error.map(|target| target.to_string())
}

/// What is known of a picture's error, and how certain that is.
pub(super) fn error_of(args: &RenderArgs, rendered: &Rendered) -> Option<(PictureError, f64)> {
    let confidence = args.goal.confidence;
    rendered.estimates.as_ref().map(|estimates| (estimates.whole(confidence), confidence))
}

/// Says what the picture's error is, and what ended the render.
pub(super) fn tell(
    args: &RenderArgs,
    rendered: &Rendered,
    error: Option<(PictureError, f64)>,
    samples_per_pixel: f64,
    say: &dyn Fn(Arguments<'_>),
) {
    let percent = |x: f64| format!("{:.3} %", 100.0 * x);
    let samples = format!("{samples_per_pixel:.1} samples per pixel");
    match error {
        None => say(format_args!("{samples}, too few to estimate the error")),
        Some((error, confidence)) => {
            let [low, high] = [error.interval.low, error.interval.high].map(percent);
            let (error_text, certainty) = (percent(error.error), (confidence * 1e6).round() / 1e4);
            say(format_args!(
                "{samples}; estimated relative error {error_text}, with {certainty} % confidence from {low} to {high}"
            ));
            if error.is_of_black() {
                say(format_args!("warning: no light was found at all, so nothing is known of the error"));
            } else if error.is_heavy_tailed() {
                say(format_args!(
                    "warning: rare bright samples make most of the error (tail index {:.2}, surprise {:.1}): there may be more \
                     where none has been seen yet, so the estimate may be far too small",
                    error.tail, error.surprise
                ));
            }
        }
    }
    let ended = match (rendered.ended, args.goal.names()) {
        (Ended::Error, _) => "the target error is reached",
        (Ended::Time, _) => "the time is up",
        (Ended::Samples, Some(_)) => "all samples are taken",
        _ => return,
    };
    if args.goal.is_adaptive() && !rendered.is_adaptive {
        say(format_args!("every pixel has as many samples: sending them where the error is would not have paid"));
    }
    let short = if is_short(args, rendered) { "; the target error is not reached" } else { "" };
    say(format_args!("{ended}{short}"));
}

/// Whether a target was asked for and not reached.
fn is_short(args: &RenderArgs, rendered: &Rendered) -> bool {
    args.goal.target_error.is_some() && rendered.ended != Ended::Error
}

/// 0; 130 where it was interrupted, 1 where it ended short of its target.
pub(super) fn exit_code(args: &RenderArgs, rendered: &Rendered) -> ExitCode {
    if !rendered.is_complete() {
        return ExitCode::from(EXIT_INTERRUPTED);
    }
    if is_short(args, rendered) { ExitCode::from(EXIT_FAILED) } else { ExitCode::SUCCESS }
}
