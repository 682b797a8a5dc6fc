//! Peak temperature and share of members within the limit against the thickness of a ply.

use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::line;
use crate::report::{format, size};
use crate::study::answers::Answers;
use crate::study::size::Sizing;

pub(super) fn figures(answers: &Answers, outcome: &Sizing) -> Vec<Figure> {
    vec![peaks(answers, outcome), share_within_limit(answers, outcome)]
}

/// Vertical lines at the nominal and at the required thickness.
fn thickness_lines(outcome: &Sizing, low: f64, high: f64) -> Vec<Layer> {
    let names = ["nominal".to_owned(), format!("for {}", format::percent_near_limits(outcome.requirement.probability))];
    let found = [(outcome.nominal, Ink::Series(1)), (outcome.required, Ink::Series(2))];
    let each = found.into_iter().zip(names).filter_map(|((needed, ink), name)| {
        let at_mm = 1e3 * needed.found_m()?;
        Some(line(format!("{} {name}", size::thickness_text(needed)), ink, Stroke::Dashed, &[at_mm; 2], &[low, high]))
    });
    each.collect()
}

fn thickness_axis(outcome: &Sizing) -> Axis {
    Axis::linear(&format!("Thickness of {}, mm", outcome.requirement.ply))
        .with_range(1e3 * outcome.thickness_range_m.0, 1e3 * outcome.thickness_range_m.1)
}

fn peaks(answers: &Answers, outcome: &Sizing) -> Figure {
    let name = super::limited_part(answers, outcome);
    let x: Vec<f64> = outcome.peak_curve.iter().map(|rung| 1e3 * rung.thickness_m).collect();
    let of = |place: usize| -> Vec<f64> {
        let finite = |at_k: f64| if at_k.is_finite() { at_k } else { f64::NAN };
        outcome.peak_curve.iter().map(|rung| finite(rung.percentiles_k[place])).collect()
    };
    let nominal: Vec<f64> = outcome.peak_curve.iter().map(|rung| rung.nominal.temperature_k).collect();
    let limit_k = outcome.requirement.limit_k;
    let (low, high) = (of(0), of(2));
    let lowest = low.iter().chain(&nominal).copied().filter(|at_k| at_k.is_finite()).fold(limit_k, f64::min);
    let highest = high.iter().chain(&nominal).copied().filter(|at_k| at_k.is_finite()).fold(limit_k, f64::max);
    let mut layers = vec![
        Layer::Band { name: "95 % interval".to_owned(), ink: Ink::Series(0), opacity: 0.2, x: x.clone(), low, high },
        line("median".to_owned(), Ink::Series(0), Stroke::Solid, &x, &of(1)),
        line("nominal".to_owned(), Ink::Series(1), Stroke::Solid, &x, &nominal),
        line("limit".to_owned(), Ink::Measured, Stroke::Dotted, &[x[0], x[x.len() - 1]], &[limit_k; 2]),
    ];
    layers.extend(thickness_lines(outcome, lowest, highest));
    Figure {
        id: "size-peaks".to_owned(),
        title: format!("Peak of {name} against the thickness of {}", outcome.requirement.ply),
        caption: format!(
            "{} Band: 95 % interval of the peaks of {}, the same at every thickness.",
            size::finding(answers, outcome),
            format::counted(outcome.members.min(crate::study::size::CURVE_MEMBERS), "member")
        ),
        x: thickness_axis(outcome),
        y: Axis::linear("Peak temperature, K").with_range(lowest, highest),
        layers,
    }
}

fn share_within_limit(answers: &Answers, outcome: &Sizing) -> Figure {
    let of = outcome.member_thicknesses_m.len();
    let stride = of.div_ceil(1000).max(1);
    // The last member is always picked, as it ends the curve.
    let picked = (0..of).filter(|&place| place.is_multiple_of(stride) || place + 1 == of);
    let points = picked.filter(|&place| outcome.member_thicknesses_m[place].is_finite());
    let (x, y): (Vec<f64>, Vec<f64>) =
        points.map(|place| (1e3 * outcome.member_thicknesses_m[place], 100.0 * (place + 1) as f64 / of as f64)).unzip();
    let (low_mm, high_mm) = (1e3 * outcome.thickness_range_m.0, 1e3 * outcome.thickness_range_m.1);
    let required = 100.0 * outcome.requirement.probability;
    let mut layers = vec![
        line("within the limit".to_owned(), Ink::Series(0), Stroke::Solid, &x, &y),
        line("required".to_owned(), Ink::Measured, Stroke::Dotted, &[low_mm, high_mm], &[required; 2]),
    ];
    layers.extend(thickness_lines(outcome, 0.0, 100.0));
    if let Some(check) = &outcome.check {
        let (low, high) = check.below_limit.interval_95();
        layers.push(Layer::Points {
            name: "check, ± 95 %".to_owned(),
            ink: Ink::Series(3),
            x: outcome.required.found_m().into_iter().map(|at_m| 1e3 * at_m).collect(),
            y: vec![100.0 * check.below_limit.fraction()],
            error: vec![50.0 * (high - low)],
        });
    }
    let text: Vec<String> =
        [Some(size::stated_thickness(outcome)), size::check_result(outcome)].into_iter().flatten().collect();
    Figure {
        id: "size-held".to_owned(),
        title: format!("Members with {}", size::limit_text(answers, outcome)),
        caption: text.join(" "),
        x: thickness_axis(outcome),
        y: Axis::linear("Members within the limit, %").with_range(0.0, 100.0),
        layers,
    }
}
