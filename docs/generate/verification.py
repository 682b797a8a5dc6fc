"""Write docs/verification.md, its tables and its plot: verification.py PROGRAM, or verification.py FILE.json."""

import csv
import json
import math
import re
import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).parent.parent
GROUPS = {
    "exact": (
        "Exact solutions",
        "The march against closed forms and series: conduction with constant and with temperature-dependent\n"
        "properties, contacts, radiation, a holder, reactions, Darcy flow. Cells and steps are refined until the\n"
        "tolerance is met, so that a wrong term cannot hide behind the discretisation error.",
    ),
    "orders": (
        "Observed orders of accuracy",
        "Errors at successively halved cells and steps. The scheme is of second order; an observed order below 1.9\n"
        "fails.",
    ),
    "codes": (
        "Other codes and published computations",
        "Published results of other programs. The tolerance is the accuracy of the reference.",
    ),
    "adapted": (
        "What an analyst gets",
        "The same problems with the cells and steps that the adaptation chooses, extrapolated, and random cases whose\n"
        "reported error is compared with the true one.",
    ),
    "balance": (
        "Balances of heat and mass",
        "Heat in, less heat out, less heat stored; the same for mass where gas moves.",
    ),
    "fit": (
        "Least squares",
        "The minimiser against certified answers: the 27 nonlinear sets of NIST's Statistical Reference Datasets from\n"
        "both starts, and the test problems of Moré, Garbow and Hillstrom (1981).",
    ),
    "coverage": (
        "Coverage of intervals",
        "How often the 95 % intervals of each kind contain the truth, counted over seeds under default settings; n is\n"
        "the number of members or samples. A row of `history, knots` counts the share of the knots of each history\n"
        "whose interval contains the heating. A row of `design` counts the estimates within 1.96 predicted standard\n"
        "errors of the truth. Posteriors are sampled with 32 walkers of 250 iterations, sizings and trades with 200\n"
        "members.\n"
        "Coverage of estimates under noise of other kinds, and of other histories, is in [](theory/inference.md).",
    ),
    "cross-backend": (
        "CPU against GPU",
        "Every backend against the CPU in double precision. On a device that rounds as IEEE 754 says, GPU and CPU\n"
        "results of the same precision are bit-identical (src/march/gpu/tests, tests/inside/parity.rs).",
    ),
}


def rows_of(source: str) -> list[dict]:
    if source.endswith(".json"):
        return json.loads(Path(source).read_text())["rows"]
    done = subprocess.run([source, "verify", "--json"], capture_output=True, text=True, check=False)
    return json.loads(done.stdout)["rows"]


def short(value: float) -> str:
    return f"{value:.2g}"


def unit_of(row: dict) -> str:
    words = row["unit"].split(" ")
    try:
        return " ".join([words[0], f"{float(words[1]):.4g}", *words[2:]])
    except (IndexError, ValueError):
        return row["unit"]


def plot(rows: list[dict]) -> str:
    """A row of dots a group: difference over tolerance, logarithmic; a dot right of the line would fail."""
    left, right, low, step = 130, 700, -12.0, 34
    height = step * len(GROUPS) + 60

    def x(ratio: float) -> float:
        decade = max(low, math.log10(ratio)) if ratio > 0 else low
        return left + (decade - low) / (1 - low) * (right - left)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 {height}" font-family="sans-serif" font-size="13">',
        f'<rect width="720" height="{height}" fill="white"/>',
    ]
    for decade in range(int(low), 2, 2):
        at = x(10.0**decade)
        parts.append(f'<line x1="{at:.1f}" y1="20" x2="{at:.1f}" y2="{height - 40}" stroke="#ddd"/>')
        name = "1" if decade == 0 else f"1e{decade}"
        parts.append(f'<text x="{at:.1f}" y="{height - 24}" text-anchor="middle">{name}</text>')
    for place, group in enumerate(GROUPS):
        y = 36 + step * place
        parts.append(f'<text x="{left - 12}" y="{y + 4}" text-anchor="end">{group}</text>')
        for number, row in enumerate(r for r in rows if r["group"] == group):
            at, shift = x(abs(row["difference"]) / row["tolerance"]), (number * 7) % 17 - 8
            color = "#1f6f8b" if row["pass"] else "#c0392b"
            parts.append(f'<circle cx="{at:.1f}" cy="{y + shift}" r="2.6" fill="{color}" fill-opacity="0.6"/>')
    limit = x(1)
    parts.append(f'<line x1="{limit:.1f}" y1="20" x2="{limit:.1f}" y2="{height - 40}" stroke="#c0392b"/>')
    parts.append(f'<text x="{(left + right) / 2}" y="{height - 6}" text-anchor="middle">difference / tolerance</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def coverage_plot(rows: list[dict]) -> str:
    """A line a kind of interval: the share counted, with its 95 % interval by Wilson, beside the stated 95 %."""
    left, right, low, high, step = 330, 700, 84.0, 100.0, 24
    height = step * len(rows) + 62

    def x(percent: float) -> float:
        return left + (max(percent, low) - low) / (high - low) * (right - left)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 {height}" font-family="sans-serif" font-size="13">',
        f'<rect width="720" height="{height}" fill="white"/>',
    ]
    for percent in range(int(low), int(high) + 1, 2):
        parts.append(f'<line x1="{x(percent):.1f}" y1="16" x2="{x(percent):.1f}" y2="{height - 40}" stroke="#ddd"/>')
        parts.append(f'<text x="{x(percent):.1f}" y="{height - 24}" text-anchor="middle">{percent}</text>')
    parts.append(f'<line x1="{x(95):.1f}" y1="16" x2="{x(95):.1f}" y2="{height - 40}" stroke="#c0392b"/>')
    for place, row in enumerate(rows):
        found = re.match(r"([\d.]+) % of (\d+) \w+, (.*)", row["quantity"])
        if found is None:
            sys.exit(f"a row of coverage without a share: {row['quantity']}")
        share, total, y = float(found[1]) / 100.0, int(found[2]), 28 + step * place
        centre = (share + 1.92 / total) / (1.0 + 3.84 / total)
        reach = 1.96 / (1.0 + 3.84 / total) * math.sqrt(share * (1.0 - share) / total + 0.96 / total**2)
        ends = [x(100.0 * (centre - reach)), x(100.0 * (centre + reach))]
        color = "#1f6f8b" if row["pass"] else "#c0392b"
        name = row["case"]
        if sum(other["case"] == name for other in rows) > 1:
            base = name.split(", n = ")[0]
            sizes = {other["case"] for other in rows if other["case"].split(", n = ")[0] == base}
            name = f"{base if len(sizes) == 1 else name}: {found[3].split(', ')[-1]}"
        parts.append(f'<text x="{left - 12}" y="{y + 4}" text-anchor="end">{short_name(name)}</text>')
        parts.append(f'<line x1="{ends[0]:.1f}" y1="{y}" x2="{ends[1]:.1f}" y2="{y}" stroke="{color}"/>')
        parts.append(f'<circle cx="{x(100.0 * share):.1f}" cy="{y}" r="3.5" fill="{color}"/>')
    label = "intervals that contain the truth, %"
    parts.append(f'<text x="{(left + right) / 2}" y="{height - 6}" text-anchor="middle">{label}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def short_name(name: str) -> str:
    """A name that fits beside the plot."""
    for words, fewer in [
        ("noise that decorrelates over", "noise over"),
        (" under white noise", ", white noise"),
        (" under correlated noise", ", correlated noise"),
        ("history, knots: ", "history: "),
    ]:
        name = name.replace(words, fewer)
    return name if len(name) <= 50 else f"{name[:49]}…"


def main() -> None:
    rows = rows_of(sys.argv[1])
    folder = DOCS / "verification"
    folder.mkdir(exist_ok=True)
    (folder / "ratios.svg").write_text(plot(rows))
    (folder / "coverage.svg").write_text(coverage_plot([row for row in rows if row["group"] == "coverage"]))
    passed = sum(row["pass"] for row in rows)
    page = f"""# Verification and validation

<!-- Written by docs/generate/verification.py from `bondline verify --json`: scripts/docs.sh --renew. -->

*Verification* asks whether the equations are solved correctly, *validation* whether they are the right equations.
`bondline verify` prints the evidence for the first, one row per quantity, each with a tolerance and the reason for it;
`bondline verify --group orders` prints one group. The tables below are its output: {passed} of {len(rows)} rows pass. A
tolerance that is more than ten times the difference says why it is that wide ("wide: …").

![Difference over tolerance of every row, by group](verification/ratios.svg)

## Validation

The cases `kaowool` and `kaowool-tc` hold a measurement by NIST of an insulating ceramic-fibre board, with error bars.
Fitted to the thermocouple at 5.72 mm alone, the predictive band of `kaowool` holds all that was measured at 11.44 mm.
The flight layups cannot be validated here: their measured traces and material tables are not public, and the
observations of the LCAT cases are synthetic. Predictions for real hardware need its own tables and measurements.

## A second program

`tests/oracle` computes the folder of a case once more, in Python and SciPy: by the method of lines in enthalpy, with
tables and schedules as the files state them, and without any code of bondline. It states an error of each of its values
and is itself checked against exact solutions. Random cases with latent heat, foils of 0.1 µm beside felts of 100 mm,
contacts from 0.1 to 10⁹ W/m²/K, varying pressure, pulses of a millisecond and reactions are computed by both; what
`predict` reports in f64 and f32 must be within its own error. Of 500 cases the oracle resolves 447. 99.8 % of 6,836
claims were at least the error, and none was below half of it. In three cases a temperature was 2 to 18 % beyond the
tolerance with a claim just below it, thus without a warning. In 15 cases `predict` ends with exit code 1 and the
reason, mostly that no affordable cells and steps reach the tolerance, and 6 take more than five minutes.
Decomposing plies whose conductivity jumps may fail to march, which is said.
`tests/oracle/test_random_cases.py` would list under `KNOWN` kinds of input that the 30 cases of the suite meet and for
which the claims do not hold.
"""
    for group, (title, text) in GROUPS.items():
        of = [row for row in rows if row["group"] == group]
        name = f"{group}.csv"
        with (folder / name).open("w", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["case", "quantity", "difference", "tolerance", "unit", "reference", "tolerance from"])
            for row in of:
                # Threads and vector instructions are those of the machine that made the table.
                quantity = re.sub(r", \d+ threads, [\w-]+", "", row["quantity"])
                values = [row["case"], quantity, short(row["difference"]), short(row["tolerance"])]
                table.writerow([*values, unit_of(row), row["reference"], row["source_of_tolerance"]])
        count = f"{sum(row['pass'] for row in of)} of {len(of)} rows pass."
        if group == "coverage":
            name_of_figure = "Coverage of every kind of printed interval under default settings"
            count += f"\n\n![{name_of_figure}](verification/coverage.svg)"
        table = f"```{{csv-table}}\n:file: verification/{name}\n:header-rows: 1\n```\n"
        page += f"\n## {title}\n\n{text}\n{count}\n\n{table}"
    (DOCS / "verification.md").write_text(page)
    if passed < len(rows):
        failed = "".join(f"  {row['group']}: {row['case']}, {row['quantity']}\n" for row in rows if not row["pass"])
        sys.exit(f"{len(rows) - passed} of {len(rows)} rows fail:\n{failed}")


main()
