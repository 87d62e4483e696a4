//! Films, reconstruction filters and samplers: what belongs to a sensor.

use super::find;
use crate::description::{ComponentFormat, Crop, Film, Filter, PixelFormat, Sampler};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::document::{Category, ObjectId};
use crate::loader::params::Params;

type FilmFn = fn(&mut Builder<'_>, &Params<'_>) -> Result<Film>;
type FilterFn = fn(&Params<'_>) -> Result<Filter>;
type SamplerFn = fn(&Params<'_>) -> Result<()>;

const FILMS: &[(&str, FilmFn)] = &[("hdrfilm", hdrfilm)];

const FILTERS: &[(&str, FilterFn)] = &[
    ("box", |_| Ok(Filter::Box)),
    ("catmullrom", |_| Ok(Filter::CatmullRom)),
    ("gaussian", gaussian),
    ("lanczos", lanczos),
    ("mitchell", mitchell),
    ("tent", tent),
];

const SAMPLERS: &[(&str, SamplerFn)] = &[
    ("independent", no_more),
    ("ldsampler", no_more),
    ("multijitter", jittered),
    ("orthogonal", orthogonal),
    ("stratified", jittered),
];

/// Mitsuba's film unless there is one: 768 × 576.
const DEFAULT_SIZE: (u32, u32) = (768, 576);

/// Samples per pixel unless given.
const DEFAULT_SAMPLE_COUNT: u32 = 4;

/// Radius of a tent unless given.
const DEFAULT_TENT_RADIUS: f64 = 1.0;

/// Standard deviation of a Gaussian unless given.
const DEFAULT_STDDEV: f64 = 0.5;

/// Side lobes of a Lanczos filter unless given.
const DEFAULT_LOBES: u32 = 3;

/// Both of Mitchell's parameters unless given.
const DEFAULT_MITCHELL: f64 = 1.0 / 3.0;

/// The film of a sensor.
pub(crate) fn film(b: &mut Builder<'_>, id: ObjectId) -> Result<Film> {
    let p = Params::new(b.document, id);
    let made = find(b.document, id, FILMS)?(b, &p)?;
    p.finish(b)?;
    Ok(made)
}

/// The film of a sensor that has none: Mitsuba's default.
pub(crate) fn default_film(sensor: &Params<'_>) -> Film {
    let (width, height) = DEFAULT_SIZE;
    Film {
        at: sensor.span(),
        width,
        height,
        crop: Crop { x: 0, y: 0, width, height },
        filter: Filter::DEFAULT,
        sample_border: false,
        component_format: ComponentFormat::Half,
        pixel_format: PixelFormat::Rgb,
    }
}

fn hdrfilm(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Film> {
    let width = side(p, "width", DEFAULT_SIZE.0)?;
    let height = side(p, "height", DEFAULT_SIZE.1)?;
    let crop = crop(p, width, height)?;
    let pixel_format =
        match p.choice("pixel_format", &["rgb", "rgba", "luminance", "luminance_alpha", "xyz", "xyza"])? {
            "luminance" => PixelFormat::Luminance,
            "luminance_alpha" => PixelFormat::LuminanceAlpha,
            "rgba" => PixelFormat::Rgba,
            "xyz" => PixelFormat::Xyz,
            "xyza" => PixelFormat::Xyza,
            _ => PixelFormat::Rgb,
        };
    if p.choice("file_format", &["openexr", "exr", "rgbe", "pfm"])?.trim_start_matches("open") != "exr" {
        b.approximate(p.at("file_format"), "a file format other than 'openexr'", "", "'openexr'")?;
    }
    let component_format = match p.choice("component_format", &["float16", "float32", "uint32"])? {
        "float16" => ComponentFormat::Half,
        "float32" => ComponentFormat::Float,
        _ => {
            b.approximate(p.at("component_format"), "the component format 'uint32'", "", "'float32'")?;
            ComponentFormat::Float
        }
    };
    let sample_border = p.boolean("sample_border", false)?;
    // Sums are exact without being compensated, and pictures have no banner.
    p.boolean("compensate", false)?;
    p.boolean("banner", true)?;
    let (at, filter) = (p.span(), filter(b, p)?);
    Ok(Film { at, width, height, crop, filter, sample_border, component_format, pixel_format })
}

fn side(p: &Params<'_>, name: &'static str, default: u32) -> Result<u32> {
    let value = p.unsigned(name, default, 1)?;
    Film::check_side(value).map_err(|m| p.error(name, format!("'{name}': {m}")))?;
    Ok(value)
}

fn crop(p: &Params<'_>, width: u32, height: u32) -> Result<Crop> {
    let crop = Crop {
        x: p.unsigned("crop_offset_x", 0, 0)?,
        y: p.unsigned("crop_offset_y", 0, 0)?,
        width: p.unsigned("crop_width", width, 1)?,
        height: p.unsigned("crop_height", height, 1)?,
    };
    let fits = |offset: u32, size: u32, whole: u32| offset.checked_add(size).is_some_and(|end| end <= whole);
    let outside =
        |name, size, whole| p.error(name, format!("the crop window ends outside the film: {size} pixels of {whole}"));
    if !fits(crop.x, crop.width, width) {
        return Err(outside("crop_offset_x", u64::from(crop.x) + u64::from(crop.width), width));
    }
    if !fits(crop.y, crop.height, height) {
        return Err(outside("crop_offset_y", u64::from(crop.y) + u64::from(crop.height), height));
    }
    Film::check_pixels(crop).map_err(|m| p.error("width", m))?;
    Ok(crop)
}

fn filter(b: &mut Builder<'_>, film: &Params<'_>) -> Result<Filter> {
    let Some((id, _)) = film.child(Category::Rfilter)? else { return Ok(Filter::DEFAULT) };
    let p = Params::new(b.document, id);
    let made = find(b.document, id, FILTERS)?(&p)?;
    if made.radius() > Filter::MAX_RADIUS {
        let (radius, most) = (made.radius(), Filter::MAX_RADIUS);
        let message = format!("a filter that reaches {radius} pixels is too wide; at most {most} are supported");
        return Err(b.document.sources.error(p.object.at, message));
    }
    p.finish(b)?;
    Ok(made)
}

fn tent(p: &Params<'_>) -> Result<Filter> {
    Ok(Filter::Tent { radius: p.positive("radius", DEFAULT_TENT_RADIUS)? })
}

fn gaussian(p: &Params<'_>) -> Result<Filter> {
    Ok(Filter::Gaussian { stddev: p.positive("stddev", DEFAULT_STDDEV)? })
}

fn mitchell(p: &Params<'_>) -> Result<Filter> {
    let parameter = |name| Ok(p.float(name)?.unwrap_or(DEFAULT_MITCHELL));
    Ok(Filter::Mitchell { b: parameter("B")?, c: parameter("C")? })
}

fn lanczos(p: &Params<'_>) -> Result<Filter> {
    Ok(Filter::Lanczos { lobes: p.unsigned("lobes", DEFAULT_LOBES, 1)? })
}

/// The sampler of a sensor; its type is a hint.
pub(crate) fn sampler(b: &mut Builder<'_>, sensor: &Params<'_>) -> Result<Sampler> {
    let Some((id, _)) = sensor.child(Category::Sampler)? else {
        return Ok(Sampler { sample_count: DEFAULT_SAMPLE_COUNT, seed: 0 });
    };
    let p = Params::new(b.document, id);
    find(b.document, id, SAMPLERS)?(&p)?;
    let sample_count = p.unsigned("sample_count", DEFAULT_SAMPLE_COUNT, 1)?;
    let seed = p.unsigned("seed", 0, 0)?;
    p.finish(b)?;
    Ok(Sampler { sample_count, seed })
}

fn no_more(_: &Params<'_>) -> Result<()> {
    Ok(())
}

fn jittered(p: &Params<'_>) -> Result<()> {
    p.boolean("jitter", true).map(|_| ())
}

fn orthogonal(p: &Params<'_>) -> Result<()> {
    p.integer("strength")?;
    jittered(p)
}
