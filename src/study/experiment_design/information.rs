//! The information of candidate depths, from marches with derivatives at members of the prior.

use super::candidates::{Candidate, existing, instrumented, selectable};
use super::{Design, DesignError, DesignRequest, InformationMap};
use crate::case::Case;
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::fit::noise_model::ScoreSum;
use crate::fit::optimal_design::{InformationTable, Objective, OptimalSet, Robustness};
use crate::limits::SENSORS;
use crate::march::{March, MarchError};
use crate::plan::{ErrorEstimate, Plan};
use crate::traces::{Balance, MemberStatus, Traces};

/// Information of one case.
pub(super) struct Information {
    pub candidates: Vec<Candidate>,
    pub selectable: usize,
    pub run_lengths_s: Vec<f64>,
    /// One per run length.
    pub tables: Vec<InformationTable>,
    /// Derivatives of the peak of the target, member × factor, K per prior standard deviation.
    pub prediction: Vec<f64>,
    pub failed: usize,
    /// Prior standard deviations of the factors.
    pub deviations: Vec<f64>,
    instants_s: Vec<f64>,
    /// Factor × candidate × instant at nominal factors, K per prior standard deviation.
    nominal_k: Vec<Vec<Vec<f64>>>,
    /// Error estimate of the plan.
    pub error_estimate: Option<ErrorEstimate>,
    /// Energy and mass balance of the nominal march.
    pub balance: Balance,
}

/// Points with their derivatives per batch: traces of a few ten megabytes.
const BATCH: usize = 64;
/// Fraction of the members that may fail.
const MOST_FAILED: f64 = 0.1;

/// March the members of the prior of a case.
pub(super) fn gather(
    case: &Case,
    target: &str,
    march: &mut dyn March,
    request: &DesignRequest,
    adapt: &mut dyn FnMut(&Case) -> Result<Plan, MarchError>,
) -> Result<Information, DesignError> {
    let factors = factor_indices(case, request)?;
    let sensor = case.sensors.iter().find(|sensor| sensor.name == target);
    let sensor = sensor.ok_or_else(|| DesignError::NoTarget { case: case.id.clone(), name: target.to_owned() })?;
    let duration_s = case.exposure.duration_s;
    let run_lengths_s = if request.question.run_lengths_s.is_empty() {
        vec![duration_s]
    } else {
        request.question.run_lengths_s.clone()
    };
    if let Some(&run_s) = run_lengths_s.iter().find(|&&run_s| run_s > duration_s * (1.0 + 1e-9)) {
        return Err(DesignError::TooLong { case: case.id.clone(), run_s, duration_s });
    }
    let mut candidates = selectable(case, request);
    let selectable = candidates.len();
    candidates.extend(existing(case));
    if candidates.len() as u64 >= SENSORS.max {
        let (found, most) = (candidates.len(), SENSORS.max - 1);
        return Err(DesignError::TooManyDepths { case: case.id.clone(), found, most });
    }
    let plan = adapt(&instrumented(case, &candidates, sensor, request.question.sampling_s))?.without_gauges();
    let members = prior_members(case, &factors, request);
    let deviations: Vec<f64> = factors
        .iter()
        .map(|&factor| case.factors[factor].prior_standard_deviation(request.question.sampling_bounds))
        .collect();
    let mut gathering = Gathering::new(request, &plan, &deviations, &candidates, &run_lengths_s);
    for rows in members.chunks(BATCH) {
        let points = Ensemble::from_values(case.factors.len(), rows.concat());
        let traces = march.tangents(&plan, &points, &factors)?.ok_or(DesignError::NoDerivatives)?;
        (0..rows.len()).for_each(|point| gathering.add(&traces, point * (1 + factors.len())));
    }
    let failed = gathering.failed;
    let is_nominal_missing = gathering.nominal_k.is_empty();
    if is_nominal_missing || failed as f64 > MOST_FAILED * members.len() as f64 {
        return Err(DesignError::TooManyFailed { case: case.id.clone(), failed, members: members.len() });
    }
    let tables = gathering.tables();
    let Gathering { prediction, nominal_k, balance, .. } = gathering;
    let (instants_s, error_estimate) = (plan.instants_s.clone(), plan.error_estimate.clone());
    Ok(Information {
        candidates,
        selectable,
        run_lengths_s,
        tables,
        prediction,
        failed,
        deviations,
        instants_s,
        nominal_k,
        error_estimate,
        balance,
    })
}

fn factor_indices(case: &Case, request: &DesignRequest) -> Result<Vec<usize>, DesignError> {
    let index = |name: &String| {
        case.factors.iter().position(|factor| factor.name == *name).ok_or_else(|| DesignError::NoFactor {
            case: case.id.clone(),
            name: name.clone(),
            known: case.factors.iter().map(|factor| factor.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    };
    request.question.factors.iter().map(index).collect()
}

/// Factors of the members: the nominal ones first, then draws of the estimated factors with the others nominal.
fn prior_members(case: &Case, factors: &[usize], request: &DesignRequest) -> Vec<Vec<f64>> {
    let sampling = Sampling { kind: SamplingKind::Normal, seed: request.question.seed };
    let drawn = Ensemble::sample(&case.factors, request.question.sampling_bounds, &sampling, request.question.members)
        .correlated(&case.correlation);
    let nominal: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
    let member = |index: usize| {
        let (mut row, drawn) = (nominal.clone(), drawn.member(index));
        factors.iter().for_each(|&factor| row[factor] = drawn[factor]);
        row
    };
    std::iter::once(nominal.clone()).chain((1..request.question.members).map(member)).collect()
}

/// Sums over the members so far.
struct Gathering<'a> {
    request: &'a DesignRequest,
    deviations: &'a [f64],
    candidates: &'a [Candidate],
    /// For each candidate the two others between which its temperature gradient is taken.
    neighbours: Vec<(usize, usize)>,
    /// End of the instants of each run length.
    ends: Vec<usize>,
    instants_s: &'a [f64],
    /// Run length × member × candidate × the lower triangles of the information and of the covariance of the score.
    entries: Vec<Vec<f64>>,
    prediction: Vec<f64>,
    nominal_k: Vec<Vec<Vec<f64>>>,
    balance: Balance,
    members: usize,
    failed: usize,
}

impl<'a> Gathering<'a> {
    fn new(
        request: &'a DesignRequest,
        plan: &'a Plan,
        deviations: &'a [f64],
        candidates: &'a [Candidate],
        run_lengths_s: &[f64],
    ) -> Self {
        let end = |run_s: &f64| plan.instants_s.partition_point(|instant_s| *instant_s <= run_s * (1.0 + 1e-9));
        Self {
            request,
            deviations,
            candidates,
            neighbours: neighbours(candidates),
            ends: run_lengths_s.iter().map(end).collect(),
            instants_s: &plan.instants_s,
            entries: vec![Vec::new(); run_lengths_s.len()],
            prediction: Vec::new(),
            nominal_k: Vec::new(),
            balance: Balance::default(),
            members: 0,
            failed: 0,
        }
    }

    /// Add a member: a row of the traces, after which its derivatives follow.
    fn add(&mut self, traces: &Traces, row: usize) {
        let is_nominal = self.members + self.failed == 0;
        if traces.statuses[row] != MemberStatus::Completed {
            self.failed += 1;
            return;
        }
        self.members += 1;
        let slopes = |factor: usize, sensor: usize| traces.trace(row + 1 + factor, sensor);
        for sensor in 0..self.candidates.len() {
            self.add_candidate(traces, row, sensor);
        }
        let target = self.candidates.len();
        let by_factor = |factor: usize| traces.peak(row + 1 + factor, target).temperature_k;
        self.prediction.extend(self.deviations.iter().enumerate().map(|(factor, sd)| sd * by_factor(factor)));
        if is_nominal {
            self.balance = traces.balances[row];
            let scaled = |factor: usize, sensor: usize| -> Vec<f64> {
                slopes(factor, sensor).iter().map(|slope| self.deviations[factor] * slope).collect()
            };
            let of_factor = |factor: usize| (0..target).map(|sensor| scaled(factor, sensor)).collect();
            self.nominal_k = (0..self.deviations.len()).map(of_factor).collect();
        }
    }

    fn add_candidate(&mut self, traces: &Traces, row: usize, sensor: usize) {
        let n = self.deviations.len();
        let slopes: Vec<&[f64]> = (0..n).map(|factor| traces.trace(row + 1 + factor, sensor)).collect();
        let (before, after) = self.neighbours[sensor];
        let (above_k, below_k) = (traces.trace(row, before), traces.trace(row, after));
        let distance_m = self.candidates[after].depth_m - self.candidates[before].depth_m;
        let tolerance_m = self.request.question.position_tolerance_m;
        let noise = self.request.noise;
        // The depth of the sensor is the last variable.
        let (mut information, mut correlated) =
            (ScoreSum::new(n + 1, 0.0), ScoreSum::new(n + 1, noise.correlation_time_s));
        let mut derivatives = Vec::with_capacity(n + 1);
        let mut start = 0;
        for (place, &end) in self.ends.iter().enumerate() {
            // Run lengths ascend, so that the sums of one continue those of the one before.
            for instant in start..end {
                let shift = if distance_m > 0.0 { (below_k[instant] - above_k[instant]) / distance_m } else { 0.0 };
                derivatives.clear();
                derivatives.extend(self.deviations.iter().zip(&slopes).map(|(sd, slope)| sd * slope[instant]));
                derivatives.push(shift * tolerance_m);
                derivatives.iter_mut().for_each(|derivative| *derivative /= noise.deviation_k);
                let before = if instant > 0 { self.instants_s[instant - 1] } else { f64::NEG_INFINITY };
                let gap_s = self.instants_s[instant] - before;
                information.add(gap_s, &derivatives);
                correlated.add(gap_s, &derivatives);
            }
            start = start.max(end);
            let scores: Vec<f64> = (information.triangle.iter().zip(&correlated.triangle))
                .map(|(white, correlated)| correlated + noise.white_fraction * (white - correlated))
                .collect();
            self.entries[place].extend(without_depth(&information.triangle, &scores, n));
        }
    }

    /// The table of each run length.
    fn tables(&self) -> Vec<InformationTable> {
        let (n, depths) = (self.deviations.len(), self.candidates.len());
        let size = n * (n + 1) / 2;
        let table = |entries: &Vec<f64>| {
            let mut table = InformationTable::new(n, self.members, depths);
            for (index, values) in entries.chunks(2 * size).enumerate() {
                table.set(index % depths, index / depths, &values[..size], &values[size..]);
            }
            table
        };
        self.entries.iter().map(table).collect()
    }
}

/// Information and covariance of the score, lower triangles, of the first variables after the last one is eliminated: a
/// nuisance parameter with a prior of standard deviation one. From the triangles of all `n + 1` variables.
fn without_depth(information: &[f64], scores: &[f64], n: usize) -> Vec<f64> {
    let last = n * (n + 1) / 2;
    let (across, squares) = (&information[last..last + n], 1.0 + information[last + n]);
    let (score_across, score_squares) = (&scores[last..last + n], 1.0 + scores[last + n]);
    let pairs = || (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).enumerate();
    let eliminated = pairs().map(|(entry, (i, j))| information[entry] - across[i] * across[j] / squares);
    let covariance = pairs().map(|(entry, (i, j))| {
        let mixed = across[i] * score_across[j] + score_across[i] * across[j];
        scores[entry] - mixed / squares + across[i] * across[j] * score_squares / squares.powi(2)
    });
    eliminated.chain(covariance).collect()
}

/// For each candidate the next one above and below it, or itself at an end.
fn neighbours(candidates: &[Candidate]) -> Vec<(usize, usize)> {
    let nearest = |of: &Candidate, side: f64, own: usize| {
        let distance = |other: &usize| side * (candidates[*other].depth_m - of.depth_m);
        let others = (0..candidates.len()).filter(|other| distance(other) > 1e-9);
        others.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(own)
    };
    let pair = |(own, of): (usize, &Candidate)| (nearest(of, -1.0, own), nearest(of, 1.0, own));
    candidates.iter().enumerate().map(pair).collect()
}

impl Information {
    /// Results of a set of depths.
    pub(super) fn design(&self, objective: &Objective<'_>, set: &OptimalSet) -> Design {
        let (n, members) = (self.deviations.len(), objective.table.members());
        let mut errors = vec![Vec::with_capacity(members); n];
        let mut correlation = vec![vec![0.0; n]; n];
        let mut prediction = 0.0;
        for member in 0..members {
            let covariance = objective.table.covariance(&set.candidates, member);
            let gradient = &self.prediction[member * n..(member + 1) * n];
            for i in 0..n {
                errors[i].push(self.deviations[i] * covariance[(i, i)].sqrt());
                for j in 0..n {
                    let scale = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
                    correlation[i][j] += covariance[(i, j)] / scale / members as f64;
                    prediction += gradient[i] * covariance[(i, j)] * gradient[j] / members as f64;
                }
            }
        }
        let rms = |values: &Vec<f64>| (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt();
        let standard_errors = errors.iter().map(rms).collect();
        let range = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            let at = |share: f64| values[(share * (values.len() - 1) as f64).round() as usize];
            (at(0.05), at(0.95))
        };
        Design {
            candidates: set.candidates.clone(),
            loss: objective.loss(&set.candidates),
            worst_loss: Objective { robustness: Robustness::Worst, ..*objective }.loss(&set.candidates),
            standard_errors,
            error_ranges: errors.iter_mut().map(range).collect(),
            correlation,
            prediction_k: prediction.max(0.0).sqrt(),
        }
    }

    /// Information over depth and time, up to the end of a run.
    pub(super) fn map(&self, run_length_s: f64) -> InformationMap {
        let end = self.instants_s.partition_point(|instant_s| *instant_s <= run_length_s * (1.0 + 1e-9));
        let of_factor = |by_depth: &Vec<Vec<f64>>| {
            by_depth[..self.selectable].iter().map(|trace_k| trace_k[..end].to_vec()).collect()
        };
        InformationMap {
            instants_s: self.instants_s[..end].to_vec(),
            candidates: (0..self.selectable).collect(),
            changes_k: self.nominal_k.iter().map(of_factor).collect(),
        }
    }
}
