//! Sensitivities, and the set of identifiable factors.

mod figures;
mod record;
mod reduction;

use super::answer::{Answer, Finding, Room, Section};
use super::figure::Figure;
use super::files::json::Record;
use super::files::table::File;
use super::files::table::Table;
use super::files::tables::{factor_columns, head};
use super::html::table::{list, paragraph, table};
use super::summary::wrapped;
use super::warnings::CONDITION;
use super::words::sentence;
use super::{ReportError, words};
use crate::case::Case;
use crate::study::answers::Answers;
use crate::study::sensitivity::{Identifiability, Sensitivity};

impl Answer for Sensitivity {
    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let steps = reduction::steps(&answers.case, self).map(|text| Finding { about: "Identifiability", said: text });
        let stated = reduction::stated(&answers.case, self).map(|text| Finding { about: "Stated set", said: text });
        steps.into_iter().chain(stated).collect()
    }

    fn warnings(&self, _: &Answers) -> Vec<String> {
        if self.proposed.factors.is_empty() || self.proposed.condition_number <= CONDITION {
            return Vec::new();
        }
        vec![format!(
            "The proposed set is ill-conditioned (condition number {}). Least determined direction: {}.",
            words::condition(self.proposed.condition_number),
            self.proposed.weakest
        )]
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(&answers.case, self).into_iter().map(|figure| ("sensitivity", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("sensitivity", "Sensitivity", page(answers, self))]
    }

    fn method(&self, _: &Answers) -> Vec<String> {
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

    fn tables(&self, answers: &Answers) -> Result<Vec<File>, ReportError> {
        Ok(vec![sensitivities(&answers.case, self)?])
    }

    fn record(&self, answers: &Answers, record: &mut Record<'_>) -> Result<(), ReportError> {
        record.put("identifiability", &record::estimable(&answers.case, self))
    }

    fn screen(&self, answers: &Answers, room: &Room) -> Vec<String> {
        let mut lines = if answers.uncertainty.is_none() { table_on_screen(answers, self, room) } else { Vec::new() };
        let steps = if room.is_shared { reduction::shortly } else { reduction::steps };
        lines.extend(wrapped("", &steps(&answers.case, self).join(" ")));
        lines
    }

    fn screen_at_the_end(&self, answers: &Answers) -> Vec<String> {
        reduction::stated(&answers.case, self).map_or(Vec::new(), |text| wrapped("", &text))
    }
}

fn page(answers: &Answers, outcome: &Sensitivity) -> String {
    let case = &answers.case;
    let (all, proposed) = (&outcome.all, &outcome.proposed);
    let error = |set: &Identifiability, factor: usize| {
        let place = set.factors.iter().position(|&other| other == factor);
        place.map_or("–".to_owned(), |place| words::significant(set.standard_errors[place], 2))
    };
    let rows: Vec<Vec<String>> = (all.factors.iter().enumerate())
        .map(|(place, &index)| {
            let factor = &case.factors[index];
            let stated = outcome.stated.as_ref();
            vec![
                factor.name.clone(),
                words::meaning(factor),
                words::significant(0.01 * all.magnitude_k[place], 2),
                words::significant(factor.deviation(case.estimate.bounds), 2),
                words::percent_of(outcome.shares[index]).replace(" %", ""),
                error(all, index),
                error(proposed, index),
                stated.map_or("–".to_owned(), |stated| error(stated, index)),
            ]
        })
        .collect();
    let mut text = reduction::steps(case, outcome).to_vec();
    text.extend(reduction::stated(case, outcome));
    text.push(format!(
        "All {}: condition number {}, rank {}; least determined direction: {}.",
        words::counted(all.factors.len(), "factor"),
        words::condition(all.condition_number),
        all.rank,
        sentence(&all.weakest)
    ));
    let left_out: Vec<String> = outcome.reduction.iter().map(|dropped| reduction::left_out(case, dropped)).collect();
    let left_out = if left_out.is_empty() {
        String::new()
    } else {
        "<h3>Excluded factors and why</h3>\n".to_owned() + &list(&left_out)
    };
    let how = match outcome.step {
        Some(step) => format!("Derivatives by central differences, relative step {}.", words::significant(step, 2)),
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
        + &paragraph(&reduction::explanation())
        + &left_out
        + &paragraph(&how)
}

fn table_on_screen(answers: &Answers, outcome: &Sensitivity, room: &Room) -> Vec<String> {
    let mut lines = vec![format!("{:<20}{:>14}  {}", "factor", "K per 1 %, rms", "scales")];
    let mut order: Vec<usize> = (0..outcome.all.factors.len()).collect();
    order.sort_by(|&a, &b| outcome.all.magnitude_k[b].total_cmp(&outcome.all.magnitude_k[a]));
    for index in order.into_iter().take(room.factors) {
        let factor = &answers.case.factors[outcome.all.factors[index]];
        lines.push(format!(
            "{:<20}{:>14}  {}",
            words::short(&factor.name, 19),
            words::significant(0.01 * outcome.all.magnitude_k[index], 2),
            words::meaning(factor)
        ));
    }
    lines
}

fn sensitivities(case: &Case, outcome: &Sensitivity) -> Result<File, ReportError> {
    let columns = factor_columns(case, "_K_per_percent");
    let mut table = Table::new("sensitivities.csv", head(&["sensor", "time_s"], columns))?;
    let scaled: Vec<_> = (0..case.factors.len()).map(|factor| outcome.per_percent_k(case, factor)).collect();
    for (index, sensor) in case.sensors.iter().enumerate() {
        for (at, &time_s) in outcome.instants_s.iter().enumerate() {
            let changes = scaled.iter().map(|factor| factor[index][at]);
            table.row(Some(&sensor.name), std::iter::once(time_s).chain(changes))?;
        }
    }
    table.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::Layer;
    use crate::report::figures::file_name;
    use crate::report::{figures, fixture};

    /// Every curve of the chart is a column of the table.
    #[test]
    fn sensitivities_are_in_kelvin_per_percent_in_table_and_chart() {
        let mut outcomes = fixture::outcomes();
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
                let column = head.iter().position(|column| *column == format!("{name}_K_per_percent"));
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
