//! `--checkpoint` and `--resume`: keeps how far a render is, again and again, and goes on from there.

use super::args::KeepArgs;
use super::finish::Outcome;
use super::record::{self, Kept, Record};
use crate::error::{Error, Result};
use crate::image::sums_file::Sums;
use crate::image::{OutputFile, Reserved};
use crate::render::adaptive::{AdaptiveSession, Keeping};
use crate::render::{Session, State};
use std::fmt::Arguments;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// After a checkpoint the render goes on alone for so many times as long as that took: it costs less than a hundredth.
const LEISURE: u32 = 100;

/// What is kept, for messages.
const WHAT: &str = "the checkpoint";

/// Keeps a render in a file.
pub(super) struct Keeper<'a> {
    path: &'a Path,
    interval: Duration,
    resume: bool,
    kept: &'a Kept,
}

impl<'a> Keeper<'a> {
    /// Makes sure, before anything is rendered, that a checkpoint can be written, and that none is lost.
    pub(super) fn check(args: &KeepArgs, others: &[&Path]) -> Result<()> {
        let Some(path) = &args.checkpoint else { return Ok(()) };
        if path.exists() && !args.resume {
            let message = "there is a checkpoint already: add --resume to go on from it, or delete it to begin afresh";
            return Err(Error::file(path, message));
        }
        let same = |other: &&Path| match (other.canonicalize(), path.canonicalize()) {
            (Ok(a), Ok(b)) => a == b,
            _ => *other == path,
        };
        if others.iter().any(same) {
            return Err(Error::file(path, "the checkpoint needs a file of its own"));
        }
        Reserved::new(path, WHAT).map(drop)
    }

    /// Keeps what `kept` says where the arguments ask for it.
    pub(super) fn new(args: &'a KeepArgs, kept: &'a Kept) -> Option<Self> {
        let path = args.checkpoint.as_deref()?;
        Some(Self { path, interval: args.checkpoint_interval, resume: args.resume, kept })
    }

    /// The render, where the checkpoint left it if that is asked for and there is one.
    ///
    /// Fails where the checkpoint cannot be read or is of another render.
    pub(super) fn resume<'s>(&self, session: Session<'s>, say: &dyn Fn(Arguments<'_>)) -> Result<Session<'s>> {
        let Some((record, sums)) = self.open(false, say)? else { return Ok(session) };
        let resumed = session.resume(record.state(self.path, &sums)?);
        let session = resumed.ok_or_else(|| Error::file(self.path, "the checkpoint contradicts itself"))?;
        self.tell(&record, say);
        Ok(session)
    }

    /// The same for a render whose samples go where the error is.
    pub(super) fn resume_adaptive<'s>(
        &self,
        session: AdaptiveSession<'s>,
        say: &dyn Fn(Arguments<'_>),
    ) -> Result<AdaptiveSession<'s>> {
        let Some((record, sums)) = self.open(true, say)? else { return Ok(session) };
        let earlier = record.earlier(self.path, &sums, self.kept.target.as_ref())?;
        let resumed = session.resume(&earlier, |name| sums.plane(name));
        let session = resumed.map_err(|why| record::unfit(self.path, &why))?;
        self.tell(&record, say);
        Ok(session)
    }

    /// The checkpoint to go on from, if that is asked for and there is one.
    ///
    /// Fails where it cannot be read or is of another render.
    fn open(&self, adaptive: bool, say: &dyn Fn(Arguments<'_>)) -> Result<Option<(Record, Sums)>> {
        if !self.resume {
            return Ok(None);
        }
        if !self.path.exists() {
            say(format_args!("there is no {} yet: beginning afresh", self.path.display()));
            return Ok(None);
        }
        let (record, sums) = Record::open(self.path)?;
        let other = "this checkpoint is of another render";
        if record.is_adaptive() != adaptive {
            let kind = if adaptive {
                "it has as many samples in every pixel: it cannot go on with --adaptive or --target-error"
            } else {
                "it is of --adaptive or --target-error, and goes on with these only"
            };
            return Err(Error::file(self.path, format!("{other}: {kind}")));
        }
        record.part_identity().expect(&self.kept.part_identity(), self.path, other)?;
        Ok(Some((record, sums)))
    }

    fn tell(&self, record: &Record, say: &dyn Fn(Arguments<'_>)) {
        let (taken, seconds) = (record.taken, record.outcome().seconds);
        say(format_args!("resuming {} after {taken} samples, {seconds:.2} s", self.path.display()));
    }

    /// Keeps the state; what was kept before stays until all of it is on disk.
    pub(super) fn save(&self, state: &State, complete: bool) -> Result<()> {
        let file = OutputFile::exr(self.path, WHAT)?;
        let outcome = Outcome::new(state, complete, self.kept.sampled_pixels);
        let sealed = Some(self.kept.sealed(state, complete));
        let finish = self.kept.finish.picture_only();
        finish
            .develop((&state.film, None), &outcome, 0.0, sealed, |layers, options| file.write(layers, options))
            .map(drop)
    }

    /// Keeps the session again and again until `stopped`; where that fails, what was kept before stays, and it is tried again.
    pub(super) fn keep_saving(&self, session: &Session<'_>, stopped: &Receiver<()>, say: &dyn Fn(Arguments<'_>)) {
        let mut wait = self.interval;
        while stopped.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
            wait = self.save_and_rest(&|| session.state(), say);
        }
    }

    /// Keeps a state that is not the last; returns how long to go on alone then.
    fn save_and_rest(&self, state: &dyn Fn() -> State, say: &dyn Fn(Arguments<'_>)) -> Duration {
        let start = Instant::now();
        if let Err(error) = self.save(&state(), false) {
            say(format_args!("warning: {error}; it will be tried again"));
        }
        self.interval.max(start.elapsed().saturating_mul(LEISURE))
    }

    /// Whoever keeps a render in passes, from now on.
    pub(super) fn pace(&self, say: &'a (dyn Fn(Arguments<'_>) + Sync)) -> Pace<'_> {
        Pace { keeper: self, say, last: Instant::now(), wait: self.interval }
    }
}

/// Keeps a render whose threads rest meanwhile.
pub(super) struct Pace<'a> {
    keeper: &'a Keeper<'a>,
    say: &'a (dyn Fn(Arguments<'_>) + Sync),
    /// When it was kept last.
    last: Instant,
    /// How long to wait from then on.
    wait: Duration,
}

impl Keeping for Pace<'_> {
    fn is_due(&self) -> bool {
        self.last.elapsed() >= self.wait
    }

    fn keep(&mut self, state: &dyn Fn() -> State) {
        self.wait = self.keeper.save_and_rest(state, self.say);
        self.last = Instant::now();
    }
}
