"""bondline's march compared with other implementations at equal accuracy, for benches/README.md; see run.sh.

All implementations march the same members with the same cells, steps and property tables, at both resolutions that
bondline extrapolates from (SciPy with its own steps, on the cheapest grids). They give the temperature at every sensor
and instant and use the same processors. They run in turn, and a ratio is taken within one turn. Times of an
implementation that would exceed the limit are scaled from fewer members. NumPy, JAX and Numba have two versions:
optimised, and plain.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import show
from command import TARGET, Command

HERE = pathlib.Path(__file__).parent
AT_BEST = {"SciPy": "scipy_peer.py", "NumPy": "numpy_peer.py", "JAX": "jax_peer.py", "Numba": "numba_peer.py"}
PLAIN = {f"{name}, plain": AT_BEST[name] for name in ("NumPy", "JAX", "Numba")}
PEERS = AT_BEST | PLAIN
TOLERANCE_K = 0.05
# Members for the accuracy.
JUDGED = 15
# Members and rounds of the scaling with cells and steps.
GROWING, GROWTH_ROUNDS = 100, 2
# Members of the warm-up: a block on each processor, so that everything is compiled.
WARMING = 256


def resolution(cells, clock):
    first_s, growth, longest_s = clock
    clock = {"first_step": f'"{first_s} s"', "step_growth": growth, "max_step": f'"{longest_s} s"'}
    return [f"resolution.{key}={value}" for key, value in {"cells": cells, **clock}.items()]


# Tolerances of the adaptation: the loosest at which all members, not only the nominal one, are within TOLERANCE_K.
ADAPTATION_TOLERANCES_K = (0.05, 0.04, 0.03, 0.02, 0.01)
# First step (s), growth, largest step (s).
FINE = resolution(1024, (0.0005, 0.008, 0.05))
COARSE = resolution(20, (1, 1, 20))
# Grids of SciPy without extrapolation, as an alternative to the two grids of bondline.
SINGLE_CELLS = (512, 640)
GROWTH_CELLS = (128, 256, 512, 1024)
GROWTH_CLOCKS = [(0.08, 0.08, 2.4), (0.04, 0.04, 1.2), (0.02, 0.02, 0.6), (0.01, 0.01, 0.3)]


class Peer:
    """A process of a peer, ready for requests."""

    def __init__(self, name, folder, *arguments):
        began = time.perf_counter()
        command = [sys.executable, HERE / PEERS[name], *map(str, arguments)]
        # One thread per operation: members are parallel.
        alone = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NUMBA_CACHE_DIR": folder / name}
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=alone)
        self.note = self.answer()["note"]
        self.start_s = time.perf_counter() - began

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"{self.process.args[1]}: ended with {self.process.wait()}")
        return json.loads(line)

    def march(self, members, traces=None):
        self.process.stdin.write(json.dumps({"members": members, "traces": traces and str(traces)}) + "\n")
        self.process.stdin.flush()
        return self.answer()

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def settle(command, reference, given):
    """The given resolution, else the adapted one at the loosest tolerance that keeps all members within it."""
    for sets in (
        [given] if given else [[f"resolution.tolerance={tolerance_k} K"] for tolerance_k in ADAPTATION_TOLERANCES_K]
    ):
        traces, summary = command.traces(JUDGED, sets)
        error_k = float(np.abs(traces - reference).max())
        if given or error_k <= TOLERANCE_K:
            return traces, summary, error_k, sets
    raise SystemExit(f"no resolution keeps {JUDGED} members within {TOLERANCE_K} K")


def started(command, folder, sets, peers):
    path = command.plan(sets, folder / "plan.json")
    members = folder / "members.npy"
    single = (
        [command.plan(resolution(cells, GROWTH_CLOCKS[-2]), folder / f"{cells}.json") for cells in SINGLE_CELLS]
        if "SciPy" in peers
        else []
    )
    extra = {"SciPy": (folder / "reference.npy", TOLERANCE_K, *single)} | dict.fromkeys(PLAIN, ["plain"])
    return {name: Peer(name, folder, path, members, *extra.get(name, ())) for name in peers}


def rounds(members):
    return 5 if members <= 15 else 3 if members <= 1000 else 1


def timed(command, sets, peers, sizes, limit_s, rounds):
    """Wall and processor seconds of every round by size and name; scaled from fewer members beyond the limit."""
    found = {}
    for members in sizes:
        found[members] = now = {}
        waited = []
        for name, peer in peers.items():
            base = max((size for size in found if size < members and not found[size][name]["from"]), default=None)
            ratio = members / base if base else 0.0
            if base and ratio * statistics.median(found[base][name]["s"]) > limit_s:
                now[name] = {key: [ratio * s for s in found[base][name][key]] for key in ("s", "processor_s")} | {
                    "from": base
                }
            else:
                waited.append(name)
                # Warm-up: compilation and page faults are not timed.
                peer.march(min(members, WARMING))
        note = lambda name, s, processor_s: [
            now.setdefault(name, {"s": [], "processor_s": [], "from": None})[key].append(value)
            for key, value in (("s", s), ("processor_s", processor_s))
        ]
        for _ in range(rounds(members)):
            summary = command.sweep(members, sets)
            note(show.MARCH, summary["seconds"]["march"], summary["processor_s"])
            note(show.COMMAND, summary["process_s"], summary["processor_s"])
            for name in waited:
                answer = peers[name].march(members)
                note(name, answer["march_s"], answer["processor_s"])
        medians = (f"{name} {statistics.median(times['s']):.3f} s" for name, times in now.items())
        print(f"{time.strftime('%T')} {members} members: {', '.join(medians)}", file=sys.stderr)
    return found


def growth(command, folder, names, cells):
    """Processor seconds over cells and over steps, the least of some rounds, and the resolution that is constant."""
    found = {}
    held_clock = GROWTH_CLOCKS[-2]
    of = {
        "cells": [resolution(each, held_clock) for each in GROWTH_CELLS],
        "steps": [resolution(cells, each) for each in GROWTH_CLOCKS],
    }
    for axis, resolutions in of.items():
        found[axis] = {"s": {}}
        for sets in resolutions:
            # Without SciPy, which has its own steps, and without plain versions, which scale alike.
            peers = started(command, folder, sets, [name for name in names if name in AT_BEST and name != "SciPy"])
            summary = command.sweep(GROWING, sets)
            times = timed(command, sets, peers, [GROWING], float("inf"), lambda _: GROWTH_ROUNDS)[GROWING]
            for peer in peers.values():
                peer.end()
            found[axis]["held"] = f"{summary['steps']} steps" if axis == "cells" else f"{summary['cells']} cells"
            for name in [show.COMMAND, *peers]:
                found[axis]["s"].setdefault(name, []).append((summary[axis], min(times[name]["processor_s"])))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", default="lcat-2259")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        help="change the case, as for bondline; a resolution is then taken as it is",
    )
    parser.add_argument("--members", type=int, nargs="+", default=[15, 100, 1000, 5000, 50_000])
    parser.add_argument("--limit", type=float, default=60.0, help="longest march of a peer that is waited for, s")
    parser.add_argument("--peers", nargs="+", default=list(PEERS), choices=PEERS)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument(
        "--results", type=pathlib.Path, default=TARGET / "peers.json", help="what show.py writes the tables from"
    )
    options = parser.parse_args()
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: options.threads])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        command = Command(options.case, folder)
        reference, _ = command.traces(JUDGED, FINE)
        np.save(folder / "reference.npy", reference)
        ours, summary, error_k, sets = settle(command, reference, options.set)
        print(f"{' '.join(sets)}: {summary['cells']} cells, {summary['steps']} steps, {error_k:.4f} K", file=sys.stderr)

        factors = json.loads(command.plan(sets, folder / "plan.json").read_text())["factors"]
        np.save(folder / "members.npy", command.columns(max(GROWING, *options.members), factors, COARSE))
        peers = started(command, folder, sets, options.peers)
        accuracy = {
            show.MARCH: {"start_s": None, "note": summary["backend"]["name"], "apart_k": 0.0, "error_k": error_k}
        }
        for name, peer in peers.items():
            prepared = peer.march(JUDGED, folder / "traces.npy")["prepare_s"]
            traces = np.load(folder / "traces.npy")
            apart_k, off_k = (float(np.abs(traces - other).max()) for other in (ours, reference))
            accuracy[name] = {
                "start_s": peer.start_s + prepared,
                "note": peer.note,
                "apart_k": apart_k,
                "error_k": off_k,
            }
            print(f"{name}: {accuracy[name]}", file=sys.stderr)
        times = timed(command, sets, peers, sorted(options.members), options.limit, rounds)
        for peer in peers.values():
            peer.end()
        results = {
            "case": options.case,
            "sets": sets,
            "cells": summary["cells"],
            "steps": summary["steps"],
            "accuracy": accuracy,
            "times": times,
        }
        options.results.write_text(json.dumps(results, indent=1))
        results |= {"growth": growth(command, folder, options.peers, summary["cells"]), "growing": GROWING}
        options.results.write_text(json.dumps(results, indent=1))
    show.publish(json.loads(options.results.read_text()))


if __name__ == "__main__":
    main()
