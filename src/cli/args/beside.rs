//! Arguments about what goes beside the picture.

use clap::Args;

/// How much of it.
#[derive(Debug, Args)]
pub(in crate::cli) struct BesideArgs {
    /// Of how many samples of each pixel the surface is looked at for --aov, from the first on; of all unless given. The error
    /// and the count of samples are those of all samples whatever this says.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(in crate::cli) aov_spp: Option<u32>,
}
