//! Valid inputs, from which mutants are made.

use super::Input;
use super::mutation::{Choice, mutated};
use crate::support::{files, text};
use bondline::verify::random_case::random_case_toml;
use std::path::Path;

/// Random cases among the inputs.
const RANDOM_CASES: u64 = 40;
/// Largest table: longer ones have nothing more to mutate.
const MAX_ROWS: usize = 120;

/// The valid inputs: shipped cases with every built-in material and gas as a file of their own, and random cases.
pub(super) struct Seeds {
    inputs: Vec<Input>,
}

impl Seeds {
    pub(super) fn new() -> Self {
        let built_in: Vec<(String, String)> = ["materials", "gases"]
            .into_iter()
            .flat_map(|folder| files(&format!("data/{folder}"), ".toml"))
            .map(|path| (path.trim_start_matches("data/").to_owned(), text(&path)))
            .collect();
        let with_database = |own: Input| {
            let used = |(path, _): &&(String, String)| {
                let id = Path::new(path).file_stem().expect("a file has a name").to_string_lossy();
                let texts = || own.values().map(|text| text.replace('-', "_"));
                texts().any(|text| text.contains(&*id))
            };
            let mut input: Input = built_in.iter().filter(used).cloned().collect();
            input.extend(own);
            input
        };
        let shipped = files("cases", "/case.toml").into_iter().map(|path| {
            let folder = path.trim_end_matches("case.toml");
            let names = [".toml", ".csv"].into_iter().flat_map(|ending| files(folder, ending));
            let own = names.map(|path| path.trim_start_matches(folder).to_owned());
            let case = text(&path);
            let of_others = case.split('"').filter(|quoted| quoted.starts_with("../")).map(str::to_owned);
            own.chain(of_others).map(|name| (name.clone(), shortened(&text(&format!("{folder}{name}"))))).collect()
        });
        let random = (0..RANDOM_CASES).map(|seed| Input::from([("case.toml".to_owned(), random_case_toml(seed))]));
        Self { inputs: shipped.chain(random).map(with_database).collect() }
    }

    pub(super) fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// The mutant of a number: one file of an input is mutated, in one of three mutants the case itself.
    pub(super) fn mutant(&self, number: u64) -> Input {
        let (mut input, name, text) = self.mutation(number);
        input.insert(name, text);
        input
    }

    /// The mutant in a message: its case, and the new lines of the mutated file.
    pub(super) fn description(&self, number: u64) -> String {
        let (input, name, text) = self.mutation(number);
        let title = input["case.toml"].lines().next().unwrap_or_default();
        let is_new = |line: &&str| !input[&name].lines().any(|old| old == *line);
        let new: Vec<&str> = text.lines().filter(is_new).take(20).collect();
        format!("{title}, {name} with {new:?} and {} bytes more", text.len() as i64 - input[&name].len() as i64)
    }

    /// An input, the name of one of its files, and the mutated text of that file.
    fn mutation(&self, number: u64) -> (Input, String, String) {
        let mut choice = Choice::new(number);
        let input = choice.of(&self.inputs).clone();
        let donor = choice.of(&self.inputs);
        let names: Vec<&String> = input.keys().collect();
        let name = if choice.below(3) == 0 { "case.toml".to_owned() } else { (*choice.of(&names)).clone() };
        let ending = name.rsplit('.').next().unwrap_or_default();
        let donors: Vec<&String> =
            donor.iter().filter(|(other, _)| other.ends_with(ending)).map(|(_, text)| text).collect();
        let other = if donors.is_empty() { "" } else { choice.of(&donors).as_str() };
        let text = mutated(&input[&name], other, &mut choice);
        (input, name, text)
    }
}

fn shortened(text: &str) -> String {
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    if lines.len() <= 3 * MAX_ROWS { text.to_owned() } else { lines[..MAX_ROWS].concat() }
}
