//! Time that was worked, and what time it is.

use cpu_time::ProcessTime;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// What something took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Took {
    /// Processor time in seconds, of all threads of the process, the system's work for it included.
    pub cpu: f64,
    /// Seconds that passed.
    pub wall: f64,
}

/// Runs `f` and says what it took.
pub fn timed<T>(f: impl FnOnce() -> T) -> (T, Took) {
    let (worked, now) = (ProcessTime::try_now(), Instant::now());
    let result = f();
    let wall = now.elapsed();
    // Where the system does not tell what was worked, the best guess is what passed.
    let cpu = worked.and_then(|w| w.try_elapsed()).unwrap_or(wall);
    // Nothing takes no time at all: a rate must be finite.
    let seconds = |d: Duration| d.max(Duration::from_nanos(1)).as_secs_f64();
    (result, Took { cpu: seconds(cpu), wall: seconds(wall) })
}

/// Date and time in the form of ISO 8601, in universal time.
pub fn utc_now() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    utc(seconds)
}

/// Date and time, `seconds` after the beginning of 1970.
fn utc(seconds: u64) -> String {
    const DAY: u64 = 86_400;
    let (mut days, rest) = (seconds / DAY, seconds % DAY);
    let mut year = 1970;
    let leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    while days >= 365 + u64::from(leap(year)) {
        days -= 365 + u64::from(leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while days >= lengths[month] {
        days -= lengths[month];
        month += 1;
    }
    let (month, day) = (month + 1, days + 1);
    format!("{year}-{month:02}-{day:02} {:02}:{:02} UTC", rest / 3600, rest / 60 % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_at_their_landmarks() {
        let known = [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (4_107_542_399, "2100-02-28 23:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
            (1_798_761_599, "2026-12-31 23:59 UTC"),
        ];
        for (seconds, text) in known {
            assert_eq!(utc(seconds), text);
        }
    }

    #[test]
    fn work_of_all_threads_counts() {
        // By the clocks of two threads, which stand still while a busy machine does other things, as the process's does.
        let busy = || {
            let start = cpu_time::ThreadTime::now();
            (0..60_000_000_u64).fold(0, |a, b| std::hint::black_box(a ^ b));
            start.elapsed().as_secs_f64()
        };
        let (each, whole) = timed(|| {
            std::thread::scope(|s| [s.spawn(busy), s.spawn(busy)].map(|t| t.join().expect("no thread panics")))
        });
        assert!(each[0] > 0.0 && each[1] > 0.0 && whole.cpu >= 0.99 * (each[0] + each[1]), "{whole:?} {each:?}");
    }
}
