//! Pictures as others read them: what an EXR of ours says and holds.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod desk;

use desk::*;
use exr::prelude::{AttributeValue, FlatImage, FlatSamples, IntegerBounds, Text, Vec2, read_all_flat_layers_from_file};
use std::fs;

fn read(desk: &Desk, name: &str) -> FlatImage {
    read_all_flat_layers_from_file(desk.path(name)).unwrap()
}

/// The values of each channel, R, G, B.
fn values(image: &FlatImage) -> [Vec<f32>; 3] {
    ["R", "G", "B"].map(|name| {
        let channels = &image.layer_data[0].channel_data.list;
        let channel = channels.iter().find(|c| c.name.eq(name)).unwrap();
        channel.sample_data.values_as_f32().collect()
    })
}

/// A sphere around the camera that emits `radiance` and reflects half.
fn emitting_room(radiance: f32) -> String {
    let film = r#"type="hdrfilm""#;
    scene_text(&format!(
        r#"<shape type="sphere"><float name="radius" value="9"/><boolean name="flip_normals" value="true"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>"#
    ))
    .replace(film, &format!("{film}><string name=\"component_format\" value=\"float32\"/"))
}

/// Where samples are limited the file tells by what, and nothing is above it.
#[test]
fn a_limit_is_told_by_the_file() {
    let desk = Desk::new();
    fs::write(desk.path("room.xml"), emitting_room(5.0)).unwrap();
    let limited = |arguments: &[&str]| {
        desk.succeeds(&[&["render", "room.xml", "--spp=4", "-q", "-o", "a.exr"], arguments].concat());
        let image = read(&desk, "a.exr");
        let Some(AttributeValue::Text(bias)) = image.layer_data[0].attributes.other.get(&Text::from("snell.bias"))
        else {
            panic!("it says nothing of bias")
        };
        (bias.to_string(), values(&image).iter().flatten().copied().fold(0.0, f32::max))
    };
    let (bias, brightest) = limited(&["--clamp=7.5"]);
    assert_eq!((bias.as_str(), brightest), ("clamp 7.5", 7.5));
    let (bias, brightest) = limited(&["--clamp=1e9"]);
    assert!(bias == "clamp 1000000000" && brightest > 7.5);
    assert_eq!(limited(&["--regularize"]).0, "regularize");
    assert_eq!(limited(&["--clamp=7.5", "--regularize"]), ("clamp 7.5, regularize".into(), 7.5));
    for bad in ["0", "-1", "nan", "inf", "bright"] {
        let output = desk.snell(&["render", "room.xml", &format!("--clamp={bad}")]);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains("expected a radiance, more than 0"));
    }
}

#[test]
fn a_crop_keeps_its_place_and_its_bits() {
    let desk = Desk::new();
    let common = ["render", SCENE, "-Dres=16", "--spp=2", "--seed=9007199254740993", "-q"];
    desk.succeeds(&[&common[..], &["-o", "whole.exr"]].concat());
    desk.succeeds(&[&common[..], &["-o", "part.exr", "--crop", "3,5,6,4"]].concat());
    let (whole, part) = (read(&desk, "whole.exr"), read(&desk, "part.exr"));
    assert_eq!(part.attributes.display_window, IntegerBounds::new(Vec2(0, 0), Vec2(16, 16)));
    let layer = &part.layer_data[0];
    assert_eq!((layer.attributes.layer_position, layer.size), (Vec2(3, 5), Vec2(6, 4)));
    let whole = values(&whole);
    for (channel, part) in values(&part).iter().enumerate() {
        for (i, value) in part.iter().enumerate() {
            assert_eq!(value.to_bits(), whole[channel][(i / 6 + 5) * 16 + i % 6 + 3].to_bits());
        }
    }
    let says = |name: &str| layer.attributes.other.get(&Text::from(name)).cloned();
    assert_eq!(says("snell.samples"), Some(AttributeValue::F64(2.0)));
    assert_eq!(says("snell.seed"), Some(AttributeValue::Text("9007199254740993".into())));
    assert_eq!(says("snell.bias"), Some(AttributeValue::Text("none".into())));
    assert_eq!(says("snell.nonFiniteSamples"), Some(AttributeValue::F64(0.0)));
    assert_eq!(says("snell.complete"), Some(AttributeValue::Text("yes".into())));
    let Some(AttributeValue::Text(command)) = says("snell.command") else { panic!("no command") };
    let words = shlex::split(&command.to_string()).unwrap();
    assert_eq!(words[1..], [&common[..], &["-o", "part.exr", "--crop", "3,5,6,4"]].concat());
}

#[test]
fn half_floats_are_clamped_and_counted() {
    let desk = Desk::new();
    // Twice the largest half float, in 64 pixels of three channels.
    fs::write(desk.path("float.xml"), emitting_room(131_008.0)).unwrap();
    fs::write(desk.path("half.xml"), emitting_room(131_008.0).replace("float32", "float16")).unwrap();
    let render = |scene: &str, stats: &str| {
        let output = desk.succeeds(&["render", scene, "--spp=1", "--max-depth=1", "--stats", stats]);
        let figures: serde_json::Value = serde_json::from_slice(&fs::read(desk.path(stats)).unwrap()).unwrap();
        (String::from_utf8_lossy(&output.stderr).into_owned(), figures["clamped_values"].as_u64())
    };
    let (told, counted) = render("half.xml", "half.json");
    assert!(told.contains("192 values were too large") && counted == Some(192), "{told} {counted:?}");
    let (told, counted) = render("float.xml", "float.json");
    assert!(!told.contains("too large") && counted == Some(0), "{told} {counted:?}");
    let half = read(&desk, "half.exr");
    assert!(matches!(half.layer_data[0].channel_data.list[0].sample_data, FlatSamples::F16(_)));
    assert_eq!(values(&half).concat(), [65504.0; 192]);
    assert_eq!(values(&read(&desk, "float.exr")).concat(), [131_008.0; 192]);
}

/// A ball before nothing, with something in the film and around it.
fn ball(film: &str, beside: &str) -> String {
    let whole = r#"<film type="hdrfilm">"#;
    scene_text(&format!(r#"<shape type="sphere"><point name="center" value="0 0 4"/></shape>{beside}"#))
        .replace(whole, &format!(r#"{whole}<string name="component_format" value="float32"/>{film}"#))
}

/// Names of the channels with their types, in the order of the file.
fn channels(image: &FlatImage) -> Vec<(String, char)> {
    let kind = |samples: &FlatSamples| match samples {
        FlatSamples::F16(_) => 'h',
        FlatSamples::F32(_) => 'f',
        FlatSamples::U32(_) => 'u',
    };
    image.layer_data[0].channel_data.list.iter().map(|c| (c.name.to_string(), kind(&c.sample_data))).collect()
}

fn channel(image: &FlatImage, name: &str) -> Vec<f32> {
    let found = image.layer_data[0].channel_data.list.iter().find(|c| c.name.eq(name));
    found.unwrap_or_else(|| panic!("no channel {name}")).sample_data.values_as_f32().collect()
}

#[test]
fn aovs_are_channels_of_one_file() {
    let desk = Desk::new();
    let all = "--aov=albedo,normal,shading_normal,depth,position,uv,primitive,shape,material,samples,error";
    desk.succeeds(&["render", SCENE, "-Dres=16", "--spp=3", "-q", all, "-o", "a.exr", "-o", "a.png"]);
    desk.succeeds(&["render", SCENE, "-Dres=16", "--spp=3", "-q", "-o", "plain.exr"]);
    let (image, plain) = (read(&desk, "a.exr"), read(&desk, "plain.exr"));
    let own = channels(&plain)[0].1;
    let expected = "B G N.X N.Y N.Z Ns.X Ns.Y Ns.Z P.X P.Y P.Z R Z albedo.B albedo.G albedo.R error.B error.G \
                    error.R material primitive samples shape uv.U uv.V";
    let expected = expected.split_whitespace().map(|name| {
        let is_whole = ["material", "primitive", "samples", "shape"].contains(&name);
        let is_colour = ["R", "G", "B"].contains(&name) || name.starts_with("albedo") || name.starts_with("error");
        (
            name.to_owned(),
            if is_whole {
                'u'
            } else if is_colour {
                own
            } else {
                'f'
            },
        )
    });
    assert_eq!(channels(&image), expected.collect::<Vec<_>>());
    assert_eq!(values(&image), values(&plain), "the picture does not depend on what is beside it");
    assert_eq!(channel(&image, "samples"), [3.0; 256]);
    // A pixel whose first sample met something is covered, and there is something near the middle.
    for (i, (shape, z)) in channel(&image, "shape").iter().zip(channel(&image, "Z")).enumerate() {
        assert!(if *shape > 0.0 { z > 0.0 } else { i != 136 }, "pixel {i}: shape {shape}, depth {z}");
    }
}

/// Of independent samples the mean square of the estimate is that of the error; of a sequence's it is rather larger.
///
/// Hypothesis: the mean over pixels and seeds of the estimated squares is that of the true ones, 16 independent samples
/// against the mean of 64 times as many. The ratio of 24 seeds, on pixels without the rim of the light, whose few samples
/// would decide alone, has a standard deviation of 7 % (found by 60 seeds in groups): false alarms beyond 30 % are rarer
/// than one in 10⁴. Of a sequence's halves the ratio was 1.15 with a deviation of 4 %.
#[test]
fn the_error_is_estimated() {
    let desk = Desk::new();
    let picture = |name: &str, args: &[&str]| {
        desk.succeeds(
            &[&["render", SCENE, "-Dres=16", "--crop=0,6,16,10", "-q", "--aov=error", "-o", name], args].concat(),
        );
        read(&desk, name)
    };
    let truth = values(&picture("truth.exr", &["--spp=1024"]));
    let ratio = |sampler: &str| {
        let (mut estimated, mut found) = (0.0, 0.0);
        for seed in 0..24 {
            let image = picture("a.exr", &["--spp=16", sampler, "--seed", &seed.to_string()]);
            let errors = ["error.R", "error.G", "error.B"].map(|name| channel(&image, name));
            for ((values, errors), truth) in values(&image).iter().zip(&errors).zip(&truth) {
                for ((value, error), truth) in values.iter().zip(errors).zip(truth) {
                    estimated += f64::from(error * error);
                    found += f64::from((value - truth).powi(2));
                }
            }
        }
        estimated / found
    };
    let independent = ratio("--sampler=independent");
    assert!((0.7..1.3).contains(&independent), "{independent}");
    let sobol = ratio("--sampler=sobol");
    assert!((0.95..1.35).contains(&sobol), "{sobol}");
}

/// Colours without alpha, weighed as Mitsuba does; luminance is what it is of white.
#[test]
fn pixel_formats_are_the_films() {
    let desk = Desk::new();
    let white = r#"<emitter type="constant"/>"#;
    for (format, expected) in [
        ("rgb", "B G R"),
        ("rgba", "A B G R"),
        ("luminance", "Y"),
        ("luminance_alpha", "A Y"),
        ("xyz", "X Y Z"),
        ("xyza", "A X Y Z"),
    ] {
        let text = ball(&format!(r#"<string name="pixel_format" value="{format}"/>"#), white);
        fs::write(desk.path("scene.xml"), text).unwrap();
        desk.succeeds(&["render", "scene.xml", "--spp=1", "-q", "-oa.exr", "-oa.png", "--max-depth=1"]);
        let image = read(&desk, "a.exr");
        let names: Vec<String> = channels(&image).into_iter().map(|(name, _)| name).collect();
        assert_eq!(names.join(" "), expected);
        // The first pixel sees the sky: white, of which a scene's default emitter has 1 in each channel of sRGB.
        let first = |name: &str| channel(&image, name)[0];
        match format {
            "rgb" | "rgba" => assert_eq!((first("R"), first("G"), first("B")), (1.0, 1.0, 1.0)),
            "luminance" | "luminance_alpha" => assert_eq!(first("Y"), 1.0),
            _ => assert_eq!((first("X"), first("Y"), first("Z")), (0.950_456, 1.0, 1.088_754)),
        }
        let png = image::open(desk.path("a.png")).unwrap();
        let (grey, alpha) = (format.starts_with("lum"), format.ends_with('a'));
        assert_eq!(png.color().channel_count(), if grey { 1 } else { 3 } + u8::from(alpha), "{format}");
    }
    // Mitsuba's `path` counts a sky that is seen, its `direct` does not.
    for (integrator, alpha) in [("path", 1.0), ("direct", 0.0)] {
        let beside = format!(r#"{white}<integrator type="{integrator}"/>"#);
        fs::write(desk.path("sky.xml"), ball(r#"<string name="pixel_format" value="rgba"/>"#, &beside)).unwrap();
        desk.succeeds(&["render", "sky.xml", "--spp=1", "-q", "-oa.exr"]);
        let image = read(&desk, "a.exr");
        assert_eq!((channel(&image, "R")[0], channel(&image, "A")[0], channel(&image, "A")[36]), (1.0, alpha, 1.0));
    }
    desk.refuses(&["render", "scene.xml", "--aov=depth"], &["two channels of the picture would be called 'Z'"]);
}

/// What is not covered is black and transparent, what is covered stays as it was, and PNG has colours divided by alpha.
#[test]
fn a_hidden_sky_leaves_alpha() {
    let desk = Desk::new();
    fs::write(desk.path("scene.xml"), ball("", r#"<emitter type="constant"/>"#)).unwrap();
    let render = |name: &str, options: &[&str]| {
        let exr = format!("-o{name}.exr");
        let png = format!("-o{name}.png");
        desk.succeeds(&[&["render", "scene.xml", "--spp=16", "-q", &exr, &png], options].concat());
        read(&desk, &format!("{name}.exr"))
    };
    let shown = render("shown", &["--env-visible=true"]);
    assert_eq!(channels(&shown).len(), 3);
    let hidden = render("hidden", &["--env-visible", "false"]);
    let alpha = channel(&hidden, "A");
    assert!(alpha.contains(&0.0) && alpha.contains(&1.0) && alpha.iter().any(|a| *a > 0.0 && *a < 1.0));
    let (r, whole) = (channel(&hidden, "R"), channel(&shown, "R"));
    for (i, a) in alpha.iter().enumerate() {
        assert!((r[i] + (1.0 - a) - whole[i]).abs() <= 4.0 * f32::EPSILON, "pixel {i}: {} and {}, {a}", r[i], whole[i]);
    }
    let png = image::open(desk.path("hidden.png")).unwrap().into_rgba8();
    for (pixel, (a, r)) in png.pixels().zip(alpha.iter().zip(&r)) {
        assert_eq!(pixel.0[3], (a * 255.0 + 0.5) as u8);
        let bare = if *a > 0.0 { (r / a).min(1.0) } else { 0.0 };
        // IEC 61966-2-1, above its toe.
        let byte = if bare == 0.0 { 0.0 } else { 255.0 * (1.055 * bare.powf(1.0 / 2.4) - 0.055) };
        assert!((f32::from(pixel.0[0]) - byte).abs() <= 0.51, "{pixel:?}, {a}, {r}");
    }
}

/// What `aov` and `moment` ask for, by the names that Mitsuba gives.
#[test]
fn a_files_own_channels() {
    let desk = Desk::new();
    let inside = r#"<integrator type="path" name="img"/>"#;
    let list = "dd.y:depth,nn:sh_normal, g:geo_normal p:position uv:uv a:albedo i:prim_index s:shape_index";
    let aov =
        |inside: &str| format!(r#"<integrator type="aov"><string name="aovs" value="{list}"/>{inside}</integrator>"#);
    let render = |integrator: &str| {
        fs::write(desk.path("scene.xml"), ball("", &(r#"<emitter type="constant"/>"#.to_owned() + integrator)))
            .unwrap();
        desk.succeeds(&["render", "scene.xml", "--spp=4", "-q", "-oa.exr"]);
        read(&desk, "a.exr")
    };
    let names = |image: &FlatImage| channels(image).into_iter().map(|(name, _)| name).collect::<Vec<_>>().join(" ");
    let own = "a.B a.G a.R dd.y.T g.X g.Y g.Z i.I";
    let more = "nn.X nn.Y nn.Z p.X p.Y p.Z s.I uv.U uv.V";
    let image = render(&aov(inside));
    assert_eq!(names(&image), format!("B G R {own} img.A img.B img.G img.R {more}"));
    assert_eq!((channel(&image, "img.R"), channel(&image, "img.A")), (channel(&image, "R"), vec![1.0; 64]));
    let image = render(&aov(""));
    assert_eq!(names(&image), format!("B G R {own} {more}"));
    assert_eq!(channel(&image, "R"), [0.0; 64]);
    assert!(channel(&image, "dd.y.T").iter().any(|t| *t > 2.9));
    let image = render(r#"<integrator type="moment"><integrator type="direct"/></integrator>"#);
    let own = "_arg_0.X _arg_0.Y _arg_0.Z";
    assert_eq!(names(&image), format!("B G R {own} m2_{}", own.replace(' ', " m2_")));
    // Sky, of which every sample is 1: so are the square and its mean.
    assert_eq!((channel(&image, "_arg_0.Y")[0], channel(&image, "m2__arg_0.Y")[0]), (1.0, 1.0));
    let image = render(&format!(
        r#"<integrator type="moment">{}</integrator>"#,
        aov(inside).replace("i:prim_index s:shape_index", "")
    ));
    assert!(names(&image).contains("m2__arg_0.img.R") && names(&image).contains("m2__arg_0.dd.y.T"));
    let told = desk.succeeds(&["render", "scene.xml", "--spp=1", "-oa.png"]);
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    assert!(told.contains("the channels beside the picture are not written: only a file"), "{told}");
}

/// One bounce of `bsdf` has no variance in this room. With radiance 1 the light itself shows 1, one bounce adds a half,
/// all bounces 1: the file's `direct` stays direct whoever estimates, and no depth at all is black.
#[test]
fn the_file_says_how_much_light_is_wanted() {
    let desk = Desk::new();
    let room = emitting_room(1.0);
    fs::write(desk.path("path.xml"), &room).unwrap();
    let direct = room.replace("<sensor", "<integrator type=\"direct\"/><sensor");
    fs::write(desk.path("direct.xml"), direct).unwrap();
    let cases: [(&str, &[&str], f32); 6] = [
        ("direct.xml", &["--integrator=bsdf"], 1.5),
        ("direct.xml", &["--integrator=bsdf", "--max-depth=3"], 1.75),
        ("path.xml", &["--integrator=bsdf", "--max-depth=1"], 1.0),
        ("path.xml", &["--integrator=bsdf", "--max-depth=0"], 0.0),
        ("path.xml", &["--max-depth=0"], 0.0),
        ("path.xml", &["--integrator=bsdf", "--max-depth=40", "--rr-depth=99"], 2.0),
    ];
    for (scene, options, expected) in cases {
        desk.succeeds(&[&["render", scene, "--spp=4", "-q", "-oout.exr"], options].concat());
        for v in values(&read(&desk, "out.exr")).concat() {
            // A few roundings, and 2⁻⁴⁰ of the series.
            assert!((v - expected).abs() <= 4.0 * f32::EPSILON, "{scene} {options:?}: {v}, expected {expected}");
        }
    }
}
