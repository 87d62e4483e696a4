//! What a scene says in a complicated way: folded to what it comes to, with the same picture, and told by `snell info`.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;
mod desk;

use common::*;
use desk::{Desk, scene_text};
use snell::accel::Accelerator;
use snell::description::SceneDescription;
use snell::integrator::Estimator;
use snell::loader::{LoadOptions, load as load_file};
use snell::scene::compile::{Beyond, fold};
use std::fs;

/// A lamp above a floor and what stands on it; `more` are attributes of the integrator.
fn room(depth: &str, content: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
    <integrator type="path">{depth}</integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, -4, 2" target="0, 0, 0.5" up="0, 0, 1"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/>
            <string name="pixel_format" value="rgb"/><rfilter type="box"/></film>
    </sensor>
    <shape type="rectangle" id="lamp"><transform name="to_world"><scale value="0.7"/><rotate x="1" angle="180"/><translate z="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="6, 5, 4"/></emitter></shape>
    <shape type="rectangle" id="floor"><transform name="to_world"><scale value="3"/></transform></shape>
    {content}
</scene>"#
    )
}

const ANY_DEPTH: &str = r#"<integer name="max_depth" value="-1"/>"#;

fn bitmap(name: &str, file: &str) -> String {
    format!(
        r#"<texture name="{name}" type="bitmap"><string name="filename" value="{file}"/><boolean name="raw" value="true"/></texture>"#
    )
}

/// A wall with a bsdf.
fn wall(bsdf: &str) -> String {
    format!(
        r#"<shape type="rectangle" id="wall"><transform name="to_world"><rotate x="1" angle="90"/><translate y="1" z="1"/></transform>{bsdf}</shape>"#
    )
}

fn diffuse(reflectance: &str) -> String {
    format!(r#"<bsdf type="diffuse"><rgb name="reflectance" value="{reflectance}"/></bsdf>"#)
}

fn info(desk: &Desk, text: &str) -> String {
    fs::write(desk.path("s.xml"), text).unwrap();
    String::from_utf8(desk.succeeds(&["info", "s.xml"]).stdout).unwrap()
}

/// The bits of a picture of the scene.
fn bits(desk: &Desk, text: &str) -> Vec<u8> {
    fs::write(desk.path("s.xml"), text).unwrap();
    let render = ["render", "s.xml", "--spp=2", "--reuse=off", "--light-samples=1", "-q", "-o", "p.exr"];
    desk.succeeds(&render);
    let picture = snell::image::read_picture(&desk.path("p.exr")).unwrap().picture;
    picture.pixels().iter().flat_map(|p| p.to_array()).flat_map(f32::to_bits_bytes).collect()
}

trait BitsBytes {
    fn to_bits_bytes(self) -> [u8; 4];
}

impl BitsBytes for f32 {
    fn to_bits_bytes(self) -> [u8; 4] {
        self.to_bits().to_le_bytes()
    }
}

fn assert_told(told: &str, parts: &[&str]) {
    for part in parts {
        assert!(told.contains(part), "{part} in\n{told}");
    }
}

/// What is one colour, one number, one side or flat gives the very bits of the scene that says so at once.
#[test]
fn what_is_simpler_than_it_looks_is_that() {
    let desk = Desk::new();
    image::GrayImage::from_pixel(64, 32, image::Luma([255])).save(desk.path("white.png")).unwrap();
    image::GrayImage::from_pixel(2, 2, image::Luma([0])).save(desk.path("black.png")).unwrap();
    let [green, red, white] = ["0.2, 0.7, 0.3", "0.7, 0.2, 0.3", "1"].map(diffuse);
    let checkers = r#"<texture name="reflectance" type="checkerboard"><rgb name="color0" value="0.2, 0.7, 0.3"/>
        <rgb name="color1" value="0.2, 0.7, 0.3"/></texture>"#;
    for (bsdf, same, note) in [
        (
            format!(r#"<bsdf type="diffuse">{}</bsdf>"#, bitmap("reflectance", "white.png")),
            &*white,
            "one colour (1, 1, 1) instead of the 2048 bytes of ",
        ),
        (
            format!(r#"<bsdf type="diffuse">{checkers}</bsdf>"#),
            &green,
            "one colour (0.2, 0.7, 0.3) instead of a texture\n",
        ),
        (
            format!(r#"<bsdf type="mask">{}{green}</bsdf>"#, bitmap("opacity", "white.png")),
            &green,
            "the bsdf: an opacity of 1 is no mask\n",
        ),
        (
            format!(r#"<bsdf type="mask" id="gone"><float name="opacity" value="0"/>{green}</bsdf>"#),
            r#"<bsdf type="null"/>"#,
            "the bsdf 'gone': an opacity of 0 leaves nothing\n",
        ),
        (
            format!(r#"<bsdf type="blendbsdf"><float name="weight" value="0"/>{green}{red}</bsdf>"#),
            &green,
            "the bsdf: a blend of weight 0 is its first bsdf\n",
        ),
        (
            format!(r#"<bsdf type="blendbsdf"><float name="weight" value="1"/>{green}{red}</bsdf>"#),
            &red,
            "the bsdf: a blend of weight 1 is its second bsdf\n",
        ),
        (
            format!(r#"<bsdf type="bumpmap">{}{green}</bsdf>"#, bitmap("bump", "black.png")),
            &green,
            "the bsdf: a bump map of one height has no bumps\n",
        ),
        (
            r#"<bsdf type="roughconductor"><float name="alpha" value="1e-6"/></bsdf>"#.into(),
            r#"<bsdf type="conductor"/>"#,
            "the bsdf: its roughness is less than directions can tell: it is a mirror\n",
        ),
        (
            r#"<bsdf type="roughdielectric"><float name="alpha" value="1e-6"/></bsdf>"#.into(),
            r#"<bsdf type="dielectric"/>"#,
            "the bsdf: its roughness is less than directions can tell: it is a mirror\n",
        ),
    ] {
        let (long, short) = (room("", &wall(&bsdf)), room("", &wall(same)));
        let told = info(&desk, &long);
        assert_told(&told, &["folded       s.xml:", note]);
        assert!(!told.lines().any(|l| l.starts_with("has  ") && l.contains("varying")), "{told}");
        assert!(bits(&desk, &long) == bits(&desk, &short), "{bsdf}");
        assert!(!info(&desk, &short).contains(note), "{same} needs no folding");
    }
}

/// What only looks like that stays: two colours, an opacity that varies, a mirror that is just rough enough, a rough mirror that shows
/// lights without size.
#[test]
fn what_is_not_simpler_stays() {
    let desk = Desk::new();
    let mut almost = image::GrayImage::from_pixel(5, 3, image::Luma([255]));
    almost.put_pixel(4, 2, image::Luma([254]));
    almost.save(desk.path("almost.png")).unwrap();
    let rough = |alpha: &str| format!(r#"<bsdf type="roughconductor"><float name="alpha" value="{alpha}"/></bsdf>"#);
    let point = r#"<emitter type="point"/>"#;
    for content in [
        wall(&format!(r#"<bsdf type="diffuse">{}</bsdf>"#, bitmap("reflectance", "almost.png"))),
        wall(&format!(r#"<bsdf type="mask">{}<bsdf type="diffuse"/></bsdf>"#, bitmap("opacity", "almost.png"))),
        wall(
            r#"<bsdf type="blendbsdf"><float name="weight" value="0.5"/><bsdf type="diffuse"/><bsdf type="plastic"/></bsdf>"#,
        ),
        wall(&rough("5e-6")),
        wall(&rough("1e-6")) + point,
    ] {
        let told = info(&desk, &room("", &content));
        assert!(!told.contains("folded "), "{content}\n{told}");
    }
}

/// Light of one colour needs no texture, and light of none is none.
#[test]
fn lights_are_folded() {
    let desk = Desk::new();
    image::GrayImage::from_pixel(4, 4, image::Luma([255])).save(desk.path("white.png")).unwrap();
    image::GrayImage::from_pixel(4, 4, image::Luma([0])).save(desk.path("black.png")).unwrap();
    let emitter = |inside: &str| format!(r#"<emitter type="area">{inside}</emitter>"#);
    let plain = room("", &wall(&emitter(r#"<rgb name="radiance" value="1"/>"#)));
    let textured = room("", &wall(&emitter(&bitmap("radiance", "white.png"))));
    let told = info(&desk, &textured);
    assert_told(
        &told,
        &["the light of 'wall' has one colour: no texture is looked up\n", "lights       2 on surfaces"],
    );
    assert!(bits(&desk, &plain) == bits(&desk, &textured));
    for black in [bitmap("radiance", "black.png"), r#"<rgb name="radiance" value="0"/>"#.into()] {
        let told = info(&desk, &room("", &wall(&emitter(&black))));
        assert_told(
            &told,
            &["the light of 'wall' is black: it is none\n", "lights       1 on surfaces", "the only one\n"],
        );
    }
    for black in [
        r#"<emitter type="point"><rgb name="intensity" value="0"/></emitter>"#,
        r#"<emitter type="constant"><rgb name="radiance" value="0"/></emitter>"#,
    ] {
        let told = info(&desk, &room("", black));
        assert_told(&told, &[": the light is black: it is none\n", "choice       the only one\n"]);
    }
    let many = r#"<emitter type="point"><rgb name="intensity" value="0"/></emitter>"#.repeat(20);
    assert_told(&info(&desk, &room("", &many)), &["folded       ... and 4 things more\n"]);
}

/// A surface that is not there is left out where nobody can tell, and stays with the reason where one could.
#[test]
fn transparent_surfaces_are_left_out_where_that_cannot_be_told() {
    let desk = Desk::new();
    let pane = wall(r#"<bsdf type="null"/>"#);
    let sky = r#"<emitter type="constant"/>"#;
    let told = info(&desk, &room(ANY_DEPTH, &(pane.clone() + sky)));
    assert_told(&told, &["'wall' is fully transparent: no ray meets it\n", "shapes       2 with 4 triangles"]);
    let stays = |told: String, why: &str| {
        let note = format!("'wall' is fully transparent, but stays: {why}\n");
        assert_told(&told, &[&note, "shapes       3 with 6 triangles"]);
    };
    let depth = r#"<integer name="max_depth" value="6"/>"#;
    stays(info(&desk, &room(depth, &pane)), "it counts as a vertex of paths, which have a largest depth");
    let lamp = pane.clone() + r#"<emitter type="point"/>"#;
    stays(info(&desk, &room(ANY_DEPTH, &lamp)), "shadow rays to lights without size stop at it");
    let aov = r#"<integrator type="aov"><string name="aovs" value="d:depth"/><integrator type="path"/></integrator>"#;
    let with_aov = room("", &pane).replace(r#"<integrator type="path"></integrator>"#, aov);
    stays(info(&desk, &with_aov), "channels beside the picture show it");
    // A surface that shines is there, whatever its bsdf.
    let lit = wall(r#"<bsdf type="null"/><emitter type="area"/>"#);
    assert!(!info(&desk, &room(ANY_DEPTH, &lit)).contains("transparent"));
}

/// Hypothesis: leaving the surface out changes no expectation, of any tile (8×8 pixels) or of the whole: light that shadow rays do
/// not find behind it the bsdf does. 24 pictures each of 64 samples; z follows Student's t with 23 to 46 degrees of freedom: |t₂₃| > 7
/// has probability 4·10⁻⁷, in one of 9 tiles 4·10⁻⁶, and |t₂₃| > 6 for the whole 4·10⁻⁶. The seeds are fixed.
#[test]
fn leaving_transparent_surfaces_out_changes_no_expectation() {
    let desk = Desk::new();
    // Between the lamp and the floor.
    let pane = r#"<shape type="rectangle"><transform name="to_world"><scale value="2"/><translate z="2.5"/></transform><bsdf type="null"/></shape>"#;
    fs::write(desk.path("s.xml"), room(ANY_DEPTH, pane)).unwrap();
    let whole: SceneDescription = load_file(&desk.path("s.xml"), &LoadOptions::default()).unwrap();
    let (folded, notes) = fold(whole.clone(), Beyond { any_depth: true, aovs: false }).unwrap();
    assert_eq!((whole.shapes.len(), folded.shapes.len(), notes.len()), (3, 2, 1), "{notes:?}");
    let estimate = |description: &SceneDescription| {
        let scene = compiled(description, Accelerator::Native);
        Estimate::of(&scene, &file_settings(description, Estimator::Path, 64), 24)
    };
    let worst = estimate(&whole).worst_z_against(&estimate(&folded));
    println!("z {:.2}, worst tile {:.2}", worst.whole, worst.tile);
    assert!(worst.whole < 6.0, "off by {} standard errors", worst.whole);
    assert!(worst.tile < 7.0, "off by {} standard errors in a tile", worst.tile);
}

/// Pictures that are asked for no more are let go.
#[test]
fn pictures_that_nothing_asks_are_let_go() {
    let desk = Desk::new();
    let mut picture = image::RgbImage::new(8, 8);
    picture.put_pixel(1, 1, image::Rgb([9, 9, 9]));
    picture.save(desk.path("p.png")).unwrap();
    let masked = format!(
        r#"<bsdf type="mask"><float name="opacity" value="0"/><bsdf type="diffuse">{}</bsdf></bsdf>"#,
        bitmap("reflectance", "p.png")
    );
    let told = info(&desk, &room("", &wall(&masked)));
    assert_told(&told, &["s.xml:", ": nothing asks ", "p.png any more: 256 bytes are free again\n"]);
    assert_told(&told, &["textures 0.0 MiB"]);
}

/// Files of what nothing uses are never opened: those here are not there.
#[test]
fn what_nothing_uses_is_never_read() {
    let desk = Desk::new();
    let unread = r#"<shape type="shapegroup" id="spare"><shape type="ply"><string name="filename" value="none.ply"/></shape></shape>
        <bsdf type="diffuse" id="coat"><texture type="bitmap" name="reflectance"><string name="filename" value="none.png"/></texture></bsdf>"#;
    let told = info(&desk, &room("", unread));
    assert_told(&told, &["not used     shape 'shapegroup' 'spare'", "not used     bsdf 'diffuse' 'coat'"]);
    // What is there is not opened either: this is no picture.
    fs::write(desk.path("words.png"), "words").unwrap();
    let unread = r#"<texture type="bitmap" id="spare"><string name="filename" value="words.png"/></texture>"#;
    assert_told(
        &info(&desk, &room("", unread)),
        &["not used     texture 'bitmap' 'spare' (", "), 'words.png' (5 bytes) is not read\n"],
    );
}

/// The facts that code depends on, and what a scene is spared.
#[test]
fn info_tells_which_code_a_scene_gets() {
    let desk = Desk::new();
    let told = info(&desk, &room("", ""));
    assert_told(
        &told,
        &[
            "has          lights with size, triangles\n",
            "has no       vertex normals, delta lobes, transmission, volumes, anisotropy, varying materials, masks, ",
            "saved        without vertex normals: a triangle's normal is that of its plane, nothing is interpolated\n",
            "saved        without transmission: lights are chosen for one side of every surface\n",
            "saved        without volumes: paths are inside of nothing, no exponentials\n",
            "saved        without anisotropy: no tangents are kept or looked up\n",
            "saved        without varying materials: every bsdf is ready before the render: no layers, no texture \
             coordinates, nothing looked up ahead\n",
            "saved        without masks: no layer lets light straight through\n",
            "saved        without several lights: no choice, one uniform number less at a vertex\n",
            "saved        without a sky: what meets nothing ends\n",
            "saved        without instances: no second tree, no ray is moved to another space\n",
            "saved        without quadrics: no tree beside that of the triangles\n",
            "saved        without a lens: two uniform numbers less a path\n",
            "code         estimator path for plain materials and one lamp at most, nothing beside radiance, hits looked \
             at one by one, vector instructions ",
        ],
    );
    let ball = r#"<shape type="sphere"><bsdf type="mask"><bsdf type="dielectric"/></bsdf></shape>
        <emitter type="directional"/>"#;
    assert_told(
        &info(&desk, &room("", ball)),
        &[
            "has          delta lobes, transmission, varying materials, masks, several lights, lights with size, lights \
             without size, quadrics, triangles\n",
            "code         estimator path for any materials and any lights, ",
        ],
    );
    let alpha = scene_text("").replace("<rfilter", r#"<string name="pixel_format" value="rgba"/><rfilter"#);
    assert_told(
        &info(&desk, &alpha),
        &[
            " and one lamp at most, quantities beside radiance, ",
            "saved        without triangles: no tree beside that of the quadrics\n",
            "saved        without lights with size: no path can run into a light: nothing is weighed against that\n",
        ],
    );
    let checkers = wall(r#"<bsdf type="diffuse"><texture name="reflectance" type="checkerboard"/></bsdf>"#);
    assert_told(
        &info(&desk, &room("", &checkers)),
        &["code         estimator path for any materials and one lamp at most, ", "hits looked at ahead"],
    );
}
