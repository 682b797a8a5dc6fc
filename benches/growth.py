#!/usr/bin/env python3
"""Growth of the time of a command with the size of its problem: one table row a size, one exponent a quantity.

    benches/growth.py BONDLINE [QUANTITY…]      all quantities without a name; a table in Markdown

Each quantity grows alone; the others stay. The time is the wall time of the whole command, the shortest of three runs
below two seconds. The exponent is the slope of a line through the logarithms, over the sizes that take more than twice
the time of the smallest: below, what does not grow takes most of the time.
"""

import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

DURATION_S = 100
#: Time limit of one run, s: larger sizes are left out.
LONGEST_S = 600


def case(plies=4, cells=64, sensors=2, factors=4, steps=200, rows=3):
    """Files of a case: plies in turn of two materials, sensors at equal depths, factors on conductivities."""
    thickness_mm = 20.0
    lines = [
        'initial_temperature = "300 K"',
        f'duration = "{DURATION_S} s"',
        f"[resolution]\ncells = {cells}\nfirst_step = \"{DURATION_S / steps!r} s\"",
        f'max_step = "{DURATION_S / steps!r} s"\nstep_growth = 1\noutput_interval = "4 s"',
        '[hot_face]\nkind = "heated"\nflux = { file = "flux.csv", outside = "hold" }',
        '[back_face]\nkind = "insulated"',
    ]
    for ply in range(plies):
        material = ("saffil-96", "nextel440-bf20")[ply % 2]
        lines.append(f'[[ply]]\nname = "P{ply}"\nmaterial = "{material}"\nthickness = "{thickness_mm / plies!r} mm"')
    for sensor in range(sensors):
        lines.append(f'[[sensor]]\nname = "S{sensor}"\ndepth = "{thickness_mm * (sensor + 0.5) / sensors!r} mm"')
    for factor in range(factors):
        lines.append(f'[[factor]]\nname = "f{factor}"\ngroup = "P{factor}"\nproperty = "conductivity"')
        lines.append("small = [0.9, 1.1]\nlarge = [0.8, 1.2]")
    shares = [row / (rows - 1) for row in range(rows)]
    fluxes = (f"{DURATION_S * share!r},{share * (3 + math.sin(20 * share))!r}" for share in shares)
    return {"case.toml": "\n".join(lines) + "\n", "flux.csv": "\n".join(["time_s,flux_w_cm2", *fluxes]) + "\n"}


#: Quantity: sizes; the files of the case of a size; the arguments of the command.
QUANTITIES = {
    "members": (
        [100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000],
        lambda n: case(plies=1, cells=16, sensors=1, factors=1, steps=20),
        lambda n: ["uncertainty", "-n", str(n)],
    ),
    "cells": (
        [50, 100, 200, 400, 800, 1024],
        lambda n: case(cells=n),
        lambda n: ["uncertainty", "-n", "2000"],
    ),
    "steps": (
        [100, 400, 1_600, 6_400, 25_600],
        lambda n: case(steps=n),
        lambda n: ["uncertainty", "-n", "500"],
    ),
    "plies": (
        [4, 16, 64, 128, 256],
        lambda n: case(plies=n, cells=4 * n),
        lambda n: ["uncertainty", "-n", "500"],
    ),
    "sensors": (
        [2, 8, 32, 64, 128],
        lambda n: case(sensors=n),
        lambda n: ["uncertainty", "-n", "1000"],
    ),
    "factors": (
        [1, 4, 16, 64, 100],
        lambda n: case(plies=100, cells=400, factors=n),
        lambda n: ["sensitivity"],
    ),
    "rows of a schedule": (
        [10, 1_000, 10_000, 100_000, 1_000_000],
        lambda n: case(rows=n),
        lambda n: ["predict"],
    ),
}


def seconds(bondline, folder, words):
    """Wall time of a command, the shortest of several runs."""
    command = [bondline, words[0], str(folder / "case.toml"), *words[1:]]
    command += ["--backend", "cpu", "--quiet", "--force", "--out", str(folder / "report")]
    shortest = math.inf
    for _ in range(3):
        began = time.perf_counter()
        ran = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S)
        took = time.perf_counter() - began
        if ran.returncode:
            sys.exit(f"{' '.join(command)}: exit code {ran.returncode}\n{ran.stderr}")
        shortest = min(shortest, took)
        if took > 2:
            break
    return shortest


def exponent(sizes, times):
    """Slope of the logarithms over the sizes that take more than twice the time of the smallest."""
    rows = [(math.log(n), math.log(t)) for n, t in zip(sizes, times) if t > 2 * times[0]]
    if len(rows) < 2:
        return None
    mean_n, mean_t = (sum(column) / len(rows) for column in zip(*rows))
    return sum((n - mean_n) * (t - mean_t) for n, t in rows) / sum((n - mean_n) ** 2 for n, _ in rows)


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    bondline, chosen = sys.argv[1], sys.argv[2:] or list(QUANTITIES)
    for name in chosen:
        if name not in QUANTITIES:
            sys.exit(f"unknown quantity {name!r}: expected one of {', '.join(QUANTITIES)}")
    print("| quantity | command | s at each size | exponent |\n|---|---|---|---:|")
    for name in chosen:
        sizes, files, words = QUANTITIES[name]
        times = []
        for size in sizes:
            with tempfile.TemporaryDirectory() as folder:
                for file, text in files(size).items():
                    (Path(folder) / file).write_text(text)
                try:
                    times.append(seconds(bondline, Path(folder), words(size)))
                except subprocess.TimeoutExpired:
                    break
        slope = exponent(sizes, times)
        grown = ", ".join(f"{size:,}: {took:.3g}" for size, took in zip(sizes, times))
        shown = "constant" if slope is None else f"{slope:.2f}"
        print(f"| {name} | `{' '.join(words('N'))}` | {grown} | {shown} |", flush=True)


if __name__ == "__main__":
    main()
