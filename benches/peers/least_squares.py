"""MINPACK and SciPy's trust-region reflective method on the problems of `cargo bench --bench least_squares`.

    python3 -m venv venv && venv/bin/pip install -r benches/peers/requirements.txt
    venv/bin/python benches/peers/least_squares.py > peers.json

Prints one JSON object per run, in the form of the bench. Residual evaluations are counted where they are computed, so
columns of a finite-difference Jacobian count like trial points. The problems are typed a second time here on purpose.
"""

import csv
import json
import pathlib
import sys
import warnings

import numpy as np
import scipy
from scipy.optimize import least_squares, leastsq

DATA = pathlib.Path(__file__).parents[2] / "data" / "verification"
FTOL, XTOL, GTOL = 1e-12, 1e-10, 1e-12
# Maximum number of trial points.
MAX_TRIALS = 2000


def table(name):
    with open(DATA / name, encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def column(rows, series, name):
    return np.array([float(row[name]) for row in rows if row["series"] == series and row[name]])


def exponentials(b, x, _):
    return b[0] * np.exp(-b[1] * x) + b[2] * np.exp(-b[3] * x) + b[4] * np.exp(-b[5] * x)


def bells(b, x, _):
    bell = lambda h, m, w: h * np.exp(-((x - m) ** 2) / w**2)
    return b[0] * np.exp(-b[1] * x) + bell(b[2], b[3], b[4]) + bell(b[5], b[6], b[7])


def chwirut(b, x, _):
    return np.exp(-b[0] * x) / (b[1] + b[2] * x)


def cubics(b, x, _):
    return (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3)


def seasons(b, x, _):
    wave = lambda period, c, s: c * np.cos(2 * np.pi * x / period) + s * np.sin(2 * np.pi * x / period)
    return b[0] + wave(12.0, b[1], b[2]) + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8])


def arctan(z):
    return np.arctan(z.real) + (1j * z.imag / (1 + z.real**2) if np.iscomplexobj(z) else 0.0)


NIST = {
    "Misra1a": lambda b, x, _: b[0] * (1 - np.exp(-b[1] * x)),
    "Chwirut2": chwirut,
    "Chwirut1": chwirut,
    "Lanczos3": exponentials,
    "Gauss1": bells,
    "Gauss2": bells,
    "DanWood": lambda b, x, _: b[0] * x ** b[1],
    "Misra1b": lambda b, x, _: b[0] * (1 - (1 + b[1] * x / 2) ** (-2)),
    "Kirby2": lambda b, x, _: (b[0] + b[1] * x + b[2] * x**2) / (1 + b[3] * x + b[4] * x**2),
    "Hahn1": cubics,
    "Nelson": lambda b, x, x2: b[0] - b[1] * x * np.exp(-b[2] * x2),
    "MGH17": lambda b, x, _: b[0] + b[1] * np.exp(-x * b[3]) + b[2] * np.exp(-x * b[4]),
    "Lanczos1": exponentials,
    "Lanczos2": exponentials,
    "Gauss3": bells,
    "Misra1c": lambda b, x, _: b[0] * (1 - (1 + 2 * b[1] * x) ** (-0.5)),
    "Misra1d": lambda b, x, _: b[0] * b[1] * x / (1 + b[1] * x),
    "Roszman1": lambda b, x, _: b[0] - b[1] * x - arctan(b[2] / (x - b[3])) / np.pi,
    "ENSO": seasons,
    "MGH09": lambda b, x, _: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "Thurber": cubics,
    "BoxBOD": lambda b, x, _: b[0] * (1 - np.exp(-b[1] * x)),
    "Rat42": lambda b, x, _: b[0] / (1 + np.exp(b[1] - b[2] * x)),
    "MGH10": lambda b, x, _: b[0] * np.exp(b[1] / (x + b[2])),
    "Eckerle4": lambda b, x, _: b[0] / b[1] * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Rat43": lambda b, x, _: b[0] / (1 + np.exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Bennett5": lambda b, x, _: b[0] * (b[1] + x) ** (-1 / b[2]),
}


def nist():
    certified, observed = table("nist_strd_certified.csv"), table("nist_strd_observations.csv")
    for name, law in NIST.items():
        x, y, x2 = (column(observed, name, which) for which in ("x", "y", "x2"))
        y = np.log(y) if name == "Nelson" else y
        residuals = lambda b, law=law, x=x, y=y, x2=x2: law(b, x, x2) - y
        for start in ("far", "near"):
            yield name, start, column(certified, name, start), residuals


def classics():
    data = table("more_garbow_hillstrom.csv")
    stack = lambda *parts: np.concatenate([np.atleast_1d(part) for part in parts])

    def linear_full(m):
        return lambda x: stack(x, np.zeros(m - 5)) - 2 / m * np.sum(x) - 1

    def linear_rank_one(m):
        return lambda x: np.arange(1, m + 1) * np.sum(np.arange(1, 6) * x) - 1

    def linear_hollow(m):
        rows = np.arange(m) * (np.arange(m) < m - 1)
        return lambda x: rows * np.sum(np.arange(2, 5) * x[1:4]) - 1

    def helical(x):
        if x[0].real == 0:
            turn = -0.25 if x[1].real < 0 else 0.25
        else:
            turn = arctan(x[1] / x[0]) / (2 * np.pi) + (0.5 if x[0].real < 0 else 0)
        return stack(10 * (x[2] - 10 * turn), 10 * (np.sqrt(x[0] ** 2 + x[1] ** 2) - 1), x[2])

    def bard(x):
        u, y = np.arange(1, 16), column(data, "Bard", "y")
        return y - (x[0] + u / ((16 - u) * x[1] + np.minimum(u, 16 - u) * x[2]))

    def kowalik_osborne(x):
        y, u = column(data, "Kowalik and Osborne", "y"), column(data, "Kowalik and Osborne", "u")
        return y - x[0] * (u**2 + u * x[1]) / (u**2 + u * x[2] + x[3])

    def meyer(x):
        return x[0] * np.exp(x[1] / (45 + 5 * np.arange(1, 17) + x[2])) - column(data, "Meyer", "y")

    def watson(x):
        t, j = (np.arange(1, 30) / 29)[:, None], np.arange(len(x))
        value = np.sum(x * t**j, axis=1)
        slope = np.sum(j[1:] * x[1:] * t ** (j[1:] - 1), axis=1)
        return stack(slope - value**2 - 1, x[0], x[1] - x[0] ** 2 - 1)

    def box(x):
        t = np.arange(1, 11) / 10
        return np.exp(-t * x[0]) - np.exp(-t * x[1]) - x[2] * (np.exp(-t) - np.exp(-10 * t))

    def jennrich_sampson(x):
        i = np.arange(1, 11)
        return 2 + 2 * i - (np.exp(i * x[0]) + np.exp(i * x[1]))

    def brown_dennis(x):
        t = np.arange(1, 21) / 5
        return (x[0] + t * x[1] - np.exp(t)) ** 2 + (x[2] + x[3] * np.sin(t) - np.cos(t)) ** 2

    def chebyquad(m):
        def residuals(x):
            before, now, found = np.ones_like(x), 2 * x - 1, []
            for i in range(1, m + 1):
                found.append(np.mean(now) + (1 / (i * i - 1) if i % 2 == 0 else 0))
                before, now = now, 2 * (2 * x - 1) * now - before
            return np.array(found)

        return residuals

    def almost_linear(x):
        return stack(x[:-1] + np.sum(x) - (len(x) + 1), np.prod(x) - 1)

    def osborne_1(x):
        t = 10 * np.arange(33)
        return column(data, "Osborne 1", "y") - (x[0] + x[1] * np.exp(-t * x[3]) + x[2] * np.exp(-t * x[4]))

    def osborne_2(x):
        t = np.arange(65) / 10
        bell = lambda j: x[j] * np.exp(-((t - x[j + 7]) ** 2) * x[j + 4])
        return column(data, "Osborne 2", "y") - (x[0] * np.exp(-t * x[4]) + bell(1) + bell(2) + bell(3))

    found = []
    for m in (10, 50):
        found.append((f"linear, full rank, {m} residuals", np.ones(5), linear_full(m)))
    for m in (10, 50):
        found.append((f"linear, rank one, {m} residuals", np.ones(5), linear_rank_one(m)))
    for m in (10, 50):
        found.append((f"linear, rank one, columns and rows of zeros, {m} residuals", np.ones(5), linear_hollow(m)))
    found += [
        ("Rosenbrock", [-1.2, 1], lambda x: stack(10 * (x[1] - x[0] ** 2), 1 - x[0])),
        ("helical valley", [-1, 0, 0], helical),
        (
            "Powell, singular",
            [3, -1, 0, 1],
            lambda x: stack(
                x[0] + 10 * x[1], 5**0.5 * (x[2] - x[3]), (x[1] - 2 * x[2]) ** 2, 10**0.5 * (x[0] - x[3]) ** 2
            ),
        ),
        (
            "Freudenstein and Roth",
            [0.5, -2],
            lambda x: stack(-13 + x[0] + ((5 - x[1]) * x[1] - 2) * x[1], -29 + x[0] + ((x[1] + 1) * x[1] - 14) * x[1]),
        ),
        ("Bard", [1, 1, 1], bard),
        ("Kowalik and Osborne", [0.25, 0.39, 0.415, 0.39], kowalik_osborne),
        ("Meyer", [0.02, 4000, 250], meyer),
        *((f"Watson, {n} variables", np.zeros(n), watson) for n in (6, 9, 12)),
        ("Box, three variables", [0, 10, 20], box),
        ("Jennrich and Sampson", [0.3, 0.4], jennrich_sampson),
        ("Brown and Dennis", [25, 5, -5, -1], brown_dennis),
        *(
            (f"Chebyquad, {n} variables", np.arange(1, n + 1) / (n + 1), chebyquad(m))
            for n, m in ((1, 8), (8, 8), (9, 9), (10, 10))
        ),
        *((f"Brown, almost linear, {n} variables", np.full(n, 0.5), almost_linear) for n in (10, 30, 40)),
        ("Osborne 1", [0.5, 1.5, -1, 0.01, 0.02], osborne_1),
        ("Osborne 2", [1.3, 0.65, 0.65, 0.7, 0.6, 3, 5, 7, 2, 4.5, 5.5], osborne_2),
    ]
    for name, start, residuals in found:
        start = np.array(start, float)
        for factor in (1, 10, 100):
            # A start at zero becomes 10 and 100, as in MINPACK's driver.
            at = np.full_like(start, factor) if factor > 1 and not start.any() else factor * start
            yield name, f"× {factor}", at, residuals


class Counted:
    """Residuals and derivatives with counts. Non-finite values become large ones: neither library accepts them."""

    def __init__(self, residuals):
        self.law, self.residuals, self.tangents = residuals, 0, 0

    def __call__(self, x):
        self.residuals += 1
        return np.nan_to_num(self.law(x), nan=1e150, posinf=1e150, neginf=-1e150)

    def jacobian(self, x, *_):
        self.tangents += 1
        steps = x + 1e-100j * np.eye(len(x))
        return np.nan_to_num(
            np.array([self.law(step).imag * 1e100 for step in steps]).T, nan=0.0, posinf=1e150, neginf=-1e150
        )


def minpack(f, start, exact):
    # With finite differences, the limit of leastsq counts the columns of the Jacobian too.
    limit = MAX_TRIALS if exact else MAX_TRIALS * (len(start) + 1)
    return leastsq(
        f, start, Dfun=f.jacobian if exact else None, ftol=FTOL, xtol=XTOL, gtol=GTOL, maxfev=limit, full_output=True
    )[0]


def trf(scale):
    def run(f, start, exact):
        jac = f.jacobian if exact else "2-point"
        return least_squares(f, start, jac=jac, x_scale=scale, ftol=FTOL, xtol=XTOL, gtol=GTOL, max_nfev=MAX_TRIALS).x

    return run


def main():
    warnings.filterwarnings("ignore")
    np.seterr(all="ignore")
    print(f"scipy {scipy.__version__}, numpy {np.__version__}", file=sys.stderr)
    methods = {"minpack": minpack, "trf": trf("jac"), "trf, unscaled": trf(1.0)}
    for group, problems in (("nist", nist()), ("classics", classics())):
        for name, start, at, residuals in problems:
            for method, run in methods.items():
                for exact in (True, False):
                    f = Counted(residuals)
                    try:
                        point = run(f, at, exact)
                        objective = float(np.sum(np.square(residuals(point))))
                    except ValueError as error:
                        print(f"{name}, {start}, {method}: {error}", file=sys.stderr)
                        objective = float("inf")
                    record = {
                        "group": group,
                        "problem": name,
                        "start": start,
                        "method": method,
                        "derivatives": "exact" if exact else "differences",
                    }
                    record |= {"residuals": f.residuals, "tangents": f.tangents, "objective": objective}
                    print(json.dumps(record, ensure_ascii=False))


if __name__ == "__main__":
    main()
