//! Reading of case, material and gas files.
//!
//! The files are TOML. They are not deserialised with derived code: every value keeps its line and column, an unknown
//! key is an error, and reading continues after an error, so that one run reports all of them. The keys are documented
//! in `docs/reference/case-file.md`.

mod column_choice;
mod decomposition;
mod exposure;
mod factor;
mod files;
mod gas;
mod gas_flow;
mod import;
mod layup;
mod material;
mod observation;
mod property;
mod references;
mod schedule;
mod spanned_toml;
mod table_file;
#[cfg(test)]
mod tests;
mod text_file;

pub use files::{FileSource, Folder};
pub use import::{ImportRecord, ImportedMaterial, MaterialColumns, PatoHeat, PatoOptions, PropertyColumns};

use super::builder::CaseBuilder;
use super::error::{CaseError, Diagnostics, ReadResult, SourceLocation};
use super::factor_targets::FactorTargets;
use super::gas::BLOWING_NEEDS_GAS;
use super::input_files::InputFiles;
use super::own_materials::OwnMaterials;
use super::reading_notes::ReadingNotes;
use super::unit::Dimension;
use super::{
    Case, Exposure, Face, Gas, Layup, Material, PyrometerDriver, Resolution, Schedule, Sensor, SmoothedDriver,
};
use crate::limits::{TEXT_FILE_MIB, read_file};
use exposure::{BackFace, HotFace};
use files::RecordedFiles;
use references::{ReferenceResolver, built_in_gas_named, built_in_material_named};
use schedule::{InitialTemperature, ScheduleReader, Trajectory};
use spanned_toml::{SpannedValue, TableReader, ValueReader};
use std::path::{Path, PathBuf};

impl Case {
    /// Read a case file, or the `case.toml` of a folder.
    ///
    /// # Errors
    /// All errors of the file and of the files it names, each with line and column.
    pub fn load(path: &Path) -> Result<Self, CaseError> {
        Self::load_with(path, &[])
    }

    /// Read a case and override some of its keys with pairs of a name and a value.
    ///
    /// A name is a factor, whose nominal value is set, or a dotted key of the case file; an entry of a list is selected
    /// by its `name`: `pressure`, `hot_face.surroundings`, `ply.OF1.thickness`, `f_k_INS`, `f_k_INS.small`. A value is
    /// TOML or text without quotes, such as `3 kPa`.
    ///
    /// # Errors
    /// As [`Case::load`]; an error of an override names the override.
    pub fn load_with(path: &Path, overrides: &[(String, String)]) -> Result<Self, CaseError> {
        let diagnostics = Diagnostics::default();
        let mut read = InputFiles::default();
        let case = case_file_path(path, &diagnostics).and_then(|file| {
            let (label, bytes) = (file.display().to_string(), read_file(&file, &TEXT_FILE_MIB));
            bytes.iter().for_each(|bytes| read.add(label.clone(), bytes));
            let mut root = text_file::parse_toml_file(bytes, &label, &diagnostics)?;
            override_keys(&mut root, overrides, &diagnostics)?;
            let folder = Folder::new(file.parent().unwrap_or(Path::new(".")));
            let files = RecordedFiles::new(&folder, std::mem::take(&mut read));
            let case = read_document(&root, &files, file_id(&file), &diagnostics);
            read = files.into_read();
            case
        });
        build(case, InputFiles { overrides: overrides.to_vec(), ..read }, diagnostics)
    }

    /// Read a case from the text of a case file. `id` names it in messages and output; `files` provides the files that
    /// the text names, from disk or memory.
    ///
    /// # Errors
    /// All errors of the text and of the files that it names, each with line and column.
    pub fn from_toml(text: &str, id: &str, files: &dyn FileSource) -> Result<Self, CaseError> {
        Self::from_toml_with(text, id, files, &[])
    }

    /// Read a case from text as [`from_toml`](Self::from_toml), and override some of its keys as
    /// [`load_with`](Self::load_with).
    ///
    /// # Errors
    /// As [`from_toml`](Self::from_toml) and [`load_with`](Self::load_with).
    pub fn from_toml_with(
        text: &str,
        id: &str,
        files: &dyn FileSource,
        overrides: &[(String, String)],
    ) -> Result<Self, CaseError> {
        let diagnostics = Diagnostics::default();
        let mut read = InputFiles::default();
        read.add(id.to_owned(), text.as_bytes());
        let files = RecordedFiles::new(files, read);
        let case = text_file::parse_toml(text, id, &diagnostics).and_then(|mut root| {
            override_keys(&mut root, overrides, &diagnostics)?;
            read_document(&root, &files, id.to_owned(), &diagnostics)
        });
        build(case, InputFiles { overrides: overrides.to_vec(), ..files.into_read() }, diagnostics)
    }
}

/// A case that is not validated yet, its drivers as measured, and its own materials.
type ReadCase = (CaseBuilder, (Vec<SmoothedDriver>, Option<PyrometerDriver>), OwnMaterials);

/// Replace keys of a document.
fn override_keys(root: &mut SpannedValue, overrides: &[(String, String)], diagnostics: &Diagnostics) -> ReadResult<()> {
    let mut paths = Vec::new();
    let applied = overrides.iter().map(|(name, value)| apply_override(root, name, value, &mut paths, diagnostics));
    spanned_toml::collect_all(applied).map(drop)
}

/// The validated case, with its files.
fn build(read: ReadResult<ReadCase>, input_files: InputFiles, diagnostics: Diagnostics) -> Result<Case, CaseError> {
    let (unread, recorded) = (diagnostics.take_notes(), diagnostics.take_channels());
    let (builder, (drivers, pyrometer_driver), materials) = diagnostics.into_result(read)?;
    Ok(Case {
        reading_notes: ReadingNotes { unread, recorded, drivers, pyrometer_driver, materials },
        input_files,
        ..builder.build()?
    })
}

/// The content of a document. Errors of single values are recorded here; the builder then validates the whole case.
fn read_document(
    root: &SpannedValue,
    files: &RecordedFiles<'_>,
    id: String,
    diagnostics: &Diagnostics,
) -> ReadResult<ReadCase> {
    let references = ReferenceResolver::new(files, diagnostics);
    let builder = read_case(&root.reader(diagnostics).section()?, &references, id)?;
    let materials = references.own_materials();
    Ok((builder, references.into_drivers(), materials))
}

impl Material {
    /// Read a material file.
    ///
    /// # Errors
    /// All errors of the file, each with line and column.
    pub fn load(path: &Path) -> Result<Self, CaseError> {
        let diagnostics = Diagnostics::default();
        let material =
            document(path, &diagnostics).and_then(|root| material::material(root.reader(&diagnostics), file_id(path)));
        diagnostics.into_result(material)
    }

    /// A material of the built-in database; `-` equals `_` in the id, and capital letters equal small ones.
    ///
    /// # Errors
    /// The id is unknown; the message suggests a similar one or lists the known ones.
    pub fn named(id: &str) -> Result<Self, CaseError> {
        let diagnostics = Diagnostics::default();
        let material = built_in_material_named(id, &diagnostics);
        diagnostics.into_result(material)
    }
}

impl Gas {
    /// Read a gas file.
    ///
    /// # Errors
    /// All errors of the file, each with line and column.
    pub fn load(path: &Path) -> Result<Self, CaseError> {
        let diagnostics = Diagnostics::default();
        let gas = document(path, &diagnostics).and_then(|root| gas::gas(root.reader(&diagnostics), file_id(path)));
        diagnostics.into_result(gas)
    }

    /// A gas of the built-in database; `-` equals `_` in the id, and capital letters equal small ones.
    ///
    /// # Errors
    /// The id is unknown; the message suggests a similar one or lists the known ones.
    pub fn named(id: &str) -> Result<Self, CaseError> {
        let diagnostics = Diagnostics::default();
        let gas = built_in_gas_named(id, &diagnostics);
        diagnostics.into_result(gas)
    }
}

fn document(file: &Path, diagnostics: &Diagnostics) -> ReadResult<SpannedValue> {
    text_file::parse_toml_file(read_file(file, &TEXT_FILE_MIB), &file.display().to_string(), diagnostics)
}

/// The case file of a path, which may be a folder.
fn case_file_path(path: &Path, diagnostics: &Diagnostics) -> ReadResult<PathBuf> {
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    let file = path.join("case.toml");
    if file.exists() {
        return Ok(file);
    }
    Err(diagnostics
        .record(&SourceLocation::without_line(path.display().to_string()), "the folder contains no case.toml"))
}

/// The name of the folder of a `case.toml`, else the name of the file without its extension.
fn file_id(file: &Path) -> String {
    let whole = file.canonicalize().unwrap_or_else(|_| file.to_owned());
    let named = match whole.file_name() {
        Some(name) if name == "case.toml" => whole.parent().and_then(Path::file_name),
        _ => whole.file_stem(),
    };
    named.map_or_else(|| "case".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Override a key of the document, which is not among the `paths` of the previous overrides.
fn apply_override<'a>(
    root: &mut SpannedValue,
    name: &'a str,
    value: &str,
    paths: &mut Vec<Vec<&'a str>>,
    diagnostics: &Diagnostics,
) -> ReadResult<()> {
    let shown = format!("{name}={value}");
    let location = SourceLocation::without_line(shown.as_str());
    let mut path: Vec<&str> = name.split('.').collect();
    let factors = root.get("factor").map_or(&[][..], SpannedValue::items);
    if factors.iter().any(|factor| factor.name() == Some(path[0])) {
        if root.get(path[0]).is_some() {
            let message =
                format!("{0:?} is both a factor and a key: set factor.{0}.nominal, or rename the factor", path[0]);
            return Err(diagnostics.record(&location, message));
        }
        path.insert(0, "factor");
        if path.len() == 2 {
            path.push("nominal");
        }
    }
    if paths.contains(&path) {
        return Err(diagnostics.record(&location, format!("{:?} is set twice", path.join("."))));
    }
    let set = root.set(&path, SpannedValue::parse_override(value, &shown));
    paths.push(path);
    set.map_err(|message| diagnostics.record(&location, message))
}

/// All parts are read before the first `?`, so that no error hides another.
fn read_case(top: &TableReader<'_>, references: &ReferenceResolver<'_>, id: String) -> ReadResult<CaseBuilder> {
    let name = top.optional("name").map_or(Ok(id.as_str()), ValueReader::title).map(|name| name.trim().to_owned());
    let note = top.text_or("note", "");
    let duration = top.required("duration", Dimension::Time.name_and_example());
    let duration_s =
        duration.and_then(|written| written.require(Exposure::checked_duration_s(written.positive(Dimension::Time)?)));
    let trajectory = Trajectory::read(top, references);
    let schedules = ScheduleReader { references, duration_s: duration_s.ok(), trajectory };
    let atmosphere = || Ok(Schedule::constant(101_325.0));
    let pressure = top.optional("pressure");
    let pressure_pa = pressure.map_or_else(atmosphere, |written| exposure::pressure(written, &schedules));
    let initial = top.required("initial_temperature", Dimension::Temperature.name_and_example());
    let initial = initial.and_then(InitialTemperature::read);
    let layup = gas_flow::apply_decomposition_key(top, layup::layup(top, references));
    let sensors = layup::sensors(top, layup.as_ref().ok());
    let hot_face = exposure::hot_face(top, &schedules, layup.as_ref().ok(), sensors.as_deref().ok());
    let back_face = exposure::back_face(top, &schedules);
    let holder = exposure::lateral_holder(top, &schedules);
    let observations = observation::observations(top, references, sensors.as_deref().ok(), duration_s);
    let blowing = hot_face.as_ref().ok().and_then(|face| face.blowing);
    let marched = marched_layup(layup, sensors.clone(), hot_face);
    let limits = layup::limits(top, marched.as_ref().ok().map(|(layup, sensors, _)| (layup, sensors.as_slice())));
    let covered = marched.as_ref().ok().zip(initial.as_ref().ok());
    let covered = covered.map_or(Ok(()), |((layup, ..), initial)| initial.check(layup.origin_m, layup.back_m()));
    let gas =
        gas_flow::gas_flow(top, references, marched.as_ref().ok().map(|(layup, ..)| layup), back_face.as_ref().ok());
    let blown = match (blowing, &marched, &gas) {
        (Some(written), Ok(_), Ok(None)) => Err(written.error(BLOWING_NEEDS_GAS)),
        _ => Ok(()),
    };
    let scope = marched.as_ref().ok().zip(back_face.as_ref().ok()).zip(gas.as_ref().ok().zip(holder.as_ref().ok()));
    let scope = scope.map(|(((layup, sensors, hot_face), BackFace { face: back_face, .. }), (gas, holder))| {
        let (gas_path, has_holder) = (gas.as_ref().map(|gas| gas.model), holder.is_some());
        FactorTargets { layup, hot_face, back_face, gas_path, has_holder, sensors }
    });
    let factors = factor::factors(top, scope);
    let correlation = factor::correlation(top, factors.as_deref().ok());
    let estimate = observation::estimate(
        top,
        factors.as_deref().ok(),
        sensors.as_deref().ok(),
        observations.as_deref().ok(),
        duration_s,
    );
    let plies = marched.as_ref().map_or(1, |(layup, ..)| layup.plies.len());
    let resolution = resolution(top, plies, duration_s);
    top.deny_unknown_keys();

    let seen = marched
        .as_ref()
        .map_or(Ok(()), |(layup, sensors, hot_face)| layup::check_pyrometers(top, layup, sensors, hot_face));
    covered.and(blown).and(seen)?;
    let (layup, sensors, hot_face) = marched?;
    let BackFace { face: back_face, pressure: back_pressure } = back_face?;
    let (pressure_pa, holder) = (pressure_pa?, holder?);
    schedules.trajectory?.map_or(Ok(()), |trajectory| trajectory.check_read())?;
    let exposure = Exposure {
        duration_s: duration_s?,
        initial_k: initial?.points,
        pressure_pa,
        back_pressure_pa: back_pressure.map(|(schedule, _)| schedule),
        holder,
        hot_face,
        back_face,
    };
    Ok(CaseBuilder {
        id,
        name: name?,
        note: note?,
        layup,
        sensors,
        limits: limits?,
        gas: gas?,
        exposure,
        factors: factors?,
        correlation: correlation?,
        observations: observations?,
        estimate: estimate?,
        resolution: resolution?,
    })
}

/// The marched layup with its sensors: the part below the held face, if there is one in depth.
fn marched_layup(
    layup: ReadResult<Layup>,
    sensors: ReadResult<Vec<Sensor>>,
    hot_face: ReadResult<HotFace<'_>>,
) -> ReadResult<(Layup, Vec<Sensor>, Face)> {
    let (layup, sensors, hot_face) = (layup?, sensors?, hot_face?);
    let (layup, sensors) = match hot_face.held_depth {
        Some((depth_m, at)) => layup::part_below_held_face(layup, sensors, depth_m, at)?,
        None => (layup, sensors),
    };
    Ok((layup, sensors, hot_face.face))
}

/// `[resolution]`; without cells and time steps both are adapted to the tolerance.
fn resolution(top: &TableReader<'_>, plies: usize, duration_s: ReadResult<f64>) -> ReadResult<Resolution> {
    let standard = Resolution::for_run(plies, duration_s.unwrap_or(0.0));
    let Some(written) = top.optional("resolution") else {
        return Ok(standard);
    };
    let section = written.section()?;
    let cells = section
        .optional("cells")
        .map_or(Ok(standard.cells), |written| written.require(Resolution::checked_cells(written.number()?, plies)));
    let tolerance = section.optional("tolerance");
    let stated =
        ["cells", "first_step", "step_growth", "max_step"].into_iter().find(|key| section.optional(key).is_some());
    let tolerance_k =
        match (tolerance, stated) {
            (Some(written), Some(key)) => Err(written
                .error(format!("expected `tolerance` or {key:?}, not both: a tolerance sets cells and time steps"))),
            (Some(written), None) => written.positive(Dimension::TemperatureDifference).map(Some),
            (None, Some(_)) => Ok(None),
            (None, None) => Ok(standard.tolerance_k),
        };
    let growth = section
        .optional("step_growth")
        .map_or(Ok(standard.step_growth), |written| written.require(Resolution::checked_growth(written.number()?)));
    // Stated cells have no estimate of the error of long steps.
    let max_step_s = if stated.is_some() { Resolution::default().max_step_s } else { standard.max_step_s };
    let max_step_s = section.positive_or("max_step", Dimension::Time, max_step_s);
    let first_step_s = section.optional("first_step").map_or(Ok(standard.first_step_s), |written| {
        let first_step_s = written.positive(Dimension::Time)?;
        written.require(Resolution::checked_first_step_s(first_step_s, max_step_s.unwrap_or(f64::INFINITY)))
    });
    let interval = section.optional("output_interval");
    let output_interval_s = interval.map_or(Ok(standard.output_interval_s), |written| {
        let interval_s = written.positive(Dimension::Time)?;
        written.require(Resolution::checked_output_interval_s(interval_s, duration_s.unwrap_or(0.0)))
    });
    section.deny_unknown_keys();
    Ok(Resolution {
        tolerance_k: tolerance_k?,
        cells: cells?,
        first_step_s: first_step_s?,
        step_growth: growth?,
        max_step_s: max_step_s?,
        output_interval_s: output_interval_s?,
    })
}
