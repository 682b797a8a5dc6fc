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
from bondline._options import words
from bondline._results import Uncertainty

if TYPE_CHECKING:
    from distributed import Client, Future

#: Parts that one task merges, and parts that the client merges itself as they come.
MERGED_PARTS, CLIENT_PARTS = 8, 64
#: Least members of a part, as the text of a part and its merging take as long as marching some 3,000 members.
LEAST_MEMBERS = 1 << 16
#: Parts for each worker, so that a slow one does not hold the others up.
PARTS_PER_WORKER = 8


def uncertainty(
    case: Case,
    n: int = 5000,
    seed: int = 1,
    *,
    client: Client,
    sampling: str | None = None,
    sampling_bounds: str | None = None,
    pieces: int | None = None,
    retries: int = 3,
    progress: Callable[[Uncertainty], object] | None = None,
    interval_s: float = 1.0,
) -> Uncertainty:
    """A Monte Carlo sweep over the factors: :meth:`bondline.Case.uncertainty`, cut into pieces.

    Parameters
    ----------
    case
        The case, which is sent to the cluster once.
    n, seed, sampling, sampling_bounds
        As in :meth:`bondline.Case.uncertainty`.
    client
        The client of the cluster.
    pieces
        Number of pieces; by default eight for each worker, but none of fewer than 65,536 members.
    retries
        How often a task that fails is repeated. A task whose worker dies is repeated as often as the setting
        ``distributed.scheduler.allowed-failures`` of Dask says, three times by default.
    progress
        Called with the answer from the members so far; ``completed`` and ``requested`` are their numbers. An exception
        of it ends the sweep.
    interval_s
        Least time between two of these calls, s.

    Returns
    -------
    Uncertainty
        The answer of one process, to the last bit.
    """
    options = {"seed": seed, "sampling": sampling, "sampling_bounds": sampling_bounds}
    chosen = ["-n", str(n), *words(options)]
    _bondline.check_sweep(case._core, chosen)
    count = _pieces(n, len(client.scheduler_info()["workers"])) if pieces is None else pieces
    if not 1 <= count <= n:
        raise ValueError(f"pieces: expected 1 to {n}, the number of members, found {count}")
    ends = [number * n // count for number in range(count + 1)]
    mark = _mark(case)
    sent = _send(case, client, retries)
    parts = [
        client.submit(_part, sent, chosen, first, end, key=f"bondline-part-{_key(mark, chosen, first, end)}",
                      retries=retries)
        for first, end in zip(ends[:-1], ends[1:], strict=True)
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
    return _gathered(case, parts, progress, interval_s)


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
    sent = _send(case, client, retries)
    mark = _mark(case)
    tasks = [
        client.submit(_draws, sent, seed, options, key=f"bondline-draws-{_key(mark, seed, options)}", retries=retries)
        for seed in seeds
    ]
    found: list[dict[str, Array]] = [task.result() for task in tasks]
    if not found:
        raise ValueError("seeds: expected at least one")
    count = min(len(draws) for chain in found for draws in chain.values())
    return {name: np.stack([chain[name][:count] for chain in found]) for name in found[0]}


def _pieces(members: int, workers: int) -> int:
    return max(1, min(PARTS_PER_WORKER * max(workers, 1), members // LEAST_MEMBERS))


def _mark(case: Case) -> tuple[object, ...]:
    return _bondline.__version__, case._core.fingerprint(), tuple(words(case._session))


def _key(*parts: object) -> str:
    from dask.base import tokenize

    return str(tokenize(*parts))


def _send(case: Case, client: Client, retries: int) -> Future[Case]:
    """The case as the result of a task, which is computed again where its worker has died."""
    return client.submit(
        pickle.loads, pickle.dumps(case), key=f"bondline-case-{_key(_mark(case))}", retries=retries, priority=100
    )


def _part(case: Case, chosen: list[str], first: int, end: int) -> bytes:
    return _bondline.sweep_part(case._core, chosen, first, end, words(case._session))


def _merged(case: Case, parts: list[bytes]) -> bytes:
    return _merger(case, parts).part()


def _merger(case: Case, parts: list[bytes]) -> _bondline.Merger:
    merger = _bondline.Merger(case._core, parts[0], words(case._session))
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
