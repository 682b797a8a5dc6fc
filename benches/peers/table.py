"""The table of benches/README.md from the output of the bench and of least_squares.py.

    cargo bench --bench least_squares > ours.json
    python benches/peers/table.py ours.json peers.json

A run is solved if its sum of squares is within 1e-5 of a minimum of the problem, or below 1e-13 for a minimum of zero.
Residual evaluations of two methods are compared on the runs that both solved.
"""

import json
import statistics
import sys

SOLVED = 1e-5
NOTHING = 1e-13
STARTS = {
    "NIST, both starts": ("nist", None),
    "standard": ("classics", "× 1"),
    "× 10": ("classics", "× 10"),
    "× 100": ("classics", "× 100"),
}


def main():
    runs, minima = {}, {}
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as file:
            for run in map(json.loads, file):
                minima[run["problem"]] = run.get("minima", minima.get(run["problem"]))
                runs[run["group"], run["start"], run["problem"], run["derivatives"], run["method"]] = run

    def solved(run):
        found = run["objective"]
        return found is not None and any(
            abs(found - least) <= max(SOLVED * least, NOTHING) for least in minima[run["problem"]]
        )

    methods = list(dict.fromkeys(key[4] for key in runs))
    ours = [method for method in methods if method.startswith("bondline")]
    print("| starts | derivatives | method | solved | median residuals | × MINPACK | × trf | only the others solved |")
    print("|---|---|---|---|---|---|---|---|")
    for name, (group, start) in STARTS.items():
        for derivatives in ("exact", "differences"):
            at = [
                key[:3]
                for key in runs
                if key[0] == group and start in (None, key[1]) and key[3:] == (derivatives, "minpack")
            ]
            of = lambda method: [runs[*key, derivatives, method] for key in at]
            for method in [*ours, "minpack", "trf"]:
                own = of(method)
                ratios = []
                for peer in ("minpack", "trf"):
                    pairs = [a["residuals"] / b["residuals"] for a, b in zip(own, of(peer)) if solved(a) and solved(b)]
                    ratios.append(f"{statistics.median(pairs):.2f}")
                missed = [
                    a["problem"]
                    for a, b, c in zip(own, of("minpack"), of("trf"))
                    if not solved(a) and (solved(b) or solved(c))
                ]
                median = statistics.median(run["residuals"] for run in own if solved(run))
                count = f"{sum(map(solved, own))} of {len(own)}"
                problems = ", ".join(missed).replace(" variables", "") or "none"
                row = [name, derivatives, method, count, f"{median:g}", *ratios, problems]
                print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
