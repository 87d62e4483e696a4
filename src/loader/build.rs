//! A [`Document`] to a [`SceneDescription`]: what is used is interpreted by its plugin, the rest is left alone.

use super::LoadOptions;
use super::document::{Category, Document, ObjectId};
use super::inventory;
use super::params::Params;
use super::pictures::{PictureId, Pictures};
use super::plugins;
use super::source::Loc;
use super::xml::MAX_NESTING;
use crate::description::{
    AovKind, Bsdf, BsdfId, BsdfKind, Group, GroupId, Instance, Integrator, Light, LightKind, SceneDescription, Shape,
    Texture, TextureId, TextureKind,
};
use crate::error::Result;
use crate::spectrum::Rgb;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The reflectance of a shape that has no bsdf.
const DEFAULT_REFLECTANCE: f32 = 0.5;

/// Interprets a document.
pub(crate) fn build(document: &Document, options: &LoadOptions) -> Result<SceneDescription> {
    let mut b = Builder {
        document,
        lenient: options.lenient,
        wants_uvs: options.uvs,
        warnings: document.warnings.clone(),
        bsdfs: Vec::new(),
        bsdf_ids: HashMap::new(),
        default_bsdfs: [None; 2],
        depth: 0,
        attached: HashSet::new(),
        meshes: HashMap::new(),
        textures: Vec::new(),
        texture_ids: HashMap::new(),
        pictures: Pictures::new(options.files.clone()),
        bitmaps: Vec::new(),
        groups: Vec::new(),
        group_ids: HashMap::new(),
        used: HashSet::new(),
    };
    let root = Params::new(document, 0);
    let integrator = match root.child(Category::Integrator)? {
        Some((id, _)) => plugins::integrator::integrator(&mut b, id, 0)?,
        None => Integrator::default(),
    };
    b.wants_uvs |= integrator.aovs.iter().any(|aov| aov.kind == AovKind::Uv);
    let mut cameras = Vec::new();
    for (id, _) in b.distinct(&root, Category::Sensor)? {
        cameras.push(plugins::sensor::sensor(&mut b, id)?);
    }
    let (mut shapes, mut instances): (Vec<Shape>, Vec<Instance>) = Default::default();
    for (id, _) in b.distinct(&root, Category::Shape)? {
        match document.objects[id].plugin.as_str() {
            "instance" => instances.push(plugins::group::instance(&mut b, id)?),
            // It is there to be referred to.
            "shapegroup" => {}
            _ => shapes.push(plugins::shape::shape(&mut b, id)?),
        }
    }
    let lights = b.lights(&root)?;
    b.check_unused(&root)?;
    if cameras.is_empty() {
        let message = "the scene has no sensor; add a <sensor type=\"perspective\">";
        return Err(document.sources.error(root.object.at, message));
    }
    root.finish(&mut b)?;
    b.decode_pictures()?;
    let inventory = inventory::of(document, &b.used);
    let Builder { bsdfs, textures, groups, warnings, wants_uvs, .. } = b;
    Ok(SceneDescription {
        integrator,
        cameras,
        bsdfs,
        textures,
        shapes,
        groups,
        instances,
        wants_uvs,
        lights,
        warnings,
        inventory,
    })
}

/// What plugins share while a scene is built.
pub(crate) struct Builder<'d> {
    pub(crate) document: &'d Document,
    lenient: bool,
    wants_uvs: bool,
    pub(crate) warnings: Vec<String>,
    bsdfs: Vec<Bsdf>,
    bsdf_ids: HashMap<ObjectId, BsdfId>,
    /// Of shapes without a bsdf: reflecting, black.
    default_bsdfs: [Option<BsdfId>; 2],
    depth: usize,
    /// Emitters that belong to a shape.
    attached: HashSet<ObjectId>,
    pub(crate) meshes: HashMap<plugins::shape::MeshKey, plugins::shape::LoadedMesh>,
    textures: Vec<Texture>,
    texture_ids: HashMap<ObjectId, TextureId>,
    pictures: Pictures<'static>,
    /// Textures that wait for their picture.
    bitmaps: Vec<(TextureId, PictureId)>,
    groups: Vec<Group>,
    group_ids: HashMap<ObjectId, GroupId>,
    /// Objects that were interpreted.
    used: HashSet<ObjectId>,
}

impl<'d> Builder<'d> {
    /// An error, or a warning for who is lenient.
    pub(crate) fn complain(&mut self, at: Loc, message: impl Into<String>) -> Result<()> {
        let error = self.document.sources.error(at, message);
        if !self.lenient {
            return Err(error);
        }
        self.warnings.push(error.to_string());
        Ok(())
    }

    /// Something unsupported that `instead` is near to: an error, or a warning for who is lenient.
    pub(crate) fn approximate(&mut self, at: Loc, what: &str, hint: &str, instead: &str) -> Result<()> {
        let error = self.document.sources.unsupported(at, what, hint);
        if !self.lenient {
            return Err(error);
        }
        self.warnings.push(format!("{error}; {instead} instead"));
        Ok(())
    }

    /// Something worth knowing that is not wrong.
    pub(crate) fn warn(&mut self, at: Loc, message: &str) {
        self.warnings.push(format!("{}: {message}", self.document.sources.span(at)));
    }

    /// Notes that an object was interpreted.
    pub(crate) fn note_used(&mut self, id: ObjectId) {
        self.used.insert(id);
    }

    /// The bsdf of an object, made when it is first asked for.
    pub(crate) fn bsdf(&mut self, id: ObjectId) -> Result<BsdfId> {
        if let Some(bsdf) = self.bsdf_ids.get(&id) {
            return Ok(*bsdf);
        }
        let params = Params::new(self.document, id);
        if self.depth >= MAX_NESTING {
            let message = format!("bsdfs are nested more than {MAX_NESTING} deep");
            return Err(self.document.sources.error(params.object.at, message));
        }
        self.depth += 1;
        let kind = plugins::find(self.document, id, plugins::bsdf::BSDFS).and_then(|make| make(self, &params));
        self.depth -= 1;
        let kind = kind?;
        let (name, varying) = (params.object.id.clone(), params.take_varying());
        let made = self.add_bsdf(Bsdf { at: params.span(), name, kind, varying });
        params.finish(self)?;
        self.bsdf_ids.insert(id, made);
        Ok(made)
    }

    /// The kind of a bsdf that is made already.
    pub(crate) fn bsdf_kind(&self, id: BsdfId) -> &BsdfKind {
        &self.bsdfs[id.0].kind
    }

    /// Whether a shape with this bsdf needs texture coordinates, if only to know its tangents.
    pub(crate) fn needs_uvs(&self, id: BsdfId) -> bool {
        let needs = self.bsdfs[id.0].needs(&self.bsdfs, &self.textures);
        needs.uvs || needs.tangents || self.wants_uvs
    }

    /// Whether every shape needs texture coordinates.
    pub(crate) fn wants_uvs(&self) -> bool {
        self.wants_uvs
    }

    /// Whether a texture made so far asks for what meshes say themselves; a shape's own are made before its mesh.
    pub(crate) fn wants_attributes(&self) -> bool {
        self.textures.iter().any(|texture| matches!(texture.kind, TextureKind::Attribute { .. }))
    }

    /// Whether a bsdf lets light through.
    pub(crate) fn transmits(&self, id: BsdfId) -> bool {
        self.bsdfs[id.0].transmits(&self.bsdfs)
    }

    /// The texture of an object, made when it is first asked for.
    pub(crate) fn texture(&mut self, id: ObjectId) -> Result<TextureId> {
        if let Some(texture) = self.texture_ids.get(&id) {
            return Ok(*texture);
        }
        if self.depth >= MAX_NESTING {
            let message = format!("textures are nested more than {MAX_NESTING} deep");
            return Err(self.document.sources.error(self.document.objects[id].at, message));
        }
        self.depth += 1;
        let made = plugins::texture::texture(self, id);
        self.depth -= 1;
        let made = made?;
        self.texture_ids.insert(id, made);
        Ok(made)
    }

    pub(crate) fn add_texture(&mut self, texture: Texture) -> TextureId {
        self.textures.push(texture);
        TextureId(self.textures.len() - 1)
    }

    /// Asks for the picture in a file, which is decoded once everything is read.
    pub(crate) fn picture(&mut self, path: &Path, raw: bool, at: Loc) -> PictureId {
        let source = self.pictures.file(path, self.document.sources.span(at));
        self.pictures.ask(source, raw)
    }

    /// Notes that a texture shows a picture.
    pub(crate) fn show(&mut self, texture: TextureId, picture: PictureId) {
        self.bitmaps.push((texture, picture));
    }

    fn decode_pictures(&mut self) -> Result<()> {
        let decoded = std::mem::take(&mut self.pictures).decode()?;
        for &(texture, picture) in &self.bitmaps {
            if let TextureKind::Bitmap { image, .. } = &mut self.textures[texture.0].kind {
                *image = decoded[picture.0].clone();
            }
        }
        Ok(())
    }

    /// The group that an object makes, made when it is first asked for.
    pub(crate) fn group(&mut self, id: ObjectId) -> Result<GroupId> {
        if let Some(group) = self.group_ids.get(&id) {
            return Ok(*group);
        }
        let made = plugins::group::group(self, id)?;
        self.groups.push(made);
        let group = GroupId(self.groups.len() - 1);
        self.group_ids.insert(id, group);
        Ok(group)
    }

    /// What a shape without a bsdf has: grey, or black if it is a light.
    pub(crate) fn default_bsdf(&mut self, shape: &Params<'_>, is_light: bool) -> BsdfId {
        if let Some(id) = self.default_bsdfs[usize::from(is_light)] {
            return id;
        }
        let reflectance = Rgb::splat(if is_light { 0.0 } else { DEFAULT_REFLECTANCE });
        let kind = BsdfKind::Diffuse { reflectance };
        let id = self.add_bsdf(Bsdf { at: shape.span(), name: String::new(), kind, varying: Vec::new() });
        self.default_bsdfs[usize::from(is_light)] = Some(id);
        id
    }

    fn add_bsdf(&mut self, bsdf: Bsdf) -> BsdfId {
        self.bsdfs.push(bsdf);
        BsdfId(self.bsdfs.len() - 1)
    }

    /// Notes that an emitter belongs to a shape, which it can do once.
    pub(crate) fn attach(&mut self, emitter: ObjectId, at: Loc) -> Result<()> {
        if self.attached.insert(emitter) {
            return Ok(());
        }
        Err(self.document.sources.error(at, "an emitter can belong to one shape only"))
    }

    /// Children of the scene, none of them twice.
    fn distinct(&self, root: &Params<'d>, category: Category) -> Result<Vec<(ObjectId, Loc)>> {
        let children = root.children(category);
        let mut seen = HashSet::new();
        match children.iter().find(|(id, _)| !seen.insert(*id)) {
            None => Ok(children),
            Some((_, at)) => {
                let what = format!("a second use of the same {}", category.tag());
                Err(self.document.sources.unsupported(*at, what, "; write it twice"))
            }
        }
    }

    fn lights(&mut self, root: &Params<'d>) -> Result<Vec<Light>> {
        let mut lights: Vec<Light> = Vec::new();
        for (id, at) in self.distinct(root, Category::Emitter)? {
            // An area light among the scene's own children is there to be referred to.
            if self.document.objects[id].plugin == "area" {
                continue;
            }
            let light = plugins::emitter::light(self, id)?;
            let is_sky = |l: &Light| matches!(l.kind, LightKind::Constant { .. } | LightKind::Environment { .. });
            if is_sky(&light) && lights.iter().any(is_sky) {
                return Err(self.document.sources.error(at, "a scene can have only one environment emitter"));
            }
            lights.push(light);
        }
        Ok(lights)
    }

    /// Objects that nothing uses are not interpreted, but their plugins must exist.
    fn check_unused(&self, root: &Params<'d>) -> Result<()> {
        use Category::{Bsdf, Film, Medium, Phase, Rfilter, Sampler, Texture, Volume};
        for category in [Bsdf, Texture, Film, Sampler, Rfilter, Medium, Phase, Volume] {
            root.children(category);
        }
        for id in 1..self.document.objects.len() {
            plugins::check_known(self.document, id)?;
        }
        Ok(())
    }
}
