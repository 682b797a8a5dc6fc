"""Random cases, the oracle and bondline: a table of what bondline reports wrongly.

    python tests/oracle/campaign.py --program target/work/bondline --seed 1 --cases 200 --keep out/oracle
"""

import argparse
import os
import shutil
import sys
import tempfile
import traceback
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from comparison import Finding, Outcome, judge
from random_cases import FEATURES, Writer

# An estimate of the error below this share of the true one is a violation by itself.
SMALLEST_SHARE = 0.5
# Errors below this share of the tolerance do not matter.
NEGLIGIBLE = 1e-2


@dataclass(frozen=True)
class Violation:
    """A claim of bondline that does not hold."""

    case: str
    kind: str
    finding: Finding

    def row(self) -> str:
        f = self.finding
        return (
            f"{self.case:>9}  {self.kind:28} {f.precision}  {f.quantity:46} {f.value:12.5g} {f.truth:12.5g} "
            f"{f.error:9.2g} {f.claim:9.2g} {f.tolerance:9.2g}{'' if f.is_warned else '  silent'}"
        )


HEADING = (
    f"{'case':>9}  {'kind':28} {'':3}  {'quantity':46} {'reported':>12} {'right':>12} {'error':>9} {'claim':>9} "
    f"{'tolerance':>9}"
)


def is_violation(finding: Finding) -> bool:
    """A claim below half of the error; or one beyond the tolerance without a word."""
    if finding.error - finding.doubt < NEGLIGIBLE * finding.tolerance:
        return False
    is_unsaid = finding.claim > finding.tolerance and not finding.is_warned
    return finding.ratio > 1.0 / SMALLEST_SHARE or (is_unsaid and finding.is_silent)


def kind_of(finding: Finding, outcome: Outcome) -> str:
    """The cause that a violation most probably has, by what goes with it."""
    others = {(f.quantity.split(" at ")[0], f.precision): f for f in outcome.findings if "at 0 s" not in f.quantity}
    name = finding.quantity.split(" at ")[0]
    is_gas = "over the peak" in finding.quantity
    if "at 0 s" in finding.quantity:
        return "gas at 0 s" if is_gas else "reading at 0 s"
    double = others.get((name, "f64"))
    if finding.precision == "f32" and double is not None and not is_violation(double):
        return "single precision"
    if name.startswith("peak of "):
        trace = others.get((name.replace("peak of", "trace of"), finding.precision))
        if trace is not None and not is_violation(trace):
            return "peak between instants"
    if is_gas:
        return "gas and mass"
    for kind, features in (
        ("pressure", {"pressure varies in tables", "pressure varies in pores"}),
        ("tables over temperature", {"latent heat", "jump in a table", "close nodes", "emissivity over temperature"}),
        ("reactions", {"decomposition"}),
        ("short heating", {"short pulse"}),
        ("foil", {"foil"}),
    ):
        if outcome.features & features:
            return kind
    return "other"


def violations(outcome: Outcome) -> list[Violation]:
    return [Violation(outcome.name, kind_of(f, outcome), f) for f in outcome.findings if is_violation(f)]


def _one(task: tuple[str, int, int, str, float]) -> Outcome:
    program, seed, number, keep, work = task
    writer = Writer(seed, number)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(keep or scratch) / f"{seed}-{number}"
        shutil.rmtree(folder, ignore_errors=True)
        writer.write(folder)
        outcome = judge(program, folder, writer.features, Path(scratch) / "out", work)
    if keep and not violations(outcome) and not outcome.messages:
        shutil.rmtree(folder)
    return outcome


def run(program: str, seed: int, cases: int, keep: str = "", work: float = 3e4, first: int = 0) -> list[Outcome]:
    """Outcomes of random cases, in parallel. Folders of failing cases are kept under `keep`."""
    tasks = [(program, seed, number, keep, work) for number in range(first, first + cases)]
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(_one, tasks))


def share_covered(outcomes: list[Outcome], without: set[str]) -> tuple[float, int]:
    """Share of the findings whose claim is at least the error, without some kinds of violation; and their number."""
    findings = [
        f for o in outcomes if not o.is_loose for f in o.findings if not (is_violation(f) and kind_of(f, o) in without)
    ]
    return sum(f.ratio <= 1.0 for f in findings) / max(len(findings), 1), len(findings)


def table(outcomes: list[Outcome]) -> str:
    """Violations, refusals and the share of claims that hold, as text."""
    found = [violation for outcome in outcomes for violation in violations(outcome)]
    rows = [HEADING, *(violation.row() for violation in sorted(found, key=lambda v: (v.kind, -v.finding.ratio)))]
    rows += ["", f"violations by kind, of {len(outcomes)} cases:"]
    by_kind: dict[str, set[str]] = {}
    for violation in found:
        by_kind.setdefault(violation.kind, set()).add(violation.case)
    rows += [f"  {len(cases):4} cases  {kind}" for kind, cases in sorted(by_kind.items(), key=lambda kv: -len(kv[1]))]
    share, number = share_covered(outcomes, set())
    rows += ["", f"claims that are at least the error: {100.0 * share:.1f} % of {number}"]
    silent = [f for o in outcomes for f in o.findings if f.is_silent and not is_violation(f)]
    rows += [f"beyond the tolerance with a claim of half the error or more, without a word: {len(silent)}"]
    rows += ["", "refused by bondline:"]
    rows += [f"  {o.name} {p}: {message[:300]}" for o in outcomes for p, message in o.messages.items()]
    rows += ["", "refused by the oracle:", *(f"  {o.name}: {o.refusal}" for o in outcomes if o.refusal)]
    loose = sum(o.is_loose for o in outcomes)
    rows += ["", f"known to the tolerance only, not to a tenth of it: {loose} cases"]
    counts = Counter(feature for o in outcomes if o.findings for feature in o.features)
    rows += ["", "cases compared, by feature: " + ", ".join(f"{feature} {counts[feature]}" for feature in FEATURES)]
    return "\n".join(rows)


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--program", required=True)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--first", type=int, default=0)
    arguments.add_argument("--cases", type=int, default=30)
    arguments.add_argument("--keep", default="", help="folder for the cases that fail")
    arguments.add_argument("--work", type=float, default=3e4)
    options = arguments.parse_args()
    try:
        outcomes = run(options.program, options.seed, options.cases, options.keep, options.work, options.first)
    except Exception:
        traceback.print_exc()
        return 2
    print(table(outcomes))
    return int(any(violations(outcome) for outcome in outcomes))


if __name__ == "__main__":
    sys.exit(main())
