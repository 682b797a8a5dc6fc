"""The scheme of one member under `vmap`, with steps and elimination under `scan`, in f64, in blocks of members on one
CPU device per thread.

Elimination by `scan` takes 29 ns per cell-step, `tridiagonal_solve` 50 to 90; blocks on two devices take 14, one call
with all members 30 to 45. Blocks of 64, 128 and 256 members take equal times. `plain`: all members in one call.
"""

import os
import sys

PLAIN = sys.argv[3:] == ["plain"]
THREADS = 1 if PLAIN else len(os.sched_getaffinity(0))
os.environ["XLA_FLAGS"] = f"--xla_force_host_platform_device_count={THREADS}"

import jax
import jax.numpy as jnp
import numpy as np

from peer import serve
from scheme import Scheme

BLOCK = sys.maxsize if PLAIN else 256


def put(values, places, what):
    return values.at[..., places].set(what)


def solver(lower, diagonal, upper):
    def eliminate(reciprocal, row):
        low, mid, high = row
        ratio = low * reciprocal
        reciprocal = 1 / (mid - ratio * high)
        return reciprocal, (ratio, reciprocal)

    top = 1 / diagonal[0]
    _, (ratios, reciprocals) = jax.lax.scan(eliminate, top, (lower, diagonal[1:], upper))
    above = jnp.concatenate([top[None], reciprocals[:-1]])

    def descend(carried, row):
        side, ratio = row
        carried = side - ratio * carried
        return carried, carried

    def ascend(found, row):
        side, high, reciprocal = row
        found = (side - high * found) * reciprocal
        return found, found

    def solve(side):
        bottom, down = jax.lax.scan(descend, side[0], (side[1:], ratios))
        last = bottom * reciprocals[-1]
        down = jnp.concatenate([side[:1], down[:-1]])
        _, found = jax.lax.scan(ascend, last, (down, upper, above), reverse=True)
        return jnp.concatenate([found, last[None]])

    return solve


def prepare(layups, columns, _setting=None):
    jax.config.update("jax_enable_x64", True)

    def marched(layup, column):
        scheme = Scheme(layup, jnp, solver, put)
        drives = [jnp.array(rows) for rows in (layup.steps_s, layup.flux_w_m2, layup.surroundings_k)]
        end_k, shown = jax.lax.scan(lambda k, drive: scheme.step(k, column, *drive), jnp.array(layup.start_k), drives)
        return layup.read(jnp, jnp.concatenate([shown[layup.records[:-1]], scheme.shown(end_k, column)[None]]))

    def member(column):
        return sum(layup.share * marched(layup, column) for layup in layups)

    march = jax.jit(jax.vmap(member))
    devices = jax.devices()

    def of(members):
        count = THREADS * -(-members // (THREADS * BLOCK))
        size = -(-members // count)
        # Blocks have one size, so that one kernel is compiled; the last block is padded.
        filled = np.resize(columns[:members], (count * size, columns.shape[1]))
        blocks = [jax.device_put(block, devices[i % THREADS]) for i, block in enumerate(np.split(filled, count))]
        for block in blocks[:THREADS]:
            march(block).block_until_ready()
        return lambda: np.concatenate([np.asarray(found) for found in [march(block) for block in blocks]])[:members]

    return of, (
        "all members in one call" if PLAIN else f"blocks of at most {BLOCK} members, {THREADS} devices of the processor"
    )


if __name__ == "__main__":
    serve(prepare)
