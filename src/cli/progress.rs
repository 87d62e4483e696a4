//! Shows how far a render is: a bar on a terminal, a few plain lines elsewhere, nothing if asked to be quiet.

use crate::render::Progress;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often the figures are brought up to date.
const INTERVAL: Duration = Duration::from_millis(100);
/// Plain lines come at every such part of the work.
const PLAIN_STEPS: u32 = 10;
/// Steps of the bar.
const BAR_STEPS: u64 = 10_000;

/// What a render is to reach, as far as it is known: it ends at whichever is first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    /// Over all pixels.
    pub(super) samples: Option<u64>,
    pub(super) time: Option<Duration>,
    pub(super) error: Option<f64>,
}

impl Aim {
    /// What part of the work is done, from 0 to 1.
    fn part(&self, progress: &Progress, start: Instant) -> f64 {
        let of_samples = self.samples.map(|total| progress.samples() as f64 / total.max(1) as f64);
        let of_time = self.time.map(|time| start.elapsed().as_secs_f64() / time.as_secs_f64());
        // The error's square falls as one over the number of samples.
        let of_error = self.error.and_then(|target| progress.error().map(|error| (target / error).powi(2)));
        [of_samples, of_time, of_error].into_iter().flatten().fold(0.0, f64::max).min(1.0)
    }
}

/// A display that runs until it is dropped.
pub(super) struct Display {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Display {
    /// Shows how far `progress` is.
    pub(super) fn start(progress: &Arc<Progress>, aim: Aim, quiet: bool) -> Self {
        if quiet {
            return Self { stop: None, thread: None };
        }
        let (stop, stopped) = channel();
        let progress = Arc::clone(progress);
        let show = if std::io::stderr().is_terminal() { show_bar } else { show_lines };
        let thread = std::thread::spawn(move || show(&progress, &aim, &stopped));
        Self { stop: Some(stop), thread: Some(thread) }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // A display that failed is no reason to lose the picture.
            let _ = thread.join();
        }
    }
}

/// Waits for the next look; false once the render is over.
fn tick(stopped: &Receiver<()>) -> bool {
    stopped.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout)
}

fn rates(progress: &Progress, start: Instant) -> String {
    let seconds = start.elapsed().as_secs_f64().max(f64::MIN_POSITIVE);
    let [samples, rays] = progress.of_this_run().map(|n| n as f64 / seconds);
    let error = progress.error().map_or_else(String::new, |error| format!(", error {:.2} %", 100.0 * error));
    format!("{} samples/s, {} rays/s{error}", quantity(samples), quantity(rays))
}

fn show_bar(progress: &Progress, aim: &Aim, stopped: &Receiver<()>) {
    let start = Instant::now();
    let bar = ProgressBar::new(BAR_STEPS);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}  {elapsed} gone, {eta} left") {
        bar.set_style(style);
    }
    while tick(stopped) {
        bar.set_position((aim.part(progress, start) * BAR_STEPS as f64) as u64);
        bar.set_message(rates(progress, start));
    }
    bar.finish_and_clear();
}

fn show_lines(progress: &Progress, aim: &Aim, stopped: &Receiver<()>) {
    let start = Instant::now();
    let (mut shown, begun) = (0, aim.part(progress, start));
    while tick(stopped) {
        let part = aim.part(progress, start);
        let step = (part * f64::from(PLAIN_STEPS)) as u32;
        if step > shown && step < PLAIN_STEPS {
            shown = step;
            let left = start.elapsed().as_secs_f64() * (1.0 - part) / (part - begun).max(f64::MIN_POSITIVE);
            let _ = writeln!(std::io::stderr(), "{:.0} %, {}, {left:.0} s left", 100.0 * part, rates(progress, start));
        }
    }
}

/// A number with a prefix: `1.23 M`.
pub(super) fn quantity(x: f64) -> String {
    match x {
        x if x >= 1e9 => format!("{:.2} G", x / 1e9),
        x if x >= 1e6 => format!("{:.2} M", x / 1e6),
        x if x >= 1e3 => format!("{:.2} k", x / 1e3),
        x => format!("{x:.0} "),
    }
}
