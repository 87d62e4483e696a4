//! `snell check`: the checks pass, can be repeated, and say what they are asked for.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod desk;

use desk::*;

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The table without the line that says how long it took.
fn table(desk: &Desk, arguments: &[&str]) -> String {
    let told = text(&desk.succeeds(arguments).stdout);
    told.lines().filter(|line| !line.contains(" rays in ")).map(|line| format!("{line}\n")).collect()
}

/// 48 rays of each kind at each mesh: 10752.
#[test]
fn accelerators_are_right_about_a_few_rays() {
    let desk = Desk::new();
    let told = text(&desk.succeeds(&["check", "--accel", "--rays=48"]).stdout);
    for part in [
        "mesh       rays         number       hits     ties |   wrong    lost |   wrong    lost |\n",
        "10752 rays in ",
        " s, 864 of them through closed meshes\n",
        " were put to the oracle: one of 16, and all where answers differ by more; ",
        " were ties or on rims\n",
        "native: 0 wrong, 0 lost; embree: ",
    ] {
        assert!(told.contains(part), "{part} in\n{told}");
    }
    assert_eq!(told.lines().filter(|line| line.ends_with("| ok")).count(), 16 * 14, "{told}");
    assert!(!told.contains("WRONG"), "{told}");
    assert!(desk.files().is_empty());
}

#[test]
fn the_same_table_for_any_number_of_threads_and_another_for_another_seed() {
    let desk = Desk::new();
    let with = |more: &[&str]| table(&desk, &[&["check", "--mesh=bumpy", "--rays=700"], more].concat());
    let one = with(&["--threads=1"]);
    assert_eq!(one.lines().count(), 2 + 14 + 2, "{one}");
    assert_eq!(one, with(&["--threads=3"]));
    assert_ne!(one, with(&["--seed=1"]));
    assert_eq!(with(&["--kind=edge"]).lines().nth(2), one.lines().find(|line| line.contains(" edge ")));
}

#[test]
fn a_ray_can_be_traced_alone() {
    let desk = Desk::new();
    let ray = ["check", "--accel", "--mesh=sphere", "--kind=vertex", "--ray=11", "--seed=3"];
    let told = text(&desk.succeeds(&ray).stdout);
    for part in [
        "Ray { o: Vec3::new(",
        ", tmin: 0e0, d: Vec3::new(",
        ", tmax: f32::INFINITY }\nthrough a closed mesh: it meets something\noracle: shape 0 primitive ",
        "\nnative: shape 0 primitive ",
        "\nnative, one ray at a time: shape 0 primitive ",
        ", hidden: ",
    ] {
        assert!(told.contains(part), "{part} in\n{told}");
    }
    assert!(told.contains(": right\n") || told.contains(": as right: a tie, or on a rim\n"), "{told}");
    let known = ["check", "--mesh=boxes", "--kind=between", "--ray=300"];
    let told = text(&desk.succeeds(&known).stdout);
    assert!(
        told.contains("\nleft out: shape 0 primitive ") && told.contains(", at the end shape 0 primitive "),
        "{told}"
    );
    let random = ["check", "--mesh=slivers", "--kind=random", "--ray=5"];
    assert!(text(&desk.succeeds(&random).stdout).contains("oracle: nothing\nnative: nothing, free: right\n"));
}

/// 3000 rays of each kind, and what one alone says.
#[test]
fn spawned_rays_leave_their_surfaces() {
    let desk = Desk::new();
    let told = text(&desk.succeeds(&["check", "--spawn", "--rays=3000", "--seed=5"]).stdout);
    let lines: Vec<&str> = told.lines().collect();
    assert_eq!(lines.len(), 7, "{told}");
    for line in &lines {
        assert!(line.starts_with("spawn ") && line.ends_with("; 0 wrong ok"), "{line}");
        let numbers = |word: &str| line.split(word).next().unwrap().split_whitespace().last().unwrap().parse::<u64>();
        assert!(numbers(" rays, ").unwrap() == 3000 && numbers(" to a neighbour, ").unwrap() > 1000, "{line}");
        assert!(
            line.contains(" met it, ")
                && line.contains(" segments, ")
                && line.contains(" asked of embree, which lost "),
            "{line}"
        );
    }
    let one = ["check", "--spawn", "--kind=placed-quadric", "--ray=70000", "--seed=5"];
    assert!(text(&desk.succeeds(&one).stdout).contains("placed-quadric                 1 rays, "));
    let threads = |n: &str| table(&desk, &["check", "--spawn", "--rays=9000", "--kind=sliver", n]);
    assert_eq!(threads("--threads=1"), threads("--threads=3"));
}

/// One law, light and scene each, whose line says what was done.
#[test]
fn laws_lights_and_scenes_are_checked_one_by_one() {
    let desk = Desk::new();
    for (arguments, parts) in [
        (
            &["--bsdf", "--kind=density", "--ray=3"][..],
            &["bsdf         density ", "χ² with 1 % of false alarms in all; 0 wrong"],
        ),
        (&["--bsdf", "--kind=density", "--ray=3", "--seed=9"], &["bsdf         density ", "0 wrong"]),
        (&["--bsdf", "--kind=finite", "--ray=10"], &["bsdf         finite ", "bsdfs and directions; 0 wrong"]),
        (&["--light", "--kind=areas", "--ray=12"], &["light        areas ", "1 tests, 2000 samples; 0 wrong"]),
        (&["--light", "--kind=black"], &["light        black ", "9 tests, 0 samples; 0 wrong"]),
        (
            &["--light", "--kind=skies", "--ray=3"],
            &["light        skies ", ", χ² with 1 % of false alarms in all; 0 wrong"],
        ),
        (&["--scene", "--kind=floor under a point"], &["0.135437; the worst ", " of at most 6 "]),
        (&["--scene", "--kind=floor under the sky"], &["0.600000; the worst ", " of at most 6 "]),
        (&["--determinism", "--kind=scale"], &["determinism  scale ", "all lengths × 2^k, k of [-40, "]),
        (&["--determinism", "--kind=threads"], &["determinism  threads ", "1, 3 and "]),
    ] {
        let told = text(&desk.succeeds(&[&["check"], arguments].concat()).stdout);
        assert_eq!(told.lines().count(), 1, "{told}");
        assert!(parts.iter().all(|part| told.contains(part)) && told.ends_with(" ok\n"), "{told}");
    }
    // The bits of this machine, for whoever wants to compare them.
    let told = text(&desk.succeeds(&["check", "--determinism", "--kind=bits"]).stdout);
    assert!(
        told.starts_with("native ") && told.lines().all(|line| line.len() == "native 0123456789abcdef".len()),
        "{told}"
    );
}

#[test]
fn what_is_not_there_to_be_checked_is_refused() {
    let desk = Desk::new();
    desk.refuses(&["check", "--mesh=cube"], &["--mesh: 'cube' is not known; expected one of soup, slivers, "]);
    desk.refuses(&["check", "--kind=slow"], &["--kind: 'slow' is not known; expected one of random, grazing, "]);
    desk.refuses(&["check", "--light", "--kind=red"], &["--kind: 'red' is not known; expected one of areas, skies, "]);
    desk.refuses(&["check", "--kind=edge", "--ray=3"], &["--ray: which mesh's? Expected --mesh, too"]);
    desk.refuses(
        &["check", "--kind=edge", "--spawn", "--light"],
        &["--kind: of which check? Expected one of them only"],
    );
    for wrong in [&["--ray=3"][..], &["--ray=3", "--mesh=soup"], &["--rays=0"], &["--long", "--rays=5"], &["--seed=x"]]
    {
        let output = desk.snell(&[&["check"], wrong].concat());
        assert_eq!(output.status.code(), Some(2), "{wrong:?}");
    }
}
