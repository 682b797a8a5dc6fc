"""The table of benches/README.md, from what the bench and least_squares.py printed.

    cargo bench --bench least_squares > ours.json
    python benches/peers/table.py ours.json peers.json

A run counts as solved where its sum of squares is within 1e-5 of one of the problem's minima, or, of one of zero, below
1e-13. Of two methods the residuals are compared on the runs that both solved. """

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
        for derivatives in ("told", "differences"):
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
                row = [name, derivatives, method, count, f"{median:g}", *ratios, ", ".join(missed) or "none"]
                print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
