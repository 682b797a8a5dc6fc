#!/bin/sh
# Compare bondline's march with SciPy, NumPy, JAX and Numba: install them, build bondline, run all in turn, and write
# tables and plot of benches/README.md. Options go to compare.py (--help): resolution, sizes, limit, peers.
#
#     benches/peers/run.sh [--set resolution.cells=320 …] [--members 15 100 …]
#
# On a shared machine, `chrt -f 50 benches/peers/run.sh` gives it priority (as root).
set -eu
cd "$(dirname "$0")/../.."
venv=${VENV:-${CARGO_TARGET_DIR:-target}/peers}

[ -x "$venv/bin/python" ] || python3 -m venv "$venv"
"$venv/bin/pip" install --quiet --requirement benches/peers/requirements.txt
cargo build --release
cargo bench --no-run --bench plan
exec "$venv/bin/python" benches/peers/compare.py "$@"
