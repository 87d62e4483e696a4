//! `snell bench` as a user meets it: what it measures, what it refuses, what it writes.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod desk;

use desk::*;
use serde_json::Value;
use std::fs;

/// A small Cornell box, two costs, two ways.
const SMALL: [&str; 6] = ["bench", SCENE, "-Dres=16", "--spp=1,8", "--vary=sampler=sobol,independent", "--out=out"];

fn with<'a>(first: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [first, more].concat()
}

fn report(desk: &Desk) -> Value {
    serde_json::from_slice(&fs::read(desk.path("out/bench.json")).unwrap()).unwrap()
}

/// Every number of JSON is finite: what is not is null, and only these may be.
fn nulls(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Null => found.push(at.to_owned()),
        Value::Number(n) => assert!(n.as_f64().unwrap().is_finite(), "{at}"),
        Value::Array(all) => all.iter().for_each(|v| nulls(v, at, found)),
        Value::Object(all) => all.iter().for_each(|(k, v)| nulls(v, &format!("{at}/{k}"), found)),
        Value::Bool(_) | Value::String(_) => {}
    }
}

#[test]
fn everything_is_measured_and_written() {
    let desk = Desk::new();
    let output = desk.succeeds(&with(&SMALL, &["--seeds=3", "--split", "--reference-spp=2048"]));
    let (table, told) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    for part in [
        "efficiency",
        "sobol",
        "independent",
        "samples",
        "what carries the error of 8 samples",
        "in common",
        "by the difference of its halves",
    ] {
        assert!(table.contains(part), "{part} in\n{table}");
    }
    assert!(
        told.contains("rendering a reference of 2048 samples") && told.contains("sobol, 8 samples: relMSE "),
        "{told}"
    );
    let mut files: Vec<_> = fs::read_dir(desk.path("out")).unwrap().map(|e| e.unwrap().file_name()).collect();
    files.sort();
    assert_eq!(files, ["bench.csv", "bench.html", "bench.json"]);
    let report = report(&desk);
    check_schema(&report);
    let csv = fs::read_to_string(desk.path("out/bench.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 2 * 3, "{csv}");
    assert!(csv.starts_with("scene,configuration,") && csv.contains("cornell-box,sobol,"), "{csv}");
    check_page(&fs::read_to_string(desk.path("out/bench.html")).unwrap());
}

fn check_schema(report: &Value) {
    let mut found = Vec::new();
    nulls(report, "", &mut found);
    found.retain(|at| {
        !["/machine/processor", "/scenes/reference/file", "/scenes/configurations/rows/refusal"].contains(&at.as_str())
    });
    assert!(found.is_empty(), "missing numbers: {found:?}");
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(report["settings"]["budget"], "samples");
    assert_eq!(report["settings"]["costs"], serde_json::json!([1.0, 8.0]));
    assert_eq!(report["settings"]["varied"], serde_json::json!(["sampler=sobol,independent"]));
    assert_eq!(report["refused"], 0);
    let scene = &report["scenes"][0];
    assert_eq!((&scene["name"], &scene["width"]), (&"cornell-box".into(), &16.into()));
    assert_eq!(scene["reference"]["samples"], 2048);
    let configurations = scene["configurations"].as_array().unwrap();
    assert_eq!(configurations.len(), 2);
    for c in configurations {
        let rows = c["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 2);
        for row in rows {
            assert_eq!(row["runs"].as_array().unwrap().len(), 3);
            assert_eq!(row["accepted"], true);
            let number = |name: &str| row[name]["median"].as_f64().unwrap();
            let run = |k: usize, name: &str| row["runs"][k][name].as_f64().unwrap();
            let mut each: Vec<f64> = (0..3).map(|k| 1.0 / (run(k, "cpu_seconds") * run(k, "relmse"))).collect();
            each.sort_by(f64::total_cmp);
            assert!((number("efficiency") / each[1] - 1.0).abs() < 1e-9 && number("whole_efficiency") < each[1]);
        }
        // Errors fall with the samples; how fast is a matter of statistics.
        let slope = c["slope_samples"].as_f64().unwrap();
        assert!(slope < -0.5 && slope > -2.5, "{slope}");
        let errors = rows[1]["runs"].as_array().unwrap().iter().map(|run| run["relmse"].as_f64().unwrap());
        check_split(&c["split"], errors.sum::<f64>() / 3.0);
    }
    assert_eq!(configurations[0]["efficiency_ratio"]["median"], 1.0);
}

/// All of the light is in the classes of each way to split, and all of the error in them and what they have in common;
/// which is what was `measured` of the very same pictures, but for the noise of a variance from three of them, and edges of
/// the lamp that some pictures miss.
fn check_split(split: &Value, measured: f64) {
    assert_eq!(split["samples"], 8);
    let error = split["error"].as_f64().unwrap();
    assert!((error / measured - 1.0).abs() < 0.6, "{error} of {measured}");
    let partitions = split["partitions"].as_array().unwrap();
    assert_eq!(partitions.len(), 3);
    for partition in partitions {
        let sum = |what: &str| -> f64 {
            partition["classes"].as_array().unwrap().iter().map(|c| c[what].as_f64().unwrap()).sum()
        };
        assert!((sum("light") - 1.0).abs() < 1e-9, "{partition}");
        let whole = sum("error") + partition["covariance"].as_f64().unwrap();
        assert!(error > 0.0 && (whole / error - 1.0).abs() < 1e-9, "{partition}");
    }
}

/// It holds everything that it shows.
fn check_page(page: &str) {
    for outside in ["http:", "https:", "url(", "<script", "<link", "@import", "src=\"/"] {
        assert!(!page.contains(outside), "{outside}");
    }
    let sources = page.matches("src=\"").count();
    assert_eq!(sources, page.matches("src=\"data:image/png;base64,").count());
    // The reference, two pictures and two maps, and the scale of colours.
    assert_eq!(sources, 6);
    assert_eq!(page.matches("<svg").count(), 2);
    for number in ["NaN", "inf"] {
        assert!(!page.contains(&format!("\"{number}")) && !page.contains(&format!(">{number}")), "{number}");
    }
    for (open, close) in
        [("<div", "</div>"), ("<section", "</section>"), ("<table", "</table>"), ("<tr", "</tr>"), ("<td", "</td>")]
    {
        assert_eq!(page.matches(open).count(), page.matches(close).count(), "{open}");
    }
    assert!(page.contains("prefers-color-scheme: dark"));
}

#[test]
fn a_reference_that_is_too_noisy_is_refused() {
    let desk = Desk::new();
    // About as many samples as are measured: nowhere near ten times better. Not at the edge of the lamp, which so few may
    // all miss.
    let output = desk.snell(&with(&SMALL, &["--spp=64", "--seeds=2", "--reference-spp=2", "--", "--crop=0,8,16,8"]));
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(told.contains("64 samples: not rendered, refused\n"), "{told}");
    let table = String::from_utf8(output.stdout).unwrap();
    let expected = [
        "refused",
        "REFUSED: the reference's own error is ",
        ", more than a tenth of the ",
        " samples would do",
        "not rendered: the row before was refused, and errors only get smaller",
    ];
    for part in expected {
        assert!(table.contains(part), "{part} in\n{table}");
    }
    let report = report(&desk);
    let rows = &report["scenes"][0]["configurations"][0]["rows"];
    assert_eq!(report["refused"], 6);
    assert_eq!(rows[2]["runs"], serde_json::json!([]));
    assert_eq!(rows[0]["accepted"], false);
    assert_eq!(report["scenes"][0]["configurations"][0]["slope_samples"], Value::Null);
    assert!(fs::read_to_string(desk.path("out/bench.html")).unwrap().contains("<b>Refused: "));
}

#[test]
fn what_a_reference_cannot_measure_later_is_foreseen() {
    let desk = Desk::new();
    let output = desk.snell(&with(&SMALL[..5], &["--out=out", "--spp=4096", "--seeds=2", "--reference-spp=512"]));
    let told = String::from_utf8(output.stderr).unwrap();
    for part in [
        "warning: the reference's own error is ",
        ", too much for the largest cost, where about ",
        " is expected; about ",
        " samples would do",
    ] {
        assert!(told.contains(part), "{part} in\n{told}");
    }
    assert_eq!(output.status.code(), Some(1), "{told}");
}

#[test]
fn a_reference_of_something_else_is_refused() {
    let desk = Desk::new();
    // A picture of direct light alone, and one whose variance is far too small.
    desk.succeeds(&["render", SCENE, "-Dres=16", "--spp=1024", "--integrator=direct", "-oref.exr", "-q"]);
    desk.succeeds(&[
        "render",
        SCENE,
        "-Dres=16",
        "--spp=1",
        "--integrator=direct",
        "--max-depth=0",
        "-oref_var.exr",
        "-q",
    ]);
    let bench = ["bench", SCENE, "-Dres=16", "--spp=16", "--seeds=4", "--reference=ref.exr", "--out=out", "-q"];
    let output = desk.snell(&bench);
    let table = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{table}");
    let expected = ["by the variance beside it", "the pictures have an error of ", "so they show something else"];
    for part in expected {
        assert!(table.contains(part), "{part} in\n{table}");
    }
}

#[test]
fn a_reference_without_variance_is_judged_by_pairs() {
    let desk = Desk::new();
    desk.succeeds(&["render", SCENE, "-Dres=16", "--spp=4096", "--seed=99", "-oref.exr", "-q"]);
    let bench = ["bench", SCENE, "-Dres=16", "--spp=4", "--seeds=4", "--reference=ref.exr", "--out=out", "-q"];
    let table = String::from_utf8(desk.succeeds(&bench).stdout).unwrap();
    assert!(table.contains("(own error estimated from what pictures of different seeds have in common)"), "{table}");
    assert!(report(&desk)["scenes"][0]["reference"]["own_error"].is_null());
    desk.refuses(
        &["bench", SCENE, "-Dres=16", "--seeds=1", "--reference=ref.exr", "--out=other"],
        &["--seeds 1 cannot tell how good ref.exr is: expected its variance in a file beside it"],
    );
}

#[test]
fn seconds_buy_as_many_samples_as_fit() {
    let desk = Desk::new();
    desk.snell(&["bench", SCENE, "-Dres=16", "--seconds=0.02,0.08", "--seeds=2", "--out=out", "-q"]);
    let report = report(&desk);
    assert_eq!(report["settings"]["budget"], "cpu_seconds");
    let samples = |row: usize| report["scenes"][0]["configurations"][0]["rows"][row]["samples"].as_f64().unwrap();
    let factor = samples(1) / samples(0);
    assert!((factor - 4.0).abs() < 0.5, "{factor}");
}

#[test]
fn accelerators_and_integrators_can_be_varied_and_options_added() {
    let desk = Desk::new();
    let vary =
        ["--vary=integrator=path,nee", "--vary=rr-depth=2,5", "--seeds=2", "--", "--accel", "native", "--threads=1"];
    desk.succeeds(&with(&["bench", SCENE, "-Dres=8", "--spp=2", "--out=out", "-q"], &vary));
    let report = report(&desk);
    let all = report["scenes"][0]["configurations"].as_array().unwrap();
    let names: Vec<&str> = all.iter().map(|c| c["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["path · 2", "path · 5", "nee · 2", "nee · 5"]);
    assert!(all.iter().all(|c| c["accelerator"].as_str().unwrap().starts_with("native")));
    assert_eq!(report["machine"]["threads"], 1);
}

#[test]
fn bad_requests_are_refused() {
    let desk = Desk::new();
    fs::write(desk.path("file"), "").unwrap();
    fs::create_dir(desk.path("taken")).unwrap();
    fs::create_dir(desk.path("taken/bench.csv")).unwrap();
    desk.succeeds(&["render", SCENE, "-Dres=8", "--spp=1", "-osmall.exr", "-q"]);
    let names = "'colour' cannot be varied; expected one of accel, sampler, integrator, reuse, light-samples, rr-depth";
    let rows: [(&[&str], &[&str]); 18] = [
        (&["--vary", "colour=red"], &[names]),
        (&["--vary", "sampler"], &["expected NAME=VALUE,VALUE,… with one of the names accel, "]),
        (&["--vary", "sampler=sobol,sobol"], &["'sobol' is there twice"]),
        (&["--vary", "sampler=sobol,halton"], &["invalid value 'halton' for '--sampler <SAMPLER>'", "independent"]),
        (
            &["--vary", "sampler="],
            &["a value is required for '--sampler <SAMPLER>' but none was supplied [possible values: sobol, "],
        ),
        (&["--seconds", "0"], &["expected seconds, more than 0"]),
        (&["--seconds", "1", "--spp", "1"], &["cannot be used with"]),
        (&["--spp", "0"], &["0 is not in 1.."]),
        (&["--seeds", "0"], &["0 is not in 1.."]),
        (&["--reference-spp", "1"], &["1 is not in 2.."]),
        (&["--reference", "none.exr"], &["none.exr: "]),
        (
            &["--reference", "small.exr", "--reference", "small.exr"],
            &["--reference: expected one for each scene, 1; there are 2"],
        ),
        (
            &["--reference", "small.exr", "-Dres=16"],
            &["small.exr has 8x8 pixels, but the picture of cornell-box has 16x16"],
        ),
        (&["-Dnothing=1"], &["nothing"]),
        (&["--out=file"], &["file: cannot make the report's folder: "]),
        (&["--out=no/such"], &["no/such: cannot make the report's folder: "]),
        (&["--out=taken"], &["taken/bench.csv: cannot write the report: this is a folder"]),
        (
            &["--", "--spp", "4"],
            &["expected options of render after --, but not --output, --spp, --aov, --stats or --replay"],
        ),
    ];
    for (more, expected) in rows {
        let out: &[&str] = if more[0].starts_with("--out") { &[] } else { &["--out=out"] };
        let before = desk.files();
        let output = desk.snell(&[&["bench", SCENE], out, more].concat());
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{more:?}\n{error}");
        for part in expected {
            assert!(error.contains(part), "{part} in\n{error}");
        }
        assert_eq!(desk.files(), before, "files were left behind by {more:?}");
    }
    desk.refuses(&["bench", SCENE, "none.xml", "--out=out"], &["none.xml"]);
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_nothing() {
    use std::process::{Command, Stdio};
    let desk = Desk::new();
    let long = ["bench", SCENE, "-Dres=64", "--spp=1000000", "--reference-spp=2", "--out=out"];
    let mut child = desk.command().args(long).stderr(Stdio::piped()).spawn().unwrap();
    let mut told = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    std::io::BufRead::read_line(&mut told, &mut line).unwrap();
    // It renders by now, or soon.
    std::thread::sleep(std::time::Duration::from_millis(300));
    Command::new("sh").args(["-c", "kill -TERM \"$0\"", &child.id().to_string()]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{line}");
    assert!(desk.files().is_empty(), "{:?}", desk.files());
}
