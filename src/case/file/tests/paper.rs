//! Figures of the paper that a case reproduces.

use super::{load, shipped};
use crate::case::Case;

#[test]
fn only_the_cases_of_the_paper_name_figures_that_they_reproduce() {
    let folders = std::fs::read_dir(shipped("")).expect("the cases");
    let names = folders.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let cited = names.filter(|name| shipped(name).is_dir() && !load(name).paper_figures.is_empty());
    let mut cited: Vec<String> = cited.collect();
    cited.sort();
    assert_eq!(cited, ["lcat-2259", "lcat-2259-tc3", "lcat-2330", "twin-tc3"]);
    let figures = load("twin-tc3").paper_figures;
    assert!(figures.contains(&("design-space-path".to_owned(), vec![23])), "{figures:?}");

    let written = |number: &str| Case::load_with(&shipped("slab"), &[("paper_figures.nominal".into(), number.into())]);
    assert_eq!(written("6").expect("a case").paper_figures, [("nominal".to_owned(), vec![6])]);
    for wrong in ["0", "6.5", "six"] {
        let message = written(wrong).expect_err("not a figure number").to_string();
        assert!(message.contains("paper_figures.nominal") && message.contains("expected"), "{wrong}: {message}");
    }
}
