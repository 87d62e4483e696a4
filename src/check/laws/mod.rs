//! The laws that every bsdf obeys, for a table of configurations and at the ends of their parameters; see `docs/laws.md`.

pub(crate) mod gltf;
pub(crate) mod law;
pub(crate) mod table;

use crate::bsdf::{Bsdf, BsdfSample};
use crate::sampler::{BsdfUniforms, Sampler, SamplerKind};
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;
use rayon::prelude::*;
use table::{Energy, Row, directions, edge_directions, table};

/// What the laws ask: of a bsdf, or of a falsified one.
pub(crate) trait Subject {
    /// Its value and density.
    fn value_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf);
    /// A sample.
    fn draw(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample>;
}

impl Subject for Bsdf {
    fn value_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        self.eval_pdf(wo, wi)
    }

    fn draw(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        self.sample(wo, u)
    }
}

/// The numbers of a sample.
pub(crate) fn uniform(seed: u64, i: u32) -> BsdfUniforms {
    Sampler { kind: SamplerKind::Independent, seed }.stream(0, 0, i).bsdf(0)
}

/// What is asked of bsdfs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// At the ends of parameters, seen from directions down to the horizon, everything is finite and nothing negative.
    Finite,
    /// Samples follow their density (χ²).
    Density,
    /// A sample's weight is value over density.
    Weight,
    /// No more comes back than came.
    Energy,
    /// The same comes back the other way round.
    Reciprocity,
}

/// A family of χ² tests has this false-alarm rate together.
pub const FALSE_ALARMS: f64 = law::FALSE_ALARMS;

impl Law {
    /// All there are.
    pub const ALL: [Self; 5] = [Self::Finite, Self::Density, Self::Weight, Self::Energy, Self::Reciprocity];

    /// One word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Finite => "finite",
            Self::Density => "density",
            Self::Weight => "weight",
            Self::Energy => "energy",
            Self::Reciprocity => "reciprocity",
        }
    }
}

/// What came of a law.
#[derive(Clone, Debug, Default)]
pub struct Verdicts {
    /// Bsdfs times directions that it was asked of.
    pub tests: usize,
    /// Each one that broke it: its number among all, its name, and how.
    pub broken: Vec<(usize, String)>,
}

/// Only every so manieth pair of a bsdf and a direction is tested, unless all are asked for: of densities, which take minutes,
/// of what is at the ends of parameters, and of others.
const FEW_DENSITIES: usize = 43;
const FEW_EXTREMES: usize = 5;
const FEW: usize = 3;

/// Every bsdf of the tables, with a direction of view.
fn pairs() -> Vec<(&'static Row, Vec3)> {
    let all = table().iter().chain(table::edges());
    all.flat_map(|row| directions(row.bsdf.lobes().transmits).map(move |wo| (row, wo))).collect()
}

/// Asks a law of all that it is for, or of the one with this number, by samples of this seed. `thorough`: of really all.
pub fn run(law: Law, thorough: bool, only: Option<usize>, seed: u64) -> Verdicts {
    let wanted = |number: usize| only.is_none_or(|only| only == number);
    if law == Law::Finite {
        let few = |number: usize| thorough || only.is_some() || number.is_multiple_of(FEW_EXTREMES);
        let all = table::extremes().into_iter().enumerate();
        let all: Vec<_> = all.filter(|(number, _)| wanted(*number) && few(*number)).collect();
        let broken = all.par_iter().filter_map(|(number, (name, bsdf))| {
            let failure = edge_directions().find_map(|wo| law::edges(bsdf, wo, seed).err().map(|e| (wo, e)));
            failure.map(|(wo, failure)| (*number, format!("{name}, wo {wo}: {failure}")))
        });
        return Verdicts { broken: broken.collect(), tests: all.len() * edge_directions().count() };
    }
    let all: Vec<_> = pairs().into_iter().enumerate().filter(|(number, _)| wanted(*number)).collect();
    let smooth = |(_, (row, wo)): &&(usize, (&Row, Vec3))| {
        law != Law::Density || (row.bsdf.lobes().smooth && (row.resolved)(*wo))
    };
    let step = if law == Law::Density { FEW_DENSITIES } else { FEW };
    let few = |(number, _): &&(usize, (&Row, Vec3))| thorough || only.is_some() || number.is_multiple_of(step);
    let asked: Vec<_> = all.iter().filter(smooth).filter(few).collect();
    let family = if only.is_some() { pairs().len() } else { asked.len() };
    let broken = asked.par_iter().filter_map(|(number, (row, wo))| {
        let verdict = match law {
            Law::Finite | Law::Density => law::density(&row.bsdf, *wo, (family, seed)),
            Law::Weight => law::weight(&row.bsdf, *wo, seed),
            Law::Energy => match row.energy {
                Energy::Sample(gain) => law::energy(&row.bsdf, *wo, gain, seed),
                Energy::Mean(most) => law::albedo(&row.bsdf, *wo, most, seed),
            },
            Law::Reciprocity => law::reciprocity(&row.bsdf, *wo, row.eta, row.exempt, seed),
        };
        verdict.err().map(|failure| (*number, format!("{}, wo {wo}: {failure}", row.name)))
    });
    Verdicts { broken: broken.collect(), tests: asked.len() }
}
