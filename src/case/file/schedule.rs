//! Schedules: a constant, a list of points or a column of a table file, and the values outside the points. The table
//! file of a trajectory has several of them.

use super::column_choice::{TimeChoice, stated_conversion};
use super::layup::observed_face;
use super::references::ReferenceResolver;
use super::spanned_toml::{TableReader, ValueReader, collect_all};
use super::table_file::{ChosenColumn, Headings, TableChoice, TableFile, TimeColumn, TimeSeries};
use crate::case::error::ReadResult;
use crate::case::layup::DEPTH_TOLERANCE_M;
use crate::case::pyrometer_driver::ObservedFace;
use crate::case::smoothed_driver::{SmoothedSeries, smoothed};
use crate::case::table;
use crate::case::unit::Dimension;
use crate::case::{Observation, PyrometerDriver, Schedule, SmoothedDriver};
use std::cell::Cell;

/// Times closer than this fraction of the duration are equal, as in a march.
const TIME_TOLERANCE: f64 = 1e-9;

/// Context of a schedule: the files of the case, and the duration to cover.
pub(super) struct ScheduleReader<'a> {
    pub(super) references: &'a ReferenceResolver<'a>,
    /// `None` if the duration is not valid; coverage is then not checked.
    pub(super) duration_s: Option<f64>,
    /// The table of `[trajectory]`.
    pub(super) trajectory: ReadResult<Option<Trajectory<'a>>>,
}

/// `[trajectory]`: one table for all schedules that name a column and no file.
pub(super) struct Trajectory<'a> {
    written: ValueReader<'a>,
    table: TableFile,
    time: TimeColumn,
    outside: Option<OutsidePoints>,
    is_read: Cell<bool>,
}

impl<'a> Trajectory<'a> {
    pub(super) fn read(case: &TableReader<'a>, references: &ReferenceResolver<'_>) -> ReadResult<Option<Self>> {
        let Some(written) = case.optional("trajectory") else { return Ok(None) };
        let section = written.section()?;
        let file = section.required("file", "a table such as \"trajectory.csv\"");
        let time = section.optional("time").map(TimeChoice::read).transpose();
        let sheet = TableChoice::of(&section);
        let outside = outside(&section, Dimension::Temperature);
        section.deny_unknown_keys();
        let (file, time, outside) = (file?, time?, outside?);
        let headings = time.map_or(Ok(Headings::All), |time| time.heading().map(Headings::Chosen))?;
        let table = references.table_file(file, sheet, headings)?;
        let time = time.map_or(Ok(TimeColumn::default()), |time| time.find(&table))?;
        Ok(Some(Self { written, table, time, outside, is_read: Cell::new(false) }))
    }

    fn series(
        &self,
        column: ValueReader<'_>,
        conversion: Option<(f64, f64)>,
        dimension: Dimension,
    ) -> ReadResult<TimeSeries> {
        self.is_read.set(true);
        let index = column.require(self.table.find_column(column.text()?, Some(self.time)))?;
        let column = ChosenColumn { index, conversion };
        self.table.time_series(self.time, column, dimension, true, self.written.diagnostics())
    }

    /// A trajectory of which no schedule reads a column is refused.
    pub(super) fn check_read(&self) -> ReadResult<()> {
        if self.is_read.get() {
            return Ok(());
        }
        Err(self.written.error("no schedule reads a column: expected one such as pressure = { column = \"p\" }"))
    }
}

/// The value outside the points.
#[derive(Clone, Copy, Debug, PartialEq)]
enum OutsidePoints {
    /// The first value before the first point, the last one after the last.
    Hold,
    Zero,
}

impl ScheduleReader<'_> {
    /// A constant, points `[["41 s", "26.7 W/cm^2"]]`, `{ points = [[…]], outside = "hold" }`, or
    /// `{ file = "flux.csv", column = "flux_w_cm2", outside = "zero" }`, with `unit`, `time`, `sheet` and `range` as
    /// of observations.
    pub(super) fn read(&self, written: ValueReader<'_>, dimension: Dimension) -> ReadResult<Schedule> {
        self.read_measured(written, dimension, None)
    }

    /// The temperature of a held face. With a key `noise` it is smoothed, and the measured one is recorded; with a key
    /// `pyrometer` it follows from readings.
    pub(super) fn driver(&self, written: ValueReader<'_>, is_hot_face: bool) -> ReadResult<Schedule> {
        self.read_measured(written, Dimension::LayupTemperature, Some(is_hot_face))
    }

    /// [`read`](Self::read), with the keys `noise` and `pyrometer` for the temperature of a held face.
    fn read_measured(
        &self,
        written: ValueReader<'_>,
        dimension: Dimension,
        held_face: Option<bool>,
    ) -> ReadResult<Schedule> {
        if written.is_list() {
            return self.covering_schedule(points(written, dimension, true)?, None, written, dimension);
        }
        if !written.is_table() {
            return written.quantity(dimension).map(Schedule::constant);
        }
        let section = written.section()?;
        let (file, listed, column) = (section.optional("file"), section.optional("points"), section.optional("column"));
        let (time, unit) = (section.optional("time"), section.optional("unit"));
        let sheet = TableChoice::of(&section);
        let conversion = stated_conversion(&section, dimension);
        let outside = outside(&section, dimension);
        let noise = held_face.and_then(|is_hot_face| Some((is_hot_face, section.optional("noise")?)));
        let pyrometer = held_face.and_then(|is_hot_face| Some((is_hot_face, section.optional("pyrometer")?)));
        let observed = pyrometer.map(|(is_hot_face, written)| observed_face(written, is_hot_face)).transpose();
        let noise_k = noise.map(|(_, noise)| {
            noise.require(Observation::checked_sigma_k(noise.quantity(Dimension::TemperatureDifference)?))
        });
        let noise_k = noise_k.transpose();
        section.deny_unknown_keys();
        let of_file = [("column", column), ("time", time), ("unit", unit)];
        let of_file = of_file.into_iter().find_map(|(key, written)| Some((key, written?)));
        let of_file = of_file.or(sheet.key());
        if let (None, None, Some(column)) = (file, listed, column)
            && let Some(trajectory) = self.trajectory.as_ref().map_err(|reported| *reported)?
        {
            if let Some((key, written)) = sheet.key() {
                return Err(written.error(format!("`{key}` is that of [trajectory]")));
            }
            let series = match time {
                Some(time) => Err(time.error("the times of this column are those of [trajectory]")),
                None => trajectory.series(column, conversion?, dimension),
            };
            return self.covering_schedule(series?, outside?.or(trajectory.outside), written, dimension);
        }
        let series = match (file, listed, of_file) {
            (Some(file), None, _) => time
                .map(TimeChoice::read)
                .transpose()
                .and_then(|time| self.references.series(file, sheet, column, conversion?, time, dimension)),
            (None, Some(listed), None) => points(listed, dimension, true),
            (None, _, Some((key, written))) => Err(written.error(format!("`{key}` needs a `file`: found none"))),
            (Some(_), Some(listed), _) => Err(listed.error("expected a `file` or `points`, not both")),
            (None, None, None) => Err(section
                .error("missing key \"file\": expected { file = \"flux.csv\" } or { points = [[\"0 s\", \"…\"], …] }")),
        };
        let (series, outside, observed) = (series?, outside?, observed?);
        let (Some(noise_k), Some((is_hot_face, _))) = (noise_k?, noise) else {
            let readings = self.covering_schedule(series, outside, written, dimension)?;
            return self.face_k(readings, observed, written);
        };
        let (times_s, values_k) = &series;
        let (samples, found) = (times_s.len(), smoothed(times_s, values_k, noise_k));
        let SmoothedSeries { series: smooth, residual_k, estimated_noise_k, steps_s } = found;
        let corners = smooth.0.len();
        let measured = self.covering_schedule(series, outside, written, dimension)?;
        let measured = observed.map_or(Ok(measured.clone()), |face| written.require(face.face_k(&measured, 0.0)))?;
        let driver =
            SmoothedDriver { is_hot_face, noise_k, estimated_noise_k, measured, samples, residual_k, corners, steps_s };
        self.references.record_driver(driver);
        let readings = self.covering_schedule(smooth, outside, written, dimension)?;
        self.face_k(readings, observed, written)
    }

    /// The temperature of a held face, from its schedule or, where a pyrometer observes it, from the readings.
    fn face_k(
        &self,
        readings: Schedule,
        observed: Option<ObservedFace>,
        written: ValueReader<'_>,
    ) -> ReadResult<Schedule> {
        let Some(face) = observed else { return Ok(readings) };
        self.references.record_pyrometer(written.require(PyrometerDriver::new(&face, &readings))?);
        written.require(face.face_k(&readings, 0.0))
    }

    /// A schedule whose values are not negative.
    pub(super) fn read_not_negative(&self, written: ValueReader<'_>, dimension: Dimension) -> ReadResult<Schedule> {
        if !written.is_list() && !written.is_table() {
            return written.not_negative(dimension).map(Schedule::constant);
        }
        let schedule = self.read(written, dimension)?;
        written.require(schedule.check_not_negative()).map(|()| schedule)
    }

    /// The schedule of some points, which must cover the duration or have a value `outside`.
    fn covering_schedule(
        &self,
        (mut times_s, mut values): TimeSeries,
        outside: Option<OutsidePoints>,
        written: ValueReader<'_>,
        dimension: Dimension,
    ) -> ReadResult<Schedule> {
        let (first_s, last_s) = (times_s[0], times_s[times_s.len() - 1]);
        let spans = self.duration_s.map_or(Vec::new(), |duration_s| {
            uncovered_intervals((first_s, last_s), (0.0, duration_s), TIME_TOLERANCE * duration_s)
        });
        match outside {
            None if !spans.is_empty() => {
                let zero = if may_be_zero(dimension) { " or \"zero\"" } else { "" };
                let form = if written.is_list() { "{ points = […], outside = … }" } else { "a key `outside`" };
                let spans = format_intervals(&spans, 1.0, "s");
                let message = format!(
                    "no value from {spans}: the points cover {first_s} s to {last_s} s; expected {form} with \
                     \"hold\"{zero}"
                );
                return Err(written.error(message));
            }
            None | Some(OutsidePoints::Hold) => {}
            Some(OutsidePoints::Zero) => {
                if values[0] != 0.0 {
                    times_s.insert(0, first_s);
                    values.insert(0, 0.0);
                }
                if values[values.len() - 1] != 0.0 {
                    times_s.push(last_s);
                    values.push(0.0);
                }
            }
        }
        written.require(Schedule::new(times_s, values))
    }
}

/// Whether a quantity may be zero outside its points.
fn may_be_zero(dimension: Dimension) -> bool {
    matches!(dimension, Dimension::HeatFlux | Dimension::Conductance | Dimension::MassFlux)
}

fn outside(section: &TableReader<'_>, dimension: Dimension) -> ReadResult<Option<OutsidePoints>> {
    let Some(written) = section.optional("outside") else {
        return Ok(None);
    };
    match written.text()? {
        "hold" => Ok(Some(OutsidePoints::Hold)),
        "zero" if may_be_zero(dimension) => Ok(Some(OutsidePoints::Zero)),
        "zero" => {
            Err(written
                .error("only a heat flux or a film coefficient can be zero outside its points: expected \"hold\""))
        }
        other if may_be_zero(dimension) => {
            Err(written.error(format!("expected \"hold\" or \"zero\", found {other:?}")))
        }
        other => Err(written.error(format!("expected \"hold\", found {other:?}"))),
    }
}

/// The parts of the interval `start..end` outside `first..last`, if longer than `same`.
fn uncovered_intervals((first, last): (f64, f64), (start, end): (f64, f64), same: f64) -> Vec<(f64, f64)> {
    let spans = [(start, first.min(end)), (last.max(start), end)];
    spans.into_iter().filter(|(from, to)| to - from > same).collect()
}

/// `0 s to 10 s and from 20 s to 300 s`.
fn format_intervals(spans: &[(f64, f64)], scale: f64, unit: &str) -> String {
    // Nine decimals hide the rounding error of a sum of thicknesses.
    let round = |value: f64| (value * scale * 1e9).round() / 1e9;
    let spans: Vec<String> =
        spans.iter().map(|&(from, to)| format!("{} {unit} to {} {unit}", round(from), round(to))).collect();
    spans.join(" and from ")
}

/// Pairs of an increasing time and a value; `jumps` allows equal times.
pub(super) fn points(written: ValueReader<'_>, dimension: Dimension, jumps: bool) -> ReadResult<TimeSeries> {
    increasing_points(written, Dimension::Time, dimension, jumps)
}

/// Initial temperature: a value, or points of a depth and a value, which must cover the layup or have a value
/// `outside`.
pub(super) struct InitialTemperature<'a> {
    pub(super) points: Vec<(f64, f64)>,
    /// Points without a value `outside`, which must cover the layup.
    must_cover: Option<ValueReader<'a>>,
}

impl<'a> InitialTemperature<'a> {
    pub(super) fn read(written: ValueReader<'a>) -> ReadResult<Self> {
        let depths = |written| {
            let (depths_m, values) = increasing_points(written, Dimension::Length, Dimension::LayupTemperature, false)?;
            Ok(depths_m.into_iter().zip(values).collect())
        };
        if written.is_list() {
            return Ok(Self { points: depths(written)?, must_cover: Some(written) });
        }
        if !written.is_table() {
            return Ok(Self { points: vec![(0.0, written.quantity(Dimension::LayupTemperature)?)], must_cover: None });
        }
        let section = written.section()?;
        let points = section.required("points", "pairs such as [[\"0 mm\", \"300 K\"], [\"5 mm\", \"310 K\"]]");
        let outside = outside(&section, Dimension::Temperature);
        section.deny_unknown_keys();
        let (points, outside) = (depths(points?)?, outside?);
        Ok(Self { points, must_cover: outside.is_none().then_some(written) })
    }

    /// Require that the points cover the layup from hot face to back face.
    pub(super) fn check(&self, top_m: f64, back_m: f64) -> ReadResult<()> {
        let Some(written) = self.must_cover else { return Ok(()) };
        let reach_m = (self.points[0].0, self.points[self.points.len() - 1].0);
        let spans = uncovered_intervals(reach_m, (top_m, back_m), DEPTH_TOLERANCE_M);
        if spans.is_empty() {
            return Ok(());
        }
        let (spans, reach) = (format_intervals(&spans, 1e3, "mm"), format_intervals(&[reach_m], 1e3, "mm"));
        Err(written.error(format!(
            "no value from {spans}: the points cover {reach}; expected {{ points = […], outside = \"hold\" }}"
        )))
    }
}

fn increasing_points(
    written: ValueReader<'_>,
    along: Dimension,
    dimension: Dimension,
    jumps: bool,
) -> ReadResult<TimeSeries> {
    let mut last = f64::NEG_INFINITY;
    let pairs = collect_all(written.list()?.into_iter().map(|point| {
        let [at, value] = point.pair()?;
        let (argument, value) = (at.quantity(along), value.quantity(dimension));
        let noun = if along == Dimension::Time { "time" } else { "depth" };
        last = at.require(table::checked_increasing(noun, last, argument?, jumps))?;
        Ok((last, value?))
    }))?;
    Ok(pairs.into_iter().unzip())
}
