//! `twin`: synthetic observations from known factors.

use crate::asked;
use crate::cli::On;
use crate::commands::load;
use crate::ending::{Ending, Failure, input};
use crate::watch::Watched;
use bondline::march::{Precision, choose};
use bondline::pilot::pilot;
use bondline::report;
use bondline::study::twin::{TwinError, twin};
use std::path::Path;

pub(crate) fn make(
    path: &Path,
    truth: &[String],
    noise: &str,
    seed: u64,
    out: &Path,
    force: bool,
    on: &On,
) -> Result<Ending, Failure> {
    let case = load(path, on)?;
    let mut row: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
    for (factor, value) in asked::values(&case, truth, "--truth")? {
        row[factor] = value;
    }
    let noise_k = asked::noise_k(noise)?;
    if out.exists() && !force {
        return Err(input(format!("{} exists already; give --force to overwrite it", out.display())));
    }
    let plan = pilot(&case)?;
    let mut choice = asked::choice(on);
    choice.precision = choice.precision.or(Some(Precision::F64));
    let mut march = Watched::new(choose::open_extrapolated(&choice, &plan, 1)?, on.quiet);
    let made = twin(&case, &plan, &mut march, row, noise_k, seed).map_err(|error| match error {
        TwinError::March(error) => error.into(),
        other => input(other),
    })?;
    march.done();
    report::files::measured(out, &case, &made)?;
    let text = format!(
        "{} samples of {} sensors, noise {noise_k} K, seed {seed}: {}\n",
        made.instants_s.len(),
        case.sensors.len(),
        out.display()
    );
    Ok(Ending { text, why: None })
}
