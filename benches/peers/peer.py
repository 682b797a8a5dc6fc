"""The protocol of the peers: one process per peer, so that peers run in turn and compilation is not timed.

    python numpy_peer.py plan.json members.npy [further arguments of the peer]

The process reports that it is ready, then answers each request (a line of JSON on standard input) with a line.
`members.npy` has one row per member: a one, then the factors.
"""

import json
import multiprocessing
import os
import pathlib
import sys
import time

import numpy as np

from layup import layups


def serve(prepare):
    """Answer requests. `prepare(layups, columns, *arguments)` returns a function: from a number of members to a march
    of the first members, which returns traces (member × instant × sensor, K).
    """
    of, note = prepare(layups(sys.argv[1]), np.load(sys.argv[2]), *sys.argv[3:])
    answer({"note": note})
    for line in sys.stdin:
        request = json.loads(line)
        began = time.perf_counter()
        march = of(request["members"])
        marching, busy_s = time.perf_counter(), processor_s()
        traces = march()
        ended = time.perf_counter()
        if request["traces"]:
            np.save(request["traces"], traces)
        answer({"prepare_s": marching - began, "march_s": ended - marching, "processor_s": processor_s() - busy_s})


def processor_s():
    """Processor time of this process and its workers."""
    stats = [pathlib.Path(f"/proc/{worker.pid}/stat").read_text() for worker in multiprocessing.active_children()]
    # User and system time are the 12th and 13th field after the name, which ends with a parenthesis.
    ticks = sum(int(ticks) for stat in stats for ticks in stat.rpartition(")")[2].split()[11:13])
    return time.process_time() + ticks / os.sysconf("SC_CLK_TCK")


def answer(record):
    print(json.dumps(record), flush=True)
