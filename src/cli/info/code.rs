//! What of a scene the code that renders it depends on, and what it is spared.

use crate::description::{Integrator, IntegratorKind};
use crate::integrator::variant::needs;
use crate::scene::{Features, Scene};

/// Something that not every scene has, and what is not done where it is not there.
struct Fact {
    name: &'static str,
    is_there: bool,
    /// Empty where a scene without it is only another scene.
    spared: &'static str,
}

/// All of them.
fn all(f: Features) -> [Fact; 15] {
    let fact = |name, is_there, spared| Fact { name, is_there, spared };
    [
        fact("vertex normals", f.vertex_normals, "a triangle's normal is that of its plane, nothing is interpolated"),
        fact("delta lobes", f.delta_lobes, ""),
        fact("transmission", f.transmission, "lights are chosen for one side of every surface"),
        fact("volumes", f.volumes, "paths are inside of nothing, no exponentials"),
        fact("anisotropy", f.anisotropy, "no tangents are kept or looked up"),
        fact(
            "varying materials",
            f.varying_materials > 0,
            "every bsdf is ready before the render: no layers, no texture coordinates, nothing looked up ahead",
        ),
        fact("masks", f.masks, "no layer lets light straight through"),
        fact("several lights", f.lights() > 1, "no choice, one uniform number less at a vertex"),
        fact("a sky", f.infinite_lights > 0, "what meets nothing ends"),
        fact(
            "lights with size",
            f.lights() > f.lights_without_size(),
            "no path can run into a light: nothing is weighed against that",
        ),
        fact("lights without size", f.lights_without_size() > 0, ""),
        fact("instances", f.instances > 0, "no second tree, no ray is moved to another space"),
        fact("quadrics", f.quadrics > 0, "no tree beside that of the triangles"),
        fact("triangles", f.triangles > 0, "no tree beside that of the quadrics"),
        fact("a lens", f.lens, "two uniform numbers less a path"),
    ]
}

/// All that is to be said, each thing with its name.
pub(super) fn lines(scene: &Scene, integrator: &Integrator) -> Vec<(&'static str, String)> {
    let mut lines = Vec::from(facts(scene.features));
    lines.extend(saved(scene.features).into_iter().map(|saved| ("saved", saved)));
    lines.push(("code", variant(scene, integrator)));
    lines
}

/// What the scene has of what not every scene has, and what it has not.
fn facts(f: Features) -> [(&'static str, String); 2] {
    let names = |there: bool| {
        let names: Vec<&str> = all(f).iter().filter(|fact| fact.is_there == there).map(|fact| fact.name).collect();
        names.join(", ")
    };
    [("has", names(true)), ("has no", names(false))]
}

/// What the render does not do, a line for each thing that the scene lacks.
fn saved(f: Features) -> Vec<String> {
    let missing = all(f).into_iter().filter(|fact| !fact.is_there && !fact.spared.is_empty());
    missing.map(|fact| format!("without {}: {}", fact.name, fact.spared)).collect()
}

/// Which of the compiled variants of the loop over paths renders the scene as its file says.
fn variant(scene: &Scene, integrator: &Integrator) -> String {
    let technique = match integrator.kind {
        IntegratorKind::Path | IntegratorKind::Direct => "path",
    };
    let beside = if integrator.aovs.is_empty() && !scene.film.pixel_format.has_alpha() {
        "nothing beside radiance"
    } else {
        "quantities beside radiance"
    };
    let (any_materials, any_lights) = needs(scene);
    let materials = if any_materials { "any" } else { "plain" };
    let lights = if any_lights { "any lights" } else { "one lamp at most" };
    let looks = if scene.looks_ahead() { "hits looked at ahead" } else { "hits looked at one by one" };
    let simd = crate::math::simd::name(crate::math::simd::level());
    format!(
        "estimator {technique} for {materials} materials and {lights}, {beside}, {looks}, vector instructions {simd}"
    )
}
