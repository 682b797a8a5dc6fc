//! The chapter on the paper's figures: each has an image, a sentence, and a report that it is from.

use crate::cli::run;
use crate::report::overweight;
use crate::support::{Scratch, root, text};

const FIGURES: std::ops::RangeInclusive<usize> = 6..=31;

/// The numbers of figures that a page shows.
fn shown(page: &str) -> Vec<usize> {
    let links = page.split("](images/paper/figure-").skip(1);
    links.filter_map(|rest| rest.split_once(".svg)")?.0.parse().ok()).collect()
}

#[test]
fn the_chapter_shows_every_figure_of_the_paper_once_and_in_order() {
    let page = text("docs/paper.md");
    assert_eq!(shown(&page), FIGURES.collect::<Vec<usize>>());
    for number in FIGURES {
        let path = root().join(format!("docs/images/paper/figure-{number:02}.svg"));
        let image = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(image.starts_with("<svg") && image.contains("<p"), "{} is no figure", path.display());
        let (before, _) = page.split_once(&format!("figure-{number:02}.svg)")).expect("it is shown");
        let sentence = before.rsplit("\n\n").nth(1).expect("a sentence before the image");
        assert!(sentence.ends_with('.') && sentence.len() > 40, "figure {number}: {sentence}");
    }
    assert_ne!(shown("![a](images/paper/figure-07.svg)"), FIGURES.collect::<Vec<usize>>());
}

/// Case of a report of the script, number of a figure in the paper, and its name in the report.
fn repeated() -> Vec<(String, usize, String)> {
    let script = text("scripts/paper.sh");
    let reports = script.split("\nrun ").skip(1).filter_map(|report| report.split_once("<<END\n"));
    let rows = reports.flat_map(|(command, rest)| {
        let case = command.split("cases/").nth(1).and_then(|rest| rest.split_whitespace().next()).expect("a case");
        let rows = rest.lines().take_while(|line| *line != "END");
        rows.filter_map(move |row| {
            let (number, figure) = row.split_once(' ')?;
            Some((case.to_owned(), number.parse().ok()?, figure.to_owned()))
        })
    });
    rows.collect()
}

#[test]
fn the_script_makes_every_figure_of_the_paper_once() {
    let mut numbers: Vec<usize> = repeated().into_iter().map(|(_, number, _)| number).collect();
    numbers.sort_unstable();
    assert_eq!(numbers, FIGURES.collect::<Vec<usize>>());
}

#[test]
fn studies_of_the_papers_cases_draw_its_figures_on_a_page_of_at_most_two_megabytes() {
    let scratch = Scratch::new("paper");
    let figures = repeated();
    for case in ["lcat-2259", "lcat-2330", "lcat-2259-tc3", "twin-tc3"] {
        let folder = root().join("cases").join(case);
        run(&scratch, &format!("study {} -n 20 --quiet --out {case}", folder.display())).succeeded();
        assert_eq!(overweight(&scratch.read(&format!("{case}/report.html"))), None, "{case}");
        for (_, number, figure) in figures.iter().filter(|(of, ..)| of == case) {
            let file = scratch.path().join(case).join("figures").join(format!("{figure}.svg"));
            assert!(file.is_file(), "{case}: no figure {figure:?} for figure {number} of the paper");
        }
    }
}
