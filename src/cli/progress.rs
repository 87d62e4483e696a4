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
const PLAIN_STEPS: u64 = 10;

/// A display that runs until it is dropped.
pub(super) struct Display {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Display {
    /// Shows `progress` towards `total` samples.
    pub(super) fn start(progress: &Arc<Progress>, total: u64, quiet: bool) -> Self {
        if quiet {
            return Self { stop: None, thread: None };
        }
        let (stop, stopped) = channel();
        let progress = Arc::clone(progress);
        let show = if std::io::stderr().is_terminal() { show_bar } else { show_lines };
        let thread = std::thread::spawn(move || show(&progress, total, &stopped));
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
    format!("{} samples/s, {} rays/s", quantity(samples), quantity(rays))
}

fn show_bar(progress: &Progress, total: u64, stopped: &Receiver<()>) {
    let start = Instant::now();
    let bar = ProgressBar::new(total);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}  {elapsed} gone, {eta} left") {
        bar.set_style(style);
    }
    while tick(stopped) {
        bar.set_position(progress.samples());
        bar.set_message(rates(progress, start));
    }
    bar.finish_and_clear();
}

fn show_lines(progress: &Progress, total: u64, stopped: &Receiver<()>) {
    let start = Instant::now();
    let mut shown = 0;
    while tick(stopped) {
        let done = progress.samples();
        let step = done.saturating_mul(PLAIN_STEPS) / total.max(1);
        if step > shown && step < PLAIN_STEPS {
            shown = step;
            let [samples, _] = progress.of_this_run();
            let left = start.elapsed().as_secs_f64() * (total - done) as f64 / samples as f64;
            let percent = 100 * done / total.max(1);
            let _ = writeln!(std::io::stderr(), "{percent} %, {}, {left:.0} s left", rates(progress, start));
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
