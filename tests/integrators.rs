//! All estimators converge to the same picture.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use snell::accel::Accelerator;
use snell::description::{BsdfKind, Light, LightKind, SceneDescription};
use snell::integrator::{Estimator, PathReuse};
use snell::sampler::SamplerKind;

/// Width and height of the pictures.
const RES: u32 = 32;

/// Pictures of each estimator.
const SEEDS: u64 = 32;

/// An own scene, and what it takes for `path` to see it.
struct Row {
    name: &'static str,
    /// Samples per pixel and seed.
    samples: u32,
}

const ROWS: [Row; 11] = [
    Row { name: "caustic", samples: 32 },
    Row { name: "cornell-box", samples: 16 },
    Row { name: "cornell-box-materials", samples: 32 },
    Row { name: "enclosure", samples: 16 },
    Row { name: "furnace", samples: 16 },
    Row { name: "glass", samples: 32 },
    Row { name: "layers", samples: 32 },
    Row { name: "many-lights", samples: 16 },
    Row { name: "million", samples: 16 },
    Row { name: "plates", samples: 32 },
    Row { name: "shelf", samples: 32 },
];

/// The least roughness that uniform directions are asked to find. A lobe of roughness α is met by one direction in 1/α²,
/// which then counts 1/α² times as much, refraction narrows it by another η²/(η − 1)² ≈ 9, and the factors of a path's
/// vertices multiply: with the glass scene's own 0.1 and 0.3, or its 16 segments, one path in millions carries a good part
/// of a tile's light, and 32 pictures say nothing of the mean or its error.
const BROAD: f64 = 1.0;

/// Segments for the same reason: in, out, and to the light from the second surface.
const FEW_SEGMENTS: u32 = 4;

/// Hypothesis: the expectation of every tile (8×8 pixels) and of the whole picture is that of `path`; estimators other than
/// `path` take twice its samples. z follows Student's t with 31 to 62 degrees of freedom: |t₃₁| > 6.5 has probability
/// 3·10⁻⁷, in one of 16 tiles 5·10⁻⁶; |t₃₁| > 5.5 for the whole has 5·10⁻⁶. With three comparisons a scene the false-alarm
/// rate of all is below 3·10⁻⁴. The seeds are fixed. With heavy tails (caustics) the normal law is an approximation, hence
/// the wide bounds. Estimators that do not sample lights are compared without the lights that have no size, which they
/// cannot find; uniform directions where no lobe is narrower than [`BROAD`], over [`FEW_SEGMENTS`].
#[test]
fn estimators_agree_with_path_on_every_scene() {
    for row in &ROWS {
        let scratch = tempfile::tempdir().unwrap();
        let mut description = load_scene(row.name, RES, scratch.path());
        let has_size = |light: &Light| matches!(light.kind, LightKind::Constant { .. } | LightKind::Environment { .. });
        if description.lights.iter().all(has_size) {
            agree(row, &description, &[Estimator::Nee, Estimator::Bsdf]);
        } else {
            agree(row, &description, &[Estimator::Nee]);
            description.lights.retain(has_size);
            agree(row, &description, &[Estimator::Bsdf]);
        }
        broaden(&mut description);
        agree(row, &description, &[Estimator::Naive]);
    }
}

fn broaden(description: &mut SceneDescription) {
    for bsdf in &mut description.bsdfs {
        match &mut bsdf.kind {
            BsdfKind::RoughConductor { facets, .. }
            | BsdfKind::RoughDielectric { facets, .. }
            | BsdfKind::RoughPlastic { facets, .. } => {
                facets.alpha_u = facets.alpha_u.max(BROAD);
                facets.alpha_v = facets.alpha_v.max(BROAD);
            }
            BsdfKind::Principled { shared, clearcoat, .. } => {
                shared.roughness = shared.roughness.max(BROAD);
                shared.anisotropic = 0.0;
                // Its roughness is at most 0.1.
                *clearcoat = 0.0;
            }
            BsdfKind::PrincipledThin { shared, .. } => shared.roughness = shared.roughness.max(BROAD),
            _ => {}
        }
    }
    let depth = description.integrator.max_depth.unwrap_or(u32::MAX);
    description.integrator.max_depth = Some(depth.min(FEW_SEGMENTS));
}

/// One estimate of `path` for all.
fn agree(row: &Row, description: &SceneDescription, estimators: &[Estimator]) {
    let scene = compiled(description, Accelerator::Auto);
    let estimate = |estimator, samples| Estimate::of(&scene, &file_settings(description, estimator, samples), SEEDS);
    let path = estimate(Estimator::Path, row.samples);
    for &estimator in estimators {
        let name = format!("{}, {estimator:?}", row.name);
        let worst = estimate(estimator, 2 * row.samples).worst_z_against(&path);
        println!("{name}: z {:.2}, worst tile {:.2}", worst.whole, worst.tile);
        assert!(worst.whole < 5.5, "{name} is off by {} standard errors", worst.whole);
        assert!(worst.tile < 6.5, "{name} is off by {} standard errors in a tile", worst.tile);
    }
}

/// Plastic, a pane and a ball of glass over a floor, under a sky of 16×8 pixels with a window 100 times as bright as the rest: where
/// `path` looks for the sky in mirrors, the others do not.
const GLINTS: &str = r#"<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 2, 6" target="0, 0.6, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
    <emitter type="envmap"><string name="filename" value="sky.hdr"/></emitter>
    <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="4"/></transform>
        <bsdf type="twosided"><bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf></bsdf></shape>
    <shape type="sphere"><point name="center" x="-0.9" y="0.7" z="0"/><float name="radius" value="0.7"/>
        <bsdf type="plastic"><float name="int_ior" value="1.9"/></bsdf></shape>
    <shape type="sphere"><point name="center" x="0.9" y="0.7" z="-0.4"/><float name="radius" value="0.7"/>
        <bsdf type="dielectric"/></shape>
    <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-50"/><scale value="0.6"/>
        <translate x="0" y="0.6" z="1.4"/></transform><bsdf type="thindielectric"/></shape></scene>"#;

/// A rough floor in a room with lamps behind what lets light through: a half transparent portal, a pane, a slab of glass, a mask and
/// a slab of hardly any contrast; and a dim sky, which is seen through all of them and by itself.
const WINDOWS: &str = r#"<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sensor type="perspective"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0, 3, 7" target="0, 0.6, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
    <emitter type="constant"><rgb name="radiance" value="0.1, 0.15, 0.2"/></emitter>
    <bsdf type="diffuse" id="black"><rgb name="reflectance" value="0"/></bsdf>
    <shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/></transform>
        <bsdf type="roughplastic"><float name="alpha" value="0.3"/><float name="int_ior" value="1.9"/></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="2"/><translate z="-3" y="2"/></transform>
        <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.6, 0.5, 0.4"/></bsdf></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="0.4"/><rotate y="1" angle="90"/><translate x="-3.6" y="1"/></transform>
        <ref id="black"/><emitter type="area"><rgb name="radiance" value="12, 9, 6"/></emitter></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="1"/><rotate y="1" angle="90"/><translate x="-2.6" y="1"/></transform>
        <bsdf type="blendbsdf"><float name="weight" value="0.5"/><bsdf type="dielectric"><float name="int_ior" value="1"/></bsdf>
            <ref id="black"/></bsdf></shape>
    <shape type="sphere"><point name="center" x="3.4" y="1.2" z="0"/><float name="radius" value="0.3"/>
        <emitter type="area"><rgb name="radiance" value="6, 9, 12"/></emitter></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="1.2"/><rotate y="1" angle="-70"/><translate x="2.6" y="1.2"/></transform>
        <bsdf type="thindielectric"/></shape>
    <shape type="disk"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="90"/><translate y="3.5" z="-0.5"/></transform>
        <emitter type="area"><rgb name="radiance" value="8"/></emitter></shape>
    <shape type="cube"><transform name="to_world"><scale x="1.5" y="0.1" z="1.5"/><rotate z="1" angle="15"/><translate y="2.3" z="-0.5"/></transform>
        <bsdf type="dielectric"/></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="0.7"/><rotate x="1" angle="-80"/><translate y="1.2" z="1"/></transform>
        <bsdf type="mask"><texture type="checkerboard" name="opacity"><transform name="to_uv"><scale value="2"/></transform></texture>
            <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf></shape>
    <shape type="cube"><transform name="to_world"><scale value="0.5"/><rotate y="1" angle="30"/><translate x="-1" y="0.6" z="1.5"/></transform>
        <bsdf type="dielectric"><float name="int_ior" value="1.005"/></bsdf></shape>
    </scene>"#;

/// As in [`estimators_agree_with_path_on_every_scene`]: four comparisons more, two of them with shared paths.
#[test]
fn estimators_agree_where_the_sky_is_seen_in_mirrors() {
    let folder = tempfile::tempdir().unwrap();
    let mut map = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n".to_vec();
    // 0.2, and above and to the left 20.
    map.extend(
        (0..128).flat_map(|i| if matches!(i, 36..=38 | 52..=54) { [160, 160, 160, 133] } else { [205, 205, 205, 126] }),
    );
    std::fs::write(folder.path().join("sky.hdr"), map).unwrap();
    all_agree(&Row { name: "glints", samples: 64 }, GLINTS, folder.path());
}

/// The same where light is sought through glass, by `path` and `nee`, but not by `bsdf`.
#[test]
fn estimators_agree_where_light_comes_through_glass() {
    let folder = tempfile::tempdir().unwrap();
    all_agree(&Row { name: "windows", samples: 64 }, WINDOWS, folder.path());
}

/// `path`, alone, with several light samples and with shared paths, `nee` and `bsdf` on this scene, which is written into `folder`.
fn all_agree(row: &Row, xml: &str, folder: &std::path::Path) {
    let file = folder.join("scene.xml");
    std::fs::write(&file, xml).unwrap();
    let description = snell::loader::load(&file, &snell::loader::LoadOptions::default()).unwrap();
    agree(row, &description, &[Estimator::Nee, Estimator::Bsdf]);
    let scene = compiled(&description, Accelerator::Auto);
    let alone = Estimate::of(&scene, &file_settings(&description, Estimator::Bsdf, 2 * row.samples), SEEDS);
    for (reuse, light_samples) in [(PathReuse::Eights, 1), (PathReuse::Blocks, 1), (PathReuse::Off, 4)] {
        let mut settings = file_settings(&description, Estimator::Path, row.samples);
        settings.integrator.reuse = reuse;
        settings.integrator.light_samples = light_samples;
        let worst = Estimate::of(&scene, &settings, SEEDS).worst_z_against(&alone);
        println!("{}, {reuse:?}, {light_samples}: z {:.2}, worst tile {:.2}", row.name, worst.whole, worst.tile);
        assert!(worst.whole < 5.5 && worst.tile < 6.5, "{reuse:?} is off by {} and {}", worst.whole, worst.tile);
    }
}

#[test]
fn every_scene_has_a_row() {
    let rows: Vec<&str> = ROWS.iter().map(|row| row.name).collect();
    let references: Vec<&str> = REFERENCES.iter().map(|row| row.name).collect();
    let mut folders: Vec<String> = std::fs::read_dir(project("scenes"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    folders.retain(|name| name != HEAVY_TAILED.name);
    folders.sort();
    assert_eq!(folders, rows);
    assert_eq!(folders, references);
}

/// The same for the samplers: pictures of each against those of independent numbers. 16 and 13 samples: `sobol` and
/// `stratified` take any number.
#[test]
fn samplers_agree() {
    let description = load("scenes/cornell-box-materials/scene.xml", &[("res", "32")]);
    let scene = compiled(&description, Accelerator::Auto);
    let settings = |kind, samples| {
        let mut settings = file_settings(&description, Estimator::Path, samples);
        settings.sampler.kind = kind;
        settings
    };
    let independent = Estimate::of(&scene, &settings(SamplerKind::Independent, 16), SEEDS);
    for (kind, samples) in [
        (SamplerKind::Sobol, 16),
        (SamplerKind::Sobol, 13),
        (SamplerKind::ZSobol { log_samples: 4 }, 16),
        (SamplerKind::Stratified { samples: 16 }, 16),
        (SamplerKind::Stratified { samples: 13 }, 13),
    ] {
        let worst = independent.worst_z_against(&Estimate::of(&scene, &settings(kind, samples), SEEDS));
        assert!(worst.whole < 5.5 && worst.tile < 6.5, "{kind:?}, {samples}: {worst:?}");
    }
}
