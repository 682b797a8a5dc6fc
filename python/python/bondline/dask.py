"""Studies on a cluster of Dask.

Every task is a pure function of the case and of its options, so that Dask may run it again, on any worker: the answer
is that of one process, to the last bit. Workers need bondline, and none of the files of the case.
"""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from bondline import _bondline
from bondline._case import Array, Case
from bondline._options import question
from bondline._results import Coverage, Estimate, Uncertainty

if TYPE_CHECKING:
    from distributed import Client, Future

#: Parts that one task merges, and parts that the client merges itself as they come.
MERGED_PARTS, CLIENT_PARTS = 8, 64
#: Least members of a part, as the text of a part and its merging take as long as marching some 3,000 members.
LEAST_MEMBERS = 1 << 16
#: Least minimisations of a part, as vector units march the members of several together.
LEAST_MINIMISATIONS = 8
#: Parts for each worker, so that a slow one does not hold the others up.
PARTS_PER_WORKER = 8


def uncertainty(
    case: Case,
    n: int | None = None,
    *,
    client: Client,
    pieces: int | None = None,
    retries: int = 3,
    progress: Callable[[Uncertainty], object] | None = None,
    interval_s: float | None = None,
    **options: Any,
) -> Uncertainty:
    """A Monte Carlo sweep over the factors: :meth:`bondline.Case.uncertainty`, cut into pieces.

    Parameters
    ----------
    case
        The case, which is sent to the cluster once.
    n
        As in :meth:`bondline.Case.uncertainty`.
    client
        The client of the cluster.
    pieces
        Number of pieces; by default up to eight for each worker, of at least 65,536 members, or one for each worker, of
        at least 16,384.
    retries
        How often a task that fails is repeated. A task whose worker dies is repeated as often as the setting
        ``distributed.scheduler.allowed-failures`` of Dask says, three times by default.
    progress
        Called with the answer from the members so far; ``completed`` and ``requested`` are their numbers. An exception
        of it ends the sweep.
    interval_s
        Least time between two of these calls, s; 1 s by default.
    options
        Options of :meth:`bondline.Case.uncertainty`: ``seed``, ``sampling``, ``sampling_bounds``.

    Returns
    -------
    Uncertainty
        The answer of one process, to the last bit.
    """
    for option in ("until", "depth_profiles"):
        if options.get(option) is not None:
            raise _bondline.OptionError(f"{option} has no effect here: only a whole sweep of one process has it")
    if interval_s is not None and progress is None:
        raise _bondline.OptionError("interval_s has no effect without progress")
    chosen = question("uncertainty", options, {"members": n})
    _bondline.check(case._core, "uncertainty", chosen)
    members = int(_bondline.options_of("uncertainty", chosen)["members"])
    ranges = _ranges(0, members, pieces, client, LEAST_MEMBERS, "members")
    mark, count = _mark(case), len(ranges)
    sent = _send(case, client, retries)
    parts = [
        client.submit(_part, sent, chosen, first, end, key=f"bondline-part-{_key(mark, chosen, first, end)}",
                      retries=retries)
        for first, end in ranges
    ]
    level = 0
    while len(parts) > CLIENT_PARTS:
        level += 1
        groups = [parts[first : first + MERGED_PARTS] for first in range(0, len(parts), MERGED_PARTS)]
        parts = [
            client.submit(_merged, sent, group, key=f"bondline-merged-{_key(mark, chosen, count, level, place)}",
                          retries=retries, priority=level)
            for place, group in enumerate(groups)
        ]
    return _gathered(case, parts, progress, 1.0 if interval_s is None else interval_s)


def estimate(
    case: Case,
    starts: int,
    *,
    client: Client,
    pieces: int | None = None,
    retries: int = 3,
    progress: Callable[[int, int], object] | None = None,
    **options: Any,
) -> Estimate:
    """Factors fitted from many starts: :meth:`bondline.Case.estimate`, whose minimisations are divided between tasks.

    Profiles, the map of the objective and a posterior, if ``options`` have them, are computed by the client.

    Parameters
    ----------
    case
        The case, which is sent to the cluster once.
    starts
        Number of minimisations: the first from the start of the case, the others from random points.
    client
        The client of the cluster.
    pieces
        Number of tasks; by default up to eight for each worker, of at least 8 minimisations, or one for each worker, of
        at least 2. An estimate with priors has as many again, since the weight of the data comes from those of the data
        alone.
    retries
        As in :func:`uncertainty`.
    progress
        Called with the number of minimisations that are finished, and with their number.
    options
        Options of :meth:`bondline.Case.estimate`.

    Returns
    -------
    Estimate
        The answer of one process, to the last bit.
    """
    chosen = question("estimate", options, {"starts": starts})
    return Estimate(case, _divided(case, "estimate", chosen, client, pieces, retries, progress, "starts"), None)


def coverage(
    case: Case,
    n: int,
    *,
    client: Client,
    pieces: int | None = None,
    retries: int = 3,
    progress: Callable[[int, int], object] | None = None,
    **options: Any,
) -> Coverage:
    """How often the 95 % intervals of estimates contain the truth: :meth:`bondline.Case.coverage`, whose data sets are
    divided between tasks.

    Parameters
    ----------
    case
        The case, which is sent to the cluster once.
    n
        Number of data sets.
    client
        The client of the cluster.
    pieces
        Number of tasks; by default up to eight for each worker, of at least 8 data sets, or one for each worker, of at
        least 2.
    retries
        As in :func:`uncertainty`.
    progress
        Called with the number of data sets that are fitted, and with their number.
    options
        Options of :meth:`bondline.Case.coverage`.

    Returns
    -------
    Coverage
        The answer of one process, to the last bit.
    """
    chosen = question("twin", options, {"study": n})
    return Coverage(case, _divided(case, "twin", chosen, client, pieces, retries, progress, "data sets"), None)


def posterior(
    case: Case, seeds: Iterable[int], *, client: Client, retries: int = 3, **options: Any
) -> dict[str, Array]:
    """Draws from the posterior by independent ensembles of walkers, one for each seed, each of them a task.

    Parameters
    ----------
    case
        The case, which is sent to the cluster once.
    seeds
        Seeds of the random numbers.
    client
        The client of the cluster.
    retries
        How often a task that fails is repeated.
    options
        Options of :meth:`bondline.Case.estimate`, such as ``factors``, ``walkers``, ``mcmc_iterations``.

    Returns
    -------
    dict of numpy.ndarray
        The draws of each factor: seed × draw, as ``arviz.from_dict(posterior=...)`` takes them. Each row has the draws
        of ``case.estimate(posterior=True, seed=seed, ...).draws``, up to the number that all seeds have.
    """
    for option in ("seed", "posterior"):
        if option in options:
            raise _bondline.OptionError(f"{option} has no effect here: there is a posterior for each of seeds")
    seeds = list(seeds)
    if not seeds:
        raise ValueError("seeds: expected at least one")
    _bondline.check(case._core, "estimate", question("estimate", options, {"posterior": True}))
    sent = _send(case, client, retries)
    mark = _mark(case)
    tasks = [
        client.submit(_draws, sent, seed, options, key=f"bondline-draws-{_key(mark, seed, options)}", retries=retries)
        for seed in seeds
    ]
    found: list[dict[str, Array]] = [task.result() for task in tasks]
    count = min(len(draws) for chain in found for draws in chain.values())
    return {name: np.stack([chain[name][:count] for chain in found]) for name in found[0]}


def _ranges(first: int, end: int, pieces: int | None, client: Client, least: int, noun: str) -> list[tuple[int, int]]:
    """Equal pieces of a range: as many as given, or equally many for each worker, so that none waits. One for each
    worker may be a quarter of ``least``."""
    count = end - first
    workers = max(len(client.scheduler_info()["workers"]), 1)
    many = min(PARTS_PER_WORKER * workers, count // least)
    few = min(workers, 4 * count // least)
    number = max(many - many % workers, few, 1) if pieces is None else pieces
    if not 1 <= number <= count:
        raise ValueError(f"pieces: expected 1 to {count}, the number of {noun}, found {number}")
    ends = [first + place * count // number for place in range(number + 1)]
    return list(zip(ends[:-1], ends[1:], strict=True))


def _divided(
    case: Case,
    name: str,
    chosen: dict[str, Any],
    client: Client,
    pieces: int | None,
    retries: int,
    progress: Callable[[int, int], object] | None,
    noun: str,
) -> _bondline.Answers:
    """The answers of a study whose minimisations are tasks. Those of a round depend on all of the rounds before."""
    from distributed import as_completed

    rounds = _bondline.log_rounds(case._core, name, chosen)
    divided = [_ranges(first, end, pieces, client, LEAST_MINIMISATIONS, noun) for first, end in rounds]
    mark, sent = _mark(case), _send(case, client, retries)
    parts: list[Future[bytes]] = []
    ranges: dict[str, int] = {}
    for pieces_of_round in divided:
        earlier = list(parts)
        for first, end in pieces_of_round:
            key = f"bondline-{name}-{_key(mark, chosen, len(divided[0]), first, end)}"
            parts.append(client.submit(_log_part, sent, name, chosen, first, end, earlier, key=key, retries=retries))
            ranges[key] = end - first
    finished = 0
    come: Iterable[Future[bytes]] = as_completed(parts)
    for future in come:
        future.result()
        finished += ranges[str(future.key)]
        if progress is not None:
            progress(finished, rounds[-1][1])
    found = [part.result() for part in parts]
    return _bondline.log_answers(case._core, name, chosen, found, case._session)


def _log_part(case: Case, name: str, chosen: dict[str, Any], first: int, end: int, earlier: list[bytes]) -> bytes:
    return _bondline.log_part(case._core, name, chosen, first, end, earlier, case._session)


def _mark(case: Case) -> tuple[object, ...]:
    return _bondline.__version__, case._core.fingerprint(), tuple(sorted(case._session.items()))


def _key(*parts: object) -> str:
    from dask.base import tokenize

    return str(tokenize(*parts))


def _send(case: Case, client: Client, retries: int) -> Future[Case]:
    """The case as the result of a task, which is computed again where its worker has died."""
    return client.submit(
        pickle.loads, pickle.dumps(case), key=f"bondline-case-{_key(_mark(case))}", retries=retries, priority=100
    )


def _part(case: Case, chosen: dict[str, Any], first: int, end: int) -> bytes:
    return _bondline.sweep_part(case._core, chosen | {"part": f"{first}..{end}"}, case._session)


def _merged(case: Case, parts: list[bytes]) -> bytes:
    return _merger(case, parts).part()


def _merger(case: Case, parts: list[bytes]) -> _bondline.Merger:
    merger = _bondline.Merger(case._core, parts[0], case._session)
    for part in parts[1:]:
        merger.add(part)
    return merger


def _draws(case: Case, seed: int, options: dict[str, Any]) -> dict[str, Array]:
    found = case.estimate(posterior=True, seed=seed, **options)
    return dict(zip(found.names, np.array(found.record["posterior"]["draws"], dtype=float).T, strict=True))


def _gathered(
    case: Case, parts: list[Future[bytes]], progress: Callable[[Uncertainty], object] | None, interval_s: float
) -> Uncertainty:
    """Merge the parts as they come."""
    from distributed import as_completed

    merger: _bondline.Merger | None = None
    shown = time.monotonic()
    left = len(parts)
    come: Iterable[Future[bytes]] = as_completed(parts)
    for future in come:
        part = future.result()
        if merger is None:
            merger = _merger(case, [part])
        else:
            merger.add(part)
        left -= 1
        if progress is not None and (left == 0 or time.monotonic() - shown >= interval_s):
            progress(Uncertainty(case, merger.answers(), None))
            shown = time.monotonic()
    assert merger is not None
    return Uncertainty(case, merger.answers(), None)
