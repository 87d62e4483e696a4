//! Arguments that say when a render ends, and where its samples go.

use clap::Args;
use std::time::Duration;

/// When it ends: at whichever is reached first, of these and `--spp`.
#[derive(Clone, Copy, Debug, Args)]
pub(in crate::cli) struct GoalArgs {
    /// End after this time of rendering, as 30s or 2h: with the picture of as many samples as there was time for. Without --spp,
    /// the file's number of samples counts for nothing.
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub(in crate::cli) time: Option<Duration>,
    /// End when the picture's relative error is below this, as 2% or 0.02: the root of the mean of (m-r)^2/(r^2+0.01L^2) over pixels m
    /// and channels, where r is what is right and L its mean. Samples go where the error is, as with --adaptive.
    #[arg(long, value_name = "ERROR", value_parser = error)]
    pub(in crate::cli) target_error: Option<f64>,
    /// How certain the error's interval is, and that the target is reached.
    #[arg(long, value_name = "P", default_value = "95%", value_parser = confidence)]
    pub(in crate::cli) confidence: f64,
    /// Take samples where the error is, if that promises to pay: --spp is then their mean number.
    #[arg(long)]
    pub(in crate::cli) adaptive: bool,
}

impl GoalArgs {
    /// Whether samples go where the error is.
    pub(in crate::cli) fn is_adaptive(&self) -> bool {
        self.adaptive || self.target_error.is_some()
    }

    /// Which of these options say that there is no fixed number of samples.
    pub(in crate::cli) fn names(&self) -> Option<&'static str> {
        match (self.target_error, self.time, self.adaptive) {
            (Some(_), ..) => Some("--target-error"),
            (None, Some(_), _) => Some("--time"),
            (None, None, true) => Some("--adaptive"),
            _ => None,
        }
    }
}

/// A number, or so many hundredths.
fn part(text: &str) -> Option<f64> {
    match text.trim().strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().ok().map(|p| p / 100.0),
        None => text.trim().parse().ok(),
    }
}

fn error(text: &str) -> Result<f64, String> {
    let error = part(text).filter(|e| *e > 0.0 && e.is_finite());
    error.ok_or_else(|| "expected a relative error, more than 0, for example 2% or 0.02".into())
}

fn confidence(text: &str) -> Result<f64, String> {
    /// Even odds say nothing; and nothing is certain.
    const RANGE: std::ops::RangeInclusive<f64> = 0.5..=0.9999;
    let confidence = part(text).filter(|c| RANGE.contains(c));
    confidence.ok_or_else(|| "expected a probability from 50% to 99.99%".into())
}

fn time(text: &str) -> Result<Duration, String> {
    let seconds = text.trim().parse::<f64>().ok().and_then(|s| Duration::try_from_secs_f64(s).ok());
    let time = seconds.or_else(|| humantime::parse_duration(text).ok());
    time.filter(|t| !t.is_zero()).ok_or_else(|| "expected a time, more than 0, for example 30s, 5min or 2h".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_parsed_strictly() {
        assert_eq!([error("2%"), error("0.02"), error(" 1.5 %")], [Ok(0.02), Ok(0.02), Ok(0.015)]);
        assert!(["", "0", "-1%", "nan", "inf", "%", "two"].iter().all(|t| error(t).is_err()));
        assert_eq!([confidence("95%"), confidence("0.99")], [Ok(0.95), Ok(0.99)]);
        assert!(["1", "100%", "0.3", "0", "nan"].iter().all(|t| confidence(t).is_err()));
        let seconds = Duration::from_secs;
        assert_eq!(
            [time("30s"), time("2min"), time("1.5"), time("1h 1s")].map(Result::unwrap),
            [seconds(30), seconds(120), Duration::from_millis(1500), seconds(3601)]
        );
        assert!(["", "0", "0s", "-1s", "nan", "30 parsecs"].iter().all(|t| time(t).is_err()));
    }
}
