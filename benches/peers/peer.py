"""How a peer is asked: one process a peer, so that all take turns and none compiles on the clock.

    python numpy_peer.py plan.json members.npy [further arguments of the peer]

It says that it is ready, then answers each line on its standard input, a request in JSON, with a line. `members.npy` holds a row a member, its
first column one and the others the factors.
"""

import json
import sys
import time

import numpy as np

from layup import Layup


def serve(prepare):
    """Answer requests. `prepare` takes layup, columns and further arguments to a function from a number of members to what gets ready for
    that many: a function that marches the first so many members and gives their traces, member × instant × sensor, K."""
    layup, columns = Layup(sys.argv[1]), np.load(sys.argv[2])
    of, note = prepare(layup, columns, *sys.argv[3:])
    answer({"note": note})
    for line in sys.stdin:
        request = json.loads(line)
        began = time.perf_counter()
        march = of(request["members"])
        marching = time.perf_counter()
        traces = march()
        ended = time.perf_counter()
        if request["traces"]:
            np.save(request["traces"], traces)
        answer({"prepare_s": marching - began, "march_s": ended - marching})


def answer(what):
    print(json.dumps(what), flush=True)
