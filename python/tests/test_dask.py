"""A sweep on a cluster of Dask has the answer of one process, to the last bit, also where workers die."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bondline
import bondline.dask
import numpy as np
import pytest
from distributed import Client, LocalCluster

slow = pytest.mark.skipif("BONDLINE_ALL" not in os.environ, reason="starts processes: BONDLINE_ALL=1 runs it")


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with Client(processes=False, n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as client:
        yield client


def numbers(result: bondline.Result) -> dict[str, Any]:
    """The nominal march and the sweep, without when and where they ran. NaN is equal to itself as text."""
    return {name: repr(result.record[name]) for name in ("case", "seed", "nominal", "uncertainty")}


def test_pieces_merged_in_a_tree_are_the_sweep_of_one_process(
    client: Client, slab: bondline.Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = slab.uncertainty(n=1000, seed=5)
    for pieces, merged, left in [(1, 8, 64), (7, 3, 2)]:
        monkeypatch.setattr(bondline.dask, "MERGED_PARTS", merged)
        monkeypatch.setattr(bondline.dask, "CLIENT_PARTS", left)
        assert numbers(bondline.dask.uncertainty(slab, 1000, seed=5, client=client, pieces=pieces)) == numbers(whole)
    assert numbers(bondline.dask.uncertainty(slab, 1000, seed=6, client=client, pieces=2)) != numbers(whole)


def test_a_sweep_shows_the_answer_so_far_with_its_interval(client: Client, slab: bondline.Case) -> None:
    seen: list[tuple[int, int, float]] = []

    def progress(partial: bondline.Uncertainty) -> None:
        low, high = partial.peak_percentiles.loc["BACK", [2.5, 97.5]].to_numpy(dtype=float)
        assert low < high and f"{partial.completed:,} of 4,000 members" in partial.summary()
        seen.append((partial.completed, partial.requested, high - low))

    found = bondline.dask.uncertainty(slab, 4000, client=client, pieces=8, progress=progress, interval_s=0.0)
    assert [completed for completed, _, _ in seen] == [500 * (1 + place) for place in range(8)]
    assert {requested for _, requested, _ in seen} == {4000}
    assert found.completed == 4000 and "4,000 of 4,000 members" in found.summary()


def test_an_exception_of_the_progress_ends_the_sweep(client: Client, slab: bondline.Case) -> None:
    def progress(partial: bondline.Uncertainty) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        bondline.dask.uncertainty(slab, 2000, client=client, pieces=4, progress=progress, interval_s=0.0)


def test_workers_have_equally_many_pieces(client: Client) -> None:
    def pieces(members: int) -> int:
        return len(bondline.dask._ranges(0, members, None, client, bondline.dask.LEAST_MEMBERS, "members"))

    assert len(client.scheduler_info()["workers"]) == 2
    found = [pieces(members) for members in (10_000, 40_000, 200_000, 1_000_000, 10_000_000)]
    assert found == [1, 2, 2, 14, 16]


def test_wrong_options_are_refused_before_anything_is_sent(client: Client, slab: bondline.Case) -> None:
    with pytest.raises(bondline.OptionError, match="at least 2 members"):
        bondline.dask.uncertainty(slab, 1, client=client)
    with pytest.raises(ValueError, match="expected 1 to 10, the number of members, found 11"):
        bondline.dask.uncertainty(slab, 10, client=client, pieces=11)


@pytest.mark.parametrize("prior", ["none", "small"])
def test_an_estimate_whose_starts_are_divided_is_that_of_one_process(
    client: Client, slab: bondline.Case, prior: str
) -> None:
    options: dict[str, Any] = {"prior": prior, "profile": ["f_k"]}
    whole = slab.estimate(starts=9, **options)
    seen: list[tuple[int, int]] = []
    found = bondline.dask.estimate(
        slab, 9, client=client, pieces=4, progress=lambda *finished: seen.append(finished), **options
    )
    assert repr(found.record["estimated"]) == repr(whole.record["estimated"])
    assert len(found.record["estimated"]["start_results"]) == 9
    minimisations = 9 if prior == "none" else 18
    assert len(seen) == 4 * minimisations // 9 and seen[-1] == (minimisations, minimisations)
    fewer = bondline.dask.estimate(slab, 8, client=client, **options)
    assert repr(fewer.record["estimated"]) != repr(whole.record["estimated"])


def test_a_coverage_study_whose_data_sets_are_divided_is_that_of_one_process(
    client: Client, slab: bondline.Case
) -> None:
    whole = slab.coverage(n=12, seed=3)
    found = bondline.dask.coverage(slab, 12, client=client, pieces=5, seed=3)
    assert repr(found.record["coverage_study"]) == repr(whole.record["coverage_study"])
    other = bondline.dask.coverage(slab, 12, client=client, seed=4)
    assert repr(other.record["coverage_study"]) != repr(whole.record["coverage_study"])


def test_wrong_options_of_divided_studies_are_refused_before_anything_is_sent(
    client: Client, slab: bondline.Case
) -> None:
    with pytest.raises(bondline.OptionError, match="starts 0: expected at least 1"):
        bondline.dask.estimate(slab, 0, client=client)
    with pytest.raises(bondline.OptionError, match="no factor"):
        bondline.dask.estimate(slab, 4, client=client, factors=["f_none"])
    with pytest.raises(bondline.OptionError, match="at least 2 data sets"):
        bondline.dask.coverage(slab, 1, client=client)
    with pytest.raises(ValueError, match="expected 1 to 3, the number of starts, found 4"):
        bondline.dask.estimate(slab, 3, client=client, pieces=4)


def test_chains_of_several_seeds_are_those_of_one_process(client: Client, slab: bondline.Case) -> None:
    options: dict[str, Any] = {"factors": ["f_k", "f_cp"], "walkers": 24, "mcmc_iterations": 60}
    found = bondline.dask.posterior(slab, [1, 2], client=client, **options)
    for chain, seed in enumerate([1, 2]):
        alone = slab.estimate(posterior=True, seed=seed, **options).draws
        for name in ("f_k", "f_cp"):
            count = found[name].shape[1]
            assert count > 10 and np.array_equal(found[name][chain], alone[name].to_numpy()[:count])
    assert not np.array_equal(found["f_k"][0], found["f_k"][1])


@contextmanager
def workers(client: Client, cluster: LocalCluster, number: int) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Processes of one thread each, without nannies, which would start them again."""
    command = [sys.executable, "-m", "distributed.cli.dask_worker", cluster.scheduler_address]
    options = ["--no-nanny", "--no-dashboard", "--nthreads", "1", "--host", "127.0.0.1"]
    processes = [subprocess.Popen([*command, *options], stderr=subprocess.DEVNULL) for _ in range(number)]
    try:
        client.wait_for_workers(number, timeout=120)
        yield processes
    finally:
        for process in processes:
            process.kill()
            process.wait(60)


@slow
def test_a_sweep_survives_the_death_of_three_of_four_workers(slab: bondline.Case) -> None:
    members = 200_000
    with (
        LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster) as client,
        workers(client, cluster, 4) as processes,
    ):
        left = list(processes)

        def kill(partial: bondline.Uncertainty) -> None:
            """Kill a worker after each of the first three answers."""
            if len(left) > 1:
                assert partial.completed < members
                left.pop().kill()

        found = bondline.dask.uncertainty(
            slab, members, client=client, pieces=60, progress=kill, interval_s=0.0, seed=3
        )
        assert len(client.scheduler_info()["workers"]) == 1
        assert [process.wait(60) for process in processes[1:]] == [-signal.SIGKILL] * 3
    assert numbers(found) == numbers(slab.uncertainty(n=members, seed=3))


@slow
@pytest.mark.parametrize("question", ["estimate", "coverage"])
def test_a_divided_study_survives_the_death_of_a_worker(slab: bondline.Case, question: str) -> None:
    with (
        LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster) as client,
        workers(client, cluster, 2) as processes,
    ):

        def kill(finished: int, number: int) -> None:
            assert finished < number or processes[1].poll() is not None
            processes[1].kill()

        divided = {"client": client, "pieces": 20, "progress": kill}
        if question == "estimate":
            found: bondline.Result = bondline.dask.estimate(slab, 400, prior="small", **divided)
        else:
            found = bondline.dask.coverage(slab, 200, **divided)
        assert processes[1].wait(60) == -signal.SIGKILL
    alone = slab.estimate(starts=400, prior="small") if question == "estimate" else slab.coverage(200)
    part = "estimated" if question == "estimate" else "coverage_study"
    assert repr(found.record[part]) == repr(alone.record[part])
