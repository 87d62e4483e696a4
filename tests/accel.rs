//! Both accelerators against the oracle and against each other: what they find, what they lose, and who wins a tie.
#![allow(clippy::print_stdout, reason = "says what was measured, if asked by --nocapture")]

mod accel_support;

use accel_support::{
    Rng, accelerators, boxes, build, check, chord, closed_cylinder, closest, cuboid, degenerate, displaced_sphere,
    is_inside, layers, occluded, on_surface, random_axes, random_cylinder, random_disk, random_instances, random_rays,
    random_soup, random_sphere, scaled, segment, slivers, soup, spawned,
};
use glam::Vec3;
use snell::accel::oracle::{self, Verdict};
use snell::accel::{Accel, Accelerator, Hit, Start};
use snell::math::ray::Ray;
use snell::shape::offset::SurfacePoint;
use snell::shape::sphere::Sphere;
use snell::shape::triangle::WatertightRay;
use snell::shape::{Shape, TriangleMesh};

/// 20,000 rays over soups from one triangle to 2,000.
#[test]
fn random_soups() {
    let mut rng = Rng(1);
    for (count, size) in [(1, 1.0), (2, 1.0), (3, 0.5), (4, 0.5), (5, 0.5), (9, 1.0), (60, 0.3), (2000, 0.1)] {
        let shapes = [soup(&random_soup(&mut rng, count, size)), soup(&random_soup(&mut rng, count, size))];
        check(&shapes, &random_rays(&mut rng, 2500, 1.0));
    }
}

/// The tree leaves nothing out: 12,000 rays find exactly what the same test finds over all triangles, of very different
/// sizes, from origins inside and up to 10⁵ times as far as the scene, along the axes and askew.
#[test]
fn tree_finds_what_a_loop_finds() {
    let mut rng = Rng(11);
    for distance in [0.0, 1.0, 10.0, 1e3, 1e5] {
        let mut triangles = random_soup(&mut rng, 400, 1.0);
        for size in [0.1, 1e-2, 1e-4] {
            triangles.extend(random_soup(&mut rng, 400, size));
        }
        let rays: Vec<Ray> = (0..2400)
            .map(|i| {
                let [a, b, c] = triangles[rng.below(triangles.len())];
                let o = rng.in_cube() + distance * rng.direction();
                let mut d = a.lerp(b, rng.unit()).lerp(c, rng.unit()) - o;
                if i % 4 == 0 {
                    d[rng.below(3)] = 0.0;
                }
                if i % 8 == 0 {
                    d[rng.below(3)] *= 1e-20;
                }
                Ray::new(if i % 6 == 0 { a - d } else { o }, d)
            })
            .filter(|ray| ray.d != Vec3::ZERO)
            .collect();
        let hits = closest(&build(Accelerator::Native, &[soup(&triangles)]), &rays);
        for (ray, hit) in rays.iter().zip(hits) {
            let watertight = WatertightRay::new(ray);
            let distances = triangles.iter().map(|t| watertight.intersect(t[0], t[1], t[2]));
            let nearest = (0u32..).zip(distances).filter_map(|(primitive, t)| Some((t?, primitive)));
            let nearest = nearest.min_by(|a, b| a.partial_cmp(b).expect("no distance is NaN"));
            let truth = nearest.map_or(Hit::NONE, |(_, primitive)| Hit { shape: 0, primitive });
            assert_eq!(hit, truth, "{ray:?}");
        }
    }
}

/// 8,000 rays over needles of width 1e-3 to 1e-7 of their length.
#[test]
fn needles() {
    let mut rng = Rng(2);
    for width in [1e-3, 1e-5, 1e-6, 1e-7] {
        let triangles = slivers(&mut rng, 300, width);
        let rays: Vec<Ray> = (0..2000)
            .map(|_| {
                let [a, b, c] = triangles[rng.below(triangles.len())];
                let (o, s) = (1.5 * rng.in_cube(), rng.unit());
                Ray::new(o, a.lerp(b, s).lerp(c, rng.unit()) - o)
            })
            .collect();
        check(&[soup(&triangles)], &rays);
    }
}

/// 4,000 rays at triangles that are points, segments or lines among some that are none of these, and at meshes of nothing
/// else: what has no area is not met, and hides nothing.
#[test]
fn degenerate_triangles() {
    let mut rng = Rng(16);
    let triangles = degenerate(&mut rng, 100);
    let flat: Vec<_> = triangles.iter().copied().filter(|[a, b, c]| (b - a).cross(c - a) == Vec3::ZERO).collect();
    assert!(flat.len() >= 300, "{}", flat.len());
    for triangles in [triangles, flat] {
        let shapes = [soup(&triangles)];
        check(&shapes, &random_rays(&mut rng, 1000, 1.0));
        let aimed: Vec<Ray> = (0..1000)
            .map(|_| {
                let [a, b, c] = triangles[rng.below(triangles.len())];
                let o = 1.5 * rng.in_cube();
                Ray::new(o, a.lerp(b, rng.unit()).lerp(c, rng.unit()) - o)
            })
            .collect();
        check(&shapes, &aimed);
    }
}

/// 3,000 rays a scale. Far beyond what a scene can be after it is brought to unit size.
#[test]
fn huge_and_tiny() {
    let mut rng = Rng(3);
    for exponent in [-100, -60, -20, 20, 40, 60] {
        let scale = 2.0f32.powi(exponent);
        let triangles: Vec<_> = random_soup(&mut rng, 200, 0.3).into_iter().map(|t| t.map(|v| scale * v)).collect();
        let shapes = [soup(&triangles)];
        let rays = random_rays(&mut rng, 3000, scale);
        if exponent.abs() <= 40 {
            check(&shapes, &rays);
            continue;
        }
        // Embree's f32 products over- and underflow here.
        let hits = closest(&build(Accelerator::Native, &shapes), &rays);
        for (ray, hit) in rays.iter().zip(hits) {
            let truth = oracle::closest(&shapes, ray).map_or(Hit::NONE, |(hit, _)| hit);
            let fine =
                hit == truth || matches!(oracle::verdict(&shapes, ray, &[], truth, hit), Verdict::Tie | Verdict::Edge);
            assert!(fine, "2^{exponent}: {ray:?}: {hit:?}, but {truth:?}");
        }
    }
}

/// 12,000 rays along the axes and planes of boxes, many of them in the planes of boxes of the tree.
#[test]
fn parallel_to_axes() {
    let mut rng = Rng(4);
    let shapes = [boxes()];
    let grid = [-1.0, -0.999, -0.7, -0.6, -0.1, 0.0, 0.1, 0.3, 0.6, 0.7, 1.0, 2.0, -2.0];
    let rays: Vec<Ray> = (0..12_000)
        .map(|i| {
            let mut pick = || grid[rng.below(grid.len())];
            let o = Vec3::new(pick(), pick(), pick());
            let mut d = Vec3::ZERO;
            d[i % 3] = if i % 2 == 0 { 1.0 } else { -1.0 };
            if i % 5 == 0 {
                d[(i + 1) % 3] = if i % 7 == 0 { -0.0 } else { 1e-30 };
            }
            if i % 11 == 0 {
                d[(i + 2) % 3] = 0.5;
            }
            Ray::new(o, d)
        })
        .collect();
    check(&shapes, &rays);
}

/// 600,000 rays from inside a closed mesh of 43,200 triangles at random points, vertices and edge midpoints, from
/// origins that are no good numbers. Our own loses none; Embree none of the first kind.
#[test]
fn closed_mesh_is_tight() {
    let mut rng = Rng(5);
    let mesh = displaced_sphere(60);
    let aims: [fn(&mut Rng, [Vec3; 3]) -> Vec3; 3] = [
        |rng, [a, b, c]| a.lerp(b, rng.unit()).lerp(c, rng.unit()),
        |_, [a, _, _]| a,
        |_, [a, b, _]| a * 0.5 + b * 0.5,
    ];
    for (kind, aim) in aims.iter().enumerate() {
        let rays: Vec<Ray> = (0..200_000)
            .map(|_| {
                let o = 0.3 * rng.in_cube();
                let triangle = mesh.triangle(rng.below(mesh.faces.len()) as u32);
                Ray::new(o, aim(&mut rng, triangle) - o)
            })
            .collect();
        let shapes = [Shape::Mesh(mesh.clone())];
        for which in accelerators() {
            let accel = build(which, &shapes);
            let lost = closest(&accel, &rays).iter().filter(|hit| !hit.is_some()).count();
            let open = occluded(&accel, &rays).iter().filter(|occluded| !**occluded).count();
            println!("{which:?} loses {lost} and {open} of {} rays of kind {kind}", rays.len());
            let allowed = if which == Accelerator::Native || kind == 0 { 0 } else { rays.len() / 50 };
            assert!(lost <= allowed && open <= allowed, "{which:?} loses {lost}, {open} of kind {kind}");
        }
    }
}

/// The lowest shape, then the lowest primitive, of four copies of a soup: 4,000 rays. And coplanar overlaps.
#[test]
fn lowest_id_wins_a_tie() {
    let mut rng = Rng(6);
    let triangles = random_soup(&mut rng, 100, 0.4);
    let twice: Vec<_> = triangles.iter().chain(triangles.iter().rev()).copied().collect();
    let shapes = [soup(&twice), soup(&twice)];
    let accel = build(Accelerator::Native, &shapes);
    let rays = random_rays(&mut rng, 4000, 1.0);
    for (ray, hit) in rays.iter().zip(closest(&accel, &rays)) {
        assert!(hit == Hit::NONE || (hit.shape == 0 && hit.primitive < 100), "{ray:?}: {hit:?}");
    }
    check(&shapes, &rays);
    let overlapping = layers(&mut rng, 50, 0.25);
    let rays: Vec<Ray> = (0..4000)
        .map(|_| {
            let o = Vec3::new(rng.between(-1.0, 1.0), 1.0, rng.between(-1.0, 1.0));
            Ray::new(o, Vec3::new(0.3 * rng.unit(), -1.0, 0.3 * rng.unit()))
        })
        .collect();
    let shapes = [soup(&overlapping)];
    check(&shapes, &rays);
    for (ray, hit) in rays.iter().zip(closest(&build(Accelerator::Native, &shapes), &rays)) {
        let lower = (0..50).find(|&primitive| is_inside(&shapes, Hit { shape: 0, primitive }, ray));
        assert!(lower.is_none_or(|lower| hit.primitive <= lower), "{ray:?}: {hit:?}, but {lower:?}");
    }
}

/// Open intervals at exact distances: ends on the surface do not meet it.
#[test]
fn ends_of_the_interval() {
    let shapes = [
        soup(&cuboid(Vec3::splat(-1.0), Vec3::splat(1.0))),
        Shape::Sphere(Sphere { centre: Vec3::new(4.0, 0.0, 0.0), radius: 1.0, flip: false }),
    ];
    for which in accelerators() {
        let accel = build(which, &shapes);
        let along = |tmin: f32, tmax: f32| {
            let ray = Ray { o: Vec3::new(0.0, 0.25, 0.125), tmin, d: Vec3::X, tmax };
            let (hit, answer) = (closest(&accel, &[ray])[0], occluded(&accel, &[ray])[0]);
            assert_eq!(hit.is_some(), answer);
            hit.shape
        };
        assert_eq!(along(0.0, f32::INFINITY), 0, "{which:?}");
        assert_eq!(along(1.0, f32::INFINITY), 1, "{which:?}");
        assert_eq!(along(0.0, 1.0), Hit::NONE.shape, "{which:?}");
        assert_eq!(along(1.0, 3.0), Hit::NONE.shape, "{which:?}");
        assert_eq!(along(3.5, 6.0), 1, "{which:?}");
        assert_eq!(along(6.0, 9.0), Hit::NONE.shape, "{which:?}");
    }
}

/// 12,000 rays among spheres, disks and cylinders, from inside and outside, alone, all together and mixed with triangles.
#[test]
fn quadrics_and_mixed_scenes() {
    let mut rng = Rng(7);
    let mut shapes: Vec<Shape> = Vec::new();
    for make in [random_sphere, random_disk, random_cylinder] {
        let alike: Vec<Shape> = (0..60).map(|_| make(&mut rng, 0.4)).collect();
        check(&alike, &random_rays(&mut rng, 2000, 1.0));
        shapes.extend(alike);
    }
    check(&shapes, &random_rays(&mut rng, 3000, 1.0));
    shapes.insert(7, soup(&random_soup(&mut rng, 200, 0.2)));
    shapes.push(Shape::Mesh(TriangleMesh::default()));
    check(&shapes, &random_rays(&mut rng, 3000, 1.0));
}

/// What a quadric of one size meets, it meets at any: 2,000 rays a scale and kind.
#[test]
fn huge_and_tiny_quadrics() {
    for make in [random_sphere, random_disk, random_cylinder] {
        let hits = |exponent: i32| {
            let (mut rng, scale) = (Rng(13), 2.0f32.powi(exponent));
            let shapes: Vec<Shape> = (0..40).map(|_| scaled(&make(&mut rng, 0.4), scale)).collect();
            let rays = random_rays(&mut rng, 2000, scale);
            check(&shapes, &rays);
            closest(&build(Accelerator::Native, &shapes), &rays)
        };
        let unit = hits(0);
        assert!(unit.iter().any(|hit| hit.is_some()));
        for exponent in [-40, -20, 20, 40] {
            assert_eq!(hits(exponent), unit, "2^{exponent}");
        }
    }
}

/// A cylinder closed by disks at both ends is closed: of 300,000 rays from inside, a third aimed at its rims, none gets
/// out, whatever affine map it went through.
#[test]
fn closed_cylinder_is_tight() {
    let mut rng = Rng(14);
    for round in 0..10 {
        let axes = random_axes(&mut rng, 0.8);
        let base = 0.2 * rng.in_cube().as_dvec3() - 0.5 * axes[2];
        let shapes = closed_cylinder(base, axes);
        let inside = |x: f64, y: f64, z: f64| base + x * axes[0] + y * axes[1] + z * axes[2];
        let rays: Vec<Ray> = (0..30_000)
            .map(|i| {
                let spread = 0.5 * rng.in_cube().as_dvec3();
                let o = inside(spread.x, spread.y, 0.5 + spread.z).as_vec3();
                let (y, x) = f64::from(rng.between(0.0, 7.0)).sin_cos();
                let rim = inside(x, y, f64::from(rng.next() as u32 % 2));
                let d = if i % 3 == 0 { rim.as_vec3() - o } else { rng.direction() };
                Ray::new(o, d)
            })
            .collect();
        for which in accelerators() {
            let accel = build(which, &shapes);
            let lost = closest(&accel, &rays).iter().filter(|hit| !hit.is_some()).count();
            let open = occluded(&accel, &rays).iter().filter(|occluded| !**occluded).count();
            assert_eq!((lost, open), (0, 0), "{which:?}, round {round}");
        }
    }
}

/// 300,000 rays that start on random quadrics: none meets what it starts on where it cannot, that is a disk anywhere, and
/// a sphere or cylinder from outside; and seen from inside, the far side is met and nothing nearer.
#[test]
fn no_ray_meets_its_own_quadric() {
    let (mut rng, mut through) = (Rng(15), 0);
    for make in [random_sphere, random_disk, random_cylinder] {
        for i in 0..1000 {
            let shape = make(&mut rng, if i % 2 == 0 { 0.4 } else { 1e-4 });
            let disk = matches!(shape, Shape::Disk(_));
            let accel = build(Accelerator::Native, std::slice::from_ref(&shape));
            for _ in 0..100 {
                let Some(p) = on_surface(&mut rng, &shape) else { continue };
                let d = rng.direction();
                let ray = Ray::new(p.origin_towards(d), d);
                let hit = closest(&accel, &[ray])[0];
                if disk || p.n.dot(d) > 0.0 {
                    assert!(!hit.is_some(), "{shape:?}: {ray:?} meets {hit:?}");
                } else if is_through(&shape, &p, ray.o) {
                    through += 1;
                } else if hit.is_some() {
                    // Less by no more than the origin was moved: coordinates below 2 are rounded by at most 2⁻²⁴ each.
                    let (t, chord) = (shape.resolve_distance(0, &ray), chord(&shape, p.p, d.as_dvec3()));
                    assert!(t > 0.5 * chord - 2f64.powi(-22), "{shape:?}: {ray:?}: {t} of {chord}");
                }
            }
        }
    }
    assert!(through < 10, "few cylinders are so thin, and these at their edges only: {through}");
}

/// Whether the origin may have been moved through the whole of what it starts on: at the edge of a flat cylinder that is thinner
/// than coordinates are rounded, nobody is inside.
fn is_through(shape: &Shape, p: &SurfacePoint, o: Vec3) -> bool {
    let inwards = p.n.as_dvec3() * (o.as_dvec3() - p.p).dot(p.n.as_dvec3()).signum();
    chord(shape, p.p, inwards) < 2.0 * (o.as_dvec3() - p.p).length()
}

#[test]
fn nothing_to_hit() {
    let empty_mesh = [Shape::Mesh(TriangleMesh::default())];
    for which in accelerators() {
        for shapes in [&[][..], &empty_mesh] {
            let accel = build(which, shapes);
            let rays = [Ray::new(Vec3::ZERO, Vec3::X)];
            assert_eq!(closest(&accel, &rays), [Hit::NONE], "{}", accel.name());
            assert_eq!(occluded(&accel, &rays), [false]);
            assert_eq!(closest(&accel, &[]), []);
        }
    }
}

/// A million triangles in one place, and 3,000 each of twice the size of the one before: no stack overflows.
#[test]
fn hopeless_inputs() {
    let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let accel = build(Accelerator::Native, &[soup(&vec![triangle; 1_000_000])]);
    let ray = Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z);
    assert_eq!(closest(&accel, &[ray]), [Hit { shape: 0, primitive: 0 }]);
    let nested: Vec<_> = (0..3000).map(|i| triangle.map(|v| v * 2.0f32.powi(i / 20 - 100))).collect();
    let accel = build(Accelerator::Native, &[soup(&nested)]);
    assert!(closest(&accel, &[ray])[0].is_some());
    assert_eq!(occluded(&accel, &[ray]), [true]);
}

/// 50,000 rays: the same hits from trees built by one thread and by four.
#[test]
fn same_for_any_number_of_threads() {
    let mut rng = Rng(8);
    let shapes = [Shape::Mesh(displaced_sphere(80))];
    let rays = random_rays(&mut rng, 50_000, 1.0);
    let answers: Vec<_> = [1, 4]
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let accel = pool.install(|| build(Accelerator::Native, &shapes));
            (closest(&accel, &rays), accel.memory_bytes())
        })
        .into();
    assert!(answers[0] == answers[1]);
}

/// Segments between two points that are the same meet nothing, on a surface or off, in anyone's eyes.
#[test]
fn empty_segments_are_free() {
    let mut rng = Rng(21);
    let shapes = [
        Shape::Mesh(displaced_sphere(10)),
        soup(&random_soup(&mut rng, 100, 0.3)),
        random_sphere(&mut rng, 0.5),
        random_disk(&mut rng, 0.5),
        random_cylinder(&mut rng, 0.5),
    ];
    let mut points: Vec<Vec3> = (0..200).map(|_| rng.in_cube()).collect();
    let on_surfaces = (0..200).filter_map(|i| on_surface(&mut rng, &shapes[2 + i % 3]));
    points.extend(on_surfaces.map(|point| point.p.as_vec3()));
    let Shape::Mesh(mesh) = &shapes[0] else { unreachable!() };
    points.extend(&mesh.positions);
    let segments: Vec<Ray> = points.iter().map(|&p| Ray::segment(p, p)).collect();
    for which in accelerators() {
        let accel = build(which, &shapes);
        assert!(closest(&accel, &segments).iter().all(|hit| !hit.is_some()), "{which:?}");
        assert!(occluded(&accel, &segments).iter().all(|answer| !answer), "{which:?}");
    }
}

/// A million rays that start on random triangles and slivers: none meets the one it starts on.
#[test]
fn no_ray_meets_its_own_surface() {
    let mut rng = Rng(9);
    for (name, stretch, count) in [("round", 1.0, 500_000), ("1:100", 1e-2, 250_000), ("1:10000", 1e-4, 250_000)] {
        let triangles: Vec<_> = random_soup(&mut rng, 2000, 0.3)
            .into_iter()
            .map(|[a, b, c]| [a, b, a.lerp(b, rng.unit()) + stretch * (c - a)])
            .collect();
        let shapes = [soup(&triangles)];
        let starts: Vec<usize> = (0..count).map(|_| rng.below(triangles.len())).collect();
        let rays: Vec<Ray> = starts.iter().map(|&i| spawned(&mut rng, triangles[i])).collect();
        for which in accelerators() {
            let accel = build(which, &shapes);
            let hits = closest(&accel, &rays);
            let own = hits.iter().zip(&starts).filter(|(hit, start)| hit.primitive as usize == **start).count();
            let answers = occluded(&accel, &rays);
            let differ = hits.iter().zip(&answers).filter(|(hit, answer)| hit.is_some() != **answer).count();
            println!("{which:?}, {name}: {own} self-hits, {differ} any hits differ, {:?}", accel.embree_false_hits());
            assert_eq!((own, differ), (0, 0), "{which:?} on {name} triangles");
        }
    }
}

/// 120,000 rays that leave the planes x = 0, y = 0 and z = 0, where no point has a coordinate that rounding could be
/// measured by, steeply and at slopes down to 10⁻⁶: none meets its own triangle or the other one of its rectangle.
#[test]
fn no_ray_meets_a_plane_through_the_origin_that_it_leaves() {
    let mut rng = Rng(17);
    for axis in 0..3 {
        let size = rng.between(1e-3, 1.0);
        let corner = |a: f32, b: f32| {
            let mut p = Vec3::ZERO;
            (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (a, size * b);
            p
        };
        let [a, b, c, d] = [corner(-1.0, -0.9), corner(0.8, -1.0), corner(1.0, 1.0), corner(-1.0, 0.7)];
        let triangles = [[a, b, c], [a, c, d]];
        let rays: Vec<Ray> = (0..40_000)
            .map(|i| {
                let Ray { o, mut d, .. } = spawned(&mut rng, triangles[i % 2]);
                d[axis] = rng.between(-20.0, 0.0).exp2().copysign(d[axis]);
                Ray::new(o, d.normalize())
            })
            .collect();
        for which in accelerators() {
            let hits = closest(&build(which, &[soup(&triangles)]), &rays);
            assert_eq!(hits.iter().filter(|hit| hit.is_some()).count(), 0, "{which:?}, axis {axis}");
        }
    }
}

/// 600,000 segments between points of random triangles and slivers, offset like the renderer's shadow rays: none is
/// blocked by either of the two.
#[test]
fn no_segment_is_blocked_by_its_ends() {
    let mut rng = Rng(12);
    for stretch in [1.0, 1e-2, 1e-4] {
        let triangles: Vec<_> = random_soup(&mut rng, 2000, 0.3)
            .into_iter()
            .map(|[a, b, c]| [a, b, a.lerp(b, rng.unit()) + stretch * (c - a)])
            .collect();
        // Two different ones: between points of one triangle there is no side to be on.
        let ends: Vec<[usize; 2]> = (0..200_000)
            .map(|_| {
                let first = rng.below(triangles.len());
                [first, (first + 1 + rng.below(triangles.len() - 1)) % triangles.len()]
            })
            .collect();
        let segments: Vec<Ray> = ends.iter().map(|ends| segment(&mut rng, ends.map(|i| triangles[i]))).collect();
        for which in accelerators() {
            let accel = build(which, &[soup(&triangles)]);
            let hits = closest(&accel, &segments);
            let own = hits.iter().zip(&ends).filter(|(hit, ends)| ends.contains(&(hit.primitive as usize))).count();
            let answers = occluded(&accel, &segments);
            let differ = hits.iter().zip(&answers).filter(|(hit, answer)| hit.is_some() != **answer).count();
            println!("{which:?}, 1:{stretch}: {own} blocked by an end, {differ} any hits differ");
            assert_eq!((own, differ), (0, 0), "{which:?} on triangles of 1:{stretch}");
        }
    }
}

/// 50,000 short segments within far small triangles. Rounded, some pierce the triangle that both their ends are on; who is told
/// of the ends takes none for hidden, and who is told of the start finds nothing.
#[test]
fn segments_within_a_triangle_are_free() {
    let mut rng = Rng(17);
    let triangles = random_soup(&mut rng, 50, 1e-3);
    let shapes = [soup(&triangles)];
    let at = |i: usize| Hit { shape: 0, primitive: (i % triangles.len()) as u32 };
    let segments: Vec<Ray> = (0..50_000).map(|i| segment(&mut rng, [triangles[i % triangles.len()]; 2])).collect();
    let pierced = (0..).zip(&segments).filter(|&(i, ray)| is_inside(&shapes, at(i), ray)).count();
    assert!(pierced > 1000, "{pierced}");
    let starts: Vec<Hit> = (0..segments.len()).map(at).collect();
    let ends: Vec<[Hit; 2]> = starts.iter().map(|&hit| [hit; 2]).collect();
    for which in accelerators() {
        let accel = build(which, &shapes);
        let (mut hits, mut hidden) = (vec![Hit::NONE; segments.len()], vec![true; segments.len()]);
        accel.closest_hits_from(&segments, Start::Primitives(&starts), &mut hits);
        accel.occluded_between(&segments, &ends, &mut hidden);
        assert_eq!(hits.iter().filter(|hit| hit.is_some()).count(), 0, "{which:?}");
        assert_eq!(hidden.iter().filter(|hidden| **hidden).count(), 0, "{which:?}");
        if let Some(counts) = accel.comparison() {
            assert_eq!((counts.rays, counts.examples.len(), counts.ties), (100_000, 0, 0), "{counts:?}");
        }
    }
}

/// 200,000 rays through both: nothing but ties and edges, no false hit and no miss of our own.
#[cfg(feature = "embree")]
#[test]
fn comparison_of_both() {
    let mut rng = Rng(10);
    let shapes = [
        Shape::Mesh(displaced_sphere(30)),
        Shape::Sphere(Sphere { centre: Vec3::ZERO, radius: 0.3, flip: false }),
        soup(&random_soup(&mut rng, 500, 0.2)),
    ];
    let accel = build(Accelerator::Both, &shapes);
    let rays = random_rays(&mut rng, 200_000, 1.0);
    closest(&accel, &rays);
    occluded(&accel, &rays);
    let counts = accel.comparison().unwrap();
    println!("{}: {counts:?}", accel.name());
    assert_eq!(counts.rays, 400_000);
    assert_eq!((counts.native_misses, counts.native_false, counts.embree_false), (0, 0, 0), "{counts:?}");
    assert!(counts.embree_misses <= 2, "{counts:?}");
}

/// 12,000 rays at 1 to 30 instances, against the oracle, and exactly against the same tests of every primitive in turn.
#[test]
fn instances() {
    let mut rng = Rng(31);
    for count in [1, 2, 5, 30] {
        let shapes = random_instances(&mut rng, count);
        let rays = random_rays(&mut rng, 3000, 1.0);
        check(&shapes, &rays);
        let hits = closest(&build(Accelerator::Native, &shapes), &rays);
        for (ray, hit) in rays.iter().zip(hits) {
            let mut nearest: Option<(f32, Hit)> = None;
            for (shape, description) in (0..).zip(&shapes) {
                for primitive in 0..description.primitive_count() as u32 {
                    let met = description.intersect(primitive, ray).map(|t| (t, Hit { shape, primitive }));
                    nearest = [nearest, met].into_iter().flatten().min_by(|a, b| a.partial_cmp(b).expect("no NaN"));
                }
            }
            assert_eq!(hit, nearest.map_or(Hit::NONE, |(_, hit)| hit), "{ray:?}");
        }
    }
}

/// 20,000 rays that leave placed triangles as the renderer spawns them: none meets the plane that it leaves, whatever the
/// map does to it; and what is known of where a ray starts changes no answer.
#[test]
fn spawned_from_instances() {
    let mut rng = Rng(32);
    let shapes = random_instances(&mut rng, 10);
    let accels: Vec<Accel> = accelerators().into_iter().map(|which| build(which, &shapes)).collect();
    let mut rays = Vec::new();
    let mut from = Vec::new();
    while rays.len() < 20_000 {
        let (o, p) = (1.5 * rng.in_cube(), rng.in_cube());
        let ray = Ray::new(o, p - o);
        let hit = closest(&accels[0], &[ray])[0];
        if !hit.is_some() || !matches!(&shapes[hit.shape as usize], Shape::Placed(_)) {
            continue;
        }
        let shape = &shapes[hit.shape as usize];
        let point = shape.meet(&ray, hit.primitive).point;
        let d = rng.direction();
        let spawned = Ray::new(point.origin_towards(d), d);
        let flat = !matches!(shape, Shape::Placed(p) if matches!(p.shape(), Shape::Sphere(_) | Shape::Cylinder(_)));
        assert!(!flat || shape.intersect(hit.primitive, &spawned).is_none(), "{hit:?} is met again: {spawned:?}");
        rays.push(spawned);
        from.push(hit);
    }
    for accel in &accels {
        let mut hits = vec![Hit::NONE; rays.len()];
        accel.closest_hits_from(&rays, Start::Primitives(&from), &mut hits);
        assert_eq!(hits, closest(accel, &rays));
    }
}
