//! Workbooks as table files.

use super::VALID_CASE;
use crate::case::{Case, CaseError, Schedule};
use crate::limits::{SHARED_TEXTS_MIB, UNPACKED_MIB};
use rust_xlsxwriter::{ExcelDateTime, Format, Formula, Workbook};
use std::collections::BTreeMap;
use std::io::{Cursor, Read as _, Write as _};
use std::time::{Duration, Instant};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

const SAMPLES: &str = "TC2 = [[\"0 s\", \"300 K\"], [\"10 s\", \"320 K\"]]";
const FLUX: &str = r#"{ points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }"#;
/// What the case chooses of the file of a logger.
const CHOSEN: &str = "file = \"run\"\ntime = { column = \"Time\", offset = \"-17.5 s\" }\nTC2 = { column = \"CH 12\" }";

/// Lines above the headings, a merged heading above two others, units, a blank column, text, an error and a gap.
const LOGGER: [&[&str]; 9] = [
    &["", "Run 17", "panel B"],
    &[],
    &["", "", "Front", "", "", "", "Back"],
    &["", "Time", "CH 11", "CH 12", "Alarm", "", "TC1"],
    &["", "ms", "degC", "degF", "", "", "K"],
    &["", "15500", "20.5", "68.9", "ok", "", "293.65"],
    &["", "17500", "21.5", "70.7", "ok", "", "294.65"],
    &["", "18500", "#N/A", "72.5", "HIGH", "", "295.65"],
    &["", "217500", "23.5", "", "ok", "", "296.65"],
];

/// The valid case with other `observations`, and a file `run`.
fn observed(run: Vec<u8>, observations: &str) -> Result<Case, CaseError> {
    Case::from_toml(&VALID_CASE.replacen(SAMPLES, observations, 1), "own", &BTreeMap::from([("run".to_owned(), run)]))
}

fn refusal(run: Vec<u8>, observations: &str) -> String {
    observed(run, observations).expect_err("a refusal").to_string()
}

fn notes(case: &Case) -> Vec<String> {
    case.unread_data().iter().map(ToString::to_string).collect()
}

/// Sheets of rows of cells: numbers, texts, and errors of formulas.
fn workbook(sheets: &[(&str, &[&[&str]])]) -> Vec<u8> {
    let mut book = Workbook::new();
    for (name, rows) in sheets {
        let sheet = book.add_worksheet().set_name(*name).expect("a name");
        for (row, cells) in (0..).zip(*rows) {
            for (column, cell) in (0..).zip(*cells).filter(|(_, cell)| !cell.is_empty()) {
                let written = match cell.parse::<f64>() {
                    Ok(number) => sheet.write(row, column, number),
                    Err(_) if cell.starts_with('#') => {
                        sheet.write(row, column, Formula::new("=NA()").set_result(*cell))
                    }
                    Err(_) => sheet.write(row, column, *cell),
                };
                written.expect("a cell");
            }
        }
    }
    book.save_to_buffer().expect("a workbook")
}

/// Parts of a zip archive.
fn parts(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).expect("an archive");
    (0..archive.len())
        .map(|index| {
            let mut part = archive.by_index(index).expect("a part");
            let (name, mut content) = (part.name().expect("a name").into_owned(), Vec::new());
            part.read_to_end(&mut content).expect("its content");
            (name, content)
        })
        .collect()
}

fn archive(parts: &[(String, Vec<u8>)], method: CompressionMethod) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in parts {
        writer.start_file(name.as_str(), SimpleFileOptions::default().compression_method(method)).expect("a part");
        writer.write_all(content).expect("its content");
    }
    writer.finish().expect("an archive").into_inner()
}

#[test]
fn a_sheet_is_read_as_the_text_file_of_its_cells() {
    let lines = LOGGER.map(|cells| cells[cells.len().min(1)..].join(",").replace("#N/A", ""));
    let text =
        lines.map(
            |line| if line.is_empty() { line } else { format!("{line}{}", ",".repeat(5 - line.matches(',').count())) },
        );
    let of_text = observed(text.join("\n").into_bytes(), CHOSEN).unwrap_or_else(|error| panic!("{error}"));
    let of_sheet = observed(workbook(&[("Run 17", &LOGGER)]), CHOSEN).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(of_text.observations(), of_sheet.observations());
    assert_eq!(notes(&of_text), notes(&of_sheet));
    let [tc2, tc1] = of_sheet.observations() else { panic!("two observations") };
    assert_eq!((&tc2.times_s[..], &tc1.times_s[..]), (&[0.0, 1.0][..], &[0.0, 1.0][..]));
}

#[test]
fn errors_name_the_sheet_and_the_cell() {
    let with = |row: usize, column: usize, text: &'static str| {
        let mut rows = LOGGER.map(<[&str]>::to_vec);
        rows[row][column] = text;
        let rows: Vec<&[&str]> = rows.iter().map(Vec::as_slice).collect();
        refusal(workbook(&[("Run 17", &rows)]), CHOSEN)
    };
    let text = with(7, 3, "open");
    assert!(text.contains("run:'Run 17'!D8: expected a finite number, found \"open\""), "{text}");
    let decreasing = with(7, 1, "17000");
    assert!(decreasing.contains("run:'Run 17'!B8: times must increase: -0.5 s follows 0 s"), "{decreasing}");
    let repeated = with(3, 6, "CH 12");
    assert!(repeated.contains("run has several columns \"CH 12\""), "{repeated}");
    let plain = workbook(&[("Data", &[&["time_s", "", "TC1_K"], &["0", "", "300"]])]);
    assert!(refusal(plain, "file = \"run\"").contains("run:Data!B1: column 2 has no heading"));
    let unknown = refusal(workbook(&[("Data", &[&["time_s", "TC9_K"], &["0", "300"]])]), "file = \"run\"");
    assert!(unknown.contains("run:Data!B1: unknown sensor \"TC9\""), "{unknown}");
    let longer =
        refusal(workbook(&[("Data", &[&["time_s", "TC1_K"], &["0", "300"], &["1", "300", "x"]])]), "file = \"run\"");
    assert!(longer.contains("run:Data!A3: found 3 values under 2 headings"), "{longer}");
    let empty = refusal(workbook(&[("Data", &[])]), "file = \"run\"");
    assert!(empty.contains("run:Data: no cells"), "{empty}");
}

#[test]
fn the_case_chooses_a_sheet_and_a_range() {
    let table: &[&[&str]] = &[&["time_s", "TC1_K"], &["0", "300"], &["1", "301"], &["mean", "300.5"]];
    let book = || workbook(&[("Notes", &[&["Run 17"]]), ("Data", table)]);
    let case = observed(book(), "file = \"run\"\nsheet = \"Data\"\nrange = \"A1:B3\"");
    assert_eq!(case.unwrap_or_else(|error| panic!("{error}")).observations()[0].temperatures_k, [300.0, 301.0]);
    let below = refusal(book(), "file = \"run\"\nsheet = \"Data\"");
    assert!(below.contains("run:Data!A4: expected a finite number, found \"mean\""), "{below}");
    let unknown = refusal(book(), "file = \"run\"\nsheet = \"Date\"");
    assert!(unknown.contains("run has no sheet \"Date\"") && unknown.contains("Data"), "{unknown}");
    let outside = refusal(book(), "file = \"run\"\nsheet = \"Data\"\nrange = \"D1:E9\"");
    assert!(outside.contains("run:Data: no cells"), "{outside}");
    let reversed = refusal(book(), "file = \"run\"\nsheet = \"Data\"\nrange = \"B3:A1\"");
    assert!(reversed.contains("expected a range from its upper left to its lower right cell"), "{reversed}");
    let first = observed(workbook(&[("Data", &table[..3]), ("Notes", &[])]), "file = \"run\"");
    assert_eq!(notes(&first.unwrap_or_else(|error| panic!("{error}"))), ["run: sheet \"Data\" read, the first of 2"]);
    let text = refusal(b"time_s,TC1_K\n0,300\n".to_vec(), "file = \"run\"\nsheet = \"Data\"");
    assert!(text.contains("`sheet` needs a workbook: run is a text file"), "{text}");
    assert!(refusal(book(), &format!("{SAMPLES}\nrange = \"A1:B2\"")).contains("`range` needs a `file`: found none"));
    let older = refusal(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1".to_vec(), "file = \"run\"");
    assert!(older.contains("an .xls workbook or one with a password"), "{older}");
}

#[test]
fn a_schedule_is_read_from_a_sheet() {
    let book = workbook(&[("Notes", &[]), ("Flux", &[&["t", "Q"], &["s", "kW/m^2"], &["0", "0"], &["2", "50"]])]);
    let flux = "{ file = \"run\", sheet = \"Flux\", column = \"Q\", time = \"t\", outside = \"hold\" }";
    let text = VALID_CASE.replacen(FLUX, flux, 1);
    let case = Case::from_toml(&text, "own", &BTreeMap::from([("run".to_owned(), book)]));
    let crate::case::Face::Open(face) = case.unwrap_or_else(|error| panic!("{error}")).exposure.hot_face else {
        panic!("an open face")
    };
    assert_eq!(Schedule::new(vec![0.0, 2.0], vec![0.0, 5e4]), Ok(face.flux_w_m2));
}

/// A sheet of a column of times with a format, and temperatures.
fn timed(format: &str, times: &[ExcelDateTime]) -> Vec<u8> {
    let mut book = Workbook::new();
    let format = Format::new().set_num_format(format);
    let sheet = book.add_worksheet();
    sheet.write(0, 0, "Clock").and_then(|sheet| sheet.write(0, 1, "TC1_K")).expect("headings");
    for (row, time) in (1..).zip(times) {
        sheet.write_with_format(row, 0, time, &format).expect("a time");
        sheet.write(row, 1, 300.0 + f64::from(row)).expect("a temperature");
    }
    book.save_to_buffer().expect("a workbook")
}

#[test]
fn dates_are_seconds_since_the_first_and_durations_are_seconds() {
    let at = |text: &str| ExcelDateTime::parse_from_str(text).expect("a time");
    let dates = ["2026-11-24T10:15:30.250", "2026-11-24T10:15:30.350", "2026-11-24T10:16:30.250"].map(at);
    let chosen = "file = \"run\"\ntime = \"Clock\"";
    let case = observed(timed("yyyy-mm-dd hh:mm:ss.000", &dates), chosen).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.observations()[0].times_s, [0.0, 0.1, 60.0]);
    let note =
        "run:Sheet1: times \"Clock\" are dates or times of day, as seconds since the first, 2026-11-24 10:15:30.250";
    assert!(notes(&case).contains(&note.to_owned()), "{:?}", notes(&case));
    let durations = || timed("[h]:mm:ss.0", &["00:00:17.5", "00:00:18", "01:00:00"].map(at));
    let offset = "file = \"run\"\ntime = { column = \"Clock\", offset = \"-17.5 s\" }";
    let case = observed(durations(), offset).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.observations()[0].times_s, [0.0, 0.5]);
    let stated = refusal(durations(), "file = \"run\"\ntime = { column = \"Clock\", unit = \"s\" }");
    assert!(stated.contains("times \"Clock\" are durations in seconds: expected no `unit`"), "{stated}");
    let value = refusal(durations(), "file = \"run\"\ntime = \"TC1_K\"\nTC2 = { column = \"Clock\", unit = \"K\" }");
    assert!(value.contains("column \"Clock\" holds durations in seconds: expected a temperature"), "{value}");
}

#[test]
fn a_number_among_dates_is_refused() {
    let mut book = Workbook::new();
    let sheet = book.add_worksheet();
    sheet.write(0, 0, "Clock").and_then(|sheet| sheet.write(0, 1, "TC1_K")).expect("headings");
    let date = ExcelDateTime::parse_from_str("2026-11-24T10:15:30").expect("a date");
    let format = Format::new().set_num_format("yyyy-mm-dd hh:mm:ss");
    sheet.write_with_format(1, 0, &date, &format).and_then(|sheet| sheet.write(1, 1, 300)).expect("a row");
    sheet.write(2, 0, 12.5).and_then(|sheet| sheet.write(2, 1, 300)).expect("a row");
    let mixed = refusal(book.save_to_buffer().expect("a workbook"), "file = \"run\"\ntime = \"Clock\"");
    assert!(
        mixed.contains("Sheet1!A3: expected a time written as those before, found \"12.5 without a date format\""),
        "{mixed}"
    );
}

/// The message of a workbook with one part in place of another, which must come within a second.
fn refused_part(name: &str, content: Vec<u8>) -> String {
    let mut changed = parts(&workbook(&[("Run 17", &LOGGER)]));
    changed.iter_mut().find(|(part, _)| part == name).expect("the part").1 = content;
    let bytes = archive(&changed, CompressionMethod::Deflated);
    let began = Instant::now();
    let message = refusal(bytes, CHOSEN);
    assert!(began.elapsed() < Duration::from_secs(10), "{:?}", began.elapsed());
    message
}

#[test]
fn a_workbook_that_unpacks_to_more_than_the_limit_is_refused() {
    let zeros = |mib: u64| vec![b' '; ((mib + 1) << 20) as usize];
    let sheet = refused_part("xl/worksheets/sheet1.xml", zeros(UNPACKED_MIB.max));
    assert!(sheet.contains("expected at most 512 MiB of an unpacked workbook"), "{sheet}");
    let texts = refused_part("xl/sharedStrings.xml", zeros(SHARED_TEXTS_MIB.max));
    assert!(texts.contains("expected at most 64 MiB of the texts of a workbook"), "{texts}");
    let count =
        br#"<sst xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" uniqueCount="99999999999999"/>"#;
    let count = refused_part("xl/sharedStrings.xml", count.to_vec());
    assert!(count.contains("a damaged workbook: 99999999999999 texts in"), "{count}");
}

#[test]
fn a_sheet_of_two_distant_cells_is_refused_with_the_limit() {
    let cell = |at: &str| format!("<row><c r=\"{at}\"><v>1</v></c></row>");
    let head = "<worksheet xmlns=\"http://schemas.openxmlformats.org/spreadsheetml/2006/main\"><sheetData>";
    let sheet = format!("{head}{}{}</sheetData></worksheet>", cell("A1"), cell("XFD1048576"));
    let mut changed = parts(&workbook(&[("Data", &[])]));
    changed.iter_mut().find(|(part, _)| part == "xl/worksheets/sheet1.xml").expect("a sheet").1 = sheet.into();
    let message = refusal(archive(&changed, CompressionMethod::Stored), "file = \"run\"");
    assert!(message.contains("run:Data!A1048576: found 2 values under 1 headings"), "{message}");
}

/// Every read of a mutant ends with a case or a message.
#[test]
fn no_truncated_or_mutated_workbook_panics() {
    let book = workbook(&[("Notes", &[&["Run 17"]]), ("Run 17", &LOGGER)]);
    let chosen = CHOSEN.replacen("file", "sheet = \"Run 17\"\nfile", 1);
    for end in (0..book.len()).step_by(97) {
        let read = observed(book[..end].to_vec(), &chosen);
        assert!(read.is_err(), "the first {end} of {} bytes", book.len());
    }
    let parts = parts(&book);
    let mut valid = 0;
    const MUTANTS: u64 = 3000;
    for mutant in 0..MUTANTS {
        let mut random = Random::new(mutant);
        let mut changed = parts.clone();
        let part = random.below(changed.len());
        mutate(&mut changed[part].1, &mut random);
        let mut bytes = archive(&changed, CompressionMethod::Stored);
        if mutant % 4 == 0 {
            mutate(&mut bytes, &mut random);
        }
        valid += u64::from(observed(bytes, &chosen).is_ok());
    }
    assert!(10 * valid > MUTANTS, "only {valid} of {MUTANTS} mutants are valid");
}

/// Random numbers (Steele, Lea and Flood, SplitMix64, 2014).
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }
}

/// Change, repeat or remove some bytes, or put a large number for digits.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    const NUMBERS: [&str; 8] = ["0", "-1", "4294967296", "1048577", "99999999999999999999", "1e400", "NaN", ""];
    if bytes.is_empty() {
        return;
    }
    let at = random.below(bytes.len());
    let end = (at + 1 + random.below(40)).min(bytes.len());
    match random.below(5) {
        0 => bytes[at] = random.next() as u8,
        1 => drop(bytes.drain(at..end)),
        2 => {
            let repeated = bytes[at..end].repeat(1 + random.below(3));
            bytes.splice(at..at, repeated);
        }
        3 => bytes[at] ^= 1 << random.below(8),
        _ => {
            let Some(first) = bytes[at..].iter().position(u8::is_ascii_digit) else { return };
            let digits = bytes[at + first..].iter().take_while(|byte| byte.is_ascii_digit()).count();
            let number = NUMBERS[random.below(NUMBERS.len())];
            bytes.splice(at + first..at + first + digits, number.bytes());
        }
    }
}
