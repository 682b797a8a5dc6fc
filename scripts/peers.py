#!/usr/bin/env python3
"""Reference figures of SciPy, emcee and SALib for tests/fit/peers.rs: writes data/verification/peers.csv.

Needs NumPy, SciPy, emcee and SALib (pip install numpy scipy emcee SALib). The suite needs none of them: it reads the
file. The model is a plate that is heated and cooled, T = 300 + 200 a (1 - exp(-0.05 b t)) in K, read with 2 K noise.
"""

import emcee
import numpy as np
import scipy
from importlib.metadata import version
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling
from scipy.optimize import least_squares

OUT = "data/verification/peers.csv"
LOW, HIGH = np.array([0.5, 0.5]), np.array([1.5, 1.5])
PRIOR = 0.05  # standard deviation of a and b about one

times = np.arange(1.0, 41.0)
random = np.random.default_rng(2026)
readings = 300 + 200 * 1.04 * (1 - np.exp(-0.05 * 0.93 * times)) + random.normal(0, 2, times.size)
readings[[7, 23]] += [15.0, -12.0]  # two readings far off, for the robust losses
readings = np.round(readings, 6)


def residuals(x):
    return (300 + 200 * x[0] * (1 - np.exp(-0.05 * x[1] * times)) - readings) / 2


def with_prior(x):
    return np.concatenate([residuals(x), (x - 1) / PRIOR])


def best(function=residuals, high=HIGH, **options):
    tight = dict(xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac", max_nfev=10_000)
    return least_squares(function, [0.8, 0.8], bounds=(LOW, high), jac="3-point", **tight, **options).x


def quantiles(function):
    def log_density(x):
        inside = np.all((x >= LOW) & (x <= HIGH))
        return -0.5 * np.sum(function(x) ** 2) if inside else -np.inf

    starts = best(function) + 0.01 * random.normal(size=(64, 2))
    sampler = emcee.EnsembleSampler(64, 2, log_density)
    np.random.seed(2026)
    sampler.run_mcmc(starts, 6000)
    draws = sampler.get_chain(discard=500, flat=True)
    return np.quantile(draws, [0.025, 0.5, 0.975], axis=0).T


def indices():
    """First-order and total Sobol indices of the plate at 20 s, its start scaled by a third factor, all evenly
    drawn."""
    bounds = [[0.5, 1.5], [0.5, 1.5], [0.9, 1.1]]
    problem = dict(num_vars=3, names=list("abc"), bounds=bounds)
    a, b, c = sampling.sample(problem, 2**18, calc_second_order=False, seed=1).T
    found = analysis.analyze(problem, 300 * c + 200 * a * (1 - np.exp(-b)), calc_second_order=False, seed=1)
    return zip("abc", found["S1"], found["ST"])


rows = [("squares", best()), ("soft-l1=1", best(loss="soft_l1")), ("huber=1.345", best(loss="huber", f_scale=1.345))]
rows += [("prior", best(with_prior)), ("bound", best(high=np.array([1.5, 0.85])))]
with open(OUT, "w") as file:
    versions = f"SciPy {scipy.__version__}, emcee {emcee.__version__}, SALib {version('SALib')}"
    print(f"# scripts/peers.py: {versions}; reading: time s, K", file=file)
    columns = "quantile: objective, factor, 2.5 %, 50 %, 97.5 %; index: factor, first order, total"
    print(f"# optimum: objective, a, b; {columns}", file=file)
    for time, reading in zip(times, readings):
        print(f"reading,{time:.0f},{reading:.6f}", file=file)
    for name, (a, b) in rows:
        print(f"optimum,{name},{a:.10f},{b:.10f}", file=file)
    for name, function in [("squares", residuals), ("prior", with_prior)]:
        for factor, (low, middle, high) in zip("ab", quantiles(function)):
            print(f"quantile,{name},{factor},{low:.6f},{middle:.6f},{high:.6f}", file=file)
    for factor, first, total in indices():
        print(f"index,{factor},{first:.6f},{total:.6f}", file=file)
