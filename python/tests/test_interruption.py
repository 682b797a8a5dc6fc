"""Ctrl-C, callbacks that raise, and other threads while a sweep runs."""

import signal
import threading
import time

import bondline
import numpy as np
import pytest

#: Long enough not to end before the signal.
LONG = 3_000_000


def test_ctrl_c_ends_a_sweep_at_once_and_leaves_the_next_call_unharmed(slab: bondline.Case) -> None:
    before = slab.march([[1.0, 1.0]])
    sent = [0.0]

    def interrupt() -> None:
        sent[0] = time.monotonic()
        signal.raise_signal(signal.SIGINT)

    timer = threading.Timer(0.5, interrupt)
    # A shell starts background jobs with this signal ignored.
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            slab.uncertainty(n=LONG)
    finally:
        signal.signal(signal.SIGINT, handler)
    # 0.2 s on an idle machine; tests share theirs.
    assert time.monotonic() - sent[0] < 2.0
    assert np.array_equal(slab.march([[1.0, 1.0]]), before)


def test_an_exception_of_the_progress_ends_the_sweep_and_is_raised(slab: bondline.Case) -> None:
    seen = []

    def progress(marched: int, expected: int | None) -> None:
        seen.append((marched, expected))
        if marched > 0 and expected == LONG:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        slab.uncertainty(n=LONG, progress=progress)
    assert seen[-1][0] < LONG


def test_other_threads_run_during_a_sweep(slab: bondline.Case) -> None:
    counted = 0
    done = threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.wait(0.001):
            counted += 1

    thread = threading.Thread(target=count)
    thread.start()
    began = time.monotonic()
    slab.uncertainty(n=10_000)
    seconds = time.monotonic() - began
    done.set()
    thread.join()
    assert counted > 20 * seconds
