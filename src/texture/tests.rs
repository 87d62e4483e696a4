//! Lookups in pictures and checkerboards.

use super::*;
use crate::image::Raster;
use std::sync::Arc;

/// A picture of 4×2 pixels with the red channel 0, 51, ... from the left, green 255 in the lower row.
fn picture() -> Arc<Raster> {
    let mut pixels = image::RgbImage::new(4, 2);
    for (x, y, p) in pixels.enumerate_pixels_mut() {
        *p = image::Rgb([51 * x as u8, 255 * y as u8, 0]);
    }
    let mut png = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut png, image::ImageFormat::Png).unwrap();
    Arc::new(Raster::decode(&png.into_inner(), None, true, &Default::default()).unwrap())
}

fn bitmap(bilinear: bool, wrap: Wrap) -> Bitmap {
    Bitmap { image: picture(), bilinear, wrap: [wrap; 2] }
}

fn close(a: Rgb, b: [f32; 3]) -> bool {
    // Two interpolations of numbers up to 1.
    (a.0 - glam::Vec3::from(b)).abs().max_element() <= 4.0 * f32::EPSILON
}

#[test]
fn pixels_have_their_own_colour_in_their_middle() {
    for bilinear in [false, true] {
        let b = bitmap(bilinear, Wrap::Repeat);
        for x in 0..4u8 {
            for y in 0..2u8 {
                let uv = Vec2::new((f32::from(x) + 0.5) / 4.0, (f32::from(y) + 0.5) / 2.0);
                assert!(close(b.colour(uv), [0.2 * f32::from(x), f32::from(y), 0.0]), "{x} {y}");
            }
        }
    }
}

#[test]
fn bilinear_lookups_interpolate_and_have_that_gradient() {
    let b = bitmap(true, Wrap::Clamp);
    let uv = Vec2::new(0.3, 0.4);
    // Columns at 1/8 and 3/8, 0.7 of the way; rows at 1/4 and 3/4, 0.3 of the way.
    assert!(close(b.colour(uv), [0.2 * 0.7, 0.3, 0.0]));
    let [red, green, _] = Rgb::LUMINANCE;
    let expected = Vec2::new(0.2 * 4.0 * red, 2.0 * green);
    assert!((b.gradient(uv) - expected).length() < 1e-6);
    assert_eq!(bitmap(false, Wrap::Clamp).gradient(uv), Vec2::ZERO);
}

#[test]
fn outside_the_unit_square_the_picture_wraps() {
    let red = |wrap, u: f32| (bitmap(false, wrap).colour(Vec2::new(u, 0.1)).0.x * 5.0).round();
    let around = [-0.375, -0.125, 0.125, 1.125, 1.375];
    assert_eq!(around.map(|u| red(Wrap::Repeat, u)), [2.0, 3.0, 0.0, 0.0, 1.0]);
    assert_eq!(around.map(|u| red(Wrap::Mirror, u)), [1.0, 0.0, 0.0, 3.0, 2.0]);
    assert_eq!(around.map(|u| red(Wrap::Clamp, u)), [0.0, 0.0, 0.0, 3.0, 3.0]);
}

#[test]
fn coordinates_without_bounds_are_no_panic() {
    for u in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -f32::MAX] {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for bilinear in [false, true] {
                let _ = bitmap(bilinear, wrap).colour(Vec2::new(u, -u));
                let _ = bitmap(bilinear, wrap).gradient(Vec2::new(u, -u));
            }
        }
    }
}

#[test]
fn checkerboards_alternate_by_half_units() {
    let constant = |v| Texture { kind: TextureKind::Constant(Rgb::splat(v)), uv_set: 0, to_uv: Affine2::IDENTITY };
    let board = TextureKind::Checkerboard { colors: [0, 1] };
    let scaled = Affine2::from_scale(Vec2::new(2.0, 1.0));
    let textures = Textures::new(vec![
        constant(0.0),
        constant(1.0),
        Texture { kind: board.clone(), uv_set: 0, to_uv: Affine2::IDENTITY },
        Texture { kind: board, uv_set: 0, to_uv: scaled },
    ]);
    let at = |index, u, v| textures.colour(index, &TexturePoint::new(Vec2::new(u, v))).0.x.round();
    assert_eq!([at(2, 0.2, 0.2), at(2, 0.7, 0.2), at(2, 0.7, 0.7), at(2, -0.2, 0.2)], [0.0, 1.0, 0.0, 1.0]);
    assert_eq!([at(3, 0.2, 0.2), at(3, 0.3, 0.2), at(3, 0.6, 0.2)], [0.0, 1.0, 0.0]);
    // As numbers, with the colours exchanged.
    let number = |index, u, v| textures.number(index, &TexturePoint::new(Vec2::new(u, v))).round();
    assert_eq!([number(2, 0.2, 0.2), number(2, 0.7, 0.2), number(2, 0.7, 0.7)], [1.0, 0.0, 1.0]);
}

#[test]
fn integer_samples_are_decoded_by_the_transfer_function_unless_raw() {
    let mut pixels = image::GrayImage::new(1, 1);
    pixels.put_pixel(0, 0, image::Luma([188]));
    let mut png = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let decoded = |raw| Raster::decode(png.get_ref(), None, raw, &Default::default()).unwrap().colour(0, 0).0.x;
    assert_eq!(decoded(true), 188.0 / 255.0);
    assert_eq!(decoded(false), crate::spectrum::srgb_to_linear(188.0 / 255.0) as f32);
}

/// A mesh of two vertices more than it needs, with a second set of coordinates, a colour of the vertices with opacity, and a
/// grey of the faces.
fn values() -> MeshValues {
    let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];
    let colours = Attribute {
        of_faces: false,
        width: 4,
        values: vec![0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.5, 0.0, 2.0, 0.0, 0.0, 9.0, 9.0, 9.0, 9.0],
    };
    let greys = Attribute { of_faces: true, width: 1, values: vec![0.25, 0.75] };
    MeshValues { uvs: vec![Vec::new(), uvs], attributes: vec![None, Some(colours), Some(greys)] }
}

fn textures(kinds: Vec<TextureKind>) -> Textures {
    let plain = |kind| Texture { kind, uv_set: 0, to_uv: Affine2::IDENTITY };
    Textures::new(kinds.into_iter().map(plain).collect())
}

#[test]
fn meshes_give_colours_and_further_coordinates() {
    let values = values();
    let point = |face| TexturePoint {
        uv: Vec2::ZERO,
        mesh: Some(MeshPoint { values: &values, face, corners: [0, 1, 2], weights: [0.5, 0.25, 0.25] }),
        ahead: &[],
    };
    let attribute = |index| TextureKind::Attribute { index, scale: 2.0 };
    let alpha = TextureKind::Channel { of: 1, channel: Channel::Alpha };
    let all = textures(vec![attribute(0), attribute(1), attribute(2), alpha]);
    assert!(close(all.colour(1, &point(0)), [0.5, 1.0, 0.0]));
    assert_eq!(all.colour(2, &point(1)), Rgb::splat(1.5));
    assert_eq!([all.number(3, &point(0)), all.number(0, &point(0))], [1.0 - 0.125 - 0.25, 0.0]);
    // The first set is not there, nor is a third; nor anything without a mesh.
    assert_eq!([1, 2, 3].map(|set| point(0).mesh.unwrap().uv(set)), [Vec2::ZERO, Vec2::splat(0.25), Vec2::ZERO]);
    assert_eq!(all.colour(1, &TexturePoint::new(Vec2::ONE)), Rgb::BLACK);
    // A texture in set 2: red of the picture at u = 1/8 is 0, at 3/8 it is 1/5.
    let lies_in = |uv_set| Texture {
        kind: TextureKind::Bitmap(bitmap(true, Wrap::Repeat)),
        uv_set,
        to_uv: Affine2::from_translation(Vec2::new(0.125, 0.0)),
    };
    let pictures = Textures::new(vec![lies_in(0), lies_in(2)]);
    assert_eq!([0, 1].map(|i| (5.0 * pictures.colour(i, &point(0)).0.x).round()), [0.0, 1.0]);
}

#[test]
fn textures_are_made_of_textures() {
    let all = textures(vec![
        TextureKind::Constant(Rgb::new(0.5, 0.25, 2.0)),
        TextureKind::Constant(Rgb::splat(0.5)),
        TextureKind::Product([0, 1]),
        TextureKind::Channel { of: 2, channel: Channel::Blue },
        TextureKind::Channel { of: 2, channel: Channel::Green },
        TextureKind::Channel { of: 2, channel: Channel::Red },
        TextureKind::Channel { of: 2, channel: Channel::Alpha },
        TextureKind::Product([3, 4]),
        TextureKind::Threshold { of: 4, cutoff: 0.125 },
        TextureKind::Threshold { of: 4, cutoff: 0.126 },
        TextureKind::Sum([0, 7]),
    ]);
    let at = TexturePoint::new(Vec2::ZERO);
    assert_eq!(all.colour(2, &at), Rgb::new(0.25, 0.125, 1.0));
    assert_eq!([3, 4, 5, 6, 7, 8, 9].map(|i| all.number(i, &at)), [1.0, 0.125, 0.25, 1.0, 0.125, 1.0, 0.0]);
    assert_eq!(all.colour(7, &at), Rgb::splat(0.125));
    assert_eq!(all.colour(10, &at), Rgb::new(0.625, 0.375, 2.125));
    // Of a channel no more is known than of all: from 0.125·0.125 to 1 in the product.
    assert_eq!(all.range(10, None), Some([0.25 + 0.015_625, 2.0 + 1.0]));
}

#[test]
fn wrapping_is_one_thing_across_and_another_down() {
    let b = Bitmap { image: picture(), bilinear: false, wrap: [Wrap::Clamp, Wrap::Repeat] };
    let colour = b.colour(Vec2::new(1.4, 1.4)).0;
    assert_eq!([(5.0 * colour.x).round(), colour.y], [3.0, 0.0]);
}
