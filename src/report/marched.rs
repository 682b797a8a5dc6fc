//! Answers of marched cases, for the tests of the report.

use crate::case::{Case, GasFlow, GasFlowModel, Observation};
use crate::fit::ChainDiagnostics;
use crate::march::Backend;
use crate::question::{self, FactorValue, Fit, PosteriorSampling, Twin};
use crate::session::{BackendKind, Options, Session};
use crate::study::answers::Answers;
use crate::study::depth_profiles::ProfileInstants;
use crate::study::estimate::ParameterEstimates;
use crate::study::nominal::Prediction;
use crate::study::posterior::Posterior;
use crate::study::sensitivity::Sensitivity;
use crate::study::uncertainty::Uncertainty;
use std::path::Path;
use std::sync::OnceLock;

/// Noise of the observations, K: above the discretisation error.
const NOISE_K: f64 = 4.0;

/// The answers of a study. A test changes those that its sentence is about.
#[derive(Clone)]
pub(super) struct Study {
    pub case: Case,
    pub backend: Backend,
    pub nominal: Prediction,
    pub uncertainty: Uncertainty,
    pub sensitivity: Sensitivity,
    pub estimated: ParameterEstimates,
    pub posterior: Posterior,
    whole: Answers,
}

impl Study {
    /// The part of the answers that belongs to a question.
    pub(super) fn answers(&self, question: &'static str) -> Answers {
        let is = |questions: &[&str]| question == "study" || questions.contains(&question);
        Answers {
            question,
            case: self.case.clone(),
            backend: self.backend.clone(),
            seed: self.whole.seed.filter(|_| is(&["uncertainty"])),
            nominal: is(&["predict", "uncertainty", "sensitivity"]).then(|| self.nominal.clone()),
            uncertainty: is(&["uncertainty"]).then(|| self.uncertainty.clone()),
            depth_profiles: self.whole.depth_profiles.clone().filter(|_| is(&[])),
            sensitivity: is(&["sensitivity"]).then(|| self.sensitivity.clone()),
            estimated: is(&["estimate"]).then(|| self.estimated.clone()),
            posterior: is(&["estimate"]).then(|| self.posterior.clone()),
            ..self.whole.clone()
        }
    }

    /// Chains of 500 iterations that have converged, with an autocorrelation time of 21; those marched are too short.
    pub(super) fn with_long_chains(mut self) -> Self {
        let found = &mut self.posterior;
        (found.walkers.number, found.walkers.iterations, found.annealing, found.burn_in) = (2000, 500, 24, 129);
        for (marginal, r_hat) in found.marginals.iter_mut().zip([1.002, 1.004]) {
            marginal.diagnostics = ChainDiagnostics { autocorrelation_time: 21.0, effective_draws: 37_600.0, r_hat };
        }
        self
    }
}

/// A study of `lcat-2259` at a coarse resolution, with observations that its own model generates.
pub(super) fn study() -> Study {
    static STUDY: OnceLock<Study> = OnceLock::new();
    STUDY.get_or_init(marched_study).clone()
}

/// The study, with the nominal march of the same layup when its insulator decomposes.
pub(super) fn charring() -> Study {
    static STUDY: OnceLock<Study> = OnceLock::new();
    let marched = || {
        let (mut study, decomposing) = (study(), case("lcat-2259-pyrolysis", &[]));
        study.case.layup.plies[2..4].clone_from_slice(&decomposing.layup.plies[2..4]);
        study.case.gas = decomposing.gas.map(|gas| GasFlow { model: GasFlowModel::Darcy, ..gas });
        let mut stated = study.case.clone();
        (stated.resolution.tolerance_k, stated.resolution.cells) = (None, 48);
        study.nominal = session(stated).predict().expect("a march");
        study.estimated.fitted[0].before = study.nominal.clone();
        study
    };
    STUDY.get_or_init(marched).clone()
}

fn marched_study() -> Study {
    let coarse = [("resolution.tolerance", "5 K"), ("resolution.output_interval", "4 s")];
    let fitted = [("estimate.factors", "[\"f_k_INS\", \"f_cp_INS\"]"), ("estimate.window", "[\"0 s\", \"200 s\"]")];
    let mut case = case("lcat-2259", &[coarse, fitted].concat());
    case.observations.clear();
    let truth = vec![FactorValue::new("f_k_INS", 0.97), FactorValue::new("f_cp_INS", 1.02)];
    let twin = Twin { truth, noise_k: Some(NOISE_K), correlation_time_s: Some(2.0), ..Twin::default() };
    let data = session(case.clone()).twin(&twin).expect("synthetic data");
    let observation = |(sensor, temperatures_k)| Observation {
        sensor,
        times_s: data.instants_s.clone(),
        temperatures_k,
        sigma_k: vec![NOISE_K; data.instants_s.len()],
        window_s: None,
    };
    case.observations = data.measured_k.into_iter().enumerate().map(observation).collect();
    let mut session = session(case);
    let question = question::Study {
        members: 64,
        depth_profiles: Some(ProfileInstants::Even(5)),
        fit: Fit { profile: vec!["f_k_INS".to_owned()], ..Fit::default() },
        posterior: PosteriorSampling { posterior: true, walkers: 24, mcmc_iterations: 60 },
        ..question::Study::default()
    };
    let whole = session.study(&question).expect("a study").clone();
    Study {
        case: whole.case.clone(),
        backend: whole.backend.clone(),
        nominal: whole.nominal.clone().expect("a prediction"),
        uncertainty: whole.uncertainty.clone().expect("a sweep"),
        sensitivity: whole.sensitivity.clone().expect("derivatives"),
        estimated: whole.estimated.clone().expect("an estimate"),
        posterior: whole.posterior.clone().expect("a posterior"),
        whole,
    }
}

fn case(id: &str, overrides: &[(&str, &str)]) -> Case {
    let overrides: Vec<(String, String)> =
        overrides.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    Case::load_with(&Path::new("cases").join(id), &overrides).expect("a shipped case")
}

fn session(case: Case) -> Session {
    let command_line = ["bondline", "study", "lcat-2259", "--set", "resolution.tolerance=5 K"].map(str::to_owned);
    let options = Options::default().backend(BackendKind::Cpu).threads(2).command_line(command_line);
    Session::open(case, &options).expect("the CPU is always available")
}
