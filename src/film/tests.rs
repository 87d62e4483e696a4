//! Laws of the film.

use super::*;

const CROP: Crop = Crop { x: 5, y: 9, width: 37, height: 21 };

fn value(id: SampleId) -> Rgb {
    let h = (id.x * 7919 + id.y * 104_729 + id.index * 1299) % 1000;
    Rgb::new(h as f32 * 0.1, (h * h) as f32 * 1e-7, -1e-3 * h as f32)
}

fn ids(samples: u32) -> Vec<SampleId> {
    let mut ids = Vec::new();
    for y in CROP.y..CROP.y + CROP.height {
        for x in CROP.x..CROP.x + CROP.width {
            ids.extend((0..samples).map(|index| SampleId { x, y, index }));
        }
    }
    ids
}

fn film_of(mut ids: Vec<SampleId>, chunk: usize, reverse: bool) -> Film {
    let film = Film::new(CROP, Scale::for_radiance(100.0));
    if reverse {
        ids.reverse();
    }
    for part in ids.chunks(chunk) {
        for index in 0..film.tile_count() {
            let mut tile = film.start_tile(index);
            let b = tile.bounds();
            for &id in part {
                if (b.x..b.x + b.width).contains(&id.x) && (b.y..b.y + b.height).contains(&id.y) {
                    tile.add_sample(id, value(id));
                }
            }
            film.add(&tile);
        }
    }
    film
}

#[test]
fn the_order_of_samples_and_tiles_changes_no_bit() {
    let a = film_of(ids(5), usize::MAX, false).develop();
    for (chunk, reverse) in [(100, false), (333, true), (1000, true)] {
        assert_eq!(a, film_of(ids(5), chunk, reverse).develop());
    }
}

#[test]
fn tiles_cover_the_crop_once() {
    let film = Film::new(CROP, Scale::for_radiance(1.0));
    let mut count = vec![0; (CROP.width * CROP.height) as usize];
    for i in 0..film.tile_count() {
        let b = film.tile_bounds(i);
        for y in b.y..b.y + b.height {
            for x in b.x..b.x + b.width {
                count[((y - CROP.y) * CROP.width + x - CROP.x) as usize] += 1;
            }
        }
    }
    assert!(count.iter().all(|&c| c == 1));
}

#[test]
fn bad_samples_are_left_out_counted_and_named() {
    let film = Film::new(CROP, Scale::for_radiance(1.0));
    let id = |index| SampleId { x: CROP.x, y: CROP.y, index };
    let mut tile = film.start_tile(0);
    tile.add_sample(id(0), Rgb::splat(2.0));
    tile.add_sample(id(1), Rgb::new(f32::NAN, 0.0, 0.0));
    tile.add_sample(id(2), Rgb::splat(4.0));
    film.add(&tile);
    assert_eq!(film.develop().get(0, 0), Rgb::splat(3.0));
    assert_eq!(film.dropped(), Dropped { count: 1, examples: vec![id(1)] });
}

#[test]
fn a_million_samples_lose_nothing() {
    let film = Film::new(Crop { x: 0, y: 0, width: 1, height: 1 }, Scale::for_radiance(1.0));
    let mut tile = film.start_tile(0);
    for index in 0..1_000_000 {
        tile.add_sample(SampleId { x: 0, y: 0, index }, Rgb::splat(0.1));
    }
    film.add(&tile);
    assert_eq!(film.develop().get(0, 0), Rgb::splat(0.1));
}
