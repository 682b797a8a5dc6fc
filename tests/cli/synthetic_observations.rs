//! `scripts/observations.sh` reproduces the committed synthetic observations.

use super::run;
use crate::support::{FILE_K, Scratch, root, text};

/// A column of a CSV table by its heading.
fn column(table: &str, name: &str) -> Vec<f64> {
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let index = lines.next().and_then(|head| head.split(',').position(|cell| cell == name));
    let index = index.unwrap_or_else(|| panic!("no {name}"));
    lines.map(|line| line.split(',').nth(index).expect("a cell").parse().expect("a number")).collect()
}

/// The heading of a column that is made, and of the committed one, whose unit is an upper-case K.
fn heading(committed: &str) -> (String, &str) {
    (committed.replace("_K", "_k"), committed)
}

#[track_caller]
fn same(made: &str, committed: &str, names: &[(String, &str)]) {
    for (of_made, of_committed) in names {
        let (made, known) = (column(made, of_made), column(&text(committed), of_committed));
        assert_eq!(made.len(), known.len(), "{committed}");
        let worst = made.iter().zip(&known).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst <= FILE_K, "{committed}, {of_committed}: {worst} K; run scripts/observations.sh");
        assert!(
            made.windows(2).any(|pair| (pair[1] - pair[0]).abs() > FILE_K),
            "{committed}, {of_made}: the column is constant"
        );
    }
}

#[test]
fn the_script_reproduces_the_committed_synthetic_observations() {
    let scratch = Scratch::new("observations");
    let made = |case: &str, options: &str| {
        let path = root().join(case);
        run(&scratch, &format!("twin {} --out made.csv --force --quiet {options}", path.display())).succeeded();
        scratch.read("made.csv")
    };
    for run in ["2259", "2330"] {
        let table = made(&format!("cases/lcat-{run}/truth.toml"), &format!("--noise 2K --seed {run}"));
        let names = ["TC1_K", "TC2_K", "TC3_K", "TC4_K"].map(heading);
        same(&table, &format!("cases/lcat-{run}/measured.csv"), &names);
        if run == "2259" {
            same(&table, "cases/lcat-2259-tc3/driver.csv", &[heading("TC3_K")]);
            same(&table, "cases/lcat-2259-tc3/measured.csv", &[heading("TC4_K")]);
        }
    }
    let lamp = ["TC1_K", "TC2_K", "TC3_K"].map(heading);
    let made_lamp = made("cases/lamp-test/truth.toml", "--noise 1.5K --seed 3");
    same(&made_lamp, "cases/lamp-test/measured.csv", &lamp);
    let made_lumps = made("cases/lcat-2259-lumps/truth.toml", "--noise 1K --seed 1");
    same(&made_lumps, "cases/lcat-2259-lumps/measured.csv", &[heading("TC1_K")]);
    same(&made("cases/lcat-2259", ""), "cases/twin-tc3/driver.csv", &[heading("TC3_K")]);
    same(&made("cases/twin-tc3", ""), "cases/twin-tc3/measured.csv", &[heading("TC4_K")]);
}
