//! What a checkpoint or a shard says of itself: of which render it is, how far that is, and what is to be made of it.

use super::finish::{Finish, Outcome};
use crate::error::{Error, Result};
use crate::error_estimate::Parts;
use crate::film::exact::Scale;
use crate::film::{Dropped, Extras, Film};
use crate::image::sums_file::{self, Sums};
use crate::image::{Filter, Plane};
use crate::integrator::RayCounts;
use crate::render::adaptive::{self, Earlier, Unfit};
use crate::render::{Done, Reached, Standing, State};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::time::Duration;

/// Changes whenever a file means something else than before.
const FORMAT: u32 = 2;

/// Largest magnitude of a film's exponents: those of f32, squared, and some bits.
const MAX_EXPONENT: i32 = 600;

/// More samples or rays than anyone takes, of which some can be added up.
const MOST_COUNTED: u64 = 1 << 60;

/// Most differences that a message names.
const SHOWN: usize = 5;

/// All that decides a render's bits.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Identity {
    /// Everything that can be set, by name.
    pub(super) settings: BTreeMap<String, String>,
    /// A hash of each file that was read, by its path, relative to the scene where it lies beside it or below.
    pub(super) files: BTreeMap<String, String>,
}

impl Identity {
    /// What is different in another.
    fn differences(&self, other: &Self) -> Vec<String> {
        let none = &"none".to_owned();
        let settings = self.settings.keys().chain(other.settings.keys().filter(|k| !self.settings.contains_key(*k)));
        let settings = settings.filter_map(|key| {
            let [a, b] = [self, other].map(|i| i.settings.get(key).unwrap_or(none));
            (a != b).then(|| format!("{key}: {a}, not {b}"))
        });
        let files = self.files.iter().filter_map(|(name, hash)| match other.files.get(name) {
            None => Some(format!("{name} is not read")),
            Some(its) if its != hash => Some(format!("{name} has changed")),
            Some(_) => None,
        });
        let new = other.files.keys().filter(|name| !self.files.contains_key(*name));
        settings.chain(files).chain(new.map(|name| format!("{name} is read, too"))).collect()
    }

    /// An error that names what is different in `other`, if anything is.
    pub(super) fn expect(&self, other: &Self, path: &Path, what: &str) -> Result<()> {
        let differences = self.differences(other);
        if differences.is_empty() {
            return Ok(());
        }
        let more = differences.len().saturating_sub(SHOWN);
        let shown = differences.into_iter().take(SHOWN).collect::<Vec<_>>().join("; ");
        let more = if more > 0 { format!("; and {more} more") } else { String::new() };
        Err(Error::file(path, format!("{what}: {shown}{more}")))
    }
}

/// How far a render in passes is, beside its sums.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Passes {
    /// The target that it was to reach, if there was one.
    target: Option<String>,
    /// How many samples there were when the estimate first was below that.
    near: Option<u64>,
}

/// The record.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Record {
    format: u32,
    pub(super) identity: Identity,
    /// Which of each pixel's samples these are.
    pub(super) samples: Range<u32>,
    /// How many there are in all.
    pub(super) all_samples: u32,
    sampled_pixels: u64,
    pub(super) complete: bool,
    standing: Standing,
    /// What more there is to know where samples went where the error is.
    #[serde(skip_serializing_if = "Option::is_none")]
    passes: Option<Passes>,
    /// Samples taken over all pixels.
    pub(super) taken: u64,
    /// Rays from the camera, from surfaces, and to lights.
    rays: [u64; 3],
    ray_nanoseconds: u64,
    nanoseconds: u64,
    dropped: Dropped,
    exponent: i32,
    mean_exponents: Vec<i32>,
    numbers: usize,
    pub(super) finish: Finish,
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

/// What stays the same while a render goes on.
pub(super) struct Kept {
    pub(super) identity: Identity,
    pub(super) samples: Range<u32>,
    pub(super) all_samples: u32,
    /// In how many pixels samples are taken.
    pub(super) sampled_pixels: u64,
    /// The error that it is to reach, if there is one.
    pub(super) target: Option<String>,
    pub(super) finish: Finish,
}

/// The identity of a part of a render.
fn of_part(identity: &Identity, Range { start, end }: &Range<u32>) -> Identity {
    let mut identity = identity.clone();
    identity.settings.insert("samples of each pixel".into(), format!("{start} to {}", end.saturating_sub(1)));
    identity
}

impl Kept {
    /// All that decides the bits of this part.
    pub(super) fn part_identity(&self) -> Identity {
        of_part(&self.identity, &self.samples)
    }

    /// The record of how far it is.
    fn record(&self, state: &State, complete: bool) -> Record {
        let (scale, extras) = state.film.kept();
        let (standing, passes) = match &state.reached {
            Reached::Units(standing) => (standing.clone(), None),
            Reached::Passes(passes) => {
                (Standing::default(), Some(Passes { target: self.target.clone(), near: passes.near }))
            }
        };
        Record {
            format: FORMAT,
            identity: self.identity.clone(),
            samples: self.samples.clone(),
            all_samples: self.all_samples,
            sampled_pixels: self.sampled_pixels,
            complete,
            standing,
            passes,
            taken: state.done.samples,
            rays: [state.done.rays.camera, state.done.rays.bounce, state.done.rays.shadow],
            ray_nanoseconds: nanoseconds(state.done.rays.time),
            nanoseconds: nanoseconds(state.time),
            dropped: state.film.dropped(),
            exponent: scale.exponent(),
            mean_exponents: extras.map_or_else(Vec::new, |e| e.means.iter().map(|s| s.exponent()).collect()),
            numbers: extras.map_or(0, |e| 1 + e.numbers),
            finish: self.finish.clone(),
        }
    }

    /// What a file of sums holds of it.
    pub(super) fn sealed(&self, state: &State, complete: bool) -> (String, Vec<Plane>) {
        // Maps of texts and numbers: nothing that JSON has not.
        let record = serde_json::to_string(&self.record(state, complete)).unwrap_or_default();
        (record, state.to_planes())
    }
}

impl Record {
    /// All that decides the bits of this part.
    pub(super) fn part_identity(&self) -> Identity {
        of_part(&self.identity, &self.samples)
    }

    /// Reads a file's record, and the sums that are to be looked at with it.
    ///
    /// Fails where the file cannot be read or has none.
    pub(super) fn open(path: &Path) -> Result<(Self, Sums)> {
        let sums = sums_file::read(path)?;
        let record = Self::parse(&sums).map_err(|e| unreadable(path, &e))?;
        Ok((record, sums))
    }

    /// The record of a file.
    fn parse(sums: &Sums) -> std::result::Result<Self, String> {
        let format = serde_json::from_str::<Format>(&sums.record).map_err(|e| e.to_string())?.format;
        if format != FORMAT {
            return Err(format!("they are of version {format}, not {FORMAT}, of this kind of file"));
        }
        serde_json::from_str(&sums.record).map_err(|e| e.to_string())
    }

    /// Whether samples went where the error is, so that pixels have numbers of their own.
    pub(super) fn is_adaptive(&self) -> bool {
        self.passes.is_some()
    }

    /// The state of a render whose pixels all have the same number, with the sums of its file.
    ///
    /// Fails where they do not fit together.
    pub(super) fn state(&self, path: &Path, sums: &Sums) -> Result<State> {
        self.state_of(sums).map_err(|e| unreadable(path, &e))
    }

    fn state_of(&self, sums: &Sums) -> std::result::Result<State, String> {
        let film = self.film(sums)?.with_parts(Parts::Halves.count());
        film.add_planes(|name| sums.plane(name)).map_err(|name| missing(&name))?;
        film.add_dropped(&self.dropped);
        let reached = Reached::Units(self.standing.clone());
        Ok(State { film, reached, done: self.done(), time: Duration::from_nanos(self.nanoseconds) })
    }

    /// What is known of a render in passes beside its planes, if it is to reach the error `target` from now on.
    ///
    /// Fails where the record does not fit the sums.
    pub(super) fn earlier(&self, path: &Path, sums: &Sums, target: Option<&String>) -> Result<Earlier> {
        self.earlier_of(sums, target).map_err(|e| unreadable(path, &e))
    }

    fn earlier_of(&self, sums: &Sums, target: Option<&String>) -> std::result::Result<Earlier, String> {
        let film = self.film(sums)?;
        film.add_dropped(&self.dropped);
        // Looks at another target are none at this one.
        let near =
            self.passes.as_ref().filter(|passes| passes.target.as_ref() == target).and_then(|passes| passes.near);
        Ok(Earlier { film, near, done: self.done(), time: Duration::from_nanos(self.nanoseconds) })
    }

    /// What the file shows, whatever kind of render it is of, and its record; for those who get files from strangers.
    ///
    /// Fails where record and sums do not fit together.
    pub(super) fn show(sums: &Sums) -> std::result::Result<(Self, Film), String> {
        let record = Self::parse(sums)?;
        let film = match &record.passes {
            None => record.state_of(sums)?.film,
            Some(passes) => {
                let earlier = record.earlier_of(sums, passes.target.as_ref())?;
                adaptive::put_together(earlier, |name| sums.plane(name)).map_err(|unfit| unfit_text(&unfit))?
            }
        };
        Ok((record, film))
    }

    fn done(&self) -> Done {
        let [camera, bounce, shadow] = self.rays;
        let rays = RayCounts { camera, bounce, shadow, time: Duration::from_nanos(self.ray_nanoseconds) };
        Done { samples: self.taken, rays }
    }

    /// An empty film like that of the sums.
    ///
    /// Fails where the record cannot be right.
    fn film(&self, sums: &Sums) -> std::result::Result<Film, String> {
        let Finish { crop, full_size, channels, pixel_format, .. } = &self.finish;
        let fits = |start: u32, length: u32, whole: u32| start.checked_add(length).is_some_and(|end| end <= whole);
        let possible = |e: &i32| e.abs() <= MAX_EXPONENT;
        let is_possible = (crop.width, crop.height) == sums.size
            && fits(crop.x, crop.width, full_size.0)
            && fits(crop.y, crop.height, full_size.1)
            && full_size.0.max(full_size.1) <= i32::MAX.cast_unsigned()
            && possible(&self.exponent)
            && self.mean_exponents.iter().all(possible)
            && self.mean_exponents.len().max(self.numbers) <= sums.plane_count()
            && self.rays.into_iter().chain([self.taken]).all(|count| count <= MOST_COUNTED)
            && self.samples.start < self.samples.end
            && self.samples.end <= self.all_samples
            && channels.has_alpha() == pixel_format.has_alpha()
            && channels.fit(self.mean_exponents.len(), self.numbers);
        if !is_possible {
            return Err(CONTRADICTION.into());
        }
        // Which filter the samples were weighted by does not matter to sums that are there.
        let film = Film::new(*crop, Filter::Box, false, Scale::for_exponent(self.exponent));
        let means = self.mean_exponents.iter().map(|&e| Scale::for_exponent(e)).collect();
        let extras = |numbers| Extras { means, numbers };
        Ok(match self.numbers.checked_sub(1) {
            None => film,
            Some(numbers) => film.with_extras(extras(numbers)),
        })
    }

    /// What it came to.
    pub(super) fn outcome(&self) -> Outcome {
        Outcome {
            samples: self.taken as f64 / self.sampled_pixels as f64,
            seconds: Duration::from_nanos(self.nanoseconds).as_secs_f64(),
            non_finite: self.dropped.non_finite(),
            oversized: self.dropped.oversized,
            complete: self.complete,
            ended: None,
            error: None,
        }
    }
}

/// What is wrong with a record that cannot be right.
const CONTRADICTION: &str = "the record contradicts itself or the file";

/// Why a render towards a target cannot go on.
const ONE_SEQUENCE: &str = "it has one sequence of samples, the same number in every pixel, which cannot tell well enough when a \
                            target is reached: it goes on with --adaptive only";

fn missing(name: &str) -> String {
    format!("the channel {name} is missing")
}

fn unreadable(path: &Path, why: &str) -> Error {
    Error::file(path, format!("cannot read the sums of a render: {why}"))
}

fn unfit_text(unfit: &Unfit) -> String {
    match unfit {
        Unfit::Missing(name) => missing(name),
        Unfit::Contradiction => CONTRADICTION.into(),
        Unfit::OneSequence => ONE_SEQUENCE.into(),
    }
}

/// Why a render in passes cannot go on from a file.
pub(super) fn unfit(path: &Path, unfit: &Unfit) -> Error {
    match unfit {
        Unfit::OneSequence => Error::file(path, ONE_SEQUENCE),
        _ => unreadable(path, &unfit_text(unfit)),
    }
}

/// What every version of the record has.
#[derive(Deserialize)]
struct Format {
    format: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::aov::Channels;
    use crate::image::{ComponentFormat, Crop, OutputFile, PixelFormat};

    fn kept() -> Kept {
        let crop = Crop { x: 1, y: 0, width: 3, height: 2 };
        Kept {
            identity: Identity::default(),
            samples: 0..4,
            all_samples: 8,
            sampled_pixels: 6,
            target: None,
            finish: Finish {
                full_size: (4, 2),
                crop,
                pixel_format: PixelFormat::Rgb,
                component_format: ComponentFormat::Half,
                channels: Channels::default(),
                about: BTreeMap::new(),
            },
        }
    }

    fn state() -> State {
        let film = Film::new(kept().finish.crop, Filter::Box, false, Scale::for_exponent(3)).with_parts(2);
        let mut tile = film.start_tile(0);
        let id = crate::film::SampleId { x: 2, y: 1, index: 0 };
        tile.add_sample(id, crate::spectrum::Rgb::new(1.0, -0.3, 1e-7), || unreachable!());
        film.add(&tile, 0);
        State { film, reached: Reached::Units(Standing::default()), done: Done::default(), time: Duration::ZERO }
    }

    /// The sums of a file with this record.
    fn sums(record: &str, planes: &[Plane]) -> sums_file::Sums {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sums.exr");
        let (finish, state) = (kept().finish, state());
        let outcome = Outcome::new(&state, false, 6);
        let sealed = Some((record.to_owned(), planes.to_vec()));
        let file = OutputFile::exr(&path, "the sums").unwrap();
        finish
            .develop((&state.film, None), &outcome, 0.0, sealed, |layers, options| file.write(layers, options))
            .unwrap();
        sums_file::read(&path).unwrap()
    }

    #[test]
    fn what_was_written_is_read() {
        let (record, planes) = kept().sealed(&state(), true);
        let sums = sums(&record, &planes);
        let read = Record::parse(&sums).unwrap();
        let back = read.state_of(&sums).unwrap();
        assert_eq!(back.film.to_planes(), state().film.to_planes());
        assert_eq!(back.film.kept(), state().film.kept());
        assert_eq!((read.samples.clone(), read.all_samples, read.complete), (0..4, 8, true));
        assert_eq!(read.outcome().samples, 0.0);
    }

    /// Hashes are no secret: whoever writes such a file can make it say anything.
    #[test]
    fn what_cannot_be_is_refused() {
        let (record, planes) = kept().sealed(&state(), true);
        let error = |record: &str, planes| Record::show(&sums(record, planes)).err().unwrap();
        let contradiction = "the record contradicts itself or the file";
        for (from, to, expected) in [
            (r#""format":2"#, r#""format":99"#, "they are of version 99, not 2, of this kind of file"),
            (r#""format":2"#, r#""form":1"#, "missing field `format`"),
            (r#""exponent":3"#, r#""exponent":2147483647"#, contradiction),
            (r#""mean_exponents":[]"#, r#""mean_exponents":[-2147483647]"#, contradiction),
            (r#""width":3"#, r#""width":4294967295"#, contradiction),
            (r#""height":2"#, r#""height":1"#, contradiction),
            (r#""x":1"#, r#""x":2"#, contradiction),
            (r#""end":4"#, r#""end":9"#, contradiction),
            (r#""start":0"#, r#""start":4"#, contradiction),
            (r#""alpha":null"#, r#""alpha":0"#, contradiction),
            (r#""rays":[0"#, r#""rays":[18446744073709551615"#, contradiction),
            (r#""numbers":0"#, r#""numbers":9999999999"#, contradiction),
            (r#""numbers":0"#, r#""numbers":1"#, "the channel snell.number.0 is missing"),
            (r#""named":[]"#, r#""named":[["a","Samples"],["a","Samples"]]"#, contradiction),
            (r#""named":[]"#, r#""named":[["a",{"Number":7}]]"#, contradiction),
            (r#""named":[]"#, r#""named":[["a",{"Error":3}]]"#, contradiction),
        ] {
            let changed = record.replacen(from, to, 1);
            assert_ne!(changed, record, "{from}");
            assert!(error(&changed, &planes).contains(expected), "{to}: {}", error(&changed, &planes));
        }
        assert_eq!(error(&record, &planes[1..]), "the channel snell.sum.R.0 is missing");
    }
}
