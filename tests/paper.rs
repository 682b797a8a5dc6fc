//! The chapter on the paper's figures: each has an image, a sentence, and a report that it is from.

use crate::support::{cases, root, text};

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

/// Figure 8 estimates other factors than its case states, so that the script names it.
#[test]
fn every_figure_of_the_paper_is_one_of_a_case_or_of_the_script() {
    let mut of_cases: Vec<usize> =
        cases().iter().flat_map(|case| case.paper_figures().iter().flat_map(|(_, numbers)| numbers.clone())).collect();
    of_cases.push(8);
    of_cases.sort_unstable();
    assert_eq!(of_cases, FIGURES.collect::<Vec<usize>>());
    let script = text("scripts/paper.sh");
    assert!(script.contains("\nfigure 8 "));
    for case in cases().iter().filter(|case| !case.paper_figures().is_empty()) {
        assert!(script.contains(case.id()), "scripts/paper.sh does not run {}", case.id());
    }
}
