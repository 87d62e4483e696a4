//! The same picture every time: for any number of threads, for both accelerators, at any power-of-two scale.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;
mod desk;

use common::*;
use desk::Desk;
use glam::{DAffine3, DMat3, DVec3};
use snell::accel::{Accelerator, Quality};
use snell::description::Filter;
use snell::description::{Geometry, SceneDescription};
use snell::image::read_picture;
use snell::integrator::Estimator;
use snell::scene::compile::{CompileOptions, compile};

const SCENES: [&str; 3] =
    ["scenes/cornell-box/scene.xml", "scenes/cornell-box-materials/scene.xml", "scenes/furnace/scene.xml"];

#[test]
fn threads_change_no_bit() {
    for path in SCENES {
        let description = load(path, &[("res", "70")]);
        for accelerator in accelerators() {
            let scene = compiled(&description, accelerator);
            let s = file_settings(&description, Estimator::Path, 20);
            let one = rendered(&scene, &s, 1).film.develop();
            for threads in [2, 7] {
                assert_eq!(
                    one,
                    rendered(&scene, &s, threads).film.develop(),
                    "{path}, {accelerator:?}, {threads} threads"
                );
            }
        }
    }
}

/// However a tree is built, each primitive has one distance.
#[test]
fn how_a_tree_is_built_changes_no_bit() {
    let description = load("scenes/shelf/scene.xml", &[("res", "48")]);
    let s = file_settings(&description, Estimator::Path, 8);
    for accelerator in accelerators() {
        let [low, medium, high] = [Quality::Low, Quality::Medium, Quality::High].map(|quality| {
            let options =
                CompileOptions { accelerator, quality: Some(quality), threads: 2, camera: 0, samples: Some(8) };
            picture(&compile(&description, &options).unwrap().scene, &s)
        });
        assert!(low == medium && low == high, "{accelerator:?}");
    }
}

/// Lists, trees, skies and many lights by each of the vector instructions that there are, as the environment asks for them.
#[test]
fn vector_instructions_change_no_bit() {
    for scene in ["cornell-box", "shelf", "many-lights", "layers"] {
        let (desk, file) = (Desk::new(), project(&format!("scenes/{scene}/scene.xml")));
        let mut first = None;
        for level in ["sse2", "sse4.2", "avx2", "avx512"] {
            let mut command = desk.command();
            command.env("SNELL_SIMD", level).arg("render").arg(&file).args([
                "--size=40x40",
                "--spp=4",
                "-q",
                "-o=p.exr",
            ]);
            let output = command.output().unwrap();
            let error = String::from_utf8_lossy(&output.stderr);
            if error.contains(&format!("error: SNELL_SIMD is '{level}', but here there is only ")) {
                // This processor does not have it.
                continue;
            }
            assert!(output.status.success(), "{scene}, {level}: {error}");
            let picture = read_picture(&desk.path("p.exr")).unwrap().picture;
            assert!(*first.get_or_insert_with(|| picture.clone()) == picture, "{scene}, {level}");
        }
        assert!(first.is_some() || !cfg!(target_arch = "x86_64"));
    }
}

/// With a filter, tiles write into each other; and with a border of samples a crop is still a part of the whole.
#[test]
fn threads_and_crops_change_no_bit_under_a_filter() {
    let crop = snell::image::Crop { x: 3, y: 30, width: 21, height: 18 };
    for filter in [Filter::DEFAULT, Filter::Lanczos { lobes: 3 }] {
        let mut description = load(SCENES[1], &[("res", "48")]);
        let film = &mut description.cameras[0].film;
        (film.filter, film.sample_border) = (filter, true);
        let s = file_settings(&description, Estimator::Path, 20);
        let scene = compiled(&description, Accelerator::Native);
        let whole = rendered(&scene, &s, 1).film.develop();
        for threads in [2, 7] {
            assert_eq!(whole, rendered(&scene, &s, threads).film.develop(), "{filter:?}, {threads} threads");
        }
        description.cameras[0].film.crop = crop;
        let part = picture(&compiled(&description, Accelerator::Native), &s);
        for (x, y) in (0..crop.height).flat_map(|y| (0..crop.width).map(move |x| (x, y))) {
            assert_eq!(part.get(x, y), whole.get(x + crop.x, y + crop.y), "{filter:?}, pixel {x}, {y} of the crop");
        }
    }
}

/// Every length of the Cornell boxes times 2^±40: geometry, camera, clip planes.
#[test]
fn powers_of_two_change_no_bit() {
    for path in SCENES {
        for accelerator in accelerators() {
            let description = load(path, &[("res", "48")]);
            let s = file_settings(&description, Estimator::Path, 8);
            let base = picture(&compiled(&description, accelerator), &s);
            for exponent in [-40, -3, 40] {
                let scaled = transformed(description.clone(), 2f64.powi(exponent), DVec3::ZERO);
                assert_eq!(
                    base,
                    picture(&compiled(&scaled, accelerator), &s),
                    "{path} × 2^{exponent}, {accelerator:?}"
                );
            }
        }
    }
}

/// A point light among quadrics: every length times 2^k, its intensity times 4^k.
#[test]
fn powers_of_two_change_no_bit_of_what_a_point_light_shows() {
    let description = lit_by_a_point();
    for accelerator in accelerators() {
        let s = settings(Estimator::Path, 8);
        let base = picture(&compiled(&description, accelerator), &s);
        assert!(mean(&base) > 1e-2, "there is light");
        for exponent in [-40, -3, 40] {
            let scaled = transformed(description.clone(), 2f64.powi(exponent), DVec3::ZERO);
            assert_eq!(base, picture(&compiled(&scaled, accelerator), &s), "2^{exponent}, {accelerator:?}");
        }
    }
}

/// The other lights of the scene's own: a spot, whose intensity grows by 4^k, too, and what shines from infinity.
#[test]
fn powers_of_two_change_no_bit_of_what_other_lights_show() {
    let description = lit_from_everywhere();
    for accelerator in accelerators() {
        let s = settings(Estimator::Path, 8);
        let scene = compiled(&description, accelerator);
        let base = rendered(&scene, &s, 1).film.develop();
        assert!(mean(&base) > 1e-2, "there is light");
        for threads in [2, 7] {
            assert_eq!(base, rendered(&scene, &s, threads).film.develop(), "{accelerator:?}, {threads} threads");
        }
        for exponent in [-40, -3, 40] {
            let scaled = transformed(description.clone(), 2f64.powi(exponent), DVec3::ZERO);
            assert_eq!(base, picture(&compiled(&scaled, accelerator), &s), "2^{exponent}, {accelerator:?}");
        }
    }
}

/// A sphere above a floor under a map, a spot and parallel light.
fn lit_from_everywhere() -> SceneDescription {
    use snell::description::{Emission, FieldOfView, FovAxis, LightKind, SpotTexture, TextureId};
    use snell::spectrum::Rgb;
    let ball = Geometry::Sphere { centre: DVec3::new(-0.3, 0.2, 0.4), radius: 0.3, frame: DMat3::IDENTITY };
    let mut shapes = vec![
        shape(ball, DAffine3::IDENTITY, 0, None),
        shape(Geometry::Rectangle, DAffine3::from_scale(DVec3::splat(1.5)), 0, None),
        shape(
            Geometry::Rectangle,
            DAffine3::from_scale_rotation_translation(
                DVec3::splat(0.2),
                glam::DQuat::from_rotation_y(1.0),
                DVec3::new(0.5, 0.5, 0.5),
            ),
            0,
            None,
        ),
    ];
    let radiance = Rgb::new(0.5, 1.0, 2.0);
    shapes[0].emission = Some(Emission { radiance, texture: Some(TextureId(0)), both_sides: false });
    shapes[2].emission = Some(Emission { radiance, texture: Some(TextureId(1)), both_sides: true });
    let textures = vec![
        picture_texture(5, 3, |x, y| Rgb::new(1.0, (x % 2) as f32, (y % 2) as f32)),
        picture_texture(2, 2, |x, y| Rgb::new(x as f32, y as f32, 1.0)),
    ];
    let to_world = glam::DMat3::from_axis_angle(DVec3::new(0.6, 0.8, 0.0), 1.0);
    let lights = vec![
        light(LightKind::Environment {
            map: map(16, 8, |x, y| Rgb::new(0.1, (x % 3) as f32, (y % 2) as f32)),
            scale: 0.2,
            to_world,
            mis_compensation: true,
        }),
        light(LightKind::Spot {
            position: DVec3::new(0.2, -0.1, 0.9),
            direction: DVec3::new(-0.4, 0.3, -1.0),
            intensity: Rgb::new(1.0, 2.0, 3.0),
            cutoff_angle: 40.0,
            beam_width: 10.0,
            texture: Some(SpotTexture { texture: TextureId(1), across: [DVec3::X, DVec3::new(0.0, 1.0, 0.3)] }),
        }),
        light(LightKind::Projector {
            texture: TextureId(0),
            scale: 0.5,
            to_world: camera(DVec3::new(-0.5, 0.4, 1.0), DVec3::ZERO, 90.0, 1).to_world,
            fov: FieldOfView { degrees: 70.0, axis: FovAxis::Smaller },
        }),
        light(LightKind::Directional { direction: DVec3::new(0.3, 0.2, -1.0), irradiance: Rgb::new(3.0, 2.0, 1.0) }),
    ];
    SceneDescription { shapes, lights, textures, ..enclosure(0.5, 0.0) }
}

/// A point light has one way to be found: `path` and `nee` show the same bits, the others nothing.
/// Textures of every kind on every shape, in blends, under masks, as normals and heights.
#[test]
fn threads_and_powers_of_two_change_no_bit_of_textures() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::from_fn(5, 3, |x, y| image::Rgb([40 * x as u8, 90 * y as u8, 128]))
        .save(folder.path().join("p.png"))
        .unwrap();
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, TEXTURED).unwrap();
    let description = snell::loader::load(&path, &snell::loader::LoadOptions::default()).unwrap();
    let s = file_settings(&description, Estimator::Path, 8);
    for accelerator in accelerators() {
        let picture = |description: &SceneDescription, threads| {
            rendered(&compiled(description, accelerator), &s, threads).film.develop()
        };
        let base = picture(&description, 1);
        assert!(mean(&base) > 0.05, "something is to be seen");
        assert_eq!(base, picture(&description, 3));
        for exponent in [-40, 40] {
            let scaled = transformed(description.clone(), 2f64.powi(exponent), DVec3::ZERO);
            assert_eq!(base, picture(&scaled, 2), "2^{exponent}, {accelerator:?}");
        }
    }
}

const TEXTURED: &str = r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="5"/></integrator>
    <sensor type="perspective"><float name="fov" value="50"/>
        <transform name="to_world"><lookat origin="0, 2, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="48"/>
            <rfilter type="box"/></film>
    </sensor>
    <emitter type="constant"/>
    <texture type="bitmap" id="picture"><string name="filename" value="p.png"/></texture>
    <texture type="bitmap" id="raw"><string name="filename" value="p.png"/><boolean name="raw" value="true"/>
        <string name="wrap_mode" value="mirror"/><transform name="to_uv"><scale value="3"/></transform></texture>
    <texture type="checkerboard" id="board"><transform name="to_uv"><scale value="8"/></transform></texture>
    <shape type="rectangle">
        <transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/><translate y="-1"/></transform>
        <bsdf type="twosided"><bsdf type="bumpmap"><ref id="raw"/><float name="scale" value="0.25"/>
            <bsdf type="diffuse"><ref name="reflectance" id="board"/></bsdf></bsdf></bsdf>
    </shape>
    <shape type="sphere"><point name="center" x="-1.5" y="0" z="0"/><float name="radius" value="0.75"/>
        <bsdf type="blendbsdf"><ref name="weight" id="board"/>
            <bsdf type="diffuse"><ref name="reflectance" id="picture"/></bsdf>
            <bsdf type="roughconductor"><ref name="alpha_u" id="raw"/><float name="alpha_v" value="0.3"/></bsdf></bsdf>
    </shape>
    <shape type="cylinder"><point name="p0" x="0" y="-0.75" z="0"/><point name="p1" x="0" y="0.75" z="0"/>
        <float name="radius" value="0.5"/>
        <bsdf type="mask"><ref name="opacity" id="board"/>
            <bsdf type="twosided"><bsdf type="diffuse"><ref name="reflectance" id="picture"/></bsdf></bsdf></bsdf>
    </shape>
    <shape type="disk"><transform name="to_world"><scale value="0.75"/><translate x="1.5"/></transform>
        <bsdf type="normalmap"><ref name="normalmap" id="raw"/>
            <bsdf type="roughplastic"><ref name="diffuse_reflectance" id="picture"/></bsdf></bsdf>
    </shape>
    <shape type="cube"><transform name="to_world"><scale value="0.25"/><translate y="1.25"/></transform>
        <bsdf type="principled"><ref name="base_color" id="picture"/><ref name="roughness" id="raw"/></bsdf>
    </shape>
</scene>"#;

#[test]
fn only_light_sampling_finds_a_point_light() {
    let scene = compiled(&lit_by_a_point(), Accelerator::Auto);
    let [path, nee, bsdf, naive] = [Estimator::Path, Estimator::Nee, Estimator::Bsdf, Estimator::Naive]
        .map(|estimator| picture(&scene, &settings(estimator, 4)));
    assert_eq!(path, nee);
    assert!(mean(&bsdf) == 0.0 && mean(&naive) == 0.0);
}

/// The inside of a closed cylinder with a disk and a sphere in it, lit by a point.
fn lit_by_a_point() -> SceneDescription {
    let mut shapes = closed_cylinder(DAffine3::from_scale(DVec3::new(1.5, 1.2, 1.4)), None);
    shapes.push(shape(
        Geometry::Sphere { centre: DVec3::new(-0.6, 0.2, -0.4), radius: 0.3, frame: DMat3::IDENTITY },
        DAffine3::IDENTITY,
        0,
        None,
    ));
    shapes.push(shape(Geometry::Disk, DAffine3::from_scale(DVec3::splat(0.2)), 0, None));
    let lights = vec![point_light(DVec3::new(0.2, -0.1, 0.9), snell::spectrum::Rgb::new(1.0, 2.0, 3.0))];
    SceneDescription { shapes, lights, ..enclosure(0.5, 0.0) }
}

/// A part of the picture is the same bits as that part of the whole.
#[test]
fn a_crop_is_a_part_of_the_whole() {
    let mut description = load(SCENES[1], &[("res", "64")]);
    let s = file_settings(&description, Estimator::Path, 4);
    let whole = picture(&compiled(&description, Accelerator::Native), &s);
    let crop = snell::image::Crop { x: 13, y: 30, width: 21, height: 19 };
    description.cameras[0].film.crop = crop;
    let part = picture(&compiled(&description, Accelerator::Native), &s);
    for y in 0..crop.height {
        for x in 0..crop.width {
            assert_eq!(part.get(x, y), whole.get(x + crop.x, y + crop.y), "pixel {x}, {y} of the crop");
        }
    }
}

/// Native and Embree differ only where a ray had a tie, or where Embree lost a hit that the oracle confirms; every ray of
/// renders of every own scene is counted.
#[cfg(feature = "embree")]
#[test]
fn accelerators_differ_only_by_ties_and_confirmed_misses() {
    for Reference { name, .. } in &REFERENCES {
        let scratch = tempfile::tempdir().unwrap();
        let description = load_scene(name, 32, scratch.path());
        let s = file_settings(&description, Estimator::Path, 32);
        let both = compiled(&description, Accelerator::Both);
        let rays = rendered(&both, &s, 2).rays.total();
        let counts = both.accel.comparison().expect("both are compared");
        println!("{name}: {rays} rays: {counts:?}");
        let unexplained = counts.native_misses + counts.native_false + counts.embree_false;
        assert_eq!(unexplained, 0, "{name}: {counts:?}");
        let explained = counts.ties + counts.edges + counts.embree_misses;
        let [native, embree] =
            [Accelerator::Native, Accelerator::Embree].map(|a| picture(&compiled(&description, a), &s));
        let different = native.pixels().iter().zip(embree.pixels()).filter(|(a, b)| a != b).count() as u64;
        println!("{name}: {different} pixels differ");
        assert!(different <= explained, "{name}: {different} pixels differ, {counts:?}");
    }
}
