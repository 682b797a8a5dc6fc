"""Draw the figures of docs/theory: theory_figures.py PROGRAM. It needs NumPy and SciPy, and takes some minutes.

Convergence is that of tests/oracle/theory_march.py, which has the digits of the march; cost and comparisons are those
of PROGRAM and of the method of lines of tests/oracle.
"""

import csv
import json
import math
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "oracle"))

import numpy as np  # noqa: E402
from case_file import load  # noqa: E402
from solution import integrate  # noqa: E402
from tables import Schedule, Table  # noqa: E402
from theory_march import Face, Gas, Layup, March, Material, Reaction, State, write  # noqa: E402

IMAGES = ROOT / "docs" / "images" / "theory"
COLORS = ["#1f6f8b", "#c0392b", "#6b8e23", "#8e44ad"]


@dataclass
class Series:
    name: str
    x: list[float]
    y: list[float]
    color: str
    is_line: bool = True
    bars: list[float] | None = None
    is_dashed: bool = False


@dataclass
class Panel:
    title: str
    x_label: str
    y_label: str
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    series: list[Series]
    is_log: bool = True


def ticks(low: float, high: float, is_log: bool) -> list[float]:
    if is_log:
        decades = range(math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9) + 1)
        return [10.0**decade for decade in decades]
    step = 10.0 ** math.floor(math.log10((high - low) / 3.0))
    step *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if (high - low) / (step * factor) <= 6.0)
    return [step * i for i in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def draw(name: str, panels: list[Panel]) -> None:
    """Panels side by side."""
    width, height, left, right, top, bottom = 340, 330, 62, 22, 34, 86
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width * len(panels)} {height}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{width * len(panels)}" height="{height}" fill="white"/>',
    ]
    for number, panel in enumerate(panels):
        x0, x1, y0, y1 = width * number + left, width * (number + 1) - right, height - bottom, top

        def scaled(value: float, ends: tuple[float, float], pixels: tuple[float, float], is_log: bool) -> float:
            low, high = (math.log10(end) for end in ends) if is_log else ends
            at = math.log10(max(value, 1e-300)) if is_log else value
            return pixels[0] + (at - low) / (high - low) * (pixels[1] - pixels[0])

        def x(value: float) -> float:
            return scaled(value, panel.x_range, (x0, x1), panel.is_log)

        def y(value: float) -> float:
            return scaled(value, panel.y_range, (y0, y1), panel.is_log)

        for at in ticks(*panel.x_range, panel.is_log):
            parts.append(f'<line x1="{x(at):.1f}" y1="{y1}" x2="{x(at):.1f}" y2="{y0}" stroke="#e4e4e4"/>')
            parts.append(f'<text x="{x(at):.1f}" y="{y0 + 16}" text-anchor="middle">{at:g}</text>')
        for at in ticks(*panel.y_range, panel.is_log):
            parts.append(f'<line x1="{x0}" y1="{y(at):.1f}" x2="{x1}" y2="{y(at):.1f}" stroke="#e4e4e4"/>')
            parts.append(f'<text x="{x0 - 6}" y="{y(at) + 4:.1f}" text-anchor="end">{at:g}</text>')
        parts.append(f'<rect x="{x0}" y="{y1}" width="{x1 - x0}" height="{y0 - y1}" fill="none" stroke="#444"/>')
        parts.append(f'<text x="{(x0 + x1) / 2}" y="18" text-anchor="middle" font-weight="bold">{panel.title}</text>')
        parts.append(f'<text x="{(x0 + x1) / 2}" y="{y0 + 34}" text-anchor="middle">{panel.x_label}</text>')
        middle = (y0 + y1) / 2
        turn = f"rotate(-90 {width * number + 14} {middle})"
        place_y = f'x="{width * number + 14}" y="{middle}" text-anchor="middle" transform="{turn}"'
        parts.append(f"<text {place_y}>{panel.y_label}</text>")
        for place, series in enumerate(panel.series):
            points = [
                (x(a), y(b), bar, b)
                for a, b, bar in zip(series.x, series.y, series.bars or [0.0] * len(series.x))
                if panel.x_range[0] <= a <= panel.x_range[1] and panel.y_range[0] <= b <= panel.y_range[1]
            ]
            if series.is_line:
                path = " ".join(f"{a:.1f},{b:.1f}" for a, b, _, _ in points)
                dash = ' stroke-dasharray="4 3"' if series.is_dashed else ""
                style = f'fill="none" stroke="{series.color}" stroke-width="1.6"{dash}'
                parts.append(f'<polyline points="{path}" {style}/>')
            for a, b, bar, value in points:
                if bar > 0.0:
                    ends = (max(value - bar, panel.y_range[0]), min(value + bar, panel.y_range[1]))
                    low, high = (y(end) for end in ends)
                    parts.append(
                        f'<line x1="{a:.1f}" y1="{low:.1f}" x2="{a:.1f}" y2="{high:.1f}" stroke="{series.color}"/>'
                    )
                if not series.is_dashed and (not series.is_line or panel.is_log):
                    parts.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="2.6" fill="{series.color}"/>')
            key_x, key_y = x0 + (x1 - x0) / 2 * (place % 2), height - 34 + 16 * (place // 2)
            dash = ' stroke-dasharray="4 3"' if series.is_dashed else ""
            parts.append(
                f'<line x1="{key_x}" y1="{key_y}" x2="{key_x + 18}" y2="{key_y}" stroke="{series.color}" '
                f'stroke-width="2"{dash}/><text x="{key_x + 23}" y="{key_y + 4}" font-size="11">{series.name}</text>'
            )
    IMAGES.mkdir(parents=True, exist_ok=True)
    (IMAGES / f"{name}.svg").write_text("\n".join([*parts, "</svg>"]) + "\n")


def line(at_300_k: float, at_1800_k: float) -> Table:
    beyond = (at_1800_k - at_300_k) / 15.0
    return Table((200.0, 1900.0), (at_300_k - beyond, at_1800_k + beyond))


VIRGIN = State(line(1000.0, 1800.0), line(0.08, 0.3), 0.8)
CHAR = State(line(900.0, 1900.0), line(0.1, 0.5), 0.9)
SMOOTH = Material(200.0, (VIRGIN,))
KINKED = Material(
    200.0,
    (State(Table((200.0, 500.0, 900.0, 1900.0), (900.0, 900.0, 1500.0, 1500.0)),
           Table((200.0, 450.0, 460.0, 1900.0), (0.08, 0.08, 0.16, 0.16)), 0.8),),
)  # fmt: skip
CHARRING = Material(200.0, (VIRGIN, CHAR), (Reaction(0.1, 3e4, 7e4, 1.0, 4e5), Reaction(0.2, 1e5, 9e4, 2.0, 8e5)))
FELT = Layup(
    plies=((CHARRING, 0.005),), contacts=(), sensors=(0.0, 0.001, 0.0025, 0.005), duration=30.0, initial=300.0,
    hot=Face(flux=Schedule((0.0, 30.0), (0.0, 60e3)), radiates=True), gas=Gas(Table((200.0, 1900.0), (0.0, 3.4e6))),
    flow="quasi-steady", cells=20, first_step=0.02, step_growth=0.2, max_step=0.2, interval=1.0,
)  # fmt: skip


def convergence() -> None:
    """Errors over successive halvings of cells and steps together."""
    panels = []
    halvings, first_steps = 7, 64
    for title, material in (("smooth", SMOOTH), ("kinks in k and c", KINKED), ("charring", CHARRING)):
        layup = replace(FELT, plies=((material, 0.005),), flow="unhindered" if material is not CHARRING else FELT.flow)
        traces = []
        for halving in range(halvings):
            march = March(layup, halving)
            steps = first_steps * 2**halving
            # After the corner at the start time rises as the fourth power of the step number.
            march.times = layup.duration * (np.arange(steps + 1) / steps) ** 4
            march.instants = march.times
            records = march.run().records[:: 2**halving]
            traces.append(np.array([record.temperatures for record in records])[2:])
        finer = [fine + (fine - coarse) / 3.0 for coarse, fine in zip(traces, traces[1:])]
        plain = [float(np.max(np.abs(trace - finer[-1]))) for trace in traces[1:-1]]
        extrapolated = [float(np.max(np.abs(trace - finer[-1]))) for trace in finer[:-1]]
        counts = [20.0 * 2**halving for halving in range(1, halvings - 1)]
        orders = [
            Series(f"order {order}", [30.0, 900.0], [at * (30.0 / x) ** order for x in (30.0, 900.0)], color,
                   is_dashed=True)
            for order, at, color in ((2, 0.3, "#777777"), (3, 0.3, "#bbbbbb"))
        ]  # fmt: skip
        series = [
            Series("plain", counts, plain, COLORS[0]),
            Series("extrapolated", counts, extrapolated, COLORS[1]),
            *orders,
        ]
        panels.append(Panel(title, "cells", "largest error, K", (20.0, 2000.0), (1e-5, 10.0), series))
    draw("convergence", panels)


def predict(program: str, folder: Path, out: Path) -> tuple[dict, dict[str, list[float]]]:
    command = [program, "predict", str(folder), "--precision", "f64", "--backend", "cpu", "--out", str(out), "--force",
               "-q"]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True)
    with open(out / "traces.csv") as file:
        heading, *rows = list(csv.reader(file))
    columns = {name: [float(row[i] or "nan") for row in rows] for i, name in enumerate(heading)}
    return json.loads((out / "summary.json").read_text()), columns


def cost(program: str) -> None:
    """Error over the number of solved rows: each step solves two systems at both resolutions; BDF at least one."""
    panels = []
    for title, material in (("smooth", SMOOTH), ("kinks in k and c", KINKED), ("charring", CHARRING)):
        flow = "unhindered" if material is not CHARRING else FELT.flow
        layup = replace(FELT, plies=((material, 0.005),), flow=flow)
        with tempfile.TemporaryDirectory() as scratch:
            folder, out = Path(scratch) / "case", Path(scratch) / "out"
            write(replace(layup, cells=1024, first_step=1e-4, step_growth=0.004, max_step=0.004), folder)
            text = (folder / "case.toml").read_text()
            if not material.reactions:
                text = text.replace("decomposition = true\n", "").replace("decomposition = false\n", "")
                text = text[: text.index("[gas]")] + text[text.index("[resolution]") :]
            (folder / "case.toml").write_text(text)

            def readings(columns: dict[str, list[float]]) -> np.ndarray:
                return np.array([columns[f"S{i}_k"] for i in range(len(layup.sensors))])[:, 1:]

            truth = readings(predict(program, folder, out)[1])
            claimed, true, work = [], [], []
            for tolerance in (1.0, 0.3, 0.1, 0.03, 0.01, 0.003):
                adapted = text[: text.index("[resolution]")] + f'[resolution]\ntolerance = "{tolerance} K"\n'
                (folder / "case.toml").write_text(adapted)
                summary, columns = predict(program, folder, out)
                claimed.append(summary["discretisation_error"]["nominal_k"])
                true.append(float(np.max(np.abs(readings(columns) - truth))))
                work.append(2.0 * summary["cells"] * summary["steps"] * 1.25)
            case = load(folder)
            instants = np.arange(0.0, layup.duration + 0.5)
            errors, rows = [], []
            tolerance, refinement = 0.3, 0.4
            for _ in range(6):
                found = integrate(case, refinement, tolerance, instants, 1e9)
                traces = np.array([found.traces[f"S{i}"] for i in range(len(layup.sensors))])[:, 1:]
                errors.append(float(np.max(np.abs(traces - truth))))
                rows.append(float(found.nodes * found.steps))
                tolerance, refinement = tolerance / 4.0, refinement * 2.0
        series = [
            Series("bondline, true", work, true, COLORS[0]),
            Series("bondline, reported", work, claimed, COLORS[0], is_dashed=True),
            Series("method of lines, BDF", rows, errors, COLORS[1]),
        ]
        panels.append(Panel(title, "cells × steps × solutions", "largest error, K", (1e3, 1e7), (1e-4, 10.0), series))
    draw("cost", panels)


def table(path: Path) -> tuple[list[str], list[list[str]]]:
    with open(path) as file:
        heading, *rows = list(csv.reader(line for line in file if not line.startswith("#")))
    return heading, rows


def comparison(program: str) -> None:
    """A measurement with its error bars, and other codes."""
    with tempfile.TemporaryDirectory() as scratch:
        _, board = predict(program, ROOT / "cases" / "kaowool", Path(scratch) / "kaowool")
        summary, tacot = predict(program, ROOT / "cases" / "tacot-held", Path(scratch) / "tacot")
    _, measured = table(ROOT / "cases" / "kaowool" / "measured.csv")
    series = []
    for place, name in enumerate(("TC1", "TC2")):
        rows = measured[::6]
        times = [float(row[0]) for row in rows]
        own = np.interp(times, board["time_s"], board[f"{name}_k"])
        differences = [float(value) - float(row[1 + 2 * place]) for value, row in zip(own, rows)]
        bars = [2.0 * float(row[2 + 2 * place]) for row in rows]
        series.append(Series(f"{name} (2σ)", times, differences, COLORS[place], False, bars))
    title, label = "Kaowool under 50 kW/m²", "predicted less measured, K"
    panels = [Panel(title, "time, s", label, (0.0, 1250.0), (-20.0, 80.0), series, False)]
    heading, rows = table(ROOT / "data" / "verification" / "tacot_held.csv")
    depths = [float(depth) for depth in heading[2:]]
    at_60_s = {row[0]: row[2:] for row in rows if row[1] == "60"}
    converged = [float(value) for value in at_60_s["converged"]]
    instant = tacot["time_s"].index(60.0)
    own = [tacot[f"d{1e3 * depth:g}mm_k"][instant] for depth in depths[:-1]]
    error = summary["discretisation_error"]["nominal_k"]
    series = [
        Series("bondline", [1e3 * depth for depth in depths[:-1]],
               [value - exact for value, exact in zip(own, converged)], COLORS[0], False, [error] * len(own)),
    ]  # fmt: skip
    for code, color in (("PATO", COLORS[1]), ("FIAT", COLORS[2])):
        pairs = [(d, float(v) - c) for d, v, c in zip(depths, at_60_s[code], converged) if v]
        series.append(Series(code, [1e3 * d for d, _ in pairs[:-1]], [v for _, v in pairs[:-1]], color, False))
    title = "TACOT held at 1644 K, 60 s"
    label = "less the converged method of lines, K"
    panels.append(Panel(title, "depth, mm", label, (0.0, 26.0), (-4.0, 4.0), series, False))
    draw("comparison", panels)


def main() -> None:
    convergence()
    if len(sys.argv) > 1:
        cost(sys.argv[1])
        comparison(sys.argv[1])


main()
