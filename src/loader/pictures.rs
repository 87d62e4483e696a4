//! The pictures of a scene: asked for while it is read, decoded together at the end, each file once and many at a time.
//!
//! Who reads a scene names files and bytes ([`Pictures::file`], [`Pictures::bytes`]), asks for the pictures in them
//! ([`Pictures::ask`]) only where something visible uses them, puts [`Raster::pending`] in their places, and exchanges that for
//! what [`Pictures::decode`] returns. Nothing of a picture that nobody asks for is read.

use crate::error::{Error, Result, Span};
use crate::files::Files;
use crate::image::{MAX_PICTURE_BYTES, Raster};
use image::ImageFormat;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A picture that was asked for: an index into what [`Pictures::decode`] returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct PictureId(pub(crate) usize);

/// A file or the bytes of one, from which pictures may be asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct PictureSource(usize);

/// The pictures that a scene asks for. `'a` is the life of bytes that are in memory already.
#[derive(Debug, Default)]
pub(crate) struct Pictures<'a> {
    files: Files,
    sources: Vec<Source<'a>>,
    of_files: HashMap<PathBuf, PictureSource>,
    /// What was asked for, and whether its numbers are taken as they are.
    asked: Vec<(PictureSource, bool)>,
    ids: HashMap<(PictureSource, bool), PictureId>,
}

/// Something to decode.
#[derive(Debug)]
struct Source<'a> {
    content: Content<'a>,
    /// What it is called in messages and lists.
    name: String,
    /// Where it is first asked for.
    at: Span,
}

#[derive(Debug)]
enum Content<'a> {
    File(PathBuf),
    Bytes(Cow<'a, [u8]>),
}

impl<'a> Pictures<'a> {
    /// None yet; those of files may be read where `files` says.
    pub(crate) fn new(files: Files) -> Self {
        Self { files, ..Self::default() }
    }

    /// The picture in a file, wherever it was named before; `at` is where the scene names it.
    pub(crate) fn file(&mut self, path: &Path, at: Span) -> PictureSource {
        let path = self.files.identity(path);
        if let Some(&source) = self.of_files.get(&path) {
            return source;
        }
        let name = path.display().to_string();
        let source = self.add(Source { content: Content::File(path.clone()), name, at });
        self.of_files.insert(path, source);
        source
    }

    /// The picture in the bytes of a file. Each call is another picture; its name counts where the bytes do not say their
    /// format.
    pub(crate) fn bytes(&mut self, name: String, bytes: Cow<'a, [u8]>, at: Span) -> PictureSource {
        self.add(Source { content: Content::Bytes(bytes), name, at })
    }

    fn add(&mut self, source: Source<'a>) -> PictureSource {
        self.sources.push(source);
        PictureSource(self.sources.len() - 1)
    }

    /// Asks for a picture. Its colours are decoded by the transfer function of sRGB unless its numbers are wanted `raw`.
    pub(crate) fn ask(&mut self, source: PictureSource, raw: bool) -> PictureId {
        let asked = &mut self.asked;
        *self.ids.entry((source, raw)).or_insert_with(|| {
            asked.push((source, raw));
            PictureId(asked.len() - 1)
        })
    }

    /// All that were asked for, by number, decoded by the threads of the pool in which this is called.
    ///
    /// Fails where one cannot be read; of several the one that was asked for first.
    pub(crate) fn decode(self) -> Result<Vec<Arc<Raster>>> {
        let Self { files, sources, asked, .. } = self;
        let mut wanted: Vec<Vec<bool>> = vec![Vec::new(); sources.len()];
        for &(source, raw) in &asked {
            wanted[source.0].push(raw);
        }
        let decoded: Vec<Result<Vec<Arc<Raster>>>> = sources
            .into_par_iter()
            .zip(wanted)
            .with_max_len(1)
            .map(|(source, wanted)| source.decode(&files, &wanted))
            .collect();
        let mut decoded = decoded.into_iter().map(|found| found.map(Vec::into_iter)).collect::<Result<Vec<_>>>()?;
        Ok(asked.iter().filter_map(|&(source, _)| decoded[source.0].next()).collect())
    }
}

impl Source<'_> {
    /// The pictures, one for each of `raw`.
    fn decode(self, files: &Files, raw: &[bool]) -> Result<Vec<Arc<Raster>>> {
        let Some((&first, others)) = raw.split_first() else { return Ok(Vec::new()) };
        let named = ImageFormat::from_path(&self.name).ok();
        let decode = |bytes: &[u8]| {
            Raster::decode(bytes, named, first, files.memory())
                // One for each way in which its numbers are taken.
                .and_then(|r| files.memory().keep(r.memory_bytes() * (1 + others.len() as u64)).map(|()| r))
        };
        let decoded = match &self.content {
            Content::File(path) => files.read(path, MAX_PICTURE_BYTES).and_then(|bytes| decode(&bytes)),
            Content::Bytes(bytes) => decode(bytes),
        };
        let decoded = decoded.map_err(|m| {
            let name = if let Content::File(path) = &self.content {
                format!("'{}'", path.display())
            } else {
                self.name.clone()
            };
            Error::scene(&self.at, format!("{name}: cannot read the picture: {m}"))
        })?;
        let first = Arc::new(decoded.called(self.name));
        let others: Vec<_> = others.iter().map(|&raw| Arc::new(first.decoded_as(raw))).collect();
        Ok(std::iter::once(first).chain(others).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn png(grey: u8) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image::GrayImage::from_pixel(1, 1, image::Luma([grey])).write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    fn at(line: u32) -> Span {
        Span::text(Path::new("scene"), line, 1)
    }

    #[test]
    fn files_are_decoded_once_and_bytes_by_their_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("grey.png");
        std::fs::write(&path, png(51)).unwrap();
        let mut pictures = Pictures::default();
        let file = pictures.file(&path, at(1));
        let srgb = pictures.ask(file, false);
        let memory = pictures.bytes("black".into(), png(0).into(), at(2));
        let [black, black_too] = [true, false].map(|raw| pictures.ask(memory, raw));
        let again = pictures.file(&folder.path().join("..").join(folder.path()).join("grey.png"), at(3));
        assert_eq!(again, file);
        let raw = pictures.ask(again, true);
        assert_eq!(pictures.ask(file, false), srgb);
        pictures.file(Path::new("never asked for"), at(5));
        let decoded = pictures.decode().unwrap();
        let red = |id: PictureId| decoded[id.0].colour(0, 0).0.x;
        assert_eq!([red(raw), red(black), red(black_too)], [0.2, 0.0, 0.0]);
        assert_eq!(red(srgb), crate::spectrum::srgb_to_linear(0.2) as f32);
        assert_eq!(decoded[black.0].name(), "black");
    }

    #[test]
    fn of_several_faults_the_first_is_told() {
        let mut pictures = Pictures::default();
        for line in 0..50 {
            let bytes = if line == 17 || line == 40 { b"words".to_vec() } else { png(1) };
            let source = pictures.bytes(format!("picture {line}"), bytes.into(), at(line));
            pictures.ask(source, false);
        }
        let error = pictures.decode().unwrap_err().to_string();
        assert_eq!(
            error,
            "scene:17:1: picture 17: cannot read the picture: it is none of OpenEXR, Radiance HDR, PNG, JPEG, BMP and TGA"
        );
    }
}
