//! Sensors.

use super::{film, find};
use crate::description::{Camera, FieldOfView, FovAxis, Projection};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::document::{Category, ObjectId};
use crate::loader::params::Params;
use glam::{DAffine3, DMat3};

type SensorFn = fn(&Params<'_>) -> Result<Projection>;

/// The supported sensor plugins. `panorama` is our own.
const SENSORS: &[(&str, SensorFn)] = &[
    ("orthographic", |_| Ok(Projection::Orthographic)),
    ("panorama", |_| Ok(Projection::Panorama)),
    ("perspective", perspective),
    ("thinlens", thin_lens),
];

/// Diagonal in millimetres of the 35 mm film that focal lengths refer to: 36 mm × 24 mm.
const FILM_DIAGONAL_MM: f64 = 43.266_615_305_567_875;

/// Focal length in millimetres unless there is one or a field of view.
const DEFAULT_FOCAL_LENGTH_MM: f64 = 50.0;

/// Nearest visible distance unless given.
const DEFAULT_NEAR_CLIP: f64 = 0.01;

/// Farthest visible distance unless given.
const DEFAULT_FAR_CLIP: f64 = 1e4;

/// Largest difference of an entry of MᵀM from the identity at which the matrix M of a camera still has no scale.
/// Mitsuba's number.
const SCALE_TOLERANCE: f64 = 1e-3;

/// How many times nearer than its radius an aperture can be focused. Reason: a photograph has less than 1; squares of
/// single precision end at 10¹⁹.
const MAX_APERTURE: f64 = 1e6;

/// A sensor of the scene.
pub(crate) fn sensor(b: &mut Builder<'_>, id: ObjectId) -> Result<Camera> {
    let p = Params::new(b.document, id);
    let projection = find(b.document, id, SENSORS)?(&p)?;
    let to_world = p.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
    let m = to_world.matrix3;
    let may_scale = projection == Projection::Orthographic;
    // Written so that NaN is a scale.
    if !may_scale && !(m.transpose() * m).abs_diff_eq(DMat3::IDENTITY, SCALE_TOLERANCE) {
        return Err(p.error("to_world", "the transformation of a camera must not scale or shear"));
    }
    let near_clip = p.positive("near_clip", DEFAULT_NEAR_CLIP)?;
    let far_clip = p.float("far_clip")?.unwrap_or(DEFAULT_FAR_CLIP);
    if near_clip >= far_clip {
        return Err(
            p.error("far_clip", format!("'far_clip' ({far_clip}) must be larger than 'near_clip' ({near_clip})"))
        );
    }
    // Where a camera without a lens is focused changes nothing; nor does the time, as nothing moves.
    p.float("focus_distance")?;
    let (open, close) = (p.float("shutter_open")?.unwrap_or(0.0), p.float("shutter_close")?.unwrap_or(0.0));
    if open > close {
        return Err(p.error("shutter_open", "the shutter must not open after it closes"));
    }
    let film = match p.child(Category::Film)? {
        Some((id, _)) => film::film(b, id)?,
        None => film::default_film(&p),
    };
    let sampler = film::sampler(b, &p)?;
    let at = p.span();
    p.finish(b)?;
    Ok(Camera { at, to_world, projection, near_clip, far_clip, film, sampler })
}

fn perspective(p: &Params<'_>) -> Result<Projection> {
    let fov = field_of_view(p)?;
    let offset = |name| Ok(p.float(name)?.unwrap_or(0.0));
    let principal_point_offset = (offset("principal_point_offset_x")?, offset("principal_point_offset_y")?);
    Ok(Projection::Perspective { fov, principal_point_offset })
}

/// As in Mitsuba, what is as far away as can be seen at all is sharp unless the file says otherwise.
fn thin_lens(p: &Params<'_>) -> Result<Projection> {
    let fov = field_of_view(p)?;
    let Some(aperture_radius) = p.float("aperture_radius")? else {
        let message = "sensor 'thinlens' needs the parameter 'aperture_radius' (a <float>)";
        return Err(p.document.sources.error(p.object.at, message));
    };
    if !(aperture_radius >= 0.0) {
        return Err(p.error("aperture_radius", "'aperture_radius' must not be negative"));
    }
    let far_clip = p.float("far_clip")?.unwrap_or(DEFAULT_FAR_CLIP);
    let focus_distance = p.positive("focus_distance", far_clip)?;
    if aperture_radius > MAX_APERTURE * focus_distance {
        let message = format!("'focus_distance' ({focus_distance}) is too small for the aperture ({aperture_radius})");
        return Err(p.error("focus_distance", message));
    }
    Ok(Projection::ThinLens { fov, aperture_radius, focus_distance })
}

/// The field of view in degrees, and along what: from `fov` and `fov_axis` or from `focal_length`.
pub(crate) fn field_of_view(p: &Params<'_>) -> Result<FieldOfView> {
    let axis = match p.choice("fov_axis", &["x", "y", "diagonal", "smaller", "larger"])? {
        "y" => FovAxis::Y,
        "diagonal" => FovAxis::Diagonal,
        "smaller" => FovAxis::Smaller,
        "larger" => FovAxis::Larger,
        _ => FovAxis::X,
    };
    let focal_length = p.text("focal_length")?;
    match p.float("fov")? {
        Some(_) if focal_length.is_some() => {
            Err(p.error("focal_length", "'fov' and 'focal_length' exclude each other"))
        }
        Some(degrees) if degrees > 0.0 && degrees < 180.0 => Ok(FieldOfView { degrees, axis }),
        Some(fov) => Err(p.error("fov", format!("'fov' must be between 0 and 180 degrees, not {fov}"))),
        None => {
            let mm = focal_length.map_or(Ok(DEFAULT_FOCAL_LENGTH_MM), |text| millimetres(p, text))?;
            // A focal length says how large the diagonal is, whatever the axis.
            let degrees = 2.0 * libm::atan(FILM_DIAGONAL_MM / (2.0 * mm)).to_degrees();
            Ok(FieldOfView { degrees, axis: FovAxis::Diagonal })
        }
    }
}

fn millimetres(p: &Params<'_>, text: &str) -> Result<f64> {
    let number = text.trim().trim_end_matches("mm");
    let value = crate::loader::values::number(number).map_err(|m| p.error("focal_length", m))?;
    if value > 0.0 { Ok(value) } else { Err(p.error("focal_length", "'focal_length' must be larger than zero")) }
}
