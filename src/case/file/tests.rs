//! What a case file may say, and what is said of one that is wrong.

use crate::case::Case;
use std::path::{Path, PathBuf};

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(name)
}

fn load(name: &str) -> Case {
    Case::load(&shipped(name)).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_shipped_case_loads() {
    for name in ["slab", "lcat-2259", "lcat-2330", "lcat-2259-tc3", "twin-tc3", "kaowool", "kaowool-tc"] {
        assert_eq!(load(name).id, name);
    }
}
