//! Laws of the film.

use super::*;
use glam::Vec2;

const CROP: Crop = Crop { x: 5, y: 9, width: 37, height: 21 };

const FILTERS: [Filter; 7] = [
    Filter::Box,
    Filter::Tent { radius: 1.0 },
    Filter::Tent { radius: 0.3 },
    Filter::DEFAULT,
    Filter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
    Filter::CatmullRom,
    // Wider than a tile, so that one tile reaches many.
    Filter::Lanczos { lobes: 19 },
];

fn value(id: SampleId) -> Rgb {
    let h = (id.x * 7919 + id.y * 104_729 + id.index as i32 * 1299).rem_euclid(1000);
    Rgb::new(h as f32 * 0.1, (h * h) as f32 * 1e-7, -1e-3 * h as f32)
}

/// A place in the pixel that depends on the sample.
fn position(id: SampleId) -> Vec2 {
    let h = (id.x * 31 + id.y * 17) as u32 ^ id.index.wrapping_mul(0x9e37_79b9);
    Vec2::new((h % 64) as f32 / 64.0, (h / 64 % 64) as f32 / 64.0)
}

fn ids(area: Area, samples: u32) -> Vec<SampleId> {
    let mut ids = Vec::new();
    for y in area.y..area.y + area.height as i32 {
        for x in area.x..area.x + area.width as i32 {
            ids.extend((0..samples).map(|index| SampleId { x, y, index }));
        }
    }
    ids
}

fn film_of(crop: Crop, filter: Filter, border: bool, chunk: usize, reverse: bool) -> Film {
    let film = Film::new(crop, filter, border, Scale::for_radiance(100.0));
    let mut ids = ids(filter.sampled_area(crop, border), 3);
    let mut tiles: Vec<usize> = (0..film.tile_count()).collect();
    if reverse {
        ids.reverse();
        tiles.reverse();
    }
    for part in ids.chunks(chunk) {
        for &index in &tiles {
            let mut tile = film.start_tile(index);
            for &id in part.iter().filter(|id| tile.bounds().contains(id.x, id.y)).collect::<Vec<_>>() {
                tile.add_sample(id, value(id), || position(id));
            }
            film.add(&tile, 0);
        }
    }
    film
}

#[test]
fn the_order_of_samples_and_tiles_changes_no_bit() {
    for filter in FILTERS {
        for border in [false, true] {
            let a = film_of(CROP, filter, border, usize::MAX, false).develop();
            for (chunk, reverse) in [(100, false), (333, true), (1000, true)] {
                assert_eq!(a, film_of(CROP, filter, border, chunk, reverse).develop(), "{filter:?}");
            }
        }
    }
}

/// The definition, in f64: each pixel the mean of all samples, weighted by their distance to its middle. Weights are
/// rounded to 2⁻²⁹, and the sum of weights is at least a tenth of the largest here, so that pixels differ by at most some
/// 10⁻⁷ of the largest value (10²).
#[test]
fn pixels_are_weighted_means() {
    for (filter, border) in FILTERS.into_iter().flat_map(|f| [(f, false), (f, true)]) {
        let picture = film_of(CROP, filter, border, usize::MAX, false).develop();
        let samples = ids(filter.sampled_area(CROP, border), 3);
        for (px, py) in [(5, 9), (6, 9), (20, 20), (21, 25), (41, 29), (41, 9), (30, 12)] {
            let (mut sum, mut weights) = (0.0, 0.0);
            for &id in &samples {
                let d = |pixel: i32, own: i32, u: f32| f64::from(pixel - own) + 0.5 - f64::from(u);
                let at = position(id);
                // Where in the pixel a sample lies does not matter to the box filter; that it is inside does.
                let w = match filter {
                    Filter::Box => f64::from(u8::from((px, py) == (id.x, id.y))),
                    _ => filter.value(d(px, id.x, at.x)) * filter.value(d(py, id.y, at.y)),
                };
                sum += w * f64::from(value(id).to_array()[0]);
                weights += w;
            }
            let want = if weights == 0.0 { 0.0 } else { sum / weights };
            let got = f64::from(picture.get((px - 5) as u32, (py - 9) as u32).to_array()[0]);
            assert!((got - want).abs() < 2e-5, "{filter:?}, border {border}, pixel {px},{py}: {got}, not {want}");
        }
    }
}

#[test]
fn a_flat_field_is_flat() {
    const FLAT: f32 = 0.3;
    for filter in FILTERS {
        let film = Film::new(CROP, filter, false, Scale::for_radiance(1.0));
        for index in 0..film.tile_count() {
            let mut tile = film.start_tile(index);
            for id in ids(tile.bounds(), 5) {
                tile.add_sample(id, Rgb::splat(FLAT), || position(id));
            }
            film.add(&tile, 0);
        }
        for p in film.develop().pixels() {
            // A tent that is narrower than a pixel may miss every sample.
            assert!(*p == Rgb::splat(FLAT) || (filter == FILTERS[2] && p.is_black()), "{filter:?}: {p:?}");
        }
    }
}

/// With a border of samples, a pixel does not depend on where the picture is cut.
#[test]
fn a_crop_with_a_border_shows_the_bits_of_the_whole() {
    let part = Crop { x: 13, y: 14, width: 9, height: 10 };
    for filter in FILTERS {
        let whole = film_of(CROP, filter, true, usize::MAX, false).develop();
        let crop = film_of(part, filter, true, usize::MAX, false).develop();
        for (x, y) in (0..part.height).flat_map(|y| (0..part.width).map(move |x| (x, y))) {
            assert_eq!(crop.get(x, y), whole.get(x + part.x - CROP.x, y + part.y - CROP.y), "{filter:?} {x},{y}");
        }
    }
}

#[test]
fn tiles_cover_the_crop_once() {
    let film = Film::new(CROP, Filter::Box, false, Scale::for_radiance(1.0));
    let mut count = vec![0; (CROP.width * CROP.height) as usize];
    for i in 0..film.tile_count() {
        let b = film.tile_bounds(i);
        for id in ids(b, 1) {
            count[Area::from(CROP).index(id.x, id.y)] += 1;
        }
    }
    assert!(count.iter().all(|&c| c == 1));
}

#[test]
fn bad_samples_are_left_out_counted_and_named() {
    for filter in FILTERS {
        let film = Film::new(CROP, filter, false, Scale::for_radiance(1.0));
        let id = |index| SampleId { x: CROP.x as i32, y: CROP.y as i32, index };
        let mut tile = film.start_tile(0);
        let middle = || Vec2::splat(0.5);
        tile.add_sample(id(0), Rgb::splat(2.0), middle);
        tile.add_sample(id(1), Rgb::new(f32::NAN, 0.0, 0.0), middle);
        tile.add_sample(id(2), Rgb::splat(4.0), middle);
        tile.add_sample(id(3), Rgb::new(0.0, 1e10, 0.0), middle);
        film.add(&tile, 0);
        assert_eq!(film.develop().get(0, 0), Rgb::splat(3.0), "{filter:?}");
        let dropped = Dropped { count: 2, oversized: 1, negative: 0, examples: vec![id(1), id(3)] };
        assert_eq!(film.dropped(), dropped, "{filter:?}");
        assert_eq!(film.dropped().non_finite(), 1);
    }
}

/// What is beside radiance counts the samples that radiance counts; numbers are told once, and stay in their pixel.
#[test]
fn what_is_beside_radiance_belongs_to_the_samples_that_count() {
    for filter in FILTERS {
        let film = Film::new(CROP, filter, false, Scale::for_radiance(1.0));
        let film = film.with_extras(Extras { means: vec![Scale::for_exponent(0), Scale::for_exponent(9)], numbers: 2 });
        let (x, y) = (CROP.x as i32, CROP.y as i32);
        let middle = || Vec2::splat(0.5);
        let mut first = film.start_tile(0);
        first.set_numbers(x, y, &[7, u32::MAX]);
        first.add_sample_with(SampleId { x, y, index: 0 }, Rgb::splat(f32::NAN), middle, &[0.5, 9.0]);
        first.add_sample_with(SampleId { x, y, index: 1 }, Rgb::WHITE, middle, &[0.25, 300.0]);
        let mut second = film.start_tile(0);
        second.add_sample_with(SampleId { x, y, index: 2 }, Rgb::WHITE, middle, &[-0.75, 100.0]);
        for tile in [second, first] {
            film.add(&tile, 0);
        }
        assert_eq!((film.means(0)[0], film.means(1)[0]), (-0.25, 200.0), "{filter:?}");
        assert_eq!((film.numbers(0)[0], film.numbers(1)[0], film.sample_counts()[0]), (7, u32::MAX, 2), "{filter:?}");
        assert_eq!((film.numbers(0)[1], film.sample_counts()[1], film.dropped().count), (0, 0, 1), "{filter:?}");
        // Tiles in which nothing happened are empty planes of the right size.
        let pixels = (CROP.width * CROP.height) as usize;
        assert_eq!((film.means(0).len(), film.numbers(1).len(), film.sample_counts().len()), (pixels, pixels, pixels));
    }
}

#[test]
fn a_million_samples_lose_nothing() {
    for filter in [Filter::Box, Filter::DEFAULT] {
        let one = Crop { x: 0, y: 0, width: 1, height: 1 };
        let film = Film::new(one, filter, false, Scale::for_radiance(1.0));
        let mut tile = film.start_tile(0);
        for index in 0..1_000_000 {
            let id = SampleId { x: 0, y: 0, index };
            tile.add_sample(id, Rgb::splat(0.1), || position(id));
        }
        film.add(&tile, 0);
        assert_eq!(film.develop().get(0, 0), Rgb::splat(0.1));
    }
}

/// What is above the limit keeps its hue, what is below or not finite stays what it is; without a limit nothing changes.
#[test]
fn samples_are_scaled_down_to_the_limit() {
    let crop = Crop { x: 0, y: 0, width: 1, height: 1 };
    let seen = |most: Option<f32>, radiance: Rgb| {
        let film = Film::new(crop, Filter::Box, false, Scale::for_radiance(100.0));
        let film = match most {
            Some(most) => film.clamped(most),
            None => film,
        };
        let mut tile = film.start_tile(0);
        tile.add_sample(SampleId { x: 0, y: 0, index: 0 }, radiance, || Vec2::ZERO);
        film.add(&tile, 0);
        (film.develop().get(0, 0), film.dropped().count)
    };
    let bright = Rgb::new(8.0, 4.0, -1.0);
    assert_eq!(seen(Some(2.0), bright), (Rgb::new(2.0, 1.0, -0.25), 0));
    assert_eq!(seen(Some(8.0), bright), (bright, 0));
    assert_eq!(seen(None, bright), (bright, 0));
    for bad in [f32::INFINITY, f32::NAN] {
        assert_eq!(seen(Some(2.0), Rgb::new(bad, 1.0, 1.0)), (Rgb::BLACK, 1));
    }
}
