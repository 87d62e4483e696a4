//! Scene files as users write them: what is wrong is named with its place, what is right means what it means in Mitsuba.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "these are tests, and skipping is to be seen")]

use snell::accel::Accelerator;
use snell::description::{
    BsdfKind, ComponentFormat, Emission, FieldOfView, Filter, FovAxis, Geometry, IntegratorKind, LightKind, Parameter,
    Plastic, PrincipledShared, Projection, SceneDescription, TextureKind,
};
use snell::error::Result;
use snell::loader::{LoadOptions, load};
use snell::scene::compile::{CompileOptions, compile};
use snell::spectrum::Rgb;
use std::path::{Path, PathBuf};

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Writes a scene with a sensor into a folder of its own and loads it.
fn load_text(body: &str, options: &LoadOptions) -> Result<SceneDescription> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let sensor = r#"<sensor type="perspective"><film type="hdrfilm"><rfilter type="box"/></film></sensor>"#;
    std::fs::write(&path, format!(r#"<scene version="3.0.0">{sensor}{body}</scene>"#)).unwrap();
    load(&path, options)
}

fn scene(body: &str) -> SceneDescription {
    load_text(body, &LoadOptions::default()).unwrap()
}

fn assert_close(got: Rgb, want: [f32; 3]) {
    /// Mitsuba prints six digits, and computes in single precision.
    const TOLERANCE: f32 = 1e-5;
    for (g, w) in got.to_array().into_iter().zip(want) {
        assert!((g - w).abs() <= TOLERANCE * w.abs(), "{got:?}, Mitsuba has {want:?}");
    }
}

#[test]
fn every_bad_scene_is_an_error_with_the_expected_message() {
    let folder = repository().join("tests/data/bad");
    let (mut count, mut failures) = (0, Vec::new());
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "xml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let after = text.split("<!-- expect: ").nth(1);
        let expected = after.and_then(|t| t.split(" -->").next()).expect("every bad scene says what it expects");
        match load(&path, &LoadOptions::default()) {
            Ok(_) => failures.push(format!("{} was accepted", path.display())),
            Err(e) if e.to_string().contains(expected) => {}
            Err(e) => failures.push(format!("{e}\n    expected: {expected}")),
        }
        count += 1;
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
    assert!(count > 60, "only {count} bad scenes were found");
}

#[test]
fn files_that_are_not_scenes_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let garbage: [&[u8]; 5] = [b"", b"\0\0\0", b"\xff\xfe<\0", b"<scene version=\"3.0.0\">\xe9</scene>", b"<"];
    for (i, bytes) in garbage.into_iter().enumerate() {
        let path = folder.path().join(format!("{i}.xml"));
        std::fs::write(&path, bytes).unwrap();
        assert!(load(&path, &LoadOptions::default()).is_err(), "{i}");
    }
    assert!(load(folder.path(), &LoadOptions::default()).is_err(), "a folder");
    assert!(load(&folder.path().join("none.xml"), &LoadOptions::default()).is_err(), "no file");
    let deep = folder.path().join("deep.xml");
    std::fs::write(&deep, format!("<scene version=\"3.0.0\">{}", "<bsdf type=\"twosided\">".repeat(200_000))).unwrap();
    assert!(load(&deep, &LoadOptions::default()).is_err(), "deep");
}

#[test]
fn every_prefix_of_a_scene_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let whole = std::fs::read(repository().join("tests/data/bad/unresolved-ref.xml")).unwrap();
    for end in 0..whole.len() {
        std::fs::write(&path, &whole[..end]).unwrap();
        assert!(load(&path, &LoadOptions::default()).is_err(), "{end}");
    }
}

/// Everything the loader knows, to be broken at random.
const RICH: &str = r##"<scene version="3.0.0"><default name="spp" value="16"/><path value="."/>
    <integrator type="direct"><boolean name="hide_emitters" value="true"/></integrator>
    <sensor type="perspective"><float name="fov" value="40"/><string name="fov_axis" value="smaller"/>
        <transform name="to_world"><lookat origin="1, 2, 3" target="0 0 0" up="0 1 0"/></transform>
        <sampler type="stratified"><integer name="sample_count" value="$spp"/></sampler>
        <film type="hdrfilm"><integer name="crop_width" value="7"/><rfilter type="box"/></film></sensor>
    <bsdf type="twosided" id="a"><bsdf type="roughconductor"><string name="material" value="Cu"/>
        <float name="alpha" value="0.2"/><string name="distribution" value="ggx"/></bsdf><ref id="b"/></bsdf>
    <bsdf type="diffuse" id="b"><spectrum name="reflectance" value="400:0.1, 600:0.7"/></bsdf>
    <bsdf type="dielectric" id="c"><string name="int_ior" value="water"/></bsdf><alias id="c" as="d"/>
    <shape type="obj"><string name="filename" value="m.obj"/><ref id="a"/><transform name="to_world">
        <rotate angle="30" y="1"/><scale value="2"/><matrix value="1 0 0 0 2 0 0 0 3"/></transform></shape>
    <shape type="ply"><string name="filename" value="m.ply"/><ref id="d"/></shape>
    <shape type="sphere"><point name="center" value="1 2 3"/><ref id="b"/>
        <emitter type="area"><rgb name="radiance" value="#ff8000"/></emitter></shape>
    <shape type="cylinder"><point name="p1" x="1" y="0" z="0"/><float name="radius" value="0.1"/></shape>
    <shape type="disk"><boolean name="flip_normals" value="true"/></shape><shape type="cube"/>
    <emitter type="point"><point name="position" value="1 2 3"/><rgb name="intensity" value="3"/></emitter>
    <emitter type="constant"><rgb name="radiance" value="1 2 3"/></emitter></scene>"##;
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf -1 -2 -3\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n";

/// Bytes to break files with.
const BREAKERS: &[u8] = b"<>/\"=-$#:.,9e0 \n\\\xff\0n";

fn broken(text: &str, random: &mut impl FnMut(usize) -> usize) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=random(3) {
        let at = random(bytes.len() - 1);
        match random(4) {
            0 => bytes[at] = BREAKERS[random(BREAKERS.len())],
            1 => bytes.insert(at, BREAKERS[random(BREAKERS.len())]),
            2 => drop(bytes.drain(at..(at + random(20)).min(bytes.len() - 2))),
            _ => {
                let piece = bytes[at..(at + random(60)).min(bytes.len())].to_vec();
                let to = random(bytes.len());
                bytes.splice(to..to, piece);
            }
        }
    }
    bytes
}

#[test]
fn broken_files_are_errors_or_scenes_but_never_panics() {
    const TRIALS: usize = 1500;
    let mut state = 1_u64;
    let mut random = |below: usize| {
        // Knuth, The Art of Computer Programming 2, 3.3.4: MMIX's generator.
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below.max(1)
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("m.obj", OBJ.as_bytes());
    write("m.ply", PLY.as_bytes());
    write("scene.xml", RICH.as_bytes());
    let whole = load(&path, &LoadOptions::default()).unwrap();
    assert_eq!((whole.shapes.len(), whole.lights.len()), (6, 2));
    for trial in 0..TRIALS {
        let (name, text) = [("scene.xml", RICH), ("m.obj", OBJ), ("m.ply", PLY)][trial % 3];
        write(name, &broken(text, &mut random));
        for lenient in [false, true] {
            let _ = load(&path, &LoadOptions { lenient, ..Default::default() });
        }
        write(name, text.as_bytes());
    }
}

#[test]
fn defaults_are_mitsuba_s() {
    let s = scene(r#"<shape type="sphere"/><shape type="rectangle"><emitter type="area"/></shape>"#);
    assert_eq!(s.integrator.kind, IntegratorKind::Path);
    assert_eq!((s.integrator.max_depth, s.integrator.rr_depth, s.integrator.hide_emitters), (None, 5, false));
    let camera = &s.cameras[0];
    assert_eq!(
        (camera.film.width, camera.film.height, camera.film.component_format),
        (768, 576, ComponentFormat::Half)
    );
    assert_eq!((camera.sampler.sample_count, camera.sampler.seed), (4, 0));
    assert_eq!((camera.near_clip, camera.far_clip), (0.01, 1e4));
    // Mitsuba prints x_fov = 38.1848 for this film: 4/5 of the tangent of the diagonal.
    let Projection::Perspective { fov, .. } = camera.projection else { panic!("{:?}", camera.projection) };
    assert_eq!(fov.axis, FovAxis::Diagonal);
    let x_fov = 2.0 * (0.8 * (fov.degrees.to_radians() / 2.0).tan()).atan().to_degrees();
    assert!((x_fov - 38.1848).abs() < 1e-4);
    let reflectance = |i: usize| match s.bsdfs[s.shapes[i].bsdf.0].kind {
        BsdfKind::Diffuse { reflectance } => reflectance,
        ref other => panic!("{other:?}"),
    };
    assert_eq!(reflectance(0), Rgb::splat(0.5));
    assert_eq!(reflectance(1), Rgb::BLACK);
    assert_eq!(s.shapes[1].emission, Some(Emission::uniform(Rgb::WHITE)));
}

#[test]
fn filters_have_mitsubas_parameters_and_defaults() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let film = |inside: &str| {
        let sensor = format!(r#"<sensor type="perspective">{inside}</sensor>"#);
        std::fs::write(&path, format!(r#"<scene version="3.0.0">{sensor}</scene>"#)).unwrap();
        load(&path, &LoadOptions::default()).unwrap().cameras[0].film.clone()
    };
    let filter = |inside: &str| film(&format!(r#"<film type="hdrfilm">{inside}</film>"#)).filter;
    let float = |name: &str, value: &str| format!(r#"<float name="{name}" value="{value}"/>"#);
    assert_eq!(film("").filter, Filter::Gaussian { stddev: 0.5 });
    assert_eq!(filter(""), Filter::Gaussian { stddev: 0.5 });
    let third = 1.0 / 3.0;
    for (plugin, parameters, expected) in [
        ("box", String::new(), Filter::Box),
        ("tent", String::new(), Filter::Tent { radius: 1.0 }),
        ("tent", float("radius", "2.5"), Filter::Tent { radius: 2.5 }),
        ("gaussian", String::new(), Filter::DEFAULT),
        ("gaussian", float("stddev", "0.25"), Filter::Gaussian { stddev: 0.25 }),
        ("mitchell", String::new(), Filter::Mitchell { b: third, c: third }),
        ("mitchell", float("B", "1") + &float("C", "-0.5"), Filter::Mitchell { b: 1.0, c: -0.5 }),
        ("catmullrom", String::new(), Filter::CatmullRom),
        ("lanczos", String::new(), Filter::Lanczos { lobes: 3 }),
        ("lanczos", r#"<integer name="lobes" value="2"/>"#.into(), Filter::Lanczos { lobes: 2 }),
    ] {
        assert_eq!(filter(&format!(r#"<rfilter type="{plugin}">{parameters}</rfilter>"#)), expected);
    }
    let inside = r#"<film type="hdrfilm"><boolean name="sample_border" value="true"/><boolean name="banner" value="false"/>
        <boolean name="compensate" value="true"/></film>"#;
    assert!(film(inside).sample_border && !film("").sample_border);
}

#[test]
fn layered_bsdfs_have_mitsubas_parameters_and_defaults() {
    let kind = |body: &str| {
        let s = scene(&format!(r#"<shape type="sphere"><bsdf {body}</bsdf></shape>"#));
        (s.bsdfs[0].kind.clone(), s.bsdfs[0].varying.iter().map(|v| v.0).collect::<Vec<_>>())
    };
    let grey = Rgb::splat(0.5);
    let BsdfKind::Plastic(plastic) = kind(r#"type="plastic">"#).0 else { panic!() };
    let air = 1.000277;
    let expected = Plastic {
        int_ior: 1.49,
        ext_ior: air,
        diffuse_reflectance: grey,
        specular_reflectance: Rgb::WHITE,
        nonlinear: false,
    };
    assert_eq!(plastic, expected);
    let BsdfKind::RoughPlastic { facets, plastic } = kind(r#"type="roughplastic">"#).0 else { panic!() };
    assert_eq!((facets.alpha_u, facets.alpha_v, plastic), (0.1, 0.1, expected));
    assert!(!facets.multiple_scattering);
    // Not one of Mitsuba's.
    let several = r#"<boolean name="multiple_scattering" value="true"/>"#;
    let BsdfKind::RoughDielectric { facets, .. } = kind(&format!(r#"type="roughdielectric">{several}"#)).0 else {
        panic!()
    };
    assert!(facets.multiple_scattering);
    let thin = kind(r#"type="thindielectric">"#).0;
    assert!(matches!(thin, BsdfKind::ThinDielectric { int_ior: 1.5046, ext_ior, .. } if ext_ior == air));
    let shared = |body: &str| match kind(body).0 {
        BsdfKind::Principled { shared, metallic: 0.0, clearcoat: 0.0, clearcoat_gloss: 0.0 } => shared,
        BsdfKind::PrincipledThin { shared, diff_trans: 0.0 } => shared,
        other => panic!("{other:?}"),
    };
    let zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for body in [r#"type="principled">"#, r#"type="principledthin">"#] {
        let PrincipledShared { base_color, roughness, eta, anisotropic, spec_trans, spec_tint, .. } = shared(body);
        let PrincipledShared { sheen, sheen_tint, flatness, .. } = shared(body);
        assert_eq!((base_color, roughness), (grey, 0.5));
        assert!((eta - 1.5).abs() < 1e-12, "{eta}");
        assert_eq!((anisotropic, spec_trans, spec_tint, sheen, sheen_tint, flatness), zero);
    }
    // What transmits needs an interface.
    let eta = |numbers: &str| shared(&format!(r#"type="principled">{numbers}"#)).eta;
    let (one, glass) = (r#"<float name="eta" value="1"/>"#, r#"<float name="spec_trans" value="1"/>"#);
    assert_eq!((eta(one), eta(&format!("{one}{glass}"))), (1.0, 1.001));
    let none = r#"<float name="specular" value="0"/>"#;
    assert!(eta(none) == 1.0 && eta(&format!("{none}{glass}")) > 1.01);
    // Sampling rates change nothing; textures vary.
    let (_, varying) = kind(
        r#"type="principled"><float name="clearcoat_sampling_rate" value="0"/>
        <texture type="checkerboard" name="metallic"/><texture type="checkerboard" name="base_color"/>"#,
    );
    assert!(varying.contains(&Parameter::Metallic) && varying.contains(&Parameter::BaseColor) && varying.len() == 2);
}

#[test]
fn colours_are_what_mitsuba_3_9_1_has() {
    let s = scene(
        r#"<emitter type="constant"><spectrum name="radiance" value="400:0, 500:8, 600:15.6, 700:18.4"/></emitter>
        <shape type="sphere"><bsdf type="diffuse">
            <spectrum name="reflectance" value="400:0.1, 500:0.9, 700:0.2"/></bsdf></shape>
        <shape type="sphere"><bsdf type="roughconductor"><string name="distribution" value="ggx"/>
            <string name="material" value="Au"/></bsdf>
            <emitter type="area"><spectrum name="radiance" value="2"/></emitter></shape>
        <shape type="sphere"><bsdf type="roughconductor"><string name="distribution" value="GGX"/>
            <spectrum name="eta" value="2"/><spectrum name="k" value="400:1,600:2,700:3"/></bsdf></shape>"#,
    );
    let LightKind::Constant { radiance } = s.lights[0].kind else { panic!() };
    assert_close(radiance, [20.7108, 10.8546, 2.77115]);
    let kind = |i: usize| &s.bsdfs[s.shapes[i].bsdf.0].kind;
    assert!(matches!(kind(0), BsdfKind::Diffuse { reflectance } if {
        assert_close(*reflectance, [0.367123, 0.793739, 0.508171]);
        true
    }));
    let BsdfKind::RoughConductor { facets, eta, k, .. } = kind(1) else { panic!() };
    assert_eq!((facets.alpha_u, facets.alpha_v), (0.1, 0.1));
    assert_close(*eta, [0.143036, 0.375307, 1.44205]);
    assert_close(*k, [3.983, 2.38556, 1.60336]);
    assert_close(s.shapes[1].emission.unwrap().radiance, [2.40959, 1.89658, 1.81783]);
    let BsdfKind::RoughConductor { eta, k, .. } = kind(2) else { panic!() };
    assert_close(*eta, [2.0; 3]);
    assert_close(*k, [2.30642, 1.70653, 1.19784]);
}

#[test]
fn plugins_may_stand_for_colours() {
    let s = scene(
        r#"<emitter type="constant"><texture name="radiance" type="d65"><rgb name="color" value="2 3 4"/>
            <float name="scale" value="2"/></texture></emitter>
        <shape type="sphere"><bsdf type="diffuse"><ref name="reflectance" id="grey"/></bsdf></shape>
        <spectrum type="uniform" id="grey"><float name="value" value="0.25"/></spectrum>
        <shape type="sphere"><bsdf type="diffuse"><spectrum name="reflectance" type="srgb">
            <rgb name="color" value="0.3 0.2 0.1"/></spectrum></bsdf></shape>"#,
    );
    assert_eq!(s.lights[0].kind, LightKind::Constant { radiance: Rgb::new(4.0, 6.0, 8.0) });
    assert_eq!(s.bsdfs[0].kind, BsdfKind::Diffuse { reflectance: Rgb::splat(0.25) });
    assert_eq!(s.bsdfs[1].kind, BsdfKind::Diffuse { reflectance: Rgb::new(0.3, 0.2, 0.1) });
}

#[test]
fn transformations_compose_as_in_mitsuba() {
    let s = scene(
        r#"<shape type="sphere"><transform name="to_world"><rotate angle="90" z="1"/><translate value="1 2 3"/>
            <scale value="2"/></transform></shape>
        <shape type="sphere"><point name="center" x="1" y="2" z="3"/><float name="radius" value="-2"/></shape>
        <shape type="rectangle"><transform name="to_world"><scale x="-1"/></transform></shape>"#,
    );
    let Geometry::Sphere { centre, radius, .. } = s.shapes[0].geometry else { panic!() };
    assert!(centre.abs_diff_eq(glam::DVec3::new(2.0, 4.0, 6.0), 1e-12) && (radius - 2.0).abs() < 1e-12);
    assert!(!s.shapes[0].flip_normals && s.shapes[1].flip_normals, "a negative radius turns a sphere inside out");
    let options =
        CompileOptions { accelerator: Accelerator::Native, quality: None, threads: 1, camera: 0, samples: None };
    let compiled = compile(&s, &options).unwrap().scene;
    let snell::shape::Shape::Mesh(mirrored) = &compiled.shapes[2] else { panic!() };
    assert_eq!(mirrored.plane(0).n, glam::Vec3::Z, "a mirrored rectangle keeps its normal");
}

#[test]
fn cubes_disks_cylinders_and_points() {
    let s = scene(
        r#"<shape type="cube"/><shape type="cube"><transform name="to_world"><scale x="-1"/></transform></shape>
        <shape type="disk"><boolean name="flip_normals" value="true"/></shape><shape type="cylinder"/>
        <shape type="cylinder"><point name="p0" value="1 2 3"/><point name="p1" x="4" y="0" z="0"/>
            <float name="radius" value="-2"/></shape>
        <emitter type="point"/><emitter type="point"><point name="position" value="1 2 3"/>
            <rgb name="intensity" value="1 2 3"/></emitter>
        <emitter type="point"><transform name="to_world"><translate x="5"/><scale value="2"/></transform></emitter>"#,
    );
    let Geometry::Mesh(cube) = &s.shapes[0].geometry else { panic!() };
    assert_eq!((cube.positions.len(), cube.normals.len(), cube.faces.len()), (24, 24, 12));
    let Geometry::Mesh(mirrored) = &s.shapes[1].geometry else { panic!() };
    assert_eq!((cube.faces[0], mirrored.faces[0]), ([0, 1, 2], [0, 2, 1]), "a mirrored cube is turned round");
    assert!(matches!(s.shapes[2].geometry, Geometry::Disk) && s.shapes[2].flip_normals);
    let cylinder = |i: usize| match s.shapes[i].geometry {
        Geometry::Cylinder { p0, p1, radius } => (p0, p1, radius),
        _ => panic!(),
    };
    let vector = glam::DVec3::new;
    assert_eq!(cylinder(3), (vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 1.0), 1.0));
    assert_eq!(cylinder(4), (vector(1.0, 2.0, 3.0), vector(4.0, 0.0, 0.0), 2.0));
    assert!(!s.shapes[4].flip_normals, "the sign of a cylinder's radius says nothing");
    let point = |position, intensity| LightKind::Point { position, intensity };
    assert_eq!(s.lights[0].kind, point(vector(0.0, 0.0, 0.0), Rgb::WHITE));
    assert_eq!(s.lights[1].kind, point(vector(1.0, 2.0, 3.0), Rgb::new(1.0, 2.0, 3.0)));
    assert_eq!(s.lights[2].kind, point(vector(10.0, 0.0, 0.0), Rgb::WHITE));
}

#[test]
fn spots_and_directional_lights() {
    let turned = r#"<transform name="to_world"><lookat origin="1 2 3" target="1 2 8" up="0 1 0"/><scale value="2"/></transform>"#;
    let s = scene(&format!(
        r#"<emitter type="spot"/>
        <emitter type="spot">{turned}<rgb name="intensity" value="1 2 3"/><float name="cutoff_angle" value="40"/></emitter>
        <emitter type="spot"><float name="beam_width" value="0"/><float name="sampling_weight" value="2"/></emitter>
        <emitter type="directional"/>
        <emitter type="directional"><vector name="direction" value="0 -3 0"/><rgb name="irradiance" value="4"/></emitter>
        <emitter type="directional">{turned}</emitter>"#,
    ));
    let vector = glam::DVec3::new;
    let (origin, up) = (vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 1.0));
    let spot = |position, intensity, cutoff_angle, beam_width| LightKind::Spot {
        position,
        direction: up,
        intensity,
        cutoff_angle,
        beam_width,
        texture: None,
    };
    let directional = |direction, irradiance| LightKind::Directional { direction, irradiance };
    let expected = [
        spot(origin, Rgb::WHITE, 20.0, 15.0),
        spot(vector(2.0, 4.0, 6.0), Rgb::new(1.0, 2.0, 3.0), 40.0, 30.0),
        spot(origin, Rgb::WHITE, 20.0, 0.0),
        directional(up, Rgb::WHITE),
        directional(vector(0.0, -1.0, 0.0), Rgb::splat(4.0)),
        directional(up, Rgb::WHITE),
    ];
    for (light, expected) in s.lights.iter().zip(&expected) {
        assert_eq!(&light.kind, expected);
    }
    assert_eq!(s.lights.len(), expected.len());
}

/// Files of two by three pixels, of values from 0 to 1 that 8 bits can tell, in every format that is read.
#[test]
fn environment_maps_of_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let bytes: Vec<u8> = (0..18).map(|i| 14 * i).collect();
    let eight = image::RgbImage::from_raw(2, 3, bytes.clone()).unwrap();
    let linear = |v: u8| snell::spectrum::srgb_to_linear(f64::from(v) / 255.0) as f32;
    let decoded: Vec<f32> = bytes.iter().map(|v| linear(*v)).collect();
    let float = image::Rgb32FImage::from_raw(2, 3, decoded.clone()).unwrap();
    let deep: Vec<u16> = bytes.iter().map(|v| u16::from(*v) * 257).collect();
    let deep = image::ImageBuffer::<image::Rgb<u16>, _>::from_raw(2, 3, deep).unwrap();
    let path = |name: &str| folder.path().join(name);
    eight.save(path("m.png")).unwrap();
    eight.save(path("m.bmp")).unwrap();
    eight.save(path("m.tga")).unwrap();
    // The coding of JPEG loses what such a small picture has between its pixels.
    image::RgbImage::from_pixel(2, 3, image::Rgb([200; 3])).save(path("m.jpg")).unwrap();
    deep.save(path("deep.png")).unwrap();
    image::RgbaImage::from_pixel(2, 3, image::Rgba([200, 200, 200, 7])).save(path("alpha.png")).unwrap();
    image::GrayImage::from_pixel(2, 3, image::Luma([200])).save(path("grey.png")).unwrap();
    float.save(path("m.hdr")).unwrap();
    // Another program's name in the first line.
    let text = std::fs::read(path("m.hdr")).unwrap();
    std::fs::write(path("other.hdr"), [b"#?RGBE", &text[b"#?RADIANCE".len()..]].concat()).unwrap();
    write_exr(&path("dot.exr"), 1, 1, |i| [0.1, 0.2, 0.3][i]);
    write_exr(&path("m.exr"), 2, 3, |i| decoded[i]);
    write_exr(&path("bright.exr"), 2, 3, |i| 1e5 * i as f32);
    let grey = [linear(200); 18];
    let bright: Vec<f32> = (0..18).map(|i| 1e5 * i as f32).collect();
    let one_part_in = |n: f32| 1.0 / n;
    for (name, expected, tolerance) in [
        ("m.exr", &decoded[..], 0.0),
        ("bright.exr", &bright[..], 0.0),
        ("m.png", &decoded[..], 0.0),
        ("m.bmp", &decoded[..], 0.0),
        ("m.tga", &decoded[..], 0.0),
        ("deep.png", &decoded[..], 0.0),
        ("alpha.png", &grey[..], 0.0),
        ("grey.png", &grey[..], 0.0),
        // One byte of a mantissa for the largest channel.
        ("m.hdr", &decoded[..], one_part_in(128.0)),
        ("other.hdr", &decoded[..], one_part_in(128.0)),
        ("m.jpg", &grey[..], one_part_in(64.0)),
        // Made larger.
        ("dot.exr", &[0.1, 0.2, 0.3].repeat(6)[..], 0.0),
    ] {
        let text = format!(
            r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"><rfilter type="box"/></film></sensor>
            <emitter type="envmap"><string name="filename" value="{name}"/><float name="scale" value="3"/>
            <boolean name="mis_compensation" value="true"/>
            <transform name="to_world"><rotate y="1" angle="90"/></transform></emitter></scene>"#
        );
        std::fs::write(path("scene.xml"), text).unwrap();
        let s = load(&path("scene.xml"), &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(s.warnings.is_empty(), "{:?}", s.warnings);
        let LightKind::Environment { map, scale, to_world, mis_compensation } = &s.lights[0].kind else { panic!() };
        assert_eq!((map.width(), map.height(), *scale, *mis_compensation), (2, 3, 3.0, true));
        assert!((*to_world * glam::DVec3::Z).abs_diff_eq(glam::DVec3::X, 1e-12));
        let values = map.pixels().iter().flat_map(|p| p.to_array());
        for (value, expected) in values.zip(expected) {
            assert!((value - expected).abs() <= tolerance, "{name}: {value}, but {expected}");
        }
    }
}

#[test]
fn projectors() {
    let folder = tempfile::tempdir().unwrap();
    image::GrayImage::from_pixel(5, 2, image::Luma([51])).save(folder.path().join("m.png")).unwrap();
    let bitmap = |inside: &str| {
        format!(r#"<texture name="irradiance" type="bitmap"><string name="filename" value="m.png"/>{inside}</texture>"#)
    };
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"><rfilter type="box"/></film></sensor>
        <emitter type="projector">{}</emitter>
        <emitter type="projector">{}<float name="scale" value="3"/><float name="fov" value="40"/>
            <string name="fov_axis" value="y"/><transform name="to_world"><translate x="5"/></transform></emitter></scene>"#,
        bitmap(""),
        bitmap(r#"<boolean name="raw" value="true"/>"#)
    );
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, text).unwrap();
    let s = load(&path, &LoadOptions::default()).unwrap();
    let projector = |i: usize| match &s.lights[i].kind {
        LightKind::Projector { texture, scale, to_world, fov } => {
            let TextureKind::Bitmap { image, .. } = &s.textures[texture.0].kind else { panic!() };
            assert_eq!((image.width(), image.height()), (5, 2));
            (image.colour(4, 1).0.x, *scale, to_world.translation.x, fov.degrees, fov.axis)
        }
        _ => panic!(),
    };
    let (value, scale, x, fov, axis) = projector(0);
    assert!((value - 0.033_104_77).abs() < 1e-7 && (fov - 46.793_003).abs() < 1e-4, "{value}, {fov}");
    assert_eq!((scale, x, axis), (1.0, 0.0, FovAxis::Diagonal));
    assert_eq!(projector(1), (0.2, 3.0, 5.0, 40.0, FovAxis::Y));
}

/// A picture with these values, channel by channel of each pixel.
fn write_exr(path: &Path, width: usize, height: usize, value: impl Fn(usize) -> f32 + Sync) {
    let at = |x: usize, y: usize, c: usize| value(3 * (y * width + x) + c);
    exr::prelude::write_rgb_file(path, width, height, |x, y| (at(x, y, 0), at(x, y, 1), at(x, y, 2))).unwrap();
}

#[test]
fn references_aliases_and_unused_objects() {
    let s = scene(
        r#"<shape type="sphere"><ref id="late"/></shape>
        <bsdf type="hair" id="unused"/>
        <bsdf type="diffuse" id="unused_too"><spectrum name="reflectance" filename="nowhere.spd"/></bsdf>
        <bsdf type="twosided" id="late"><bsdf type="twosided"><ref id="inner"/></bsdf></bsdf>
        <bsdf type="diffuse" id="inner"/><alias id="inner" as="other"/>
        <shape type="sphere" id="second"><ref name="bsdf" id="other"/><ref id="lamp"/></shape>
        <emitter type="area" id="lamp"><float name="sampling_weight" value="3"/></emitter>"#,
    );
    assert_eq!(s.bsdfs.len(), 3, "inner, the twosided around it, late");
    let BsdfKind::TwoSided { front, back } = s.bsdfs[s.shapes[0].bsdf.0].kind else { panic!() };
    assert_eq!((front, back), (s.shapes[1].bsdf, s.shapes[1].bsdf));
    assert_eq!(s.shapes[1].name, "second");
    assert!(s.shapes[1].emission.is_some() && s.lights.is_empty());
}

#[test]
fn definitions_replace_defaults_and_must_be_used() {
    let body = r#"<default name="r" value="2"/><shape type="sphere"><float name="radius" value="$r"/></shape>"#;
    let radius = |options: &LoadOptions| match load_text(body, options).unwrap().shapes[0].geometry {
        Geometry::Sphere { radius, .. } => radius,
        _ => panic!(),
    };
    let define = |name: &str| LoadOptions { defines: vec![(name.into(), "7".into())], ..Default::default() };
    assert_eq!(radius(&LoadOptions::default()), 2.0);
    assert_eq!(radius(&define("r")), 7.0);
    let unused = load_text(body, &define("x")).unwrap_err().to_string();
    assert_eq!(unused, "-D x=7: the scene has no such parameter; known: r");
}

#[test]
fn the_lenient_get_warnings() {
    let body = r#"<shape type="sphere" colour="red"><float name="raduis" value="1"/>
        <bsdf type="diffuse"><texture type="volume" name="reflectance"/></bsdf></shape>"#;
    assert!(load_text(body, &LoadOptions::default()).is_err());
    let s = load_text(body, &LoadOptions { lenient: true, ..Default::default() }).unwrap();
    assert_eq!(s.warnings.len(), 3, "{:#?}", s.warnings);
    assert!(load_text(r#"<shape type="sdfgrid"/>"#, &LoadOptions { lenient: true, ..Default::default() }).is_err());
}

#[test]
fn how_normals_are_sampled_is_ours_to_choose() {
    let s = scene(
        r#"<shape type="sphere"><bsdf type="roughdielectric"><boolean name="sample_visible" value="false"/></bsdf></shape>
        <shape type="sphere"><bsdf type="roughconductor"><boolean name="sample_visible" value="true"/></bsdf></shape>"#,
    );
    assert_eq!(s.warnings.len(), 1, "{:#?}", s.warnings);
    assert!(s.warnings[0].contains("visible normals are sampled all the same"), "{:#?}", s.warnings);
}

#[test]
fn names_of_mitsuba_0_6_are_understood() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.xml");
    let text = r#"<scene version="0.6.0"><integrator type="path"><integer name="maxDepth" value="3"/></integrator>
        <sensor type="perspective"><string name="fovAxis" value="smaller"/><float name="fov" value="40"/>
            <transform name="toWorld"><lookAt origin="0 0 -5" target="0 0 0" up="0 1 0"/></transform>
            <film type="hdrfilm"><string name="pixelFormat" value="rgb"/><rfilter type="box"/></film></sensor></scene>"#;
    std::fs::write(&path, text).unwrap();
    let s = load(&path, &LoadOptions::default()).unwrap();
    assert_eq!(s.integrator.max_depth, Some(3));
    let fov = FieldOfView { degrees: 40.0, axis: FovAxis::Smaller };
    assert_eq!(s.cameras[0].projection, Projection::Perspective { fov, principal_point_offset: (0.0, 0.0) });
    std::fs::write(&path, text.replace("0.6.0", "3.0.0")).unwrap();
    assert!(load(&path, &LoadOptions::default()).is_err(), "but only in files that say so");
}

#[test]
fn included_files_and_search_paths_and_shared_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    };
    write("meshes/lamp.spd", "# nm, radiance\n400 1\n600 2\n700 3\n");
    write("meshes/t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n");
    write("fragments/bsdf.xml", r#"<bsdf version="3.0.0" type="diffuse" id="m"/>"#);
    let shape = |inside: &str| format!(r#"<shape type="obj"><string name="filename" value="t.obj"/>{inside}</shape>"#);
    let shapes = format!(
        r#"<scene version="3.0.0"><include filename="bsdf.xml"/>{}{}{}</scene>"#,
        shape(r#"<ref id="m"/>"#),
        shape(r#"<transform name="to_world"><scale x="2"/></transform>"#),
        shape(r#"<boolean name="face_normals" value="true"/>"#),
    );
    write("fragments/shapes.xml", &shapes);
    let main = r#"<scene version="3.0.0"><path value="meshes"/><include filename="fragments/shapes.xml"/>
        <emitter type="constant"><spectrum name="radiance" filename="lamp.spd"/></emitter>
        <sensor type="perspective"><film type="hdrfilm"><rfilter type="box"/></film></sensor></scene>"#;
    let s = load(&write("scene.xml", main), &LoadOptions::default()).unwrap();
    let meshes: Vec<_> = s
        .shapes
        .iter()
        .map(|s| match &s.geometry {
            Geometry::Mesh(mesh) => mesh.clone(),
            other => panic!("{other:?}"),
        })
        .collect();
    assert!(std::sync::Arc::ptr_eq(&meshes[0], &meshes[1]), "the same file is read once");
    assert!(!meshes[0].normals.is_empty() && meshes[2].normals.is_empty());
    assert_eq!(s.shapes[0].name, "t.obj");
    let LightKind::Constant { radiance } = s.lights[0].kind else { panic!() };
    assert_close(radiance, [2.73471, 1.62206, 1.07266]);
}

/// A file of the shared scenes, or `None`, said aloud, where they are not there.
fn shared(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("SNELL_SHARED").map_or_else(|| repository().join("../shared"), PathBuf::from);
    let path = folder.join("scenes").join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is not there", path.display());
    None
}

#[test]
fn the_cornell_box_is_read() {
    let Some(path) = shared("cornell-box-mitsuba/cornell-box-small.xml") else {
        return;
    };
    let defines = vec![("spp".into(), "16".into()), ("seed".into(), "3".into())];
    let s = load(&path, &LoadOptions { defines, ..Default::default() }).unwrap();
    assert_eq!((s.shapes.len(), s.bsdfs.len(), s.lights.len()), (8, 5, 0));
    assert_eq!((s.cameras[0].sampler.sample_count, s.cameras[0].sampler.seed), (16, 3));
    assert_eq!(s.integrator.max_depth, Some(6));
    assert_close(s.shapes[0].emission.unwrap().radiance, [20.7108, 10.8546, 2.77115]);
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
}

/// Positions and normals of a teapot under a shearing transformation, from Mitsuba 3.9.1 in single precision.
#[test]
fn the_teapot_has_mitsuba_s_normals() {
    const TOLERANCE: f64 = 2e-5;
    let Some(path) = shared("meshes/teapot.obj") else {
        return;
    };
    let s = scene(&format!(
        r#"<shape type="obj"><string name="filename" value="{}"/><transform name="to_world">
            <rotate angle="30" x="0.6" y="0.8"/><scale x="3" y="0.5" z="-1"/></transform></shape>"#,
        path.display()
    ));
    let (Geometry::Mesh(mesh), m) = (&s.shapes[0].geometry, s.shapes[0].to_world) else { panic!() };
    assert_eq!((mesh.positions.len(), mesh.faces.len()), (3644, 6320));
    let to_world = m.matrix3.inverse().transpose();
    for (i, position, normal) in [
        (
            0,
            [3.949280023574829, 1.237086296081543, 0.013535305857658386],
            [0.3074052929878235, 0.8227416276931763, 0.478119432926178],
        ),
        (
            500,
            [-0.8081120848655701, 1.2452154159545898, 0.8913091421127319],
            [0.044177696108818054, -0.8844138979911804, -0.46460774540901184],
        ),
        (
            1000,
            [1.1079856157302856, 0.3496479094028473, 1.430979609489441],
            [-0.021060392260551453, 0.8007699847221375, -0.5986016392707825],
        ),
    ] {
        let (p, n) = (m.transform_point3(mesh.positions[i]), (to_world * mesh.normals[i]).normalize());
        assert!(p.abs_diff_eq(position.into(), TOLERANCE), "{p}, Mitsuba has {position:?}");
        assert!(n.abs_diff_eq(normal.into(), TOLERANCE), "{n}, Mitsuba has {normal:?}");
    }
}

#[test]
fn the_dragon_is_read() {
    let Some(path) = shared("meshes/dragon_vrip.ply") else {
        return;
    };
    let start = std::time::Instant::now();
    let file = path.display();
    let s = scene(&format!(
        r#"<shape type="ply"><string name="filename" value="{file}"/><boolean name="face_normals" value="true"/></shape>"#
    ));
    println!("dragon: {:?}", start.elapsed());
    let Geometry::Mesh(mesh) = &s.shapes[0].geometry else { panic!() };
    assert_eq!((mesh.positions.len(), mesh.faces.len()), (437_645, 871_414));
}

/// A file of two serialized meshes, as Mitsuba's format has them, each a triangle at its own height.
fn serialized_triangles() -> Vec<u8> {
    use std::io::Write;
    let (mut bytes, mut table) = (Vec::new(), Vec::new());
    for height in [1.0_f64, 2.0] {
        table.extend((bytes.len() as u64).to_le_bytes());
        bytes.extend([0x1C, 0x04, 4, 0]);
        let mut content =
            [&0x2000_u32.to_le_bytes()[..], b"name\0", &3_u64.to_le_bytes(), &1_u64.to_le_bytes()].concat();
        for p in [[0.0, 0.0, height], [1.0, 0.0, height], [0.0, 1.0, height]] {
            p.iter().for_each(|c: &f64| content.extend(c.to_le_bytes()));
        }
        [0_u32, 1, 2].iter().for_each(|i| content.extend(i.to_le_bytes()));
        let mut encoder = flate2::write::ZlibEncoder::new(bytes, flate2::Compression::default());
        encoder.write_all(&content).unwrap();
        bytes = encoder.finish().unwrap();
    }
    bytes.extend(table);
    bytes.extend(2_u32.to_le_bytes());
    bytes
}

#[test]
fn serialized_meshes_are_read_by_their_index() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("two.serialized");
    std::fs::write(&mesh, serialized_triangles()).unwrap();
    let shape = |inside: &str| {
        let file = mesh.display();
        let text = format!(r#"<shape type="serialized"><string name="filename" value="{file}"/>{inside}</shape>"#);
        load_text(&text, &LoadOptions::default())
    };
    let index = |i: i32| format!(r#"<integer name="shape_index" value="{i}"/>"#);
    for (inside, height, name) in [(String::new(), 1.0, "@0"), (index(0), 1.0, "@0"), (index(1), 2.0, "@1")] {
        let s = shape(&inside).unwrap();
        let Geometry::Mesh(mesh) = &s.shapes[0].geometry else { panic!("a mesh") };
        assert_eq!(mesh.positions[1], glam::DVec3::new(1.0, 0.0, height));
        // Computed, as the file has none.
        assert_eq!(mesh.normals, [glam::DVec3::Z; 3]);
        assert_eq!(s.shapes[0].name, format!("two.serialized{name}"));
    }
    let faces = shape(r#"<boolean name="face_normals" value="true"/>"#).unwrap();
    assert!(matches!(&faces.shapes[0].geometry, Geometry::Mesh(mesh) if mesh.normals.is_empty()));
    let message = shape(&index(2)).unwrap_err().to_string();
    assert!(message.contains("two.serialized: there is no mesh 2: the file says that it has 2"), "{message}");
    assert!(shape(&index(-1)).unwrap_err().to_string().contains("'shape_index' must be between 0"));
    assert!(shape(r#"<boolean name="flip_tex_coords" value="true"/>"#).is_err(), "Mitsuba has no such parameter");
}

#[test]
fn cameras_have_mitsuba_s_defaults() {
    let text = r#"<scene version="3.0.0"><sensor type="thinlens"><float name="aperture_radius" value="0.5"/></sensor>
        <sensor type="orthographic"><transform name="to_world"><scale x="3" y="2"/></transform></sensor>
        <sensor type="panorama"/></scene>"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cameras.xml");
    std::fs::write(&path, text).unwrap();
    let s = load(&path, &LoadOptions::default()).unwrap();
    let Projection::ThinLens { fov, aperture_radius, focus_distance } = s.cameras[0].projection else {
        panic!("{:?}", s.cameras[0])
    };
    assert_eq!((fov.axis, aperture_radius, focus_distance), (FovAxis::Diagonal, 0.5, 1e4));
    assert_eq!((s.cameras[1].projection, s.cameras[2].projection), (Projection::Orthographic, Projection::Panorama));
    assert_eq!(s.cameras[1].to_world.matrix3.x_axis.x, 3.0);
}

#[test]
fn instances_refer_to_one_group() {
    let s = scene(
        r#"<shape type="shapegroup" id="g"><shape type="sphere"/><shape type="cube"/>
            <transform name="to_world"><scale value="2"/></transform></shape>
        <shape type="shapegroup" id="unused"><shape type="sphere"/></shape>
        <shape type="instance"><ref id="g"/></shape>
        <shape type="instance" id="moved"><ref id="g"/>
            <transform name="to_world"><translate x="5"/></transform></shape>"#,
    );
    assert!(s.shapes.is_empty());
    assert_eq!(s.groups.len(), 1, "only what is placed");
    assert_eq!(s.groups[0].shapes.len(), 2);
    assert_eq!((s.instances[0].group, s.instances[1].group), (s.instances[1].group, s.instances[0].group));
    assert_eq!((s.instances[0].name.as_str(), s.instances[1].name.as_str()), ("instance", "moved"));
    assert_eq!(s.instances[1].to_world.translation.x, 5.0);
    assert!(s.warnings[0].contains("the to_world of a shapegroup does nothing"), "{:?}", s.warnings);
}

/// The file is not there: who opened it would fail.
#[test]
fn pictures_that_nothing_uses_are_not_opened() {
    let texture =
        r#"<texture type="bitmap" name="reflectance"><string name="filename" value="nowhere.png"/></texture>"#;
    let unused = format!(r#"<bsdf type="diffuse" id="unused">{texture}</bsdf>"#);
    let s = scene(&format!(r#"{unused}<shape type="sphere"><bsdf type="diffuse"/></shape>"#));
    assert!(s.textures.is_empty());
    let used = format!(r#"{unused}<shape type="sphere"><ref id="unused"/></shape>"#);
    assert!(load_text(&used, &LoadOptions::default()).is_err());
}

/// Two uses, one picture in memory; and texture coordinates only where something asks for them.
#[test]
fn pictures_are_decoded_once_and_coordinates_read_when_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::new(2, 3).save(folder.path().join("p.png")).unwrap();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0.25\nvt 1 0.25\nvt 0 1\nf 1/1 2/2 3/3\n";
    std::fs::write(folder.path().join("m.obj"), mesh).unwrap();
    let bitmap = |wrap: &str| {
        format!(
            r#"<bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="p.png"/>
            <string name="wrap_mode" value="{wrap}"/></texture></bsdf>"#
        )
    };
    let shape = |bsdf: &str| format!(r#"<shape type="obj"><string name="filename" value="m.obj"/>{bsdf}</shape>"#);
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"/>{}{}{}</scene>"#,
        shape(&bitmap("clamp")),
        shape(&bitmap("mirror")),
        shape("")
    );
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, text).unwrap();
    let s = load(&path, &LoadOptions::default()).unwrap();
    let picture = |i: usize| match &s.textures[i].kind {
        TextureKind::Bitmap { image, .. } => image.clone(),
        _ => panic!(),
    };
    assert!(std::sync::Arc::ptr_eq(&picture(0), &picture(1)));
    let uvs = |i: usize| match &s.shapes[i].geometry {
        Geometry::Mesh(mesh) => mesh.uvs.clone(),
        _ => panic!(),
    };
    // v is turned round, as in Mitsuba.
    assert_eq!(uvs(0)[0], glam::DVec2::new(0.0, 0.75));
    assert!(uvs(2).is_empty());
}
