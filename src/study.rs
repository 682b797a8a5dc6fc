//! The studies of a case: one module each, with one entry function and the struct of its results.

mod answer_validity;
pub mod answers;
pub mod coverage_study;
pub mod depth_profiles;
pub mod driver_emissivity;
pub mod driver_smoothing;
pub mod estimate;
pub mod experiment_design;
pub mod flux_inversion;
pub mod margins;
pub mod model_comparison;
pub mod nominal;
pub mod observation_check;
pub mod posterior;
pub mod run_record;
pub mod sensitivity;
pub mod sequential_sampling;
pub mod simultaneous_band;
pub mod size;
pub mod thermocouple_residuals;
pub mod timing;
pub mod trade;
pub mod twin;
pub mod uncertainty;
pub mod validity;
