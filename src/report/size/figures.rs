//! Peak temperature and share of members within the limit against the thickness of a ply.

use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::line;
use crate::report::{size, words};
use crate::study::answers::Answers;
use crate::study::size::Sizing;

pub(super) fn figures(answers: &Answers, outcome: &Sizing) -> Vec<Figure> {
    vec![peaks(answers, outcome), held(answers, outcome)]
}

/// Vertical lines at the nominal and at the required thickness.
fn marks(outcome: &Sizing, low: f64, high: f64) -> Vec<Layer> {
    let names = ["nominal".to_owned(), format!("for {}", words::percent_of(outcome.demand.probability))];
    let found = [(outcome.nominal, Ink::Series(1)), (outcome.needed, Ink::Series(2))];
    let each = found.into_iter().zip(names).filter_map(|((needed, ink), name)| {
        let at_mm = 1e3 * needed.found_m()?;
        Some(line(format!("{} {name}", size::thickness(needed)), ink, Stroke::Dashed, &[at_mm; 2], &[low, high]))
    });
    each.collect()
}

fn thicknesses(outcome: &Sizing) -> Axis {
    Axis::linear(&format!("Thickness of {}, mm", outcome.demand.ply))
        .within(1e3 * outcome.within_m.0, 1e3 * outcome.within_m.1)
}

fn peaks(answers: &Answers, outcome: &Sizing) -> Figure {
    let name = &answers.case.sensors[outcome.demand.sensor].name;
    let x: Vec<f64> = outcome.rungs.iter().map(|rung| 1e3 * rung.thickness_m).collect();
    let of = |place: usize| -> Vec<f64> {
        let finite = |at_k: f64| if at_k.is_finite() { at_k } else { f64::NAN };
        outcome.rungs.iter().map(|rung| finite(rung.percentiles_k[place])).collect()
    };
    let nominal: Vec<f64> = outcome.rungs.iter().map(|rung| rung.nominal.temperature_k).collect();
    let limit_k = outcome.demand.limit_k;
    let (low, high) = (of(0), of(2));
    let lowest = low.iter().chain(&nominal).copied().filter(|at_k| at_k.is_finite()).fold(limit_k, f64::min);
    let highest = high.iter().chain(&nominal).copied().filter(|at_k| at_k.is_finite()).fold(limit_k, f64::max);
    let mut layers = vec![
        Layer::Band { name: "95 % interval".to_owned(), ink: Ink::Series(0), opacity: 0.2, x: x.clone(), low, high },
        line("median".to_owned(), Ink::Series(0), Stroke::Solid, &x, &of(1)),
        line("nominal".to_owned(), Ink::Series(1), Stroke::Solid, &x, &nominal),
        line("limit".to_owned(), Ink::Measured, Stroke::Dotted, &[x[0], x[x.len() - 1]], &[limit_k; 2]),
    ];
    layers.extend(marks(outcome, lowest, highest));
    Figure {
        id: "size-peaks".to_owned(),
        number: String::new(),
        title: format!("Peak of {name} against the thickness of {}", outcome.demand.ply),
        caption: format!(
            "{} Band: 95 % interval of the peaks of {}, the same at every thickness.",
            size::found(answers, outcome),
            words::counted(outcome.members.min(crate::study::size::BAND), "member")
        ),
        x: thicknesses(outcome),
        y: Axis::linear("Peak temperature, K").within(lowest, highest),
        layers,
    }
}

fn held(answers: &Answers, outcome: &Sizing) -> Figure {
    let of = outcome.each_m.len();
    let stride = of.div_ceil(1000).max(1);
    // The last member is always picked, as it ends the curve.
    let picked = (0..of).filter(|&place| place.is_multiple_of(stride) || place + 1 == of);
    let points = picked.filter(|&place| outcome.each_m[place].is_finite());
    let (x, y): (Vec<f64>, Vec<f64>) =
        points.map(|place| (1e3 * outcome.each_m[place], 100.0 * (place + 1) as f64 / of as f64)).unzip();
    let (low_mm, high_mm) = (1e3 * outcome.within_m.0, 1e3 * outcome.within_m.1);
    let required = 100.0 * outcome.demand.probability;
    let mut layers = vec![
        line("within the limit".to_owned(), Ink::Series(0), Stroke::Solid, &x, &y),
        line("required".to_owned(), Ink::Measured, Stroke::Dotted, &[low_mm, high_mm], &[required; 2]),
    ];
    layers.extend(marks(outcome, 0.0, 100.0));
    if let Some(check) = &outcome.check {
        let (low, high) = check.held.interval_95();
        layers.push(Layer::Points {
            name: "check, ± 95 %".to_owned(),
            ink: Ink::Series(3),
            x: outcome.needed.found_m().into_iter().map(|at_m| 1e3 * at_m).collect(),
            y: vec![100.0 * check.held.share()],
            error: vec![50.0 * (high - low)],
        });
    }
    let text: Vec<String> = [Some(size::drawn(outcome)), size::checked(outcome)].into_iter().flatten().collect();
    Figure {
        id: "size-held".to_owned(),
        number: String::new(),
        title: format!("Members with {}", size::limit(answers, outcome)),
        caption: text.join(" "),
        x: thicknesses(outcome),
        y: Axis::linear("Members within the limit, %").within(0.0, 100.0),
        layers,
    }
}
