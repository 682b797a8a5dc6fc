"""A case as the program that Dakota or PEST++ calls: it reads a file of parameters and writes a file of results.

    python -m bondline.driver CASE PARAMETERS RESULTS
    python -m bondline.driver --pest FOLDER CASE

Parameters are factors of the case; the others are nominal. The first form reads either a parameters file of Dakota in
its standard format, and answers the functions of its active set, or lines of a name and a value. The second form writes
the control, template and instruction files of PEST++ for the factors and samples that the case estimates from.

Names of results are ``peak_SENSOR``, the highest temperature of a sensor in K; ``SENSOR_N``, its temperature in K at
the N-th of its fitted samples, from 1; and ``residual_N``, the N-th of all residuals, predicted minus measured
temperature over its standard deviation. Dakota's ``least_sq_term_N`` is ``residual_N``.
"""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from bondline import BondlineError, Case, OptionError
from bondline._case import Array

#: Bits of an active set: value, gradient, Hessian.
VALUE, GRADIENT = 1, 2


def respond(case: Case, factors: Mapping[str, float], by: Sequence[str] = ()) -> dict[str, tuple[float, Array]]:
    """All results of a case at values of its factors.

    Parameters
    ----------
    case
        The case.
    factors
        Values of factors by name; the others are nominal.
    by
        Factors of the derivatives.

    Returns
    -------
    dict of tuple
        The value of each result by name, and its exact derivatives with respect to ``by``.

    Raises
    ------
    OptionError
        A name is no factor of the case.
    BondlineError
        The march failed at these values.
    """
    row = case.nominal
    for name, value in factors.items():
        row[case._place(name)] = value
    if by:
        marched_k, peaks = case._tangents([row], by)
        marched_k, peaks = marched_k[0], peaks[0]
    else:
        marched_k, peaks = case._march([row])
    temperatures_k, slopes_k = marched_k[0], marched_k[1:]
    if not np.isfinite(temperatures_k).all():
        raise BondlineError(f"the march of {case.id!r} failed at {dict(factors)}")
    found: dict[str, tuple[float, Array]] = {}
    for place, sensor in enumerate(case.sensors):
        # Of a derivative the peak is the derivative at the time of the member's peak.
        found[f"peak_{sensor}"] = float(peaks[0, place, 0]), peaks[1:, place, 0]
    for name, number, place, instant, measured_k, sigma_k in _samples(case):
        value_k, slope_k = float(temperatures_k[place, instant]), slopes_k[:, place, instant]
        found[name] = value_k, slope_k
        found[f"residual_{number}"] = (value_k - measured_k) / sigma_k, slope_k / sigma_k
    return found


def _samples(case: Case) -> list[tuple[str, int, int, int, float, float]]:
    """Fitted samples: name, number of all, sensor, instant, measured temperature and its standard deviation in K."""
    if not case.has_observations:
        return []
    columns = [column.tolist() for column in case._samples]
    counts = [0] * len(case.sensors)
    found = []
    for number, (sensor, instant, measured_k, sigma_k) in enumerate(zip(*columns, strict=True), 1):
        counts[sensor] += 1
        found.append((f"{case.sensors[sensor]}_{counts[sensor]}", number, sensor, instant, measured_k, sigma_k))
    return found


def drive(case: Case, parameters: str) -> str:
    """The text of the results for the text of a file of parameters.

    Raises
    ------
    ValueError
        The text has neither of the two forms, or it asks for a result that there is not.
    """
    lines = [line.split() for line in parameters.splitlines() if line.strip()]
    if lines and len(lines[0]) == 2 and lines[0][1] == "variables":
        return _dakota(case, lines)
    factors = _unique(_named(line) for line in lines)
    return "".join(f"{name} {value!r}\n" for name, (value, _) in respond(case, factors).items())


def _unique(pairs: Iterable[tuple[str, float]]) -> dict[str, float]:
    found: dict[str, float] = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"parameters: {name!r} is stated twice")
        found[name] = value
    return found


def _named(line: Sequence[str]) -> tuple[str, float]:
    try:
        name, value = line
        return name, float(value)
    except ValueError:
        raise ValueError(f"parameters: expected a name and a number, found {' '.join(line)!r}") from None


def _dakota(case: Case, lines: list[list[str]]) -> str:
    """The answer to a parameters file in the standard format of the Dakota manual, section *Parameters file format*."""
    sections: dict[str, list[list[str]]] = {}
    rest = iter(lines)
    for line in rest:
        try:
            count, name = int(line[0]), line[1]
            sections[name] = [next(rest) for _ in range(count)] if name != "eval_id" else []
        except (IndexError, ValueError, RuntimeError, StopIteration):
            text = " ".join(line)
            raise ValueError(f"parameters of Dakota: expected a number and a heading, found {text!r}") from None
    factors = _unique((name, float(value)) for value, name in sections["variables"])
    wanted = [(int(code), label.partition(":")[2]) for code, label in sections.get("functions", [])]
    names = list(factors)
    by = [_numbered(names, number) for number, _ in sections.get("derivative_variables", [])]
    if any(code & ~(VALUE | GRADIENT) for code, _ in wanted):
        raise ValueError("Dakota asks for Hessians; expected no_hessians: there are values and exact gradients")
    found = respond(case, factors, by if any(code & GRADIENT for code, _ in wanted) else ())
    values, gradients = "", ""
    for code, label in wanted:
        name = label.replace("least_sq_term_", "residual_")
        if name not in found:
            some = ", ".join(list(found)[:8])
            raise ValueError(f"Dakota asks for {label!r}; expected descriptors such as {some}")
        value, slopes = found[name]
        values += f"{value!r} {label}\n" if code & VALUE else ""
        gradients += f"[ {' '.join(repr(float(slope)) for slope in slopes)} ]\n" if code & GRADIENT else ""
    return values + gradients


def _numbered(names: Sequence[str], number: str) -> str:
    """The name of a variable by its number from 1."""
    if not (number.isdecimal() and 1 <= int(number) <= len(names)):
        raise ValueError(
            f"Dakota asks for derivatives by variable {number}; expected a number from 1 to {len(names)}"
        )
    return names[int(number) - 1]


def pest_files(case: Case, command: str) -> dict[str, str]:
    """The files of PEST++ that estimate the factors of a case from its samples, by name.

    Parameters
    ----------
    case
        The case.
    command
        The command that reads ``bondline.par`` and writes ``bondline.out``.
    """
    samples = _samples(case)
    if not samples or not case.estimated:
        raise OptionError(f"the case {case.id!r} has no factors to estimate or no observations")
    low, high = case.bounds
    nominal = dict(zip(case.factors, case.nominal.tolist(), strict=True))
    factors = [
        f"{name} none factor {nominal[name]!r} {least!r} {most!r} factors 1.0 0.0 1"
        for name, least, most in zip(case.estimated, low.tolist(), high.tolist(), strict=True)
    ]
    observed = [
        f"{name} {measured_k!r} {1.0 / sigma_k!r} {case.sensors[sensor]}"
        for name, _, sensor, _, measured_k, sigma_k in samples
    ]
    sensors = sorted({case.sensors[sensor] for _, _, sensor, _, _, _ in samples})
    lines = [
        "pcf",
        "* control data",
        "restart estimation",
        f"{len(factors)} {len(observed)} 1 0 {len(sensors)}",
        "1 1 double point 1 0 0",
        "5.0 2.0 0.3 0.01 10",
        "3.0 3.0 0.001",
        "0.1",
        "30 0.005 4 4 0.005 4",
        "1 1 1",
        "* parameter groups",
        "factors relative 0.001 0.0 switch 2.0 parabolic",
        "* parameter data",
        *factors,
        "* observation groups",
        *sensors,
        "* observation data",
        *observed,
        "* model command line",
        command,
        "* model input/output",
        "bondline.tpl bondline.par",
        "bondline.ins bondline.out",
    ]
    template = ["ptf ~", *(f"{name} ~{name:^24}~" for name in case.estimated)]
    instructions = ["pif ~", *(f"~{name} ~ !{name}!" for name, *_ in samples)]
    texts = {"bondline.pst": lines, "bondline.tpl": template, "bondline.ins": instructions}
    return {name: "\n".join(text) + "\n" for name, text in texts.items()}


def _write_script(folder: Path, words: Sequence[str]) -> str:
    """Write a script of one command into a folder, and return the command that runs it there. PEST++ splits its command
    at blanks and knows no quotes, so that a path with a blank must not be in it."""
    if os.name == "nt":
        (folder / "bondline.bat").write_text(f"@{subprocess.list2cmdline(words)}\r\n", encoding="utf-8")
        return "bondline.bat"
    script = folder / "bondline.sh"
    script.write_text(f"#!/bin/sh\nexec {shlex.join(words)}\n", encoding="utf-8")
    script.chmod(0o755)
    return "./bondline.sh"


def main(words: Sequence[str] | None = None) -> int:
    """Run the driver with these words of the command line, and return its exit code."""
    parser = argparse.ArgumentParser("python -m bondline.driver", description="A case for Dakota and PEST++.")
    parser.add_argument("--pest", metavar="FOLDER", type=Path, help="write the files of PEST++ into this folder")
    parser.add_argument("case", type=Path, help="case file, or folder with a case.toml")
    parser.add_argument("parameters", type=Path, nargs="?", help="file that is read")
    parser.add_argument("results", type=Path, nargs="?", help="file that is written")
    given = parser.parse_args(words)
    if given.pest is None and given.results is None:
        parser.error("expected CASE PARAMETERS RESULTS, or --pest FOLDER CASE")
    try:
        case = Case.load(given.case)
        if given.pest is not None:
            given.pest.mkdir(parents=True, exist_ok=True)
            words_of_run = [sys.executable, "-m", "bondline.driver", str(given.case.resolve())]
            command = _write_script(given.pest, [*words_of_run, "bondline.par", "bondline.out"])
            for name, text in pest_files(case, command).items():
                (given.pest / name).write_text(text, encoding="utf-8")
            return 0
        answer = drive(case, given.parameters.read_text(encoding="utf-8"))
    except (BondlineError, ValueError, OSError) as error:
        print(f"bondline.driver: {error}", file=sys.stderr)
        # Dakota takes it for a failed evaluation; PEST++ finds no number.
        if given.results is not None:
            given.results.write_text("FAIL\n", encoding="utf-8")
        return 1
    given.results.write_text(answer, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
