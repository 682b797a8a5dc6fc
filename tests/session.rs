//! Sessions beside the command: the same numbers to the last bit; progress, cancellation, threads, refused options.

use crate::cli::say;
use crate::support::{Scratch, adapter, case, cases, root};
use bondline::case::Case;
use bondline::ensemble::Ensemble;
use bondline::march::March;
use bondline::march::cpu::Cpu;
use bondline::report::files::OutputFolder;
use bondline::session::{
    CancelToken, Derivatives, EstimateOptions, FitOptions, Kind, ObservationSelection, Options, SensitivityOptions,
    Session, SessionError, SizeOptions, Start, TwinOptions, TwinStudyOptions, UncertaintyOptions,
};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

fn open(case: Case) -> Session {
    Session::open(case, &Options::default().backend(Kind::Cpu)).expect("the processor marches")
}

fn sweep(members: usize) -> UncertaintyOptions {
    UncertaintyOptions { members, ..UncertaintyOptions::default() }
}

/// A record without what the clock says.
fn record(folder: &Path) -> Value {
    let text = fs::read_to_string(folder.join("summary.json")).expect("a summary");
    let mut record: Value = serde_json::from_str(&text).expect("a summary in JSON");
    let seconds = record.as_object_mut().expect("an object").remove("seconds");
    assert!(seconds.is_some(), "no seconds in {text}");
    record
}

/// The report of a session holds what that of the command holds: the record but for its seconds, and every table.
#[track_caller]
fn same_report(session: &Session, scratch: &Scratch, words: &str) {
    let (mine, theirs) = (scratch.path().join("session"), scratch.path().join("command"));
    let id = session.answers().expect("answers").id();
    session.report(&OutputFolder::open(&mine, &id, true).expect("a folder")).expect("a report");
    say(scratch, &format!("{words} --backend cpu --quiet --force --out {}", theirs.display())).done();
    let record = record(&theirs);
    assert_eq!(self::record(&mine), record, "{words}");
    let names = record["files"].as_array().expect("names of files").iter().filter_map(Value::as_str);
    let tables: Vec<&str> = names.filter(|name| name.ends_with(".csv") || name.ends_with(".parquet")).collect();
    assert!(!tables.is_empty(), "{words}: no tables in {record:#}");
    for table in tables {
        let bytes = |folder: &Path| fs::read(folder.join(table)).unwrap_or_else(|error| panic!("{table}: {error}"));
        assert!(bytes(&mine) == bytes(&theirs), "{words}: {table} differs");
    }
}

fn at(case: &str) -> String {
    root().join("cases").join(case).display().to_string()
}

#[test]
fn a_session_predicts_every_shipped_case_as_the_command_does_to_the_last_bit() {
    let scratch = Scratch::new("session-predict");
    for case in cases() {
        let words = format!("predict {}", at(case.id()));
        let mut session = open(case);
        session.predict().expect("a prediction");
        same_report(&session, &scratch, &words);
    }
}

#[test]
fn a_session_gives_the_sweep_the_derivatives_and_the_estimate_of_the_command_to_the_last_bit() {
    let scratch = Scratch::new("session-questions");
    for id in ["slab", "twin-tc3", "kaowool"] {
        let mut session = open(case(id));
        session.uncertainty(&sweep(200)).expect("a sweep");
        same_report(&session, &scratch, &format!("uncertainty {} -n 200", at(id)));
        session.sensitivity(&SensitivityOptions::default()).expect("derivatives");
        same_report(&session, &scratch, &format!("sensitivity {}", at(id)));
        session.estimate(&EstimateOptions::default()).expect("an estimate");
        same_report(&session, &scratch, &format!("estimate {}", at(id)));
    }
}

#[test]
fn options_of_a_session_are_those_of_the_command() {
    let scratch = Scratch::new("session-options");
    let mut session = open(case("slab"));
    let names: Vec<String> = session.case().factors().iter().map(|factor| factor.name.clone()).collect();
    let observations = ObservationSelection { window_s: Some((0.0, 40.0)), ..ObservationSelection::default() };
    let start = Start { factor: names[0].clone(), case: None, value: 1.1 };
    let fit = FitOptions { factors: vec![names[0].clone()], start: vec![start], ..FitOptions::default() };
    let found = session.estimate(&EstimateOptions { observations, fit, ..EstimateOptions::default() });
    assert_eq!(found.expect("an estimate").factors.len(), 1);
    let typed = format!("estimate {} --factors {} --start {}=1.1 --window 0:40", at("slab"), names[0], names[0]);
    same_report(&session, &scratch, &typed);
    assert!(session.case().estimate().window_s != Some((0.0, 40.0)), "a question changed the case of the session");

    let derivatives = Derivatives::Difference(Some(1e-4));
    session.sensitivity(&SensitivityOptions { derivatives, ..Default::default() }).expect("derivatives");
    same_report(&session, &scratch, &format!("sensitivity {} --step 1e-4", at("slab")));

    let twins = TwinStudyOptions { noise_k: Some(2.0), ..TwinStudyOptions::new(3) };
    session.twin_study(&twins).expect("a study of twins");
    same_report(&session, &scratch, &format!("twin {} --study 3 --noise 2K", at("slab")));

    let truth = vec![(names[0].clone(), 1.05)];
    let made = session.twin(&TwinOptions { truth, noise_k: 1.0, ..TwinOptions::default() }).expect("a twin");
    let words =
        format!("twin {} --truth {}=1.05 --noise 1K --backend cpu --quiet --out made.csv", at("slab"), names[0]);
    say(&scratch, &words).done();
    let csv = scratch.path().join("mine.csv");
    bondline::report::files::measured(&csv, session.case(), &made).expect("a file");
    assert_eq!(scratch.read("mine.csv"), scratch.read("made.csv"));
}

#[test]
fn an_answer_does_not_depend_on_the_questions_before_it_or_on_the_number_of_threads() {
    let mut session = open(case("slab"));
    let before = session.predict().expect("a prediction");
    session.uncertainty(&sweep(50)).expect("a sweep");
    assert_eq!(session.predict().expect("a prediction").temperatures_k, before.temperatures_k);
    let alone = Options::default().backend(Kind::Cpu).threads(1);
    let mut alone = Session::open(case("slab"), &alone).expect("the processor marches");
    assert_eq!(alone.predict().expect("a prediction").temperatures_k, before.temperatures_k);
    let backend = &alone.answers().expect("answers").backend;
    assert!(backend.name.starts_with("1 threads"), "a pool of one thread: {}", backend.name);
}

#[test]
fn rows_are_marched_as_members_and_told_with_their_derivatives() {
    let case = case("slab");
    let factors = case.factors().len();
    let mut session = open(case);
    let predicted = session.predict().expect("a prediction");
    let nominal: Vec<f64> = session.case().factors().iter().map(|factor| factor.nominal).collect();
    let rows: Vec<f64> =
        nominal.iter().chain(&nominal.iter().map(|value| 1.01 * value).collect::<Vec<_>>()).copied().collect();
    let points = Ensemble::at(factors, rows);
    let traces = session.march(&points).expect("traces");
    assert_eq!((traces.members(), traces.member(0)), (2, predicted.temperatures_k.concat().as_slice()));
    assert!(traces.member(1) != traces.member(0), "members do not differ");
    let told = session.tangents(&points, &[0]).expect("a march").expect("the processor knows derivatives");
    let derivatives = session.sensitivity(&SensitivityOptions::default()).expect("derivatives");
    assert_eq!((told.members(), told.member(1)), (4, derivatives.derivatives_k[0].concat().as_slice()));

    let wrong = Ensemble::at(factors + 1, vec![1.0; factors + 1]);
    let (rows, index) = (session.march(&wrong), session.tangents(&points, &[factors]));
    assert!(matches!(rows, Err(SessionError::Input(error)) if error.option == Some("points")));
    assert!(matches!(index, Err(SessionError::Input(error)) if error.option == Some("factors")));
}

#[test]
fn progress_is_reported_to_the_end_of_a_sweep_and_never_runs_back() {
    let seen = Arc::new(Mutex::new(Vec::new()));
    let kept = seen.clone();
    let options = Options::default().backend(Kind::Cpu).progress(move |progress| {
        kept.lock().expect("no callback panics").push((progress.expected, progress.marched));
    });
    let mut session = Session::open(case("slab"), &options).expect("the processor marches");
    session.uncertainty(&sweep(10_000)).expect("a sweep");
    let seen = seen.lock().expect("no callback panics");
    assert_eq!(seen.first(), Some(&(None, 1)), "the nominal march");
    let swept: Vec<usize> = seen.iter().filter(|(expected, _)| *expected == Some(10_000)).map(|seen| seen.1).collect();
    assert!(swept.len() > 2 && swept.is_sorted(), "{swept:?}");
    assert_eq!((swept.first(), swept.last()), (Some(&0), Some(&10_000)));
}

/// A sweep cancelled at its first batch, and the prediction after it beside the one before.
fn cancelled(options: Options) {
    let cancel = CancelToken::new();
    let (token, sweeps) = (cancel.clone(), Arc::new(Mutex::new(Vec::new())));
    let marched = sweeps.clone();
    let options = options.cancel(&cancel).progress(move |progress| {
        if progress.expected.is_some() && progress.marched > 0 {
            marched.lock().expect("no callback panics").push(progress.marched);
            token.cancel();
        }
    });
    let mut session = Session::open(case("slab"), &options).expect("a march");
    let before = session.predict().expect("a prediction");
    let ended = session.uncertainty(&sweep(20_000));
    assert!(matches!(ended, Err(SessionError::Cancelled)), "the sweep went on");
    let marched = sweeps.lock().expect("no callback panics").clone();
    assert!(marched.len() == 1 && marched[0] < 20_000, "{marched:?} members marched in a cancelled sweep");
    assert!(session.answers().is_none() && session.summary().is_err(), "a cancelled sweep left answers");
    assert!(matches!(session.predict(), Err(SessionError::Cancelled)), "a token stays cancelled until it is reset");
    cancel.reset();
    assert_eq!(session.predict().expect("a prediction").temperatures_k, before.temperatures_k);
    session.uncertainty(&sweep(20)).expect("a sweep after a cancelled one");
}

#[test]
fn a_cancelled_sweep_ends_with_its_error_and_leaves_the_next_question_unharmed() {
    cancelled(Options::default().backend(Kind::Cpu));
}

#[test]
fn a_cancelled_sweep_leaves_a_device_unharmed() {
    cancelled(Options::default().backend(Kind::Gpu).device(adapter().name));
}

#[test]
fn a_wrong_option_is_refused_by_its_name() {
    let refused = |options: Options| match Session::open(case("slab"), &options) {
        Err(SessionError::Input(error)) => error.option,
        _ => None,
    };
    assert_eq!(refused(Options::default().tolerance_k(-1.0)), Some("tolerance_k"));
    assert_eq!(refused(Options::default().tolerance_k(f64::NAN)), Some("tolerance_k"));
    assert_eq!(refused(Options::default().threads(0)), Some("threads"));
    assert_eq!(refused(Options::default().backend(Kind::Cpu).device("H200")), Some("device"));
    let device = Options::default().backend(Kind::Gpu).device("Voodoo2");
    assert!(matches!(Session::open(case("slab"), &device), Err(SessionError::March(_))));

    let mut session = open(case("slab"));
    let size = SizeOptions { probability: 1.0, ..SizeOptions::new("SLAB", "BACK", 600.0) };
    let many = SizeOptions { sweep: sweep(10), ..SizeOptions::new("SLAB", "BACK", 600.0) };
    let named = [
        (session.uncertainty(&sweep(1)).err(), "members"),
        (session.uncertainty_part(&sweep(10), 4..11, &mut |_, _| {}).err(), "part"),
        (session.size(&size).err(), "probability"),
        (session.size(&many).err(), "members"),
        (session.twin(&TwinOptions { noise_k: f64::NAN, ..TwinOptions::default() }).err(), "noise_k"),
        (session.twin_study(&TwinStudyOptions::new(1)).err(), "twins"),
    ];
    for (error, option) in named {
        assert!(
            matches!(&error, Some(SessionError::Input(error)) if error.option == Some(option)),
            "{option}: {error:?}"
        );
    }
    assert!(session.report(&OutputFolder::open("unused".as_ref(), "slab", false).expect("no folder yet")).is_err());
}

#[test]
fn the_tolerance_of_a_session_takes_the_place_of_the_case_s_own() {
    let finer = Options::default().backend(Kind::Cpu).tolerance_k(0.01);
    let finer = Session::open(case("slab"), &finer).expect("the processor marches");
    let own = open(case("slab"));
    let reached = finer.plan().reached.as_ref().expect("an adapted plan");
    assert_eq!(reached.tolerance_k, 0.01);
    assert!(reached.nominal_k <= 0.01, "{reached:?}");
    let work = |session: &Session| session.plan().cells() * session.plan().steps();
    assert!(work(&finer) > work(&own), "a fifth of the error takes no more cells and steps");
}

#[test]
fn sessions_and_marches_can_be_sent_to_other_threads() {
    fn is_send<T: Send + ?Sized>() {}
    is_send::<Session>();
    is_send::<dyn March>();
    is_send::<Cpu>();
}
