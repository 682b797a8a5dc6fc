//! The section on the run: when, by which command, and from which files.

use super::table::table;
use crate::study::answers::Answers;
use crate::study::run_record::RunRecord;

/// Date, command, version, backend and input files.
pub(super) fn provenance(answers: &Answers) -> String {
    let RunRecord { date, command_line, input_files, version, commit, driver, threads, remarks } = &answers.run;
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut rows = vec![row("Date", date.clone())];
    rows.extend(command_line.as_ref().map(|words| row("Command", shell_line(words))));
    rows.push(row("Version", version.clone()));
    rows.extend(commit.as_ref().map(|commit| row("Commit", commit.clone())));
    rows.push(row("Backend", crate::report::backend_text(&answers.backend)));
    rows.extend(driver.as_ref().map(|driver| row("Driver", driver.clone())));
    rows.push(row("Threads", threads.to_string()));
    rows.extend(answers.seed.map(|seed| row("Seed", seed.to_string())));
    rows.extend(remarks.iter().map(|remark| row("Remark", remark.clone())));
    let files: Vec<Vec<String>> = input_files.iter().map(|file| row(&file.path, file.sha256.clone())).collect();
    table("Run", &["", "Value"], &rows) + &table("Input files", &["File", "SHA-256"], &files)
}

/// A command as it is typed: words with blanks or special characters are quoted.
fn shell_line(words: &[String]) -> String {
    let is_plain = |letter: char| letter.is_alphanumeric() || "-_=+./:,@%".contains(letter);
    let quoted = |word: &String| match word.is_empty() || !word.chars().all(is_plain) {
        true => format!("'{}'", word.replace('\'', "'\\''")),
        false => word.clone(),
    };
    words.iter().map(quoted).collect::<Vec<String>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_with_special_characters_are_quoted_as_a_shell_needs_them() {
        let words = ["bondline", "size", "c", "--limit", "TC4 < 623 K", "--set", "note=it's"].map(str::to_owned);
        assert_eq!(shell_line(&words), "bondline size c --limit 'TC4 < 623 K' --set 'note=it'\\''s'");
    }
}
