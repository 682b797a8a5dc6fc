"""The tables and the plot of benches/README.md from what compare.py found.

    python benches/peers/show.py results.json
"""

import json
import pathlib
import statistics
import sys

MARCH, COMMAND = "bondline, march", "bondline, whole command"
README = pathlib.Path(__file__).parents[1] / "README.md"
PLOT = README.parent / "peers.svg"
BEGIN, END = "<!-- peers: written by show.py -->", "<!-- peers: end -->"


def seconds(value):
    return f"{value:.4f}" if value < 0.1 else f"{value:.3f}" if value < 1 else f"{value:.2f}" if value < 10 else f"{value:.0f}"


def told(results):
    yield "| who | how | ready after, s | off the reference, K | apart from bondline, K |"
    yield "|---|---|---|---|---|"
    for name, of in results["told"].items():
        start = "–" if of["start_s"] is None else f"{of['start_s']:.1f}"
        apart = "–" if name == MARCH else f"{of['apart_k']:.1e}" if of["apart_k"] < 1e-3 else f"{of['apart_k']:.3f}"
        yield f"| {name} | {of['note']} | {start} | {of['error_k']:.3f} | {apart} |"


def timed(results):
    yield "| members | who | s | from | × bondline's march | of all rounds | ns a cell-step |"
    yield "|---|---|---|---|---|---|---|"
    for members, times in results["times"].items():
        work = int(members) * results["cells"] * results["steps"]
        ours = times[MARCH]["s"]
        names = [MARCH, COMMAND, *(name for name in results["told"] if name != MARCH)]
        for name in (name for name in names if name in times):
            own, source = times[name]["s"], times[name]["from"]
            # Rounds that stand beside each other, or all against the median where one of the two was not measured here.
            beside = ours if len(ours) == len(own) and not source else [statistics.median(ours)] * len(own)
            ratios = [a / b for a, b in zip(own, beside)]
            middle = statistics.median(own)
            spread = f"{min(ratios):.2f}–{max(ratios):.2f}" if len(ratios) > 1 else "one"
            pace = "–" if name in ("SciPy", COMMAND) else f"{1e9 * middle / work:.1f}"
            origin = "measured" if source is None else f"{source} members"
            ratio = f"{statistics.median(ratios):.2f}"
            yield f"| {members} | {name} | {'' if source is None else '≈ '}{seconds(middle)} | {origin} | {ratio} | {spread} | {pace} |"


def plot(results):
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    plt.rcParams |= {"svg.hashsalt": "bondline", "font.size": 9}
    figure, panels = plt.subplots(1, 3, figsize=(11, 3.8))
    names = list(results["told"])
    times = results["times"]
    over_members = {name: [(int(n), statistics.median(t[name]["s"])) for n, t in times.items() if not t[name]["from"]] for name in names}
    series = [("members", f"{results['cells']} cells, {results['steps']} steps", over_members)]
    series += [(axis, f"{results['growing']} members, {of['held']}", of["s"]) for axis, of in results["growth"].items()]
    for panel, (axis, title, lines) in zip(panels, series):
        for place, name in enumerate(names):
            if lines.get(name):
                panel.loglog(*zip(*lines[name]), marker="o", markersize=3, linewidth=1.2, color=f"C{place}", label=name)
        xs, ys = zip(*lines[MARCH])
        panel.loglog([xs[0], xs[-1]], [ys[-1] * 0.4 * xs[0] / xs[-1], ys[-1] * 0.4], "k:", linewidth=0.8, label="linear")
        panel.set(xlabel=axis, title=title, ylabel="s" if axis == "members" else None)
        panel.grid(True, which="major", linewidth=0.3)
    panels[0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(PLOT, metadata={"Date": None})


def publish(results):
    plot(results)
    text = "\n".join(["", *told(results), "", *timed(results), ""])
    readme = README.read_text(encoding="utf-8")
    before, rest = readme.split(BEGIN)
    README.write_text(before + BEGIN + "\n" + text + "\n" + END + rest.split(END)[1], encoding="utf-8")
    print(text)


if __name__ == "__main__":
    publish(json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")))
