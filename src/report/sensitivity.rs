//! Sensitivities, and the set of identifiable factors.

mod figures;
mod record;
mod subset_selection;

use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, Names, Table, TableDescription};
use super::format::clause;
use super::html::table::{list, paragraph, table};
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::{Column, aligned, head, more, wrap};
use super::{ReportError, format};
use crate::case::Case;
use crate::fit::ILL_CONDITIONED;
use crate::study::answers::Answers;
use crate::study::sensitivity::{Identifiability, Sensitivity};

impl Reportable for Sensitivity {
    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let steps = subset_selection::steps(&answers.case, self).map(|text| Finding { label: "Identifiability", text });
        let stated =
            subset_selection::stated_set(&answers.case, self).map(|text| Finding { label: "Stated set", text });
        steps.into_iter().chain(stated).collect()
    }

    fn warnings(&self, _: &Answers) -> Vec<String> {
        if self.recommended.factors.is_empty() || self.recommended.condition_number <= ILL_CONDITIONED {
            return Vec::new();
        }
        vec![format!(
            "The proposed set is ill-conditioned (condition number {}). Least determined direction: {}.",
            format::condition_number(self.recommended.condition_number),
            self.recommended.weakest_direction
        )]
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(&answers.case, self).into_iter().map(|figure| ("sensitivity", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("sensitivity", "Sensitivity", page(answers, self))]
    }

    fn methods(&self, _: &Answers) -> Vec<String> {
        let found = match self.step {
            None => "exact (tangent-linear march)",
            Some(_) => "central differences",
        };
        vec![format!(
            "Sensitivity: derivatives at the nominal factors, {found}. The condition number is that of the sensitivity \
             matrix, weighted by the standard deviations of the measurement and scaled to unit columns; standard \
             errors are those of linear least squares (Beck & Arnold, Parameter Estimation in Engineering and Science, \
             1977).",
        )]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![sensitivities_table().description()]
    }

    fn tables(&self, answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        Ok(vec![sensitivities(&answers.case, self)?])
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put("identifiability", &record::identifiability_record(&answers.case, self))
    }

    fn screen(&self, answers: &Answers, room: &ScreenLimits) -> Vec<String> {
        let mut lines = if answers.uncertainty.is_none() { table_on_screen(answers, self, room) } else { Vec::new() };
        let steps = if room.is_shared { subset_selection::steps_without_shares } else { subset_selection::steps };
        lines.extend(wrap("", &steps(&answers.case, self).join(" ")));
        lines
    }

    fn screen_footer(&self, answers: &Answers) -> Vec<String> {
        subset_selection::stated_set(&answers.case, self).map_or(Vec::new(), |text| wrap("", &text))
    }
}

fn page(answers: &Answers, outcome: &Sensitivity) -> String {
    let case = &answers.case;
    let (all, proposed) = (&outcome.all, &outcome.recommended);
    let error = |set: &Identifiability, factor: usize| {
        let place = set.factors.iter().position(|&other| other == factor);
        place.map_or("–".to_owned(), |place| format::significant(set.standard_errors[place], 2))
    };
    let rows: Vec<Vec<String>> = (all.factors.iter().enumerate())
        .map(|(place, &index)| {
            let factor = &case.factors[index];
            let stated = outcome.stated.as_ref();
            vec![
                factor.name.clone(),
                format::factor_meaning(factor),
                format::significant(0.01 * all.magnitude_k[place], 2),
                format::significant(factor.prior_standard_deviation(case.estimate.bounds), 2),
                format::percent_near_limits(outcome.shares[index]).replace(" %", ""),
                error(all, index),
                error(proposed, index),
                stated.map_or("–".to_owned(), |stated| error(stated, index)),
            ]
        })
        .collect();
    let mut text = subset_selection::steps(case, outcome).to_vec();
    text.extend(subset_selection::stated_set(case, outcome));
    text.push(format!(
        "All {}: condition number {}, rank {}; least determined direction: {}.",
        format::counted(all.factors.len(), "factor"),
        format::condition_number(all.condition_number),
        all.rank,
        clause(&all.weakest_direction)
    ));
    let left_out: Vec<String> =
        outcome.reduction.iter().map(|dropped| subset_selection::exclusion_reason(case, dropped)).collect();
    let left_out = if left_out.is_empty() {
        String::new()
    } else {
        "<h3>Excluded factors and why</h3>\n".to_owned() + &list(&left_out)
    };
    let how = match outcome.step {
        Some(step) => format!("Derivatives by central differences, relative step {}.", format::significant(step, 2)),
        None => "Derivatives are exact up to rounding (tangent-linear march).".to_owned(),
    };
    let head = [
        "Factor",
        "Scales",
        "Sensitivity, K per 1 % (rms)",
        "Prior standard deviation",
        "Share of the variance, %",
        "Standard error, all factors",
        "Standard error, proposed set",
        "Standard error, stated set",
    ];
    list(&text)
        + &table("Sensitivity and standard error of each factor", &head, &rows)
        + &paragraph(&subset_selection::explanation())
        + &left_out
        + &paragraph(&how)
}

fn table_on_screen(answers: &Answers, outcome: &Sensitivity, room: &ScreenLimits) -> Vec<String> {
    let mut rows = vec![head(["factor", "K per 1 %, rms", "scales"])];
    let mut order: Vec<usize> = (0..outcome.all.factors.len()).collect();
    order.sort_by(|&a, &b| outcome.all.magnitude_k[b].total_cmp(&outcome.all.magnitude_k[a]));
    for index in order.into_iter().take(room.factors) {
        let factor = &answers.case.factors[outcome.all.factors[index]];
        rows.push([
            format::truncate(&factor.name, 19),
            format::significant(0.01 * outcome.all.magnitude_k[index], 2),
            format::factor_meaning(factor),
        ]);
    }
    let [name, scales] = [(0, 20), (2, 0)].map(|(gap, width)| Column::Left { gap, width });
    let mut lines = aligned([name, Column::Right(14), scales], &rows);
    lines.extend(more(outcome.all.factors.len().saturating_sub(room.factors), "factor"));
    lines
}

/// Name of the sensor, time, and change per 1 % of every factor.
type SensitivityRow<'a> = (&'a str, f64, Vec<f64>);

fn sensitivities_table<'a>() -> Table<SensitivityRow<'a>> {
    Table::<SensitivityRow<'a>>::new(
        &["sensitivities.csv"],
        "Derivatives of the temperatures, one row per sensor and instant (`sensitivity`, `study`).",
    )
    .text("sensor", "Sensor.", |row| row.0.to_owned())
    .number("time_s", "s", "Time.", |row| row.1)
    .numbers("<factor>_k_per_percent", "K/%", "Change of the temperature per 1 % of the factor.", |row| row.2.clone())
}

fn sensitivities(case: &Case, outcome: &Sensitivity) -> Result<NamedFile, ReportError> {
    let scaled: Vec<_> = (0..case.factors.len()).map(|factor| outcome.change_per_percent_k(case, factor)).collect();
    let scaled = &scaled;
    let rows = case.sensors.iter().enumerate().flat_map(|(index, sensor)| {
        let instants = outcome.instants_s.iter().enumerate();
        instants.map(move |(at, &time_s)| {
            (sensor.name.as_str(), time_s, scaled.iter().map(|factor| factor[index][at]).collect())
        })
    });
    sensitivities_table().csv(&Names::of(case), rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::Layer;
    use crate::report::figures::file_name;
    use crate::report::{figures, marched};

    /// Every curve of the chart is a column of the table.
    #[test]
    fn sensitivities_are_in_kelvin_per_percent_in_table_and_chart() {
        let mut outcomes = marched::study();
        outcomes.case.factors[3].nominal = 1.1;
        let answers = outcomes.answers("study");
        let (_, bytes) = sensitivities(&answers.case, &outcomes.sensitivity).expect("a table");
        let mut rows = csv::Reader::from_reader(bytes.as_slice());
        let head: Vec<String> = rows.headers().expect("a head").iter().map(str::to_owned).collect();
        let rows: Vec<csv::StringRecord> = rows.records().map(|row| row.expect("a row")).collect();
        let figures = figures::all(&answers);
        for sensor in &outcomes.case.sensors {
            let id = file_name("sensitivity", &sensor.name);
            let figure = figures.iter().find(|figure| figure.id == id).expect("a chart of each sensor");
            assert!(figure.y.label.contains("K per 1 %") && figure.title.contains("K per 1 %"), "{figure:?}");
            let lines = figure.layers.iter().filter_map(|layer| match layer {
                Layer::Line { name, y, .. } => Some((name, y)),
                _ => None,
            });
            let mut compared = 0;
            for (name, drawn) in lines {
                let column = head.iter().position(|column| *column == format!("{name}_k_per_percent"));
                let column = column.unwrap_or_else(|| panic!("no column of {name} in {head:?}"));
                let of_sensor = rows.iter().filter(|row| row[0] == *sensor.name);
                let written = of_sensor.map(|row| row[column].parse::<f64>().expect("a number"));
                let off = written.zip(drawn).map(|(written, drawn)| (written - drawn).abs()).fold(0.0, f64::max);
                assert!(off < 1e-6, "{name} at {}: {off} K per 1 % apart", sensor.name);
                compared += 1;
            }
            assert_eq!(compared, outcomes.case.factors.len());
        }
    }
}
