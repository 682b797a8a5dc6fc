//! Trials of a sweep at random moments: kills, races for one folder, full disks. A few belong to the suite. With
//! `BONDLINE_ALL` (`scripts/test.sh --all`) there are as many as the documentation promises, with a shipped case.

use super::resume::{ended, started};
use super::{CASE, CommandResult, run, run_limited, wait_for};
use crate::support::{Scratch, Uniform, root, runs_all, without_run};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

/// The longest work that may be done twice after a kill.
const MAX_REPEATED: Duration = Duration::from_secs(10);

/// A block of a file system in memory.
const BLOCK: u64 = 4096;

/// Print a line that the test harness does not capture.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// The files in a folder and hidden ones, with their content.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut folders) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(inner) = folders.pop() {
        for entry in fs::read_dir(inner).expect("a folder that can be read") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below the folder").to_owned();
                found.insert(name, fs::read(&path).expect("a file that can be read"));
            }
        }
    }
    found
}

/// What equal sweeps have in common: the names of all files of a folder, the summary of the report in `one` without
/// time and provenance of the run, and the Parquet file.
fn results(folder: &Path) -> (Vec<PathBuf>, Value, Vec<u8>) {
    let mut files = files(folder);
    let names = files.keys().cloned().collect();
    let mut take = |name: &str| files.remove(&Path::new("one").join(name)).unwrap_or_else(|| panic!("no {name}"));
    let summary = serde_json::from_slice(&take("summary.json")).expect("JSON");
    (names, without_run(summary), take("members.parquet"))
}

/// The line of a sweep without its folder.
fn sweep(case: &str, members: usize) -> String {
    format!("uncertainty {case} -n {members} --keep members")
}

#[test]
fn a_sweep_that_is_killed_at_any_moment_is_resumed_to_the_same_bits_and_leaves_no_file() {
    let scratch = Scratch::new("killed");
    let case = scratch.write("c/case.toml", CASE).parent().expect("a folder").to_owned();
    let (trials, line) = if runs_all() {
        (100, sweep(&root().join("cases/slab").display().to_string(), 60_000) + " --checkpoint-interval 0.2s")
    } else {
        (5, sweep(&case.display().to_string(), 20_000) + " --checkpoint-interval 0.02s")
    };
    let start = Instant::now();
    run(&scratch, &format!("{line} --out whole/one")).succeeded();
    let duration = start.elapsed();
    let (whole, killed) = (scratch.path().join("whole"), scratch.path().join("killed"));
    let expected = results(&whole);
    let (mut random, mut resumed, mut kills, mut repeated) = (Uniform(1), 0, 0, Duration::ZERO);
    let mut kill = |options: &str, after: Duration| {
        let start = SystemTime::now();
        let mut child = started(&scratch, &format!("{line} --out killed/one{options}"));
        sleep(after);
        // It may have ended before.
        kills += usize::from(child.try_wait().expect("a child").is_none());
        let _ = child.kill();
        child.wait().expect("it ends");
        let moment = SystemTime::now();
        let kept = fs::metadata(killed.join("one.checkpoint/sweep.json")).and_then(|file| file.modified());
        let since = kept.map_or(start, |kept| kept.max(start));
        // With a report, nothing is to be repeated.
        if !killed.join("one/summary.json").exists() {
            repeated = repeated.max(moment.duration_since(since).unwrap_or_default());
        }
    };
    for trial in 0..trials {
        let moments = [duration.mul_f64(random.next()), duration.mul_f64(random.next())];
        kill("", moments[0]);
        if trial % 5 == 0 {
            kill(" --resume", moments[1]);
        }
        let ended = run(&scratch, &format!("{line} --out killed/one --resume")).succeeded();
        resumed += usize::from(ended.stderr.contains("of a run of ") && ended.stderr.contains("going on from there"));
        assert!(results(&killed) == expected, "trial {trial}, killed after {moments:?}");
        fs::remove_dir_all(&killed).expect("a folder of this test");
    }
    say(&format!(
        "{kills} kills in {trials} sweeps of {duration:.1?}: {resumed} went on from kept members, at most \
         {repeated:.1?} of work done twice, all reports the same to the bit"
    ));
    assert!(repeated <= MAX_REPEATED, "{repeated:?} of work done twice");
    assert!(3 * resumed >= trials, "only {resumed} of {trials} sweeps went on from kept members");
    // The comparison notices one byte, and one file.
    let report = whole.join("one");
    let mut members = expected.2.clone();
    let middle = members.len() / 2;
    members[middle] ^= 1;
    fs::write(report.join("members.parquet"), members).expect("a file of this test");
    assert!(results(&whole) != expected);
    fs::write(report.join("members.parquet"), &expected.2).expect("a file of this test");
    assert!(results(&whole) == expected);
    fs::write(whole.join(".one.lock"), "").expect("a file of this test");
    assert!(results(&whole) != expected);
}

#[test]
fn one_changed_byte_of_kept_members_is_noticed() {
    let scratch = Scratch::new("changed-byte");
    scratch.write("c/case.toml", CASE);
    let line = sweep("c", 50_000_000) + " --out one";
    run_limited(&scratch, &line).exited_with(1);
    let mut random = Uniform(2);
    for (name, message) in [("sweep.json", "sweep.json"), ("members.rows", "does not have the rows of its")] {
        let path = scratch.path().join("one.checkpoint").join(name);
        let sound = fs::read(&path).expect("kept members");
        for _ in 0..5 {
            let mut changed = sound.clone();
            changed[(random.next() * sound.len() as f64) as usize] ^= 1;
            fs::write(&path, changed).expect("a file of this test");
            run_limited(&scratch, &format!("{line} --resume")).exited_with(2).with_stderr(&[message]);
        }
        fs::write(&path, &sound).expect("a file of this test");
    }
    let resumed = run_limited(&scratch, &format!("{line} --resume")).exited_with(1);
    assert!(resumed.stderr.contains("going on from there"), "{}", resumed.stderr);
}

#[test]
fn of_two_writers_of_one_folder_one_writes_and_the_other_is_told_who() {
    let scratch = Scratch::new("race");
    scratch.write("c/case.toml", CASE);
    let (trials, members) = if runs_all() { (15, 50_000) } else { (2, 20_000) };
    let line = |seed: usize, out: &str| format!("{} --seed {seed} --quiet --out {out}/one", sweep("c", members));
    let expected = [1, 2].map(|seed| {
        run(&scratch, &line(seed, &format!("alone-{seed}"))).succeeded();
        results(&scratch.path().join(format!("alone-{seed}")))
    });
    assert!(expected[0] != expected[1], "the comparison cannot tell the writers apart");
    let race = |outs: [&str; 2]| {
        let children = [started(&scratch, &line(1, outs[0])), started(&scratch, &line(2, outs[1]))];
        let ids = children.each_ref().map(Child::id);
        (ids, children.map(ended))
    };
    let mut wins = [0, 0];
    for trial in 0..trials {
        let (ids, results_of) = race(["raced", "raced"]);
        let codes = results_of.each_ref().map(|result| result.code);
        let winner = codes.iter().position(|&code| code == 0).unwrap_or_else(|| panic!("trial {trial}: {codes:?}"));
        let loser = &results_of[1 - winner];
        assert_eq!(loser.code, 2, "trial {trial}: {}", loser.stderr);
        let holder = format!("one\" is being written by process {} on ", ids[winner]);
        assert!(loser.stderr.contains(&holder), "trial {trial}: no {holder:?} in {}", loser.stderr);
        assert!(results(&scratch.path().join("raced")) == expected[winner], "trial {trial}: the files are mixed");
        wins[winner] += 1;
    }
    say(&format!("{trials} races for one folder, won {} and {} times: one writer each", wins[0], wins[1]));
    let (_, apart) = race(["first", "second"]);
    assert_eq!(apart.map(|result| result.code), [0, 0], "two folders have two writers");
}

/// A disk with as much room as a trial needs: a file system in memory. Where none can be mounted, the limit of a file's
/// size stands for the end of the disk.
struct Disk<'a> {
    scratch: &'a Scratch,
    path: PathBuf,
    is_mounted: bool,
}

impl<'a> Disk<'a> {
    fn new(scratch: &'a Scratch) -> Self {
        let path = scratch.path().join("disk");
        fs::create_dir(&path).expect("a folder in a temporary one");
        let mut disk = Self { scratch, path, is_mounted: false };
        disk.is_mounted = disk.mount("size=1g");
        disk
    }

    fn mount(&self, options: &str) -> bool {
        let mut mount = Command::new("mount");
        let mount = mount.args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(&self.path).stderr(Stdio::null());
        mount.status().is_ok_and(|status| status.success())
    }

    /// Bytes in blocks.
    fn used(&self) -> u64 {
        files(&self.path).values().map(|content| (content.len() as u64).div_ceil(BLOCK) * BLOCK).sum()
    }

    /// Run a command while the disk has no more than `room` bytes.
    fn run_in(&self, line: &str, room: u64) -> CommandResult {
        if self.is_mounted {
            assert!(self.mount(&format!("remount,size={}", self.used() + room)), "the disk cannot be made smaller");
            let result = run(self.scratch, line);
            assert!(self.mount("remount,size=1g"), "the disk cannot be made larger");
            return result;
        }
        let limit = room / 1024;
        let line = format!("trap '' XFSZ; ulimit -f {limit}; exec {} {line}", env!("CARGO_BIN_EXE_bondline"));
        wait_for(Command::new("bash").current_dir(self.scratch.path()).args(["-c", &line]))
    }
}

impl Drop for Disk<'_> {
    fn drop(&mut self) {
        if self.is_mounted {
            let _ = Command::new("umount").arg(&self.path).status();
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_disk_that_is_full_at_any_moment_is_an_error_and_the_earlier_report_stays() {
    let scratch = Scratch::new("full-disk");
    scratch.write("c/case.toml", CASE);
    let trials = if runs_all() { 50 } else { 5 };
    let line = |seed: usize| format!("{} --seed {seed} --checkpoint-interval 0.02s --out disk/one", sweep("c", 10_000));
    let disk = Disk::new(&scratch);
    let expected = [2, 1].map(|seed| {
        run(&scratch, &line(seed)).succeeded();
        results(&disk.path)
    });
    // The report is built beside the earlier one, and takes as much room at least.
    let largest = files(&disk.path).values().map(Vec::len).max().unwrap_or_default() as u64;
    let need = if disk.is_mounted { disk.used() - 4 * BLOCK } else { largest };
    let (mut random, mut kept) = (Uniform(3), 0);
    for trial in 0..trials {
        let (earlier, line) = (files(&disk.path), line(2 - trial % 2));
        let room = (random.next() * need as f64) as u64;
        let failed = disk.run_in(&line, room);
        let state = format!("trial {trial}, room for {room} of {need} bytes: {}", failed.stderr);
        assert_eq!(failed.code, 1, "{state}");
        let reason = if disk.is_mounted { "No space left on device" } else { "File too large" };
        assert!(failed.stderr.contains("/disk/") && failed.stderr.contains(reason), "{state}");
        let mut after = files(&disk.path);
        let checkpoint: Vec<PathBuf> =
            after.keys().filter(|name| name.starts_with("one.checkpoint")).cloned().collect();
        checkpoint.iter().for_each(|name| drop(after.remove(name)));
        assert!(after == earlier, "{state}\n{:?} after {:?}", after.keys(), earlier.keys());
        kept += usize::from(!checkpoint.is_empty());
        run(&scratch, &format!("{line} --resume")).succeeded();
        assert!(results(&disk.path) == expected[trial % 2], "{state}");
    }
    let kind = if disk.is_mounted { "full disks" } else { "files at the limit of their size" };
    say(&format!("{trials} {kind}: earlier reports unchanged; {kept} sweeps went on from kept members afterwards"));
    // With room for the report there is no error.
    disk.run_in(&line(1), 4 * need).succeeded();
}
