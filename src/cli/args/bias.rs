//! Arguments that trade truth for less noise: never on by themselves, and written into the files.

use clap::Args;

/// What makes a picture biased.
#[derive(Debug, Args)]
pub(in crate::cli) struct BiasArgs {
    /// Scale every sample whose brightest channel is above this radiance down to it (W/(sr·m²)): no fireflies, but a picture that
    /// is too dark where they were right. The file says so.
    #[arg(long, value_name = "RADIANCE", value_parser = radiance)]
    pub(in crate::cli) clamp: Option<f32>,
    /// Once a path has been scattered by something that is no mirror, it meets rougher surfaces: much less noise where light comes
    /// through glass or off mirrors, but blurred there. The file says so.
    #[arg(long)]
    pub(in crate::cli) regularize: bool,
}

impl BiasArgs {
    /// What a file says of it.
    pub(in crate::cli) fn text(&self) -> String {
        let clamp = self.clamp.map(|most| format!("clamp {most}"));
        let all: Vec<String> = clamp.into_iter().chain(self.regularize.then(|| "regularize".into())).collect();
        if all.is_empty() { "none".into() } else { all.join(", ") }
    }
}

fn radiance(text: &str) -> Result<f32, String> {
    let radiance = text.parse().ok().filter(|r: &f32| *r > 0.0 && r.is_finite());
    radiance.ok_or_else(|| "expected a radiance, more than 0".into())
}
