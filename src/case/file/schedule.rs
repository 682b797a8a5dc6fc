//! Schedules: a constant, a list of points or a column of a table file, and the values outside the points.

use super::references::References;
use super::sheet::Series;
use super::written::{Section, Written, all};
use crate::case::Schedule;
use crate::case::error::Read;
use crate::case::layup::SAME_DEPTH_M;
use crate::case::table;
use crate::case::unit::Dimension;

/// Times closer than this fraction of the duration are equal, as in a march.
const SAME_INSTANT: f64 = 1e-9;

/// Context of a schedule: the files of the case, and the duration to cover.
pub(super) struct Schedules<'a> {
    pub(super) references: &'a References<'a>,
    /// `None` if the duration is not valid; coverage is then not checked.
    pub(super) duration_s: Option<f64>,
}

/// The value outside the points.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Outside {
    /// The first value before the first point, the last one after the last.
    Hold,
    Zero,
}

impl Schedules<'_> {
    /// A constant, points `[["41 s", "26.7 W/cm^2"]]`, `{ points = [[…]], outside = "hold" }`, or
    /// `{ file = "flux.csv", column = "flux_w_cm2", outside = "zero" }`.
    pub(super) fn read(&self, written: Written<'_>, dimension: Dimension) -> Read<Schedule> {
        if written.is_list() {
            return self.whole(points(written, dimension, true)?, None, written, dimension);
        }
        if !written.is_table() {
            return written.quantity(dimension).map(Schedule::constant);
        }
        let section = written.section()?;
        let (file, listed, column) = (section.optional("file"), section.optional("points"), section.optional("column"));
        let outside = outside(&section, dimension);
        section.close();
        let series = match (file, listed, column) {
            (Some(file), None, _) => self.references.series(file, column, dimension),
            (None, Some(listed), None) => points(listed, dimension, true),
            (None, _, Some(column)) => Err(column.fault("`column` needs a `file`: found none")),
            (Some(_), Some(listed), _) => Err(listed.fault("expected a `file` or `points`, not both")),
            (None, None, None) => Err(section
                .fault("missing key \"file\": expected { file = \"flux.csv\" } or { points = [[\"0 s\", \"…\"], …] }")),
        };
        let (series, outside) = (series?, outside?);
        self.whole(series, outside, written, dimension)
    }

    /// The schedule of some points, which must cover the duration or have a value `outside`.
    fn whole(
        &self,
        (mut times_s, mut values): Series,
        outside: Option<Outside>,
        written: Written<'_>,
        dimension: Dimension,
    ) -> Read<Schedule> {
        let (first_s, last_s) = (times_s[0], times_s[times_s.len() - 1]);
        let spans = self.duration_s.map_or(Vec::new(), |duration_s| {
            uncovered((first_s, last_s), (0.0, duration_s), SAME_INSTANT * duration_s)
        });
        match outside {
            None if !spans.is_empty() => {
                let zero = if dimension == Dimension::HeatFlux { " or \"zero\"" } else { "" };
                let form = if written.is_list() { "{ points = […], outside = … }" } else { "a key `outside`" };
                let spans = shown(&spans, 1.0, "s");
                let message = format!(
                    "no value from {spans}: the points cover {first_s} s to {last_s} s; expected {form} with \
                     \"hold\"{zero}"
                );
                return Err(written.fault(message));
            }
            None | Some(Outside::Hold) => {}
            Some(Outside::Zero) => {
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

fn outside(section: &Section<'_>, dimension: Dimension) -> Read<Option<Outside>> {
    let Some(written) = section.optional("outside") else {
        return Ok(None);
    };
    match written.text()? {
        "hold" => Ok(Some(Outside::Hold)),
        "zero" if dimension == Dimension::HeatFlux => Ok(Some(Outside::Zero)),
        "zero" => Err(written.fault("only a heat flux can be zero outside its points: expected \"hold\"")),
        other if dimension == Dimension::HeatFlux => {
            Err(written.fault(format!("expected \"hold\" or \"zero\", found {other:?}")))
        }
        other => Err(written.fault(format!("expected \"hold\", found {other:?}"))),
    }
}

/// The parts of the interval `start..end` outside `first..last`, if longer than `same`.
fn uncovered((first, last): (f64, f64), (start, end): (f64, f64), same: f64) -> Vec<(f64, f64)> {
    let spans = [(start, first.min(end)), (last.max(start), end)];
    spans.into_iter().filter(|(from, to)| to - from > same).collect()
}

/// `0 s to 10 s and from 20 s to 300 s`.
fn shown(spans: &[(f64, f64)], scale: f64, unit: &str) -> String {
    // Nine decimals hide the rounding error of a sum of thicknesses.
    let round = |value: f64| (value * scale * 1e9).round() / 1e9;
    let spans: Vec<String> =
        spans.iter().map(|&(from, to)| format!("{} {unit} to {} {unit}", round(from), round(to))).collect();
    spans.join(" and from ")
}

/// Pairs of an increasing time and a value; `jumps` allows equal times.
pub(super) fn points(written: Written<'_>, dimension: Dimension, jumps: bool) -> Read<Series> {
    rising(written, Dimension::Time, dimension, jumps)
}

/// Initial temperature: a value, or points of a depth and a value, which must cover the layup or have a value
/// `outside`.
pub(super) struct Initial<'a> {
    pub(super) points: Vec<(f64, f64)>,
    /// Points without a value `outside`, which must cover the layup.
    bare: Option<Written<'a>>,
}

impl<'a> Initial<'a> {
    pub(super) fn read(written: Written<'a>) -> Read<Self> {
        let depths = |written| {
            let (depths_m, values) = rising(written, Dimension::Length, Dimension::Temperature, false)?;
            Ok(depths_m.into_iter().zip(values).collect())
        };
        if written.is_list() {
            return Ok(Self { points: depths(written)?, bare: Some(written) });
        }
        if !written.is_table() {
            return Ok(Self { points: vec![(0.0, written.quantity(Dimension::Temperature)?)], bare: None });
        }
        let section = written.section()?;
        let points = section.required("points", "pairs such as [[\"0 mm\", \"300 K\"], [\"5 mm\", \"310 K\"]]");
        let outside = outside(&section, Dimension::Temperature);
        section.close();
        let (points, outside) = (depths(points?)?, outside?);
        Ok(Self { points, bare: outside.is_none().then_some(written) })
    }

    /// Require that the points cover the layup from hot face to back face.
    pub(super) fn check(&self, top_m: f64, back_m: f64) -> Read<()> {
        let Some(written) = self.bare else { return Ok(()) };
        let reach_m = (self.points[0].0, self.points[self.points.len() - 1].0);
        let spans = uncovered(reach_m, (top_m, back_m), SAME_DEPTH_M);
        if spans.is_empty() {
            return Ok(());
        }
        let (spans, reach) = (shown(&spans, 1e3, "mm"), shown(&[reach_m], 1e3, "mm"));
        Err(written.fault(format!(
            "no value from {spans}: the points cover {reach}; expected {{ points = […], outside = \"hold\" }}"
        )))
    }
}

fn rising(written: Written<'_>, along: Dimension, dimension: Dimension, jumps: bool) -> Read<Series> {
    let mut last = f64::NEG_INFINITY;
    let pairs = all(written.list()?.into_iter().map(|point| {
        let [at, value] = point.pair()?;
        let (argument, value) = (at.quantity(along), value.quantity(dimension));
        let noun = if along == Dimension::Time { "time" } else { "depth" };
        last = at.require(table::rising(noun, last, argument?, jumps))?;
        Ok((last, value?))
    }))?;
    Ok(pairs.into_iter().unzip())
}
