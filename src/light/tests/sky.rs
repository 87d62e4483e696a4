//! The same for skies, for surfaces that face some way and for those that scatter on both sides.

use super::*;
use glam::{DVec3, Mat3};

/// Normals to sample for: none, along an axis, on a fold of the map of normals, and another.
fn normals() -> Vec<Vec3> {
    vec![Vec3::ZERO, Vec3::Y, Vec3::new(1.0, -1.0, 0.0).normalize(), Vec3::new(-0.3, 0.2, -0.9).normalize()]
}

/// Hypothesis: directions have the density that is stated, whose integral is 1. 40,000 independent samples each, together a
/// false-alarm rate of 1 %; the seed is fixed.
#[test]
fn constant_skies_follow_their_densities() {
    let sky = ConstantLight { radiance: Rgb::WHITE };
    let level = sidak(0.01, 2 * normals().len());
    for (n, combined) in normals().into_iter().flat_map(|n| [(n, true), (n, false)]) {
        let sample = |i| sky.sample(n, uniform(i), combined).map(|s| s.wi);
        let o = on_sphere(SAMPLES, sample, |w| sky.pdf(w, n, combined).0.into());
        assert!(o.p_value > level && o.lost == 0.0 && (o.integral - 1.0).abs() < 1e-2, "{n}, {combined}: {o:?}");
    }
}

/// Environment maps, each turned about an axis of no symmetry.
fn maps() -> Vec<(&'static str, EnvironmentLight)> {
    let grey = |on: bool| if on { Rgb::WHITE } else { Rgb::BLACK };
    let sun = |x: u32, y: u32| Rgb::new(0.3, 0.5, 1.0) * if (x, y) == (40, 9) { 5e4 } else { 1.0 };
    // A colour and a brightness for every pixel.
    let mixed = |x: u32, y: u32| Rgb::new((x * y % 7) as f32, (x + 2 * y) as f32 % 5.0, (3 * x + y) as f32 % 11.0);
    let axis = DVec3::new(0.48, -0.6, 0.64);
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
    [
        ("uniform", 7, 4, map(7, 4, |_, _| Rgb::splat(0.2)), DMat3::IDENTITY),
        ("sun", 64, 32, map(64, 32, sun), DMat3::from_axis_angle(axis, 1.0)),
        ("one pixel", 50, 21, map(50, 21, |x, y| grey((x, y) == (0, 13))), DMat3::from_axis_angle(axis, 2.0)),
        ("poles", 8, 9, map(8, 9, |x, y| grey(y % 8 == 0) * x as f32), DMat3::IDENTITY),
        ("least size", 2, 3, map(2, 3, |x, y| grey(x == 0 || y == 2)), DMat3::from_axis_angle(axis, 3.0)),
        ("equator", 9, 5, map(9, 5, |x, y| grey(y == 2) * (1.0 + x as f32)), DMat3::from_axis_angle(axis, 4.0)),
        ("mixed", 31, 16, map(31, 16, mixed), DMat3::from_axis_angle(axis, 5.0) * mirror),
    ]
    .map(|(name, _, _, map, turn)| (name, EnvironmentLight::new(&map, 3.0, turn, true).unwrap()))
    .into()
}

/// Hypothesis: directions have the density that [`EnvironmentLight::seen`] states, whose integral is 1, for every normal, alone
/// and in combination with bsdf sampling. 40,000 independent samples each, together a false-alarm rate of 1 %; the seed is
/// fixed.
#[test]
fn environment_maps_follow_their_densities() {
    let maps = maps();
    let level = sidak(0.01, 2 * maps.len() * normals().len());
    for (name, light) in &maps {
        for (n, combined) in normals().into_iter().flat_map(|n| [(n, true), (n, false)]) {
            let sample = |i| light.sample(n, uniform(i), combined).map(|s| s.wi);
            let o = on_sphere(SAMPLES, sample, |w| light.seen(&w, n, combined).1.0.into());
            let right = o.p_value > level && o.lost == 0.0 && (o.integral - 1.0).abs() < 1e-2;
            assert!(right, "{name}, {n}, {combined}: {o:?}");
        }
    }
}

#[test]
fn wrong_densities_of_environment_maps_are_rejected() {
    let maps = maps();
    let find = |name: &str| &maps.iter().find(|m| m.0 == name).unwrap().1;
    let (light, n) = (find("mixed"), Vec3::new(0.6, 0.0, 0.8));
    let sample = |i| light.sample(n, uniform(i), false).map(|s| s.wi);
    let claims: [&dyn Fn(Vec3) -> f32; 5] = [
        &|w| light.seen(&w, n, true).1.0,
        &|w| find("uniform").seen(&w, n, false).1.0,
        // A map half a pixel beside itself.
        &|w| light.seen(&(Mat3::from_rotation_y(0.1) * w), n, false).1.0,
        // For a normal two bins from it, and for none.
        &|w| light.seen(&w, Mat3::from_rotation_y(0.2) * n, false).1.0,
        &|w| light.seen(&w, Vec3::ZERO, false).1.0,
    ];
    for (i, claim) in claims.into_iter().enumerate() {
        let o = on_sphere(SAMPLES, sample, |w| claim(w).into());
        assert!(o.p_value < 1e-6, "claim {i} was accepted: {o:?}");
    }
}

/// Alone, the density is positive wherever there is light that the surface can see, at the poles, too, and finite. A sample says
/// of itself what is said of its direction, up to the rounding of directions, times the steepest slope of a map.
#[test]
fn environment_maps_are_sampled_in_proportion_to_what_is_seen() {
    let directions = (0..4000).map(|i| warp::square_to_uniform_sphere(uniform(i)));
    let along_axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|v| [v, -v]);
    let near_poles = (0..40).map(|i| Vec3::new(libm::ldexpf(0.6, -i), -1.0, libm::ldexpf(0.8, -i)).normalize());
    let all: Vec<Vec3> = directions.chain(along_axes).chain(near_poles).collect();
    for ((name, light), n) in maps().iter().flat_map(|map| normals().into_iter().map(move |n| (map, n))) {
        for w in &all {
            let (radiance, pdf) = light.seen(w, n, false);
            assert!(pdf.0.is_finite() && radiance.is_finite());
            assert!(!radiance.is_black() || pdf.0 == 0.0, "{name}, {n}, {w}: {radiance:?}, {pdf:?}");
            let seen = n == Vec3::ZERO || n.dot(*w) > 0.0;
            assert!(radiance.is_black() || !seen || pdf.0 > 0.0, "{name}, {n}, {w}: {radiance:?}, {pdf:?}");
        }
        // Where a surface sees nothing there is no sample.
        for s in (0..4000).filter_map(|i| light.sample(n, uniform(i), false)) {
            let (radiance, pdf) = light.seen(&s.wi, n, false);
            let slope = light.brightest() * 64.0 * f32::EPSILON;
            assert!(
                (radiance.0 - s.radiance.0).abs().max_element() <= slope + 1e-4 * s.radiance.max_component(),
                "{name}"
            );
            assert!((s.wi.length() - 1.0).abs() < 4.0 * f32::EPSILON);
            // Four weights may add up to a little more than one.
            let most = light.brightest() * (1.0 + 4.0 * f32::EPSILON);
            assert!(pdf.0 > 0.0 && s.radiance.max_component() <= most, "{name}");
        }
    }
}

/// What an unoccluded diffuse surface reflects is the cosine over the density times the same for all samples, if that is
/// perfect. Relative variance of the one and of sampling by light alone, 20,000 samples: less than a fifth on average.
#[test]
fn facing_what_is_sampled_makes_less_noise() {
    let variance = |light: &EnvironmentLight, n: Vec3, n_sampled: Vec3| {
        let values = (0..20_000).map(|i| {
            let of = |s: LightSample| f64::from(s.radiance.luminance() * n.dot(s.wi).max(0.0) / s.pdf.unwrap().0);
            light.sample(n_sampled, uniform(i), false).map_or(0.0, of)
        });
        let (sum, squares) = values.fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
        squares * 20_000.0 / (sum * sum) - 1.0
    };
    let picture = map(64, 32, |x, y| Rgb::splat(1.0 + (x * 5 % 7 + y * 3 % 5) as f32));
    let light = EnvironmentLight::new(&picture, 1.0, DMat3::IDENTITY, false).unwrap();
    let sums = normals()[1..]
        .iter()
        .fold([0.0; 2], |sums, n| [sums[0] + variance(&light, *n, *n), sums[1] + variance(&light, *n, Vec3::ZERO)]);
    assert!(sums[0] < 0.2 * sums[1], "{sums:?}");
}

/// Two rows from the poles and farther the density is the luminance over its mean but for sin θ, which is interpolated with the
/// luminance: between ⅔ and 1½ of it.
#[test]
fn environment_maps_are_sampled_in_proportion_to_their_luminance() {
    let rows = 16_u32;
    let picture = map(31, rows, |x, y| Rgb::splat(1.0 + (x * 5 % 7 + y * 3 % 5) as f32));
    let light = EnvironmentLight::new(&picture, 1.0, DMat3::IDENTITY, false).unwrap();
    let near = libm::cosf(2.0 * std::f32::consts::PI / (rows - 1) as f32);
    let directions = (0..4000).map(|i| warp::square_to_uniform_sphere(uniform(i))).filter(|w| w.y.abs() < near);
    let ratios = directions.map(|w| {
        let (radiance, pdf) = light.seen(&w, Vec3::ZERO, false);
        pdf.0 / radiance.luminance()
    });
    let (low, high) = ratios.fold((f32::INFINITY, 0.0f32), |(l, h), r| (l.min(r), h.max(r)));
    assert!(low > 0.0 && high < low * 1.5 * 1.5, "from {low} to {high}");
}

/// Mitsuba's latitude and longitude: the first row is at +y, the middle of a row at +z, its first quarter at +x; columns are
/// half a pixel from the edges, rows on the poles.
#[test]
fn pixels_of_environment_maps_are_where_mitsuba_has_them() {
    let columns = map(8, 5, |x, _| Rgb::splat(1.0 + x as f32));
    let rows = map(8, 5, |_, y| Rgb::splat(1.0 + y as f32));
    let value = |map: &Arc<Picture>, w: Vec3| {
        EnvironmentLight::new(map, 1.0, DMat3::IDENTITY, false).unwrap().seen(&w.normalize(), Vec3::ZERO, false).0.0.x
    };
    let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-5, "{a}, but {b}");
    // Between the last and the first column, between the second and the third, and so on.
    for (w, expected) in [(Vec3::NEG_Z, 4.5), (Vec3::X, 2.5), (Vec3::Z, 4.5), (Vec3::NEG_X, 6.5)] {
        close(value(&columns, w), expected);
        close(value(&rows, w), 3.0);
    }
    let node = |column: f32| (std::f32::consts::TAU * (column + 0.5) / 8.0).sin_cos();
    for column in 0..8u8 {
        let (sin, cos) = node(column.into());
        close(value(&columns, Vec3::new(sin, 0.3, -cos)), 1.0 + f32::from(column));
        let (sin, cos) = node(f32::from(column) + 0.25);
        close(value(&columns, Vec3::new(sin, -0.7, -cos)), if column == 7 { 6.25 } else { 1.25 + f32::from(column) });
    }
    for (w, expected) in [(Vec3::Y, 1.0), (Vec3::NEG_Y, 5.0), (Vec3::Y + Vec3::X, 2.0), (Vec3::NEG_Y + Vec3::Z, 4.0)] {
        close(value(&rows, w), expected);
    }
    let third = (std::f32::consts::PI / 3.0).sin_cos();
    close(value(&rows, Vec3::new(third.0, third.1, 0.0)), 1.0 + 4.0 / 3.0);
}

/// A map turned by a matrix is seen as the map itself in the direction turned back.
#[test]
fn environment_maps_turn_with_their_frame() {
    let picture = map(16, 9, |x, y| Rgb::new(x as f32, y as f32, 1.0));
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.2);
    let [straight, turned] = [DMat3::IDENTITY, turn].map(|m| EnvironmentLight::new(&picture, 1.0, m, false).unwrap());
    for i in 0..1000 {
        let w = warp::square_to_uniform_sphere(uniform(i));
        let (a, b) = (
            straight.seen(&w, Vec3::ZERO, false).0,
            turned.seen(&(turn * w.as_dvec3()).as_vec3(), Vec3::ZERO, false).0,
        );
        assert!((a.0 - b.0).abs().max_element() < 1e-4, "{w}: {a:?}, {b:?}");
    }
}

#[test]
fn black_maps_are_no_lights() {
    assert!(EnvironmentLight::new(&map(4, 4, |_, _| Rgb::BLACK), 1.0, DMat3::IDENTITY, true).is_none());
    assert!(EnvironmentLight::new(&map(4, 4, |_, _| Rgb::WHITE), 0.0, DMat3::IDENTITY, true).is_none());
    // A map of one colour is not compensated: nothing would be left.
    let grey = EnvironmentLight::new(&map(4, 4, |_, _| Rgb::splat(0.3)), 1.0, DMat3::IDENTITY, true).unwrap();
    assert_eq!(grey.seen(&Vec3::X, Vec3::ZERO, true), grey.seen(&Vec3::X, Vec3::ZERO, false));
}

/// However many are sampled for together, each gets the same bits; and those who ask for nothing are in nobody's way.
#[test]
fn lanes_of_environment_maps_do_not_matter() {
    const LANES: usize = 32;
    let bits = |sample: Option<LightSample>| {
        let sample = sample?;
        let [wi, radiance] = [sample.wi, sample.radiance.0].map(|v| v.to_array().map(f32::to_bits));
        Some((wi, radiance, sample.pdf.unwrap().0.to_bits()))
    };
    for (name, light) in maps() {
        let n = normals();
        let receiver = |i: usize| (i % 5 != 3).then(|| (n[i % n.len()], uniform(i as u32)));
        for combined in [true, false] {
            let mut found = FoundSky::<LANES>::NONE;
            light.sample_all(LANES - 2, receiver, combined, &mut found);
            for i in 0..LANES - 2 {
                let Some((n, u)) = receiver(i) else { continue };
                assert_eq!(bits(found.sample(i)), bits(light.sample(n, u, combined)), "{name}, {n}, {u}");
            }
        }
    }
}
