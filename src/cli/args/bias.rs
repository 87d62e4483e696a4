//! Arguments that trade truth for less noise: never on by themselves, and written into the files.

use clap::Args;

/// What makes a picture biased.
#[derive(Debug, Args)]
pub(in crate::cli) struct BiasArgs {
    /// Scale every sample whose brightest channel is above this radiance down to it (W/(sr·m²)): no fireflies, but a picture that
    /// is too dark where they were right. The file says so.
    #[arg(long, value_name = "RADIANCE", value_parser = radiance)]
    pub(in crate::cli) clamp: Option<f32>,
}

impl BiasArgs {
    /// What a file says of it.
    pub(in crate::cli) fn text(&self) -> String {
        self.clamp.map_or_else(|| "none".into(), |most| format!("clamp {most}"))
    }
}

fn radiance(text: &str) -> Result<f32, String> {
    let radiance = text.parse().ok().filter(|r: &f32| *r > 0.0 && r.is_finite());
    radiance.ok_or_else(|| "expected a radiance, more than 0".into())
}
