//! Arguments for renders that survive their process, and for those that several processes share.

use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// Checkpoints and shards.
#[derive(Debug, Args)]
pub(in crate::cli) struct KeepArgs {
    /// Keep all that is done in this file, so that the render can go on from there after whatever stopped it. It stays when the
    /// render is done.
    #[arg(long, value_name = "FILE")]
    pub(in crate::cli) checkpoint: Option<PathBuf>,
    /// How often; less often where it would take more than a hundredth of the time.
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = humantime::parse_duration, requires = "checkpoint")]
    pub(in crate::cli) checkpoint_interval: Duration,
    /// Go on from the checkpoint, to the same bits as without a stop; from the beginning where there is none yet. A target error, its
    /// confidence and, with --adaptive or --target-error, the time may be others than before: to a lower target it goes on from there, but
    /// to none from --adaptive where that took as many samples everywhere.
    #[arg(long, requires = "checkpoint")]
    pub(in crate::cli) resume: bool,
    /// Take the I-th of N equal parts of each pixel's samples, and write sums that `merge` puts together.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub(in crate::cli) shard: Option<Shard>,
}

impl KeepArgs {
    /// Whether sums are to be written.
    pub(in crate::cli) fn keeps_sums(&self) -> bool {
        self.checkpoint.is_some() || self.shard.is_some()
    }
}

/// Which part of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli) struct Shard {
    /// Counted from 1.
    pub(in crate::cli) number: u32,
    /// Of how many.
    pub(in crate::cli) count: u32,
}

/// What to put together.
#[derive(Debug, Args)]
pub(in crate::cli) struct MergeArgs {
    /// Files written by `render --shard`, or its checkpoints, in any order: all the parts of one picture.
    #[arg(required = true, value_name = "SHARD")]
    pub(in crate::cli) shards: Vec<PathBuf>,
    /// Where to write the picture (.exr or .png; may be repeated).
    #[arg(short, long, required = true, value_name = "FILE")]
    pub(in crate::cli) output: Vec<PathBuf>,
    /// Stops of exposure for PNG: 1 is twice as bright.
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = super::finite)]
    pub(in crate::cli) exposure: f32,
    /// Print errors only.
    #[arg(short, long)]
    pub(in crate::cli) quiet: bool,
}

fn shard(text: &str) -> Result<Shard, String> {
    match super::numbers(text, '/') {
        Some([number, count]) if 1 <= number && number <= count => Ok(Shard { number, count }),
        _ => Err("expected I/N with I from 1 to N, for example 1/4".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_counted_from_one() {
        assert_eq!(shard("1/4"), Ok(Shard { number: 1, count: 4 }));
        assert_eq!(shard("4/4"), Ok(Shard { number: 4, count: 4 }));
        for bad in ["0/4", "5/4", "1", "1/4/4", "-1/4", "a/b", "", "1/0"] {
            assert!(shard(bad).is_err(), "{bad}");
        }
    }
}
