//! Headless Chromium: opens a page and reads its console.

use crate::support::Scratch;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Prefix of the console line with the JSON result of a page, which ends the session.
pub(crate) const RESULT: &str = "SEEN ";

fn chromium() -> PathBuf {
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&path).flat_map(|folder| names.map(|name| folder.join(name)));
    found.into_iter().find(|file| file.is_file()).expect("no browser found: apt-get install chromium")
}

/// Console lines of a page up to its result. The debugging port keeps the headless browser open until it is killed.
pub(crate) fn console(scratch: &Scratch, page: &Path, flags: &[&str]) -> Vec<String> {
    let profile = scratch.path().join("profile");
    let mut browser = Command::new(chromium())
        .args(["--headless", "--no-sandbox", "--enable-logging=stderr", "--remote-debugging-port=0"])
        .arg("--allow-file-access-from-files")
        .args(flags)
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("file://{}", page.display()))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the browser starts");
    let log = BufReader::new(browser.stderr.take().expect("its log is piped"));
    let mut lines = Vec::new();
    for line in log.split(b'\n').map(|line| String::from_utf8_lossy(&line.expect("a log")).into_owned()) {
        if line.contains(":CONSOLE") {
            lines.push(line);
        }
        if lines.last().is_some_and(|line| line.contains(&format!("{RESULT}{{"))) {
            break;
        }
    }
    browser.kill().expect("the browser runs");
    browser.wait().expect("the browser ends");
    lines
}

/// The JSON result of a page, and the console lines before it.
pub(crate) fn result(mut lines: Vec<String>) -> (serde_json::Value, Vec<String>) {
    let last = lines.pop().unwrap_or_default();
    let written = last.split_once(RESULT).and_then(|(_, rest)| rest.rsplit_once("\", source"));
    let json = written.map_or("", |(json, _)| json);
    let value = serde_json::from_str(json).unwrap_or_else(|error| panic!("{error} in {last:?} after {lines:?}"));
    (value, lines)
}
