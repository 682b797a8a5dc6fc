//! Sessions against the command, bit by bit; progress, cancellation, threads, invalid options.

use crate::cli::run;
use crate::support::{Scratch, adapter, case, cases, modified, root, runs_all, without_run};
use bondline::case::Case;
use bondline::ensemble::Ensemble;
use bondline::march::March;
use bondline::march::cpu::Cpu;
use bondline::question::{
    Design, Draw, Estimate, FactorValue, Fit, Goal, Limit, ObservationSelection, PlyChoice, Prior, Question,
    Requirement, Sensitivity, Size, Study, Trade, Twin, Uncertainty,
};
use bondline::report::files::OutputFolder;
use bondline::session::{
    BackendKind, CancelToken, Checkpoint, LogPart, Options, PlanCache, Progress, Session, SessionError,
};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

fn open(case: Case) -> Session {
    Session::open(case, &Options::default().backend(BackendKind::Cpu)).expect("the CPU is always available")
}

fn sweep(members: usize) -> Uncertainty {
    Uncertainty { members, ..Uncertainty::default() }
}

fn requirement(part: &str, limit_k: f64, probability: f64) -> Requirement {
    Requirement { limit: Some(Limit::new(part, limit_k)), probability, ..Requirement::default() }
}

/// The summary of a report without times.
fn record(folder: &Path) -> Value {
    let text = fs::read_to_string(folder.join("summary.json")).expect("a summary");
    without_run(serde_json::from_str(&text).expect("a summary in JSON"))
}

/// Expect the report of a session to equal that of the command: the summary without times, every table, and the screen
/// without the time on its second line.
#[track_caller]
fn same_report(session: &Session, scratch: &Scratch, words: &str) {
    let theirs = scratch.path().join("command");
    let ran = run(scratch, &format!("{words} --backend cpu --quiet --force --out {}", theirs.display()));
    assert!(ran.code == 0 || ran.code == 1 && ran.stderr.contains("no convergence"), "{words}: {}", ran.stderr);
    let mine = scratch.path().join("session");
    let id = session.answers().expect("answers").id();
    session.report(&OutputFolder::open(&mine, &id, true).expect("a folder")).expect("a report");
    let record = record(&theirs);
    assert_eq!(self::record(&mine), record, "{words}");
    let names = record["files"].as_array().expect("names of files").iter().filter_map(Value::as_str);
    let tables: Vec<&str> = names.filter(|name| name.ends_with(".csv") || name.ends_with(".parquet")).collect();
    assert!(!tables.is_empty(), "{words}: no tables in {record:#}");
    for table in tables {
        let bytes = |folder: &Path| fs::read(folder.join(table)).unwrap_or_else(|error| panic!("{table}: {error}"));
        assert!(bytes(&mine) == bytes(&theirs), "{words}: {table} differs");
    }
    let (theirs, _) = ran.stdout.rsplit_once("\nreport: ").expect("the path of the report is last");
    let mine = session.summary().expect("a summary");
    assert_eq!(without_time(mine.trim_end()), without_time(theirs), "{words}");
}

/// A screen without the time at the end of its second line.
fn without_time(screen: &str) -> Vec<&str> {
    let lines = screen.lines().enumerate();
    lines.map(|(line, text)| text.rsplit_once(", ").filter(|_| line == 1).map_or(text, |(fact, _)| fact)).collect()
}

fn at(case: &str) -> String {
    root().join("cases").join(case).display().to_string()
}

#[test]
fn a_session_predicts_every_shipped_case_bit_identically_to_the_command() {
    let scratch = Scratch::new("session-predict");
    for case in cases() {
        let words = format!("predict {}", at(case.id()));
        let mut session = open(case);
        session.predict().expect("a prediction");
        same_report(&session, &scratch, &words);
    }
}

/// Expect the report of the command, or the same error from both. Returns whether there was a report.
#[track_caller]
fn same_or_refused<T>(session: &Session, result: Result<T, SessionError>, scratch: &Scratch, words: &str) -> bool {
    match result {
        Ok(_) => {
            same_report(session, scratch, words);
            true
        }
        Err(SessionError::Input(error)) => {
            let ran = run(scratch, &format!("{words} --backend cpu --quiet --force --out refused"));
            assert_eq!(ran.code, 2, "{words}: the session refuses ({error}), the command does not");
            assert!(ran.stderr.contains(&error.message), "{words}: {error}, and {}", ran.stderr);
            false
        }
        Err(error) => panic!("{words}: {error}"),
    }
}

/// On two cases, or with `BONDLINE_ALL` on every shipped case.
#[test]
fn a_session_gives_all_answers_of_the_command_bit_identically() {
    const MEMBERS: usize = 30;
    let scratch = Scratch::new("session-questions");
    let mut answered: BTreeMap<&str, usize> = BTreeMap::new();
    for case in if runs_all() { cases() } else { ["slab", "lcat-2259"].map(case).into() } {
        let path = at(case.id());
        // A coarse tolerance saves time; the comparison holds at any.
        let sets = case.resolution().tolerance_k.map(|_| ("resolution.tolerance".to_owned(), "2 K".to_owned()));
        let case = Case::load_with(Path::new(&path), &sets.clone().into_iter().collect::<Vec<_>>()).expect("a case");
        let set = if sets.is_some() { " --set resolution.tolerance=2K" } else { "" };
        let (ply, sensor) =
            (case.layup().plies[0].group.clone(), case.sensors()[case.sensors().len() - 1].name.clone());
        let mut session = open(case);
        let peak_k = session.predict().expect("a prediction").peaks.last().expect("a sensor").temperature_k;
        let limit_k = peak_k.round();
        let (requirement, draw) = (requirement(&sensor, limit_k, 0.8), Draw::default());
        let size = Size { ply: ply.clone(), requirement, members: MEMBERS, draw };
        let size_words = format!("size {path} --ply {ply} --limit {sensor}<{limit_k}K --probability 0.8 -n {MEMBERS}");
        let mut check = |name, session: &Session, result: Result<(), SessionError>, words: String| {
            *answered.entry(name).or_default() +=
                usize::from(same_or_refused(session, result, &scratch, &(words + set)));
        };
        for &name in Question::NAMES {
            let question = Question::named(name).expect("a question");
            // A single synthetic data set has no report.
            if !question.fields().contains_key("members") && name != "twin" {
                let result = session.ask(&question).map(drop);
                check(name, &session, result, format!("{name} {path}"));
            }
        }
        let result = session.uncertainty(&sweep(MEMBERS)).map(drop);
        check("uncertainty", &session, result, format!("uncertainty {path} -n {MEMBERS}"));
        let result = session.study(&Study { members: MEMBERS, ..Study::default() }).map(drop);
        check("study", &session, result, format!("study {path} -n {MEMBERS}"));
        let result = session.size(&size).map(drop);
        check("size", &session, result, size_words);
        let result = session.twin_study(&Twin { noise_k: Some(2.0), ..Twin::study(2) }).map(drop);
        check("twin", &session, result, format!("twin {path} --study 2 --noise 2K"));
    }
    assert!(answered.values().all(|&cases| cases >= 2), "{answered:?} cases have each answer");
}

#[test]
fn options_of_a_session_equal_those_of_the_command() {
    let scratch = Scratch::new("session-options");
    let mut session = open(case("slab"));
    let names: Vec<String> = session.case().factors().iter().map(|factor| factor.name.clone()).collect();
    let observations = ObservationSelection { window_s: Some((0.0, 40.0)), ..ObservationSelection::default() };
    let start = FactorValue::new(&names[0], 1.1);
    let fit = Fit { factors: vec![names[0].clone()], start: vec![start], ..Fit::default() };
    let found = session.estimate(&Estimate { observations, fit, ..Estimate::default() });
    assert_eq!(found.expect("an estimate").factors.len(), 1);
    let typed = format!("estimate {} --factors {} --start {}=1.1 --window 0:40", at("slab"), names[0], names[0]);
    same_report(&session, &scratch, &typed);
    assert!(session.case().estimate().window_s != Some((0.0, 40.0)), "a study changed the case of the session");

    session.sensitivity(&Sensitivity { step: Some(1e-4), ..Default::default() }).expect("derivatives");
    same_report(&session, &scratch, &format!("sensitivity {} --step 1e-4", at("slab")));

    let twins = Twin { noise_k: Some(2.0), ..Twin::study(3) };
    session.twin_study(&twins).expect("a study of twins");
    same_report(&session, &scratch, &format!("twin {} --study 3 --noise 2K", at("slab")));

    let goal = Goal::Until("P(BACK > 760 K) ± 20 %".to_owned());
    session.uncertainty_until(&Uncertainty { goal, ..sweep(20_000) }, &mut |_, _| {}).expect("a probability");
    same_report(&session, &scratch, &format!("uncertainty {} -n 20000 --until P(BACK>760K)±20%", at("slab")));

    let mut layups = open(case("lcat-2259"));
    let materials = ["pyrogel3350", "apa"].map(str::to_owned).to_vec();
    let choices = vec![PlyChoice { ply: "INS".to_owned(), materials }];
    let (size, requirement) = ("INS".to_owned(), requirement("TC4", 900.0, 0.8));
    let exposures = vec![case("lcat-2330").into()];
    let trade = Trade { choices, size, requirement, members: 30, exposures, ..Trade::default() };
    layups.trade(&trade).expect("a trade study");
    let cases = format!("{} {}", at("lcat-2259"), at("lcat-2330"));
    let words = format!("trade {cases} --ply INS=pyrogel3350,apa --size INS --limit TC4<900K --probability 0.8 -n 30");
    same_report(&layups, &scratch, &words);

    let truth = vec![FactorValue::new(&names[0], 1.05)];
    let made = session.twin(&Twin { truth, noise_k: Some(1.0), ..Twin::default() }).expect("a twin");
    let words =
        format!("twin {} --truth {}=1.05 --noise 1K --backend cpu --quiet --out made.csv", at("slab"), names[0]);
    run(&scratch, &words).succeeded();
    let csv = scratch.path().join("mine.csv");
    bondline::report::files::write_observations(&csv, session.case(), &made).expect("a file");
    assert_eq!(scratch.read("mine.csv"), scratch.read("made.csv"));
}

#[test]
fn an_answer_does_not_depend_on_earlier_studies_or_on_the_number_of_threads() {
    let mut session = open(case("slab"));
    let before = session.predict().expect("a prediction");
    session.uncertainty(&sweep(50)).expect("a sweep");
    assert_eq!(session.predict().expect("a prediction").temperatures_k, before.temperatures_k);
    let alone = Options::default().backend(BackendKind::Cpu).threads(1);
    let mut alone = Session::open(case("slab"), &alone).expect("the CPU is always available");
    assert_eq!(alone.predict().expect("a prediction").temperatures_k, before.temperatures_k);
    let backend = &alone.answers().expect("answers").backend;
    assert!(backend.name.starts_with("1 thread,"), "a pool of one thread: {}", backend.name);
}

/// Those of the case, and of the other case of an estimate, a comparison or a design.
#[test]
fn a_second_session_takes_every_plan_of_a_study_from_the_cache() {
    type Study = fn(&mut Session, Case) -> String;
    let studies: [(&str, usize, Study); 3] = [
        ("another case", 2, |session, other| {
            let fit = Fit { factors: vec!["f_k_INS".to_owned()], ..Fit::default() };
            let options = Estimate { others: vec![other.into()], fit, ..Estimate::default() };
            format!("{:?}", session.estimate(&options).expect("an estimate"))
        }),
        ("a comparison", 2, |session, other| {
            // With the observations of the case, as a comparison requires.
            let other = modified(&other, |case| {
                let own = session.case();
                (case.observations, case.layup, case.sensors) =
                    (own.observations().to_vec(), own.layup().clone(), own.sensors().to_vec());
            });
            let fit = Fit { factors: vec!["f_k_INS".to_owned()], ..Fit::default() };
            let options = Estimate { compare: Some(other.into()), fit, ..Estimate::default() };
            format!("{:?}", session.estimate(&options).expect("an estimate"))
        }),
        ("a design", 3, |session, other| {
            let options = Design { others: vec![other.into()], members: 4, ..Design::new(["f_k_INS"], 1) };
            format!("{:?}", session.design(&options).expect("a design"))
        }),
    ];
    for (name, count, study) in studies {
        let scratch = Scratch::new(&format!("plan-cache-{}", name.replace(' ', "-")));
        let folder = scratch.path().join("plans");
        let options = Options::default().backend(BackendKind::Cpu).plan_cache(PlanCache::new(&folder));
        let answer = || {
            let mut session = Session::open(case("lcat-2259"), &options).expect("the CPU is always available");
            study(&mut session, case("lcat-2330"))
        };
        let kept = || {
            let files = fs::read_dir(&folder).expect("a folder").map(|file| file.expect("a file"));
            let modified = |file: &fs::DirEntry| file.metadata().and_then(|data| data.modified()).expect("a time");
            let mut kept: Vec<_> = files.map(|file| (file.file_name(), modified(&file))).collect();
            kept.sort();
            kept
        };
        let first = answer();
        let plans = kept();
        assert_eq!(plans.len(), count, "{name}");
        assert_eq!(answer(), first, "{name}");
        assert_eq!(kept(), plans, "{name}: a plan was adapted again");
    }
}

/// A part as another process receives it.
fn sent(part: LogPart) -> LogPart {
    LogPart::from_json(&part.to_json()).expect("the text of a part")
}

#[test]
fn an_estimate_from_minimisations_of_other_sessions_is_that_of_one_session_bit_for_bit() {
    const STARTS: usize = 9;
    for prior in [Prior::None, Prior::Small] {
        let fit = Fit { prior: Some(prior), starts: STARTS, ..Fit::default() };
        let options = Estimate { fit, ..Estimate::default() };
        let whole = format!("{:?}", open(case("slab")).estimate(&options).expect("an estimate"));
        let rounds = options.rounds(&case("slab")).expect("rounds");
        assert_eq!(rounds.len(), if prior == Prior::None { 1 } else { 2 });
        let mut parts: Vec<LogPart> = Vec::new();
        for round in rounds {
            for (first, end) in [(4, STARTS), (0, 4)] {
                let rows = round.start + first..round.start + end;
                let earlier: Vec<LogPart> =
                    parts.iter().filter(|part| part.rows().end <= round.start).cloned().collect();
                let part = open(case("slab")).estimate_part(&options, rows, &earlier).expect("a part");
                parts.push(sent(part));
            }
        }
        let merged = open(case("slab")).estimate_from(&options, &parts).expect("an estimate");
        assert_eq!(format!("{merged:?}"), whole);
        assert_eq!(merged.start_results.len(), STARTS);

        let fewer = Fit { starts: STARTS - 1, ..options.fit.clone() };
        let other = open(case("slab")).estimate_from(&Estimate { fit: fewer, ..options.clone() }, &parts);
        assert!(other.is_err_and(|error| error.to_string().contains("of another study")));
        let without_first = open(case("slab")).estimate_from(&options, &parts[..1]);
        assert!(without_first.is_err_and(|error| error.to_string().contains("no part has rows 0..4")));
        let none = open(case("slab")).estimate_part(&options, 3..3, &[]);
        assert!(none.is_err_and(|error| error.to_string().contains("rows 3..3")));
    }
}

#[test]
fn a_coverage_study_from_fits_of_other_sessions_is_that_of_one_session_bit_for_bit() {
    let options = Twin::study(12);
    let whole = format!("{:?}", open(case("slab")).twin_study(&options).expect("a study"));
    let part = |rows| sent(open(case("slab")).twin_study_part(&options, rows).expect("a part"));
    let merged = open(case("slab")).twin_study_from(&options, &[part(5..12), part(0..5)]).expect("a study");
    assert_eq!(format!("{merged:?}"), whole);
    let other = Twin { seed: 2, ..options.clone() };
    let refused = open(case("slab")).twin_study_from(&other, &[part(0..5)]);
    assert!(refused.is_err_and(|error| error.to_string().contains("of another study")));
    assert_ne!(format!("{:?}", open(case("slab")).twin_study(&other).expect("a study")), whole);
}

#[test]
fn stated_members_are_computed_with_their_derivatives() {
    let case = case("slab");
    let factors = case.factors().len();
    let mut session = open(case);
    let predicted = session.predict().expect("a prediction");
    let nominal: Vec<f64> = session.case().factors().iter().map(|factor| factor.nominal).collect();
    let rows: Vec<f64> =
        nominal.iter().chain(&nominal.iter().map(|value| 1.01 * value).collect::<Vec<_>>()).copied().collect();
    let points = Ensemble::from_values(factors, rows);
    let traces = session.march(&points).expect("traces");
    assert_eq!((traces.members(), traces.member(0)), (2, predicted.temperatures_k.concat().as_slice()));
    assert!(traces.member(1) != traces.member(0), "members do not differ");
    let with_derivatives = session.tangents(&points, &[0]).expect("a march").expect("the CPU has derivatives");
    let derivatives = session.sensitivity(&Sensitivity::default()).expect("derivatives");
    assert_eq!(
        (with_derivatives.members(), with_derivatives.member(1)),
        (4, derivatives.derivatives_k[0].concat().as_slice())
    );

    let wrong = Ensemble::from_values(factors + 1, vec![1.0; factors + 1]);
    let (rows, index) = (session.march(&wrong), session.tangents(&points, &[factors]));
    assert!(matches!(rows, Err(SessionError::Input(error)) if error.option.as_deref() == Some("points")));
    assert!(matches!(index, Err(SessionError::Input(error)) if error.option.as_deref() == Some("factors")));
}

#[test]
fn progress_increases_to_the_end_of_a_sweep() {
    let seen = Arc::new(Mutex::new(Vec::new()));
    let kept = seen.clone();
    let options = Options::default().backend(BackendKind::Cpu).progress(move |progress| {
        kept.lock().expect("no callback panics").push((progress.expected, progress.marched));
    });
    let mut session = Session::open(case("slab"), &options).expect("the CPU is always available");
    session.uncertainty(&sweep(10_000)).expect("a sweep");
    let seen = seen.lock().expect("no callback panics");
    assert_eq!(seen.first(), Some(&(None, 1)), "the first march of the adaptation");
    let swept: Vec<usize> = seen.iter().filter(|(expected, _)| *expected == Some(10_000)).map(|seen| seen.1).collect();
    assert!(swept.len() > 2 && swept.is_sorted(), "{swept:?}");
    assert_eq!((swept.first(), swept.last()), (Some(&0), Some(&10_000)));
}

/// Cancel a sweep at its first batch, and compare the predictions before and after it.
fn cancelled(options: Options) {
    let cancel = CancelToken::new();
    let (token, sweeps) = (cancel.clone(), Arc::new(Mutex::new(Vec::new())));
    let marched = sweeps.clone();
    let options = options.cancel(&cancel).progress(move |progress| {
        if progress.expected.is_some() && progress.marched > 0 {
            let mut marched = marched.lock().expect("no callback panics");
            if marched.is_empty() {
                token.cancel();
            }
            marched.push(progress.marched);
        }
    });
    let mut session = Session::open(case("slab"), &options).expect("a march");
    let before = session.predict().expect("a prediction");
    let ended = session.uncertainty(&sweep(20_000));
    assert!(matches!(ended, Err(SessionError::Cancelled)), "the sweep was not cancelled");
    let marched = sweeps.lock().expect("no callback panics").clone();
    assert!(marched.len() == 1 && marched[0] < 20_000, "{marched:?} members marched in a cancelled sweep");
    assert!(session.answers().is_none() && session.summary().is_err(), "a cancelled sweep left answers");
    assert!(matches!(session.predict(), Err(SessionError::Cancelled)), "a token stays cancelled until it is reset");
    cancel.reset();
    assert_eq!(session.predict().expect("a prediction").temperatures_k, before.temperatures_k);
    session.uncertainty(&sweep(20)).expect("a sweep after a cancelled one");
}

#[test]
fn a_cancelled_sweep_returns_its_error_and_does_not_affect_the_next_study() {
    cancelled(Options::default().backend(BackendKind::Cpu));
}

#[test]
fn a_cancelled_sweep_does_not_affect_a_device() {
    cancelled(Options::default().backend(BackendKind::Gpu).device(adapter().name));
}

/// A sweep that is stopped at its first batch, and resumed by another session.
#[test]
fn a_stopped_sweep_answers_from_its_members_and_another_session_goes_on_to_the_same_bits() {
    let scratch = Scratch::new("session-checkpoint");
    let checkpoint = Checkpoint::new(scratch.path().join("kept"));
    let options = |token: &CancelToken| {
        let options = Options::default().backend(BackendKind::Cpu).cancel(token).checkpoint(checkpoint.clone());
        let token = token.clone();
        options.progress(move |progress| {
            if progress.expected == Some(9_000) && progress.marched > 0 {
                token.stop();
            }
        })
    };
    let token = CancelToken::new();
    let mut session = Session::open(case("slab"), &options(&token)).expect("the CPU is always available");
    let partial = session.uncertainty(&sweep(9_000)).expect("an answer from the members so far");
    assert!(partial.is_partial() && partial.requested == 9_000 && partial.completed >= 2, "{}", partial.members);
    assert!(session.summary().expect("a summary").contains("The sweep was stopped after"));
    let kept = checkpoint.found().expect("it can be read").expect("members are kept");
    assert_eq!((kept.unit, kept.range, kept.requested), ("members", 0..partial.members, Some(9_000)));
    drop(session);
    let mut others = Vec::new();
    let mut session = Session::open(case("slab"), &options(&CancelToken::new())).expect("the CPU is always available");
    let found = session
        .uncertainty_with(&sweep(9_000), &mut |_, traces| others.extend(traces.first..traces.first + traces.members()))
        .expect("the sweep goes on");
    assert_eq!(others, Vec::from_iter(partial.members..9_000), "members were marched again or left out");
    let whole = open(case("slab")).uncertainty(&sweep(9_000)).expect("a sweep");
    assert_eq!(serde_json::to_value(&found).expect("JSON"), serde_json::to_value(&whole).expect("JSON"));
    checkpoint.remove().expect("it can be removed");
    assert_eq!(scratch.files().len(), 0);
}

/// Options of one thread whose token is cancelled at the `report`-th progress report, from one; and the reports.
fn cancelled_at(report: usize) -> (Options, CancelToken, Arc<Mutex<Vec<Progress>>>) {
    let (cancel, seen) = (CancelToken::new(), Arc::new(Mutex::new(Vec::new())));
    let (token, kept) = (cancel.clone(), seen.clone());
    let options = Options::default().backend(BackendKind::Cpu).threads(1).cancel(&cancel).progress(move |progress| {
        let mut seen = kept.lock().expect("no callback panics");
        seen.push(progress);
        if seen.len() == report {
            token.cancel();
        }
    });
    (options, cancel, seen)
}

#[test]
fn a_cancelled_adaptation_returns_its_error_before_the_next_march() {
    for report in [1, 3] {
        let (options, _, seen) = cancelled_at(report);
        assert!(
            matches!(Session::open(case("slab"), &options), Err(SessionError::Cancelled)),
            "the adaptation was not cancelled"
        );
        let marched: Vec<usize> = seen.lock().expect("no callback panics").iter().map(|seen| seen.marched).collect();
        assert_eq!(marched, (1..=report).collect::<Vec<_>>());
    }
    let (options, cancel, seen) = cancelled_at(usize::MAX);
    cancel.cancel();
    assert!(matches!(Session::open(case("slab"), &options), Err(SessionError::Cancelled)));
    assert_eq!(seen.lock().expect("no callback panics").len(), 0, "a member was computed");
}

/// A sweep reports the nominal march first, then the envelope; sizing reports the nominal march, then the adaptation.
#[test]
fn a_study_cancelled_in_the_envelope_of_a_sweep_or_in_the_adaptation_of_sizing_returns_its_error() {
    let (options, cancel, seen) = cancelled_at(usize::MAX);
    Session::open(case("slab"), &options).expect("the CPU is always available");
    let opening = seen.lock().expect("no callback panics").len();
    assert!(opening > 1 && !cancel.is_cancelled(), "{opening} reports of the adaptation");
    let size = Size { members: 500, ..Size::new("SLAB", "BACK", 600.0) };
    type Study<'a> = &'a dyn Fn(&mut Session) -> Result<(), SessionError>;
    let studies: [Study<'_>; 2] =
        [&|session| session.uncertainty(&sweep(20_000)).map(drop), &|session| session.size(&size).map(drop)];
    for (study, reports) in studies.into_iter().zip([2, 3]) {
        let (options, _, seen) = cancelled_at(opening + reports);
        let mut session = Session::open(case("slab"), &options).expect("the CPU is always available");
        assert!(matches!(study(&mut session), Err(SessionError::Cancelled)), "the study was not cancelled");
        let seen = seen.lock().expect("no callback panics");
        let after = &seen[opening..];
        assert_eq!(after[0].marched, 1, "the nominal march");
        let swept = after.iter().filter(|seen| seen.expected.is_some() && seen.marched > 0).count();
        assert!(swept == 0 && after[reports..].iter().all(|seen| seen.marched == 0), "{after:?}");
    }
}

#[test]
fn an_error_names_the_invalid_option() {
    let refused = |options: Options| match Session::open(case("slab"), &options) {
        Err(SessionError::Input(error)) => error.option.map(|option| option.into_owned()),
        _ => None,
    };
    assert_eq!(refused(Options::default().tolerance_k(-1.0)), Some("tolerance_k".to_owned()));
    assert_eq!(refused(Options::default().tolerance_k(f64::NAN)), Some("tolerance_k".to_owned()));
    assert_eq!(refused(Options::default().threads(0)), Some("threads".to_owned()));
    assert_eq!(refused(Options::default().backend(BackendKind::Cpu).device("H200")), Some("device".to_owned()));
    let device = Options::default().backend(BackendKind::Gpu).device("Voodoo2");
    assert!(matches!(Session::open(case("slab"), &device), Err(SessionError::March(_))));

    let mut session = open(case("slab"));
    let certain = requirement("BACK", 600.0, 1.0);
    let size = Size { requirement: certain, ..Size::new("SLAB", "BACK", 600.0) };
    let many = Size { members: 10, ..Size::new("SLAB", "BACK", 600.0) };
    let beyond = Uncertainty { goal: Goal::Part(4..11), ..sweep(10) };
    let named = [
        (session.uncertainty(&sweep(1)).err(), "members"),
        (session.uncertainty_part(&beyond, &mut |_, _| {}).err(), "part"),
        (session.size(&size).err(), "probability"),
        (session.size(&many).err(), "members"),
        (session.twin(&Twin { noise_k: Some(f64::NAN), ..Twin::default() }).err(), "noise"),
        (session.twin_study(&Twin::study(1)).err(), "study"),
    ];
    for (error, option) in named {
        assert!(
            matches!(&error, Some(SessionError::Input(error)) if error.option.as_deref() == Some(option)),
            "{option}: {error:?}"
        );
    }
    assert!(session.report(&OutputFolder::open("unused".as_ref(), "slab", false).expect("no folder yet")).is_err());
}

#[test]
fn the_tolerance_of_a_session_overrides_that_of_the_case() {
    let finer = Options::default().backend(BackendKind::Cpu).tolerance_k(0.01);
    let finer = Session::open(case("slab"), &finer).expect("the CPU is always available");
    let default = open(case("slab"));
    let reached = finer.plan().error_estimate().expect("an adapted plan");
    assert_eq!(reached.tolerance_k, 0.01);
    assert!(reached.nominal_k <= 0.01, "{reached:?}");
    let work = |session: &Session| session.plan().cells() * session.plan().steps();
    assert!(work(&finer) > work(&default), "a smaller tolerance did not increase cells and steps");
}

#[test]
fn sessions_and_marches_can_be_sent_to_other_threads() {
    fn is_send<T: Send + ?Sized>() {}
    is_send::<Session>();
    is_send::<dyn March>();
    is_send::<Cpu>();
}
