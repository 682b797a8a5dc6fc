"""Compares what bondline reports of a case with the oracle's values."""

import csv
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from case_file import load
from quantities import Refused
from solution import Result, solve
from tables import Array


def program() -> str:
    """The command: of the environment, or the one that `BONDLINE_PROGRAM` states."""
    beside = Path(sys.executable).with_name("bondline")
    found = os.environ.get("BONDLINE_PROGRAM") or (str(beside) if beside.exists() else shutil.which("bondline"))
    if not found:
        pytest.skip("no command bondline: state BONDLINE_PROGRAM")
    return found


@dataclass
class Reported:
    """What bondline says of a case."""

    exit_code: int
    message: str
    summary: dict
    times_s: Array
    columns: dict[str, Array]
    screen: str

    @property
    def is_refused(self) -> bool:
        """Whether there are no values, or bondline itself says that they cannot be used."""
        return not self.summary or (self.exit_code == 1 and "cannot be used" in self.message)


@dataclass
class Finding:
    """One quantity of one case: what is claimed and what is true."""

    quantity: str
    precision: str
    value: float
    truth: float
    claim: float
    tolerance: float
    doubt: float  # the oracle's own error
    is_warned: bool

    @property
    def error(self) -> float:
        return abs(self.value - self.truth) if np.isfinite(self.value) else np.inf

    @property
    def ratio(self) -> float:
        """The true error over the claimed one; a value below 1 is kept. The doubt of the oracle counts for bondline."""
        return max(self.error - self.doubt, 0.0) / max(self.claim, 1e-300)

    @property
    def is_silent(self) -> bool:
        """Whether it is beyond its tolerance without a word."""
        return self.error - self.doubt > self.tolerance and not self.is_warned


@dataclass
class Outcome:
    name: str
    features: set[str]
    refusal: str = ""  # of the oracle
    messages: dict[str, str] = field(default_factory=dict)  # refusals of bondline, by precision
    findings: list[Finding] = field(default_factory=list)
    work: float = 0.0
    is_loose: bool = False
    decomposable_kg_m2: float = 0.0
    warnings: dict[str, str] = field(default_factory=dict)


def predict(program: str, folder: Path, out: Path, precision: str, seconds: float = 30.0) -> Reported:
    command = [program, "predict", str(folder), "--precision", precision, "--backend", "cpu", "--out", str(out),
               "--force", "-q"]  # fmt: skip
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return Reported(124, f"takes more than {seconds:.0f} s", {}, np.zeros(0), {}, "")
    summary, columns, times = {}, {}, np.zeros(0)
    if (out / "summary.json").exists():
        summary = json.loads((out / "summary.json").read_text())
    # A march that fails has a report, but no values.
    if "discretisation_error" not in summary:
        summary = {}
    if summary:
        with open(out / "traces.csv") as file:
            rows = list(csv.reader(file))
        data = np.array([[float(cell or "nan") for cell in row] for row in rows[1:]])
        times = data[:, 0]
        columns = {name: data[:, i] for i, name in enumerate(rows[0])}
    return Reported(run.returncode, run.stderr.strip(), summary, times, columns, run.stdout)


def _warnings(report: Reported) -> str:
    """The warnings on the screen: paragraphs that begin with an exclamation mark."""
    kept, inside = [], False
    for line in report.screen.splitlines():
        inside = line.startswith("! ") or (inside and line.startswith("  "))
        if inside:
            kept.append(line.strip())
    return " ".join(kept)


# Words of a warning that says that results are wrong.
_WORDS_OF_ERROR = ("discretisation error", "balance", "diverged")


def compare(outcome: Outcome, precision: str, report: Reported, truth: Result) -> None:
    """Findings of one report."""
    error = report.summary["discretisation_error"]
    tolerance = error["tolerance_k"]
    claim = error["nominal_k"]
    claim = np.inf if claim is None else claim
    words = _warnings(report)
    outcome.warnings[precision] = words
    is_warned = report.exit_code == 1 or any(word in words for word in _WORDS_OF_ERROR)

    def add(quantity: str, value: float, true: float, claim: float, tolerance: float, doubt: float) -> None:
        outcome.findings.append(Finding(quantity, precision, value, true, claim, tolerance, doubt, is_warned))

    for name, sensor in report.summary["sensors"].items():
        key = f"peak of {name}"
        add(key, sensor["peak_k"] if sensor["peak_k"] is not None else np.nan, truth.numbers[key], claim, tolerance,
            truth.errors[key])  # fmt: skip
        column = report.columns[f"{name}_k"]
        true = truth.traces[name]
        add(f"reading of {name} at 0 s", float(column[0]), float(true[0]), claim, tolerance, truth.errors[name])
        i = 1 + int(np.nanargmax(np.abs(column - true)[1:]))
        add(f"trace of {name} at {report.times_s[i]:.6g} s", float(column[i]), float(true[i]), claim, tolerance,
            truth.errors[name])  # fmt: skip
    for margin in report.summary.get("margins", []):
        if margin["kind"] == "sensor":
            continue
        key = f"peak of {margin['kind']} {margin['part']}"
        add(key, margin["nominal"]["peak_k"], truth.numbers[key], claim, tolerance, truth.errors[key])
    load_j = report.summary.get("heat_load", {}).get("nominal_j_m2")
    if load_j is not None and "heat load" in truth.numbers:
        scale = max(truth.numbers["heat load"], 1.0)
        add("heat load, relative", load_j / scale, truth.numbers["heat load"] / scale, 1e-3, 1e-3,
            truth.errors["heat load"] / scale)  # fmt: skip
    for name, gauge in report.summary.get("gauges", {}).items():
        if name not in ("mass_lost_kg_m2", "gas_flux_kg_m2_s") or name not in error["gauges"]:
            continue
        own = error["gauges"][name]
        column, true = report.columns[name], truth.traces[name]
        # Of a layup that loses next to nothing the peak is no scale.
        least = 1e-4 * outcome.decomposable_kg_m2 / (1.0 if name.startswith("mass") else truth.times_s[-1])
        peak = max(truth.numbers.get(f"peak of {name}", float(np.nanmax(np.abs(true)))), least)
        own_claim = own["error"] if own["error"] is not None else np.inf
        doubt = truth.errors[name] / peak
        if name == "gas_flux_kg_m2_s":
            add(f"peak of {name}, over the peak", gauge["peak"] / peak, truth.numbers[f"peak of {name}"] / peak,
                own_claim, own["tolerance"], truth.errors[f"peak of {name}"] / peak)  # fmt: skip
        add(f"{name} at 0 s, over the peak", float(column[0]) / peak, float(true[0]) / peak, own_claim,
            own["tolerance"], doubt)  # fmt: skip
        i = 1 + int(np.nanargmax(np.abs(column - true)[1:]))
        add(f"{name} at {report.times_s[i]:.6g} s, over the peak", float(column[i]) / peak, float(true[i]) / peak,
            own_claim, own["tolerance"], doubt)  # fmt: skip


def judge(program: str, folder: Path, features: set[str], scratch: Path, work: float = 1e5) -> Outcome:
    """Runs one case in both precisions and compares."""
    outcome = Outcome(folder.name, features)
    reports = {p: predict(program, folder, scratch / f"out-{p}", p) for p in ("f64", "f32")}
    times = set[float]()
    for precision, report in reports.items():
        if report.is_refused:
            outcome.messages[precision] = f"exit {report.exit_code}: {report.message or report.screen}"
        if report.summary:
            times.update(report.times_s.tolist())
    try:
        case = load(folder)
        if not times:
            times.update(np.arange(0.0, case.duration_s, case.output_interval_s).tolist())
        instants = np.array(sorted(times))
        truth = solve(case, instants, work=work)
    except Refused as reason:
        outcome.refusal = str(reason)
        return outcome
    outcome.decomposable_kg_m2 = sum(
        ply.thickness_m * ply.material.density * reaction.mass_loss
        for ply in case.plies
        for reaction in ply.material.reactions
    )
    outcome.work, outcome.is_loose = truth.work, truth.is_loose
    for precision, report in reports.items():
        if not report.is_refused:
            at = np.searchsorted(instants, report.times_s)
            own = Result(report.times_s, {k: v[at] for k, v in truth.traces.items()}, truth.numbers, truth.errors)
            compare(outcome, precision, report, own)
    return outcome
