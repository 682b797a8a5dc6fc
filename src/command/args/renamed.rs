//! Old names of options and of their values, which are accepted until version 0.2.

use std::ffi::OsString;
use std::fmt::Display;

/// Old and new name of each renamed option.
const OPTIONS: &[(&str, &str)] = &[
    ("--beside", "--compare"),
    ("--between", "--thickness-range"),
    ("--correlation", "--correlation-time"),
    ("--moves", "--mcmc-iterations"),
    ("--patience", "--max-iterations"),
    ("--seek", "--quantity"),
    ("--spread", "--sampling-bounds"),
];

/// Option, old and new name of each renamed value.
const VALUES: &[(&str, &str, &str)] = &[("--group", "twins", "cross-backend")];

/// The note on an old name; `renaming` is `--beside is now --compare`.
pub fn note(renaming: impl Display) -> String {
    format!("note: {renaming}; the old name will go with version 0.2")
}

/// The arguments with every old name replaced by the new one, and a note on each replacement. Arguments after `--` are
/// no options.
pub fn replace_old_names(arguments: impl IntoIterator<Item = OsString>) -> (Vec<OsString>, Vec<String>) {
    let mut notes = Vec::new();
    let mut is_option_allowed = true;
    let mut previous = OsString::new();
    let replace = |argument: OsString| {
        is_option_allowed &= argument != "--";
        let before = std::mem::replace(&mut previous, argument.clone());
        let Some(text) = argument.to_str().filter(|_| is_option_allowed) else { return argument };
        let (name, value) = text.split_at(text.find('=').unwrap_or(text.len()));
        if let Some((old, new)) = OPTIONS.iter().find(|(old, _)| *old == name) {
            notes.push(note(format_args!("{old} is now {new}")));
            return format!("{new}{value}").into();
        }
        for (option, old, new) in VALUES {
            let is_separate = before == *option && text == *old;
            if is_separate || (name == *option && value.strip_prefix('=') == Some(*old)) {
                notes.push(note(format_args!("{option} {old} is now {option} {new}")));
                return if is_separate { (*new).into() } else { format!("{option}={new}").into() };
            }
        }
        argument
    };
    let arguments = arguments.into_iter().map(replace).collect();
    (arguments, notes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::args::Cli;

    fn replaced(arguments: &[&str]) -> (Vec<OsString>, Vec<String>) {
        replace_old_names(arguments.iter().map(OsString::from))
    }

    #[test]
    fn every_old_name_is_replaced_with_a_note_and_no_other_argument_is() {
        for (old, new) in OPTIONS {
            let note = format!("note: {old} is now {new}; the old name will go with version 0.2");
            let separate = replaced(&["bondline", "study", old, "5"]);
            assert_eq!(separate, (["bondline", "study", new, "5"].map(OsString::from).to_vec(), vec![note.clone()]));
            let joined = replaced(&[&format!("{old}=a=b")]);
            assert_eq!(joined, (vec![OsString::from(format!("{new}=a=b"))], vec![note]));
            for arguments in [&["--", old][..], &[new, "5"], &[&format!("{old}s")], &[&old[2..]]] {
                let unchanged = arguments.iter().map(OsString::from).collect();
                assert_eq!(replaced(arguments), (unchanged, Vec::new()));
            }
        }
    }

    #[test]
    fn every_old_value_is_replaced_with_a_note_behind_its_option_only() {
        for (option, old, new) in VALUES {
            let note = format!("note: {option} {old} is now {option} {new}; the old name will go with version 0.2");
            let separate = replaced(&["bondline", option, old, "--json"]);
            let expected = ["bondline", option, new, "--json"].map(OsString::from).to_vec();
            assert_eq!(separate, (expected, vec![note.clone()]));
            let joined = replaced(&[&format!("{option}={old}")]);
            assert_eq!(joined, (vec![OsString::from(format!("{option}={new}"))], vec![note]));
            for arguments in [&["--", option, old][..], &[option, new], &["--out", old], &[&format!("--out={old}")]] {
                let unchanged = arguments.iter().map(OsString::from).collect();
                assert_eq!(replaced(arguments), (unchanged, Vec::new()));
            }
        }
    }

    #[test]
    fn every_new_name_is_an_option_and_no_old_name_is() {
        let command = Cli::description();
        let options: Vec<String> = command
            .get_subcommands()
            .flat_map(clap::Command::get_arguments)
            .filter_map(|argument| argument.get_long().map(|name| format!("--{name}")))
            .collect();
        for (old, new) in OPTIONS {
            assert!(options.iter().any(|option| option == new), "{new} is no option");
            assert!(options.iter().all(|option| option != old), "{old} is an option");
        }
    }
}
