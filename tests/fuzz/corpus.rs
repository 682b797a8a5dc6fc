//! Inputs that once broke bondline: a change of a shipped case, and the command that reads it.

use super::Input;
use crate::support::text;

/// A shipped case with a text in one of its files replaced.
pub(super) struct Entry {
    pub(super) name: &'static str,
    case: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
    pub(super) command: &'static str,
}

impl Entry {
    pub(super) fn input(&self) -> Input {
        let folder = format!("cases/{}", self.case);
        let names = ["case.toml", self.file];
        let mut input: Input = names.map(|name| (name.to_owned(), text(&format!("{folder}/{name}")))).into();
        let file = input.get_mut(self.file).expect("a file of the entry");
        assert!(file.contains(self.from), "{}: {:?} is not in {}", self.name, self.from, self.file);
        *file = file.replacen(self.from, self.to, 1);
        input
    }
}

/// A file that a case names.
const fn of_material(name: &'static str, from: &'static str, to: &'static str) -> Entry {
    Entry {
        name,
        case: "slab",
        file: "materials/constant.toml",
        from,
        to,
        command: "predict c --precision f32 --json --out out",
    }
}

const fn of_case(name: &'static str, from: &'static str, to: &'static str) -> Entry {
    Entry { name, case: "stack-saffil-sic", file: "case.toml", from, to, command: "predict c --json --out out" }
}

pub(super) const ENTRIES: &[Entry] = &[
    of_case("first-step-above-largest", "[hot_face]", "[resolution]\nfirst_step = \"10 s\"\n[hot_face]"),
    of_case("ply-without-cells", "thickness = \"0.28 mm\"", "thickness = \"2.8e-19 m\""),
    of_case("endless-march", "duration = \"240 s\"", "duration = \"1e7 s\""),
    of_case("endless-steps", "[hot_face]", "[resolution]\nfirst_step = \"1e-9 s\"\nmax_step = \"1e-9 s\"\n[hot_face]"),
    Entry {
        name: "thick-ply-above-a-held-face",
        case: "lcat-2259-tc3",
        file: "case.toml",
        from: "thickness = \"0.51 mm\"",
        to: "thickness = \"1e15 mm\"",
        command: "predict c --json --out out",
    },
    of_material("conductivity-beyond-single-precision", "\"0.05 W/m/K\"", "\"1e-300 W/m/K\""),
];
