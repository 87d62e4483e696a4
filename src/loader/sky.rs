//! Maps of radiance around a scene: those of a scene file, and the one that the user gives in place of it.

use super::source::MAX_DATA_BYTES;
use crate::description::{Light, LightKind, SceneDescription};
use crate::error::{Error, Result, Span};
use crate::files::Files;
use crate::image::{Picture, decode_picture};
use glam::DMat3;
use image::ImageFormat;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Fewest columns and rows of a map: smaller ones are repeated, as Mitsuba does.
pub(crate) const LEAST_SIZE: (u32, u32) = (2, 3);

/// An environment in place of the scene's own.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// A picture of the surroundings in latitude and longitude, its upper rim towards +y.
    pub file: PathBuf,
    /// How far it is turned to the left about +y, in degrees.
    pub degrees: f64,
}

/// Reads a map of radiance, which must be finite; also says how many pixels had negative values, which are taken for 0.
pub(crate) fn read_map(files: &Files, path: &Path) -> std::result::Result<(Picture, usize), String> {
    let mut map = files
        .read(path, MAX_DATA_BYTES)
        .and_then(|bytes| decode_picture(&bytes, ImageFormat::from_path(path).ok(), files.memory()))
        .map_err(|m| format!("cannot read '{}': {m}", path.display()))?
        .picture;
    if let Some(i) = map.pixels().iter().position(|v| !v.is_finite()) {
        let (x, y) = (i % map.width() as usize, i / map.width() as usize);
        return Err(format!("'{}' has a value that is not finite, in column {x} of row {y}", path.display()));
    }
    let bytes = size_of_val(map.pixels()) as u64;
    files.memory().keep(bytes).map_err(|m| format!("'{}' {m}", path.display()))?;
    let negative = map.pixels().iter().filter(|v| v.0.min_element() < 0.0).count();
    if negative > 0 {
        map.apply(|v| v.map(|c| c.max(0.0)));
    }
    Ok((map, negative))
}

impl Sky {
    /// Puts it in place of all light that comes from everywhere.
    pub(crate) fn replace_in(&self, scene: &mut SceneDescription, files: &Files) -> Result<()> {
        let (map, negative) = read_map(files, &self.file).map_err(|m| Error::Usage(format!("--env: {m}")))?;
        if negative > 0 {
            let file = self.file.display();
            scene.warnings.push(format!("{file}: {negative} pixels have negative values, which are taken for 0"));
        }
        let (width, height) = LEAST_SIZE;
        let kind = LightKind::Environment {
            map: Arc::new(map.padded(width, height)),
            scale: 1.0,
            to_world: DMat3::from_rotation_y(self.degrees.to_radians()),
            mis_compensation: true,
        };
        scene.lights.retain(|l| !matches!(l.kind, LightKind::Constant { .. } | LightKind::Environment { .. }));
        scene.lights.push(Light { at: Span::whole(self.file.as_path()), kind });
        Ok(())
    }
}
