//! Laws of blends, masks, two-sided and perturbed materials.

use super::*;
use crate::bsdf::{Conductor, Diffuse, Distribution, Microfacets, RoughConductor};
use crate::math::frame::Frame;
use crate::sampler::{Sampler, SamplerKind};
use crate::sampling::chi_square;
use crate::texture::{Texture, TextureKind, TexturePoint, Textures};
use glam::{Affine2, Vec2};

fn diffuse(reflectance: f32) -> Node {
    leaf(Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(reflectance) }))
}

fn leaf(bsdf: Bsdf) -> Node {
    Node::Leaf { bsdf, varying: Vec::new(), coat_normal: None }
}

fn metal(alpha: f32) -> Node {
    let facets = Microfacets::new(Distribution::Ggx, alpha, alpha);
    leaf(Bsdf::RoughConductor(RoughConductor::new(facets, Rgb::splat(0.2), Rgb::splat(3.0), Rgb::WHITE)))
}

/// Constants as textures: index 0, 1, ...
fn textures(colours: &[Rgb]) -> Textures {
    let constant = |&colour| Texture { kind: TextureKind::Constant(colour), uv_set: 0, to_uv: Affine2::IDENTITY };
    Textures::new(colours.iter().map(constant).collect())
}

fn layers(nodes: Vec<Node>, textures: &Textures, wo: Vec3) -> Vec<Layer> {
    resolved(&Graph::new(nodes), textures, wo)
}

fn resolved(graph: &Graph, textures: &Textures, wo: Vec3) -> Vec<Layer> {
    let place = Place { point: TexturePoint::new(Vec2::ZERO), wo, dp: [Vec3::X, Vec3::Y], mirrored: false };
    let mut layers = Vec::new();
    graph.resolve(textures, &place, &mut layers);
    layers
}

/// A normal as a normal map has it.
fn encoded(n: Vec3) -> Rgb {
    Rgb((n.normalize() + 1.0) * 0.5)
}

fn uniform(i: u32) -> BsdfUniforms {
    Sampler { kind: SamplerKind::Independent, seed: 3 }.stream(0, 0, i).bsdf(0)
}

fn towards(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z).normalize()
}

const VIEWS: [(f32, f32, f32); 4] = [(0.0, 0.0, 1.0), (0.5, 0.3, 0.8), (-0.9, 0.2, 0.3), (0.3, -0.99, 0.05)];

fn perturbed(nested: u32, texture: u32, flip_invalid: bool, shadowing: bool) -> Node {
    let terminator = Terminator::Cut { flip_invalid, shadowing };
    Node::Perturbed { nested, normal: NormalSource::Map { texture, scale: 1.0 }, terminator }
}

fn bending(nested: u32, texture: u32) -> Node {
    let normal = NormalSource::Map { texture, scale: 1.0 };
    Node::Perturbed { nested, normal, terminator: Terminator::Bend }
}

/// Materials without delta lobes, with the textures that they ask.
fn rows() -> Vec<(&'static str, Vec<Node>, Textures)> {
    let tilted = encoded(Vec3::new(0.4, -0.2, 0.8));
    let steep = encoded(Vec3::new(0.7, 0.6, 0.3));
    let blend = Node::Blend { first: 0, second: 1, weight: Number::Constant(0.3) };
    vec![
        ("blend", vec![diffuse(0.8), metal(0.3), blend.clone()], textures(&[])),
        ("normal map", vec![diffuse(0.8), perturbed(0, 0, true, true)], textures(&[tilted])),
        ("rough normal map", vec![metal(0.2), perturbed(0, 0, true, false)], textures(&[tilted])),
        ("bent normals", vec![metal(0.2), bending(0, 0)], textures(&[steep])),
        (
            "blend of a normal map in a blend",
            vec![
                diffuse(0.8),
                metal(0.3),
                perturbed(1, 0, true, true),
                Node::Blend { first: 0, second: 2, weight: Number::Texture(1) },
                metal(0.1),
                Node::Blend { first: 4, second: 3, weight: Number::Constant(0.6) },
            ],
            textures(&[tilted, Rgb::splat(0.25)]),
        ),
    ]
}

/// Hypothesis of each test: samples have the stated density. 5·10⁴ samples a test, five materials seen from four
/// directions, with a false-alarm rate of 1 % altogether; the seed is fixed. A sample that is lost (behind the surface) is
/// part of no density.
#[test]
fn samples_follow_the_density() {
    const SAMPLES: u32 = 50_000;
    let tests = rows().len() * VIEWS.len();
    for (name, nodes, textures) in rows() {
        for (x, y, z) in VIEWS {
            let wo = towards(x, y, z);
            let layers = layers(nodes.clone(), &textures, wo);
            let scatter = Scatter::Layers(&layers);
            let sample = |i| scatter.sample(wo, uniform(i)).map(|s| s.wi);
            let outcome = chi_square::on_sphere(SAMPLES, sample, |wi| scatter.eval_pdf(wo, wi).1.0.into());
            assert!(outcome.p_value >= chi_square::sidak(0.01, tests), "{name} from {wo}: {outcome:?}");
            // What is lost to the far side has a density there, which counts as none: at most all.
            assert!(outcome.integral <= 1.0 + 1e-3, "{name} from {wo}: {outcome:?}");
        }
    }
}

#[test]
fn weights_are_value_over_density() {
    for (name, nodes, textures) in rows() {
        for (x, y, z) in VIEWS {
            let wo = towards(x, y, z);
            let layers = layers(nodes.clone(), &textures, wo);
            let scatter = Scatter::Layers(&layers);
            for sample in (0..500).filter_map(|i| scatter.sample(wo, uniform(i))) {
                let (value, pdf) = scatter.eval_pdf(wo, sample.wi);
                let weight = value / pdf.0;
                let difference = (weight.0 - sample.weight.0).abs().max_element();
                // Directions in f32, on their way into a layer's frame and back.
                assert!(difference <= 2e-3 * weight.max_component().max(1.0), "{name}: {weight:?} {sample:?}");
            }
        }
    }
}

#[test]
fn a_blend_is_the_weighted_sum() {
    let (wo, wi) = (towards(0.3, 0.1, 0.9), towards(-0.4, 0.2, 0.7));
    let layers = layers(
        vec![diffuse(0.8), diffuse(0.2), Node::Blend { first: 0, second: 1, weight: Number::Texture(0) }],
        &textures(&[Rgb::splat(0.75)]),
        wo,
    );
    let value = Scatter::Layers(&layers).eval_pdf(wo, wi).0.0.x;
    let expected = (0.25 * 0.8 + 0.75 * 0.2) * wi.z / std::f32::consts::PI;
    assert!((value - expected).abs() <= 4.0 * f32::EPSILON * expected, "{value} {expected}");
}

/// Of 10⁵ samples of a mask of opacity 0.3 a share of 0.7 goes straight: the hypothesis is binomial, a deviation of 5
/// standard deviations has probability 6·10⁻⁷; the seed is fixed.
#[test]
fn a_mask_lets_through_what_it_does_not_hide() {
    const SAMPLES: u32 = 100_000;
    let wo = towards(0.3, 0.1, 0.9);
    let nodes = vec![diffuse(0.8), Node::Mask { nested: 0, opacity: Number::Constant(0.3) }];
    let layers = layers(nodes, &textures(&[]), wo);
    let scatter = Scatter::Layers(&layers);
    let straight = (0..SAMPLES).filter_map(|i| scatter.sample(wo, uniform(i))).filter(|s| s.pdf.is_none());
    let (count, all_straight) = straight
        .fold((0u32, true), |(n, all), s| (n + 1, all && s.wi == -wo && s.weight == Rgb::WHITE && s.eta == 1.0));
    assert!(all_straight);
    let (n, p) = (f64::from(SAMPLES), 0.7);
    assert!((f64::from(count) - n * p).abs() < 5.0 * (n * p * (1.0 - p)).sqrt(), "{count}");
    let wi = towards(-0.4, 0.2, 0.7);
    let (value, pdf) = scatter.eval_pdf(wo, wi);
    assert!((value.0.x / pdf.0 - 0.8).abs() < 4.0 * f32::EPSILON, "the nested bsdf is diffuse");
    assert!((pdf.0 * std::f32::consts::PI / wi.z - 0.3).abs() < 4.0 * f32::EPSILON);
}

#[test]
fn two_sides_look_as_they_do_without_a_graph() {
    let bsdf = |reflectance| Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(reflectance) });
    let sides = Sides { front: bsdf(0.9), back: Some(bsdf(0.3)) };
    let nodes = vec![diffuse(0.9), diffuse(0.3), Node::TwoSided { front: 0, back: 1 }];
    for side in [1.0, -1.0] {
        let (wo, wi) = (towards(0.3, 0.1, side * 0.9), towards(-0.4, 0.2, side * 0.7));
        let layers = layers(nodes.clone(), &textures(&[]), wo);
        let (bsdf, mirrored) = sides.seen_from(wo.z);
        let seen = |w: Vec3| if mirrored { Vec3::new(w.x, w.y, -w.z) } else { w };
        assert_eq!(Scatter::Layers(&layers).eval_pdf(wo, wi), bsdf.eval_pdf(seen(wo), seen(wi)));
        assert_eq!(Scatter::Layers(&layers).eval_pdf(wo, -wi).0, Rgb::BLACK);
        let sample = Scatter::Layers(&layers).sample(wo, uniform(1)).expect("a diffuse surface scatters");
        assert!(sample.wi.z * side > 0.0);
    }
}

#[test]
fn a_normal_map_of_the_normal_changes_nothing() {
    let flat = textures(&[encoded(Vec3::Z)]);
    for shadowing in [false, true] {
        for (wo, wi) in [(towards(0.3, 0.1, 0.9), towards(-0.4, 0.2, 0.7)), (Vec3::Z, towards(0.9, 0.0, 0.1))] {
            let layers = layers(vec![metal(0.2), perturbed(0, 0, true, shadowing)], &flat, wo);
            let Node::Leaf { bsdf, .. } = metal(0.2) else { unreachable!("a leaf") };
            assert_eq!(Scatter::Layers(&layers).eval_pdf(wo, wi), bsdf.eval_pdf(wo, wi));
        }
    }
}

#[test]
fn normals_that_look_away_are_turned_only_if_asked() {
    let (wo, wi) = (towards(-1.0, -1.0, 0.5), Vec3::Z);
    let tilted = textures(&[encoded(Vec3::new(1.0, 1.0, 1.0))]);
    let value = |flip| {
        let layers = layers(vec![diffuse(0.5), perturbed(0, 0, flip, false)], &tilted, wo);
        Scatter::Layers(&layers).eval_pdf(wo, wi).0.0.x
    };
    assert_eq!(value(false), 0.0);
    // The turned normal is (−1, −1, 1)/√3, whose cosine with +z is 1/√3.
    let expected = 0.5 / 3.0f32.sqrt() / std::f32::consts::PI;
    assert!((value(true) - expected).abs() < 1e-6, "{}", value(true));
}

/// The figures are those of the function's definition: α² = min(tan²θ_n / 8, 1), here (1/8)·1, and tan²θ_i = 1.
#[test]
fn light_fades_towards_the_terminator() {
    let tilted = textures(&[encoded(Vec3::new(0.0, 1.0, 1.0))]);
    let (wo, wi) = (Vec3::Z, towards(0.0, 1.0, 1.0));
    let value = |shadowing| {
        let layers = layers(vec![diffuse(0.5), perturbed(0, 0, false, shadowing)], &tilted, wo);
        Scatter::Layers(&layers).eval_pdf(wo, wi).0.0.x
    };
    let expected = 2.0 / (1.0 + (1.0f32 + 0.125).sqrt());
    assert!((value(true) / value(false) - expected).abs() < 1e-6);
}

#[test]
fn a_bump_tilts_the_normal_against_its_slope() {
    // A height that rises by 1/2 a unit of length along x: the normal leans back by atan(1/2).
    let place =
        Place { point: TexturePoint::new(Vec2::new(0.5, 0.25)), wo: Vec3::Z, dp: [Vec3::X, Vec3::Y], mirrored: false };
    let mut pixels = image::GrayImage::new(2, 2);
    pixels.put_pixel(1, 0, image::Luma([255]));
    pixels.put_pixel(1, 1, image::Luma([255]));
    let mut png = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut png, image::ImageFormat::Png).expect("a picture in memory");
    let image = crate::image::Raster::decode(png.get_ref(), None, true, &Default::default()).expect("the picture");
    let bitmap = crate::texture::Bitmap { image: image.into(), bilinear: true, wrap: [crate::texture::Wrap::Clamp; 2] };
    let height = Texture { kind: TextureKind::Bitmap(bitmap), uv_set: 0, to_uv: Affine2::IDENTITY };
    // From 0 to 1 between the middles of two pixels, half a unit of u apart: a slope of 2.
    let normal = NormalSource::Bump { height: 0, scale: 0.25 };
    let nodes = vec![
        diffuse(0.5),
        Node::Perturbed { nested: 0, normal, terminator: Terminator::Cut { flip_invalid: true, shadowing: false } },
    ];
    let mut layers = Vec::new();
    Graph::new(nodes).resolve(&Textures::new(vec![height]), &place, &mut layers);
    let frame = layers[0].perturbation.expect("a bump").frame;
    assert!((frame.n - towards(-0.5, 0.0, 1.0)).length() < 1e-6, "{}", frame.n);
}

#[test]
fn a_texture_gives_a_parameter_its_value() {
    let nodes = vec![Node::Leaf {
        bsdf: Bsdf::Conductor(Conductor { eta: Rgb::WHITE, k: Rgb::BLACK, reflectance: Rgb::WHITE }),
        varying: vec![(crate::bsdf::Parameter::SpecularReflectance, 0)],
        coat_normal: None,
    }];
    let layers = layers(nodes, &textures(&[Rgb::new(0.1, 0.2, 0.3)]), Vec3::Z);
    let expected = Conductor { eta: Rgb::WHITE, k: Rgb::BLACK, reflectance: Rgb::new(0.1, 0.2, 0.3) };
    assert_eq!(layers[0].bsdf, Bsdf::Conductor(expected));
}

/// Of a mirror that is blended, masked, two-sided and under a normal map, everything but the hole has a twin with a density; a
/// texture of roughness is raised where it is small.
#[test]
fn everything_in_a_graph_has_a_rougher_twin() {
    use crate::bsdf::Parameter;
    let mirror = crate::bsdf::Conductor { eta: Rgb::WHITE, k: Rgb::WHITE, reflectance: Rgb::WHITE };
    let textured = |alpha: f32| {
        let facets = Microfacets::new(Distribution::Ggx, alpha, alpha);
        Bsdf::RoughConductor(RoughConductor::new(facets, Rgb::WHITE, Rgb::WHITE, Rgb::WHITE))
    };
    let nodes = vec![
        leaf(Bsdf::Conductor(mirror)),
        Node::Leaf {
            bsdf: textured(0.7),
            varying: vec![(Parameter::AlphaU, 0), (Parameter::AlphaV, 0)],
            coat_normal: None,
        },
        Node::Blend { first: 0, second: 1, weight: Number::Constant(0.5) },
        Node::TwoSided { front: 2, back: 2 },
        perturbed(3, 1, false, false),
        Node::Mask { nested: 4, opacity: Number::Constant(0.5) },
    ];
    let textures = textures(&[Rgb::splat(0.08), encoded(Vec3::new(0.1, 0.1, 1.0))]);
    let twin = Graph::new(nodes).regularized();
    for wo in [towards(0.1, 0.2, 0.9), towards(0.1, 0.2, -0.9)] {
        let layers = resolved(&twin, &textures, wo);
        let [first, second, hole] = &layers[..] else { unreachable!("three layers") };
        assert_eq!(first.bsdf, Bsdf::Conductor(mirror).regularized());
        assert_eq!(second.bsdf, textured(0.08).regularized());
        assert_eq!(hole.bsdf, Bsdf::Null(crate::bsdf::Null));
        assert!(first.bsdf.lobes().smooth && !first.bsdf.lobes().delta);
    }
}

#[test]
fn layers_of_no_weight_are_left_out() {
    let blend = |weight| Node::Blend { first: 0, second: 1, weight: Number::Constant(weight) };
    let count = |weight| layers(vec![diffuse(0.8), metal(0.1), blend(weight)], &textures(&[]), Vec3::Z).len();
    assert_eq!([count(0.0), count(0.5), count(1.0)], [1, 2, 1]);
    // A frame is right-handed unless mirrored; both are orthonormal.
    let turned = layers(vec![diffuse(0.5), perturbed(0, 0, true, true)], &textures(&[encoded(Vec3::ONE)]), Vec3::Z);
    let Frame { s, t, n } = turned[0].perturbation.expect("a normal map").frame;
    assert!((s.cross(t) - n).length() < 1e-6);
}

/// A mirror under a steep normal map shows something of what is above the surface, from wherever it is seen, on both sides of
/// the surface; cut off, it is black from most places. Where nothing is wrong, nothing is bent.
#[test]
fn bent_normals_reflect() {
    let conductor = Bsdf::Conductor(crate::bsdf::Conductor { eta: Rgb::BLACK, k: Rgb::WHITE, reflectance: Rgb::WHITE });
    let mirror = || Node::Leaf { bsdf: conductor.clone(), varying: vec![], coat_normal: None };
    let sample = |node: Node, map: Vec3, wo: Vec3| {
        let layers = layers(vec![mirror(), node], &textures(&[encoded(map)]), wo);
        Scatter::Layers(&layers).sample(wo, uniform(1))
    };
    let steep = Vec3::new(0.7, 0.6, 0.3);
    for (x, y, z) in VIEWS {
        let wo = towards(x, y, z);
        let bent = sample(bending(0, 0), steep, wo).unwrap();
        assert!(bent.wi.z > 0.0 && (bent.weight.0.x - 1.0).abs() < 1e-5, "{wo}: {bent:?}");
        let slight = Vec3::new(0.01, 0.01, 1.0);
        let (bent, cut) =
            (sample(bending(0, 0), slight, wo).unwrap(), sample(perturbed(0, 0, false, false), slight, wo));
        assert_eq!(bent.wi, cut.unwrap().wi);
    }
    assert!(sample(perturbed(0, 0, true, false), steep, Vec3::Z).is_none());
}

/// The coat of glTF has the surface's normal, whatever the base's, or that of a map of its own, also seen from behind.
#[test]
fn coats_have_normals_of_their_own() {
    use crate::bsdf::{Gltf, GltfParameters};
    let (base, coat) = (Vec3::new(0.4, 0.2, 0.9).normalize(), Vec3::new(-0.3, 0.1, 0.9).normalize());
    let textures = textures(&[encoded(base), encoded(coat)]);
    let gltf = || Gltf::new(GltfParameters { clearcoat: 1.0, ..GltfParameters::default() });
    let map = |texture| NormalSource::Map { texture, scale: 1.0 };
    let resolved = |coat_normal: Option<NormalSource>, is_bumpy: bool, wo: Vec3| {
        let mut nodes = vec![
            Node::Leaf { bsdf: Bsdf::Gltf(gltf()), varying: vec![], coat_normal },
            Node::TwoSided { front: 0, back: 0 },
        ];
        if is_bumpy {
            nodes.push(Node::Perturbed { nested: 1, normal: map(0), terminator: Terminator::Bend });
        }
        layers(nodes, &textures, wo).remove(0)
    };
    // Where a normal of the shading frame is in the layer's own, on the side of the viewer.
    let seen = |layer: &Layer, n: Vec3, wo: Vec3| {
        let n = if wo.z < 0.0 { -n } else { n };
        layer.perturbation.as_ref().map_or(n, |p| p.frame.to_local(n))
    };
    for wo in [towards(0.1, 0.2, 0.9), towards(0.1, 0.2, -0.9)] {
        for (coat_normal, is_bumpy, expected) in
            [(None, true, Vec3::Z), (Some(map(1)), true, coat), (Some(map(1)), false, coat), (None, false, Vec3::Z)]
        {
            let layer = resolved(coat_normal, is_bumpy, wo);
            let Bsdf::Gltf(found) = &layer.bsdf else { unreachable!("it is the only leaf") };
            let mut expected_bsdf = gltf();
            expected_bsdf.set_coat_normal(seen(&layer, expected, wo));
            let difference = (found.coat_normal() - expected_bsdf.coat_normal()).length();
            // Normals in f32, normalised and turned into the frame and back.
            assert!(difference < 1e-5, "{coat_normal:?} {is_bumpy} {wo}: {difference}");
        }
    }
}

#[test]
fn layers_are_sampled_by_what_they_send() {
    // Half dark, half bright: by weights alone every other sample would carry next to nothing. Hypothesis: either way of choosing
    // has the same mean; 2·10⁴ independent samples each, 5 standard errors, false alarms 6e-7 a view. The variance falls to less
    // than half: chosen by what they send, all samples weigh about the same.
    const SAMPLES: u32 = 20_000;
    for (x, y, z) in VIEWS {
        let wo = towards(x, y, z);
        let blend = Node::Blend { first: 0, second: 1, weight: Number::Constant(0.5) };
        let chosen = layers(vec![diffuse(0.05), metal(0.1), blend], &textures(&[]), wo);
        let mut by_weight = chosen.clone();
        by_weight.iter_mut().for_each(|layer| layer.chance = layer.weight);
        let moments = |layers: &[Layer]| {
            let weights =
                (0..SAMPLES).map(|i| Scatter::Layers(layers).sample(wo, uniform(i)).map_or(0.0, |s| s.weight.mean()));
            let (sum, squares) = weights.fold((0.0, 0.0), |(a, b), w| (a + f64::from(w), b + f64::from(w * w)));
            (sum / f64::from(SAMPLES), squares / f64::from(SAMPLES))
        };
        let ((mean, square), (expected, coin)) = (moments(&chosen), moments(&by_weight));
        let error = ((square + coin) / f64::from(SAMPLES)).sqrt();
        assert!((mean - expected).abs() < 5.0 * error, "{wo}: {mean}, {expected}");
        let (variance, of_coin) = (square - mean * mean, coin - expected * expected);
        assert!(variance < 0.5 * of_coin, "{wo}: variance {variance} instead of {of_coin}");
    }
}
