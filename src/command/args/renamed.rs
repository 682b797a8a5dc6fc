//! Old names of options, which are accepted until version 0.2.

use std::ffi::OsString;

/// Old and new name of each renamed option.
const RENAMED: &[(&str, &str)] = &[
    ("--beside", "--compare"),
    ("--between", "--thickness-range"),
    ("--correlation", "--correlation-time"),
    ("--moves", "--mcmc-iterations"),
    ("--patience", "--max-iterations"),
    ("--seek", "--quantity"),
    ("--spread", "--sampling-bounds"),
];

/// The arguments with every old option name replaced by the new one, and a note on each replacement. Arguments after
/// `--` are no options.
pub(crate) fn replace_old_names(arguments: impl IntoIterator<Item = OsString>) -> (Vec<OsString>, Vec<String>) {
    let mut notes = Vec::new();
    let mut is_option_allowed = true;
    let replace = |argument: OsString| {
        is_option_allowed &= argument != "--";
        let Some(text) = argument.to_str().filter(|_| is_option_allowed) else { return argument };
        let (name, value) = text.split_at(text.find('=').unwrap_or(text.len()));
        let Some((old, new)) = RENAMED.iter().find(|(old, _)| *old == name) else { return argument };
        notes.push(format!("note: {old} is now {new}; the old name will go with version 0.2"));
        format!("{new}{value}").into()
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
        for (old, new) in RENAMED {
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
    fn every_new_name_is_an_option_and_no_old_name_is() {
        let command = Cli::description();
        let options: Vec<String> = command
            .get_subcommands()
            .flat_map(clap::Command::get_arguments)
            .filter_map(|argument| argument.get_long().map(|name| format!("--{name}")))
            .collect();
        for (old, new) in RENAMED {
            assert!(options.iter().any(|option| option == new), "{new} is no option");
            assert!(options.iter().all(|option| option != old), "{old} is an option");
        }
    }
}
