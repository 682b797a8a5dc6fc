"""The tables and the plot of benches/README.md from the results of compare.py.

python benches/peers/show.py results.json
"""

import json
import pathlib
import statistics
import sys
import textwrap

from matplotlib import pyplot

MARCH, COMMAND = "bondline, march", "bondline, whole command"
README = pathlib.Path(__file__).parents[1] / "README.md"
PLOT = README.parent / "peers.svg"
BEGIN, END = "<!-- peers: written by show.py -->", "<!-- peers: end -->"


def seconds(value):
    decimals = 4 if value < 0.1 else 3 if value < 1 else 2 if value < 10 else 0
    return f"{value:.{decimals}f}"


def accuracy(results):
    yield "| who | how | ready after, s | off the reference, K | apart from bondline, K |"
    yield "|---|---|---|---|---|"
    alternatives = []
    for name, of in results["accuracy"].items():
        note, _, tried = of["note"].partition("; tried: ")
        alternatives += [f"{name} tried: {tried}."] if tried else []
        start = "–" if of["start_s"] is None else f"{of['start_s']:.1f}"
        apart = "–" if name == MARCH else f"{of['apart_k']:.1e}" if of["apart_k"] < 1e-3 else f"{of['apart_k']:.3f}"
        yield f"| {name} | {note} | {start} | {of['error_k']:.3f} | {apart} |"
    for line in alternatives:
        yield "\n" + textwrap.fill(line, 120, break_on_hyphens=False)


def timed(results):
    yield "| members | who | s | processor, s | from | × the march | of all rounds | processor, × the command |"
    yield "|---|---|---|---|---|---|---|---|"
    names = [MARCH, COMMAND, *(name for name in results["accuracy"] if name != MARCH)]
    for members, times in results["times"].items():
        for name in names:
            own, about = times[name], "≈ " if times[name]["from"] else ""
            ratios = ratios_of(own, times[MARCH], "s")
            spread = f"{min(ratios):.2f}–{max(ratios):.2f}" if len(ratios) > 1 else "one"
            source = f"{own['from']} members" if own["from"] else "measured"
            busy = ratios_of(own, times[COMMAND], "processor_s")
            wall, ratio = about + seconds(statistics.median(own["s"])), f"{statistics.median(ratios):.2f}"
            # The march alone has no processor time of its own.
            processor, processor_ratio = "–", "–"
            if name != MARCH:
                processor = about + seconds(statistics.median(own["processor_s"]))
                processor_ratio = f"{statistics.median(busy):.2f}"
            yield f"| {' | '.join([members, name, wall, processor, source, ratio, spread, processor_ratio])} |"


def ratios_of(own, other, key):
    """Ratios within rounds; ratios to the median if the rounds differ."""
    same = len(own[key]) == len(other[key]) and not own["from"]
    return [a / b for a, b in zip(own[key], other[key] if same else [statistics.median(other[key])] * len(own[key]))]


def plot(results):
    pyplot.rcParams |= {"svg.hashsalt": "bondline", "font.size": 9}
    figure, panels = pyplot.subplots(1, 3, figsize=(11, 4.2))
    # bondline: processor time of the whole command.
    names = [COMMAND, *(name for name in results["accuracy"] if name != MARCH)]
    everyone = list(dict.fromkeys(name.split(", ")[0] for name in names))
    times = results["times"]
    over_members = {
        name: [(int(n), statistics.median(t[name]["processor_s"])) for n, t in times.items() if not t[name]["from"]]
        for name in names
    }
    series = [("members", f"{results['cells']} cells, {results['steps']} steps", over_members)]
    series += [
        (axis, f"{results['growing']} members, {of['held']}", of["s"]) for axis, of in results.get("growth", {}).items()
    ]
    for panel, (axis, title, lines) in zip(panels, series):
        for name in names:
            if lines.get(name):
                # Both versions of a peer have one colour.
                place = everyone.index(name.split(", ")[0])
                style = {"linestyle": "--" if name.endswith("plain") else "-", "color": f"C{place}", "label": name}
                panel.loglog(*zip(*lines[name]), marker="o", markersize=3, linewidth=1.2, **style)
        xs, ys = zip(*lines[COMMAND])
        panel.loglog(
            [xs[0], xs[-1]], [ys[-1] * 0.4 * xs[0] / xs[-1], ys[-1] * 0.4], "k:", linewidth=0.8, label="linear"
        )
        panel.set(xlabel=axis, title=title, ylabel="processor time, s" if axis == "members" else None)
        if axis != "members":
            # Less than a decade: ticks at the sizes only.
            panel.set_xticks(xs, [f"{x:,}" for x in xs])
            panel.xaxis.set_minor_formatter("")
        panel.grid(True, which="major", linewidth=0.3)
    figure.legend(*panels[0].get_legend_handles_labels(), fontsize=8, ncols=5, loc="lower center")
    figure.tight_layout(rect=(0, 0.12, 1, 1))
    figure.savefig(PLOT, metadata={"Date": None})


def publish(results):
    plot(results)
    text = "\n".join(["", *accuracy(results), "", *timed(results), ""])
    readme = README.read_text(encoding="utf-8")
    before, rest = readme.split(BEGIN)
    README.write_text(before + BEGIN + "\n" + text + "\n" + END + rest.split(END)[1], encoding="utf-8")
    print(text)


if __name__ == "__main__":
    publish(json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")))
