//! `--memory-limit`: what would take more is refused with its figures, and nothing is left behind.

#![allow(missing_docs, clippy::unwrap_used, reason = "test code")]

mod desk;

use desk::*;

#[test]
fn more_than_the_limit_is_refused_with_the_figures() {
    let desk = Desk::new();
    for bad in ["0", "2Q", "1.5G", ""] {
        let option = format!("--memory-limit={bad}");
        let output = desk.snell(&["info", SCENE, &option]);
        assert_eq!(output.status.code(), Some(2), "{bad}");
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(told.contains("expected a number of bytes, such as 500M or 2G") || bad.is_empty(), "{told}");
    }
    desk.refuses(
        &["render", SCENE, "--memory-limit", "20M"],
        &[
            "--memory-limit: the scene would take about ",
            "program 24.0 MiB",
            "accelerator ",
            "film ",
            ", more than 20.0 MiB",
        ],
    );
    // 64 bytes a pixel, in each of two halves.
    desk.refuses(&["render", SCENE, "--size", "4000x4000", "--memory-limit", "900M"], &["film 1953.1 MiB"]);
    // And what is kept beside them.
    let with_channels = ["render", SCENE, "--size", "1000x1000", "--memory-limit", "110M", "--aov"];
    desk.refuses(
        &[&with_channels[..], &["albedo,normal,depth,position", "-oa.exr"]].concat(),
        &["more than 110.0 MiB"],
    );
    // Copies of what is kept: of blocks two, and the picture put together.
    for (kept, film) in [(&[][..], "film 87.7 MiB"), (&["--checkpoint=c"], "film 240.3 MiB")] {
        let adaptive = ["render", SCENE, "--size", "500x500", "--adaptive", "--memory-limit", "100M"];
        desk.refuses(&[&adaptive[..], kept].concat(), &[film]);
    }
    desk.succeeds(&["render", SCENE, "-Dres=16", "--spp=1", "--memory-limit", "200M", "-oa.png", "-q"]);
    let info = String::from_utf8(desk.succeeds(&["info", SCENE, "--memory-limit=1T"]).stdout).unwrap();
    assert!(info.contains("\nexpected     at most ") && info.contains("shapes and lights 0."), "{info}");
}

#[test]
fn files_that_do_not_fit_are_refused_where_they_are_named() {
    let desk = Desk::new();
    std::fs::write(desk.path("m.obj"), "# long\n".repeat(1 << 18)).unwrap();
    let scene = scene_text(r#"<shape type="obj"><string name="filename" value="m.obj"/></shape>"#);
    std::fs::write(desk.path("s.xml"), scene).unwrap();
    let told =
        ["s.xml:3:", "the file takes 1.8 MiB, which beside 0.0 MiB in use is more than the 1.0 MiB of --memory-limit"];
    desk.refuses(&["info", "s.xml", "--memory-limit", "1M"], &told);
}
