//! Files for Mitsuba 0.6: what they mean, and what is said of what they lose.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

use glam::DVec2;
use snell::description::{SceneDescription, TextureKind};
use snell::loader::{LoadOptions, load};

fn loaded(inside: &str) -> Result<SceneDescription, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    image::RgbImage::new(2, 2).save(folder.path().join("p.png")).unwrap();
    std::fs::write(&path, format!(r#"<scene version="0.5.0">{inside}</scene>"#)).unwrap();
    load(&path, &LoadOptions::default()).map_err(|e| e.to_string())
}

const SENSOR: &str = r#"<sensor type="perspective"><film type="hdrfilm"/></sensor>"#;

#[test]
fn films_and_samplers_that_are_no_more() {
    let scene = loaded(
        r#"<sensor type="perspective">
            <sampler type="sobol"><integer name="sampleCount" value="7"/><integer name="scramble" value="1"/></sampler>
            <film type="ldrfilm"><integer name="width" value="40"/><integer name="height" value="30"/>
                <string name="fileFormat" value="png"/><float name="gamma" value="2.2"/><float name="exposure" value="1"/>
                <boolean name="highQualityEdges" value="true"/><rfilter type="tent"/></film></sensor>"#,
    )
    .unwrap();
    let camera = &scene.cameras[0];
    assert_eq!((camera.film.width, camera.film.height, camera.film.sample_border), (40, 30, true));
    assert_eq!(camera.sampler.sample_count, 7);
    let expected = "the film 'ldrfilm' of Mitsuba 0.6 is taken for 'hdrfilm': the picture is not tone-mapped";
    assert!(scene.warnings.len() == 1 && scene.warnings[0].ends_with(expected), "{:?}", scene.warnings);
}

/// Mitsuba 3 makes scale · translate of offset and scale: u becomes uscale·(u + uoffset).
#[test]
fn textures_with_offsets_and_filters_of_their_own() {
    let scene = loaded(&format!(
        r#"{SENSOR}<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">
            <float name="uoffset" value="0.5"/><float name="uscale" value="20"/><float name="vscale" value="80"/>
            </texture></bsdf></shape>
        <shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
            <string name="filename" value="p.png"/><string name="filterType" value="trilinear"/>
            <float name="maxAnisotropy" value="20"/></texture></bsdf></shape>"#
    ))
    .unwrap();
    let board = scene.textures.iter().find(|t| matches!(t.kind, TextureKind::Checkerboard { .. })).unwrap();
    assert_eq!(board.to_uv.transform_point2(DVec2::new(0.25, 0.5)), DVec2::new(15.0, 40.0));
    assert!(scene.textures.iter().any(|t| matches!(t.kind, TextureKind::Bitmap { bilinear: true, .. })));
    let expected = "the filter 'trilinear' of Mitsuba 0.6 is taken for 'bilinear'";
    assert!(scene.warnings.len() == 1 && scene.warnings[0].ends_with(expected), "{:?}", scene.warnings);
}

#[test]
fn what_is_around_a_metal_must_be_nothing() {
    let metal = |ior: &str| {
        loaded(&format!(
            r#"{SENSOR}<shape type="sphere"><bsdf type="roughconductor"><float name="extEta" value="{ior}"/>
            </bsdf></shape>"#
        ))
    };
    assert!(metal("1").unwrap().warnings.is_empty());
    assert!(metal("1.3").unwrap_err().contains("has no parameter 'ext_eta'"));
}
