//! Reference problems by family.

pub mod charring;
mod darcy_flow;
pub mod flexible;
mod holder;
mod kinetics;
mod layered;
pub mod nonlinear;
mod radiating;
mod slab;
mod tacot;

use super::problem::Problem;

/// Source of the tolerance of closed forms.
const REFINED: &str = "cells and steps refined to 1e-6 of the driving value; wide: one limit for all closed forms";

const CARSLAW_3_3: &str = "Carslaw and Jaeger 1959, §3.3";
const CARSLAW_3_8: &str = "Carslaw and Jaeger 1959, §3.8";
const CARSLAW_3_10: &str = "Carslaw and Jaeger 1959, §3.10";
const TALBOT: &str = "Laplace inversion in 30 digits";
const MOL: &str = "method of lines, converged";
const CODES_WITHIN_1_K: &str = "1 K covers the codes' own errors against the exact solution; wide: some are smaller";
const CELSIUS_K: f64 = 273.15;

/// All problems, the simplest first.
pub fn all_problems() -> Vec<Problem> {
    [
        slab::problems(),
        layered::problems(),
        nonlinear::problems(),
        radiating::problems(),
        holder::problems(),
        kinetics::problems(),
        darcy_flow::problems(),
        charring::problems(),
        tacot::problems(),
    ]
    .into_iter()
    .flatten()
    .collect()
}
