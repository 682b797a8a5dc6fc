//! The report page in a browser.

use crate::browser::{console, result};
use crate::cli::{CASE, OBSERVATIONS, decomposing_case, run};
use crate::support::{Scratch, text};

/// A phone, CSS pixels.
const PHONE: u32 = 390;
const DESK: u32 = 1280;
/// Maximum size of a page.
const PAGE_BYTES: usize = 2_000_000;

/// Shows the page in a frame of a given width and writes its state to the console. Charts are drawn as they come into
/// view, so the frame is as tall as the page; a chart not drawn after 300 animation frames has failed.
const FRAME: &str = r#"<!DOCTYPE html>
<meta charset="utf-8"><title>frame</title>
<iframe src="page.html" style="border:0;width:WIDTHpx;height:30000px"></iframe>
<script>
  const frame = document.querySelector("iframe");
  let turns = 0;
  const look = () => {
    const page = frame.contentDocument;
    const charts = [...page.querySelectorAll(".chart")];
    const drawn = charts.filter((chart) => chart.querySelector("svg.main-svg")).length;
    turns += 1;
    if (turns < 30 || (drawn < charts.length && turns < 300)) {
      requestAnimationFrame(look);
      return;
    }
    const rules = [...page.styleSheets].flatMap((sheet) => [...sheet.cssRules]);
    console.log("SEEN " + JSON.stringify({
      charts: charts.length,
      drawn,
      scroll: page.documentElement.scrollWidth,
      width: page.documentElement.clientWidth,
      requests: frame.contentWindow.performance.getEntriesByType("resource").map((entry) => entry.name),
      print: rules.filter((rule) => rule.conditionText === "print").length,
      stills: [...page.querySelectorAll(".still")].filter((still) => still.offsetHeight > 0).length,
      plotly: frame.contentWindow.Plotly?.version ?? "none",
    }));
  };
  frame.onload = look;
</script>
"#;

/// Faults of `page.html` in a window of a given width.
fn faults(scratch: &Scratch, width: u32) -> Vec<String> {
    let frame = scratch.write(&format!("frame-{width}.html"), FRAME.replace("WIDTH", &width.to_string()));
    // Layout is in CSS pixels; the scale only makes the picture of the tall page small.
    let flags = ["--disable-gpu", "--window-size=1400,30000", "--force-device-scale-factor=0.1"];
    let (seen, said) = result(console(scratch, &frame, &flags));
    let mut faults: Vec<String> = said.iter().map(|line| format!("console: {line}")).collect();
    let number = |key: &str| seen[key].as_u64().unwrap_or(0);
    if number("charts") == 0 || number("drawn") != number("charts") {
        faults.push(format!("{} of {} charts drawn", number("drawn"), number("charts")));
    }
    if number("scroll") > number("width") || number("width") != u64::from(width) {
        faults.push(format!("{} pixels wide in a window of {}", number("scroll"), number("width")));
    }
    if seen["requests"].as_array().is_none_or(|requests| !requests.is_empty()) {
        faults.push(format!("requests {}", seen["requests"]));
    }
    if number("print") == 0 {
        faults.push("no print style".to_owned());
    }
    if number("stills") > 0 {
        faults.push(format!("{} still images shown on screen", number("stills")));
    }
    let plotly = seen["plotly"].as_str().unwrap_or_default();
    let row = format!("| `plotly.js-cartesian-dist-min` | {plotly} | MIT |");
    if !text("src/report/html/vendor/README.md").contains(&row) {
        faults.push(format!("plotly.js {plotly} runs, the README of the vendored script names another version"));
    }
    faults.extend(overweight(&scratch.read("page.html")));
    faults
}

/// The fault of a page that is too large.
pub(crate) fn overweight(page: &str) -> Option<String> {
    (page.len() > PAGE_BYTES).then(|| format!("{} bytes, at most {PAGE_BYTES} expected", page.len()))
}

/// The page of a study of a small case.
fn studied(scratch: &Scratch, case: &str) -> String {
    scratch.write("c/case.toml", case.to_owned() + OBSERVATIONS);
    run(scratch, "study c -n 60 --factors f_k,f_q --quiet").succeeded();
    scratch.read("out/c/study/report.html")
}

#[test]
fn the_page_draws_every_chart_without_errors_or_requests_and_fits_a_phone() {
    let scratch = Scratch::new("page");
    for case in [CASE, &decomposing_case()] {
        scratch.write("page.html", studied(&scratch, case));
        for width in [DESK, PHONE] {
            assert_eq!(faults(&scratch, width), Vec::<String>::new(), "at {width} pixels of {case}");
        }
    }
}

#[test]
fn pages_of_sizing_flux_inversion_and_coverage_studies_are_sound() {
    let scratch = Scratch::new("pages");
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    for line in [
        "size c --ply BASE --limit TC2<480K --probability 0.9 -n 60 --out out --force --quiet",
        "history c --knots 1 --out out --force --quiet",
        "twin c --study 6 --out out --force --quiet",
    ] {
        run(&scratch, line).succeeded();
        scratch.write("page.html", scratch.read("out/report.html"));
        for width in [DESK, PHONE] {
            assert_eq!(faults(&scratch, width), Vec::<String>::new(), "at {width} pixels of {line}");
        }
    }
}

/// Negative controls: each defect of the page must be detected.
#[test]
fn defects_of_a_page_are_detected() {
    let scratch = Scratch::new("spoiled");
    let page = studied(&scratch, CASE);
    let wide = "<div style=\"width:2000px\">wide</div>";
    let heavy = format!("<!--{}-->", " ".repeat(PAGE_BYTES));
    let asking = "<img src=\"http://127.0.0.1:9/picture.png\" alt=\"\">";
    let outside = format!("{wide}{asking}</main>{heavy}");
    let no_charts = ["console: ", "0 of ", "still images shown"];
    let foreign = "<script>document.title = 'foreign'</script></main>";
    for (changes, expected) in [
        (&[("</main>", foreign)] as &[(&str, &str)], &["console: ", "inline"] as &[&str]),
        (&[("id=\"charts\">{", "id=\"charts\">{{")], &no_charts),
        (&[("id=\"plotly\">", "id=\"plotly\">AAAA")], &[&no_charts[..], &["plotly.js none runs"]].concat()),
        (
            &[("</main>", &outside), ("@media print", "@media tv")],
            &["pixels wide", "picture.png", "bytes, at most 2000000 expected", "no print style"],
        ),
    ] {
        let mut spoiled = page.clone();
        for (from, to) in changes {
            assert!(page.contains(from), "{from:?} is not on the page");
            spoiled = spoiled.replacen(from, to, 1);
        }
        scratch.write("page.html", spoiled);
        let found = faults(&scratch, PHONE);
        for fault in expected {
            assert!(found.iter().any(|text| text.contains(fault)), "{fault:?} is not detected: {found:?}");
        }
    }
}
