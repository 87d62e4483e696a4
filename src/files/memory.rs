//! How much memory a scene may take, and what was asked of it so far.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A limit that is shared by all clones; none by default.
#[derive(Clone, Debug, Default)]
pub struct Memory(Option<Arc<Limited>>);

#[derive(Debug)]
struct Limited {
    bytes: u64,
    kept: AtomicU64,
}

impl Memory {
    /// At most so many bytes.
    pub fn limited(bytes: u64) -> Self {
        Self(Some(Arc::new(Limited { bytes, kept: AtomicU64::new(0) })))
    }

    /// The limit that a text says: a number of bytes, with K, M, G or T for powers of 1024.
    pub fn parse(text: &str) -> Result<Self, String> {
        let digits = text.trim_end_matches(|c: char| !c.is_ascii_digit());
        let power = match &text[digits.len()..] {
            "" => Some(0),
            "K" | "k" => Some(1),
            "M" | "m" => Some(2),
            "G" | "g" => Some(3),
            "T" | "t" => Some(4),
            _ => None,
        };
        let number = digits.parse::<u64>().ok().filter(|n| *n > 0);
        number
            .zip(power)
            .and_then(|(number, power)| number.checked_mul(1 << (10 * power)))
            .map(Self::limited)
            .ok_or_else(|| "expected a number of bytes, such as 500M or 2G".into())
    }

    /// The limit in bytes, if there is one.
    pub fn limit(&self) -> Option<u64> {
        self.0.as_ref().map(|limited| limited.bytes)
    }

    /// An error, with the figures, where so many bytes are too many beside what is kept.
    pub fn check(&self, bytes: u64) -> Result<(), String> {
        self.ask(bytes, self.kept())
    }

    /// The same, and they are kept from now on.
    pub fn keep(&self, bytes: u64) -> Result<(), String> {
        let Some(limited) = &self.0 else { return Ok(()) };
        // Added first, so that of two at once none can think that the room is its own.
        let before = limited.kept.fetch_add(bytes, Ordering::Relaxed);
        self.ask(bytes, before)
    }

    /// Bytes kept.
    pub fn kept(&self) -> u64 {
        self.0.as_ref().map_or(0, |limited| limited.kept.load(Ordering::Relaxed))
    }

    fn ask(&self, bytes: u64, kept: u64) -> Result<(), String> {
        match &self.0 {
            Some(limited) if bytes.saturating_add(kept) > limited.bytes => Err(format!(
                "takes {}, which beside {} in use is more than the {} of --memory-limit",
                text(bytes),
                text(kept),
                text(limited.bytes)
            )),
            _ => Ok(()),
        }
    }
}

/// So many bytes for people.
pub(super) fn text(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_numbers_with_powers_of_1024() {
        let limit = |text: &str| Memory::parse(text).ok().and_then(|memory| memory.limit());
        assert_eq!(["7", "500M", "2G", "3k"].map(limit), [Some(7), Some(500 << 20), Some(2 << 30), Some(3 << 10)]);
        for bad in ["", "0", "M", "1.5G", "-1", "2GB", "2 G", "99999999999999999999", "99999999999T", "1é"] {
            assert_eq!(limit(bad), None, "{bad}");
        }
        assert_eq!(Memory::default().limit(), None);
    }

    #[test]
    fn what_is_kept_counts() {
        let memory = Memory::limited(3 << 20);
        assert!(memory.check(3 << 20).is_ok() && memory.keep(2 << 20).is_ok());
        assert_eq!(
            memory.clone().check(2 << 20).unwrap_err(),
            "takes 2.0 MiB, which beside 2.0 MiB in use is more than the 3.0 MiB of --memory-limit"
        );
        assert!(memory.keep(u64::MAX >> 1).is_err() && memory.check(u64::MAX).is_err());
        assert!(Memory::default().keep(u64::MAX).is_ok());
    }
}
