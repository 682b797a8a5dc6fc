#!/bin/sh
# bondline's march beside its peers: installs them, builds both sides, runs all side by side, and writes the tables and
# the plot of benches/README.md. What follows goes to compare.py (--help): a resolution, sizes, a limit, some of the
# peers.
#
#     benches/peers/run.sh [--set resolution.cells=320 …] [--members 15 100 …]
#
# On a machine that others share, `chrt -f 50 benches/peers/run.sh` keeps them off the processors (as root).
set -eu
here=$(dirname "$0")
root=$here/../..
venv=${VENV:-$root/target/peers}

[ -x "$venv/bin/python" ] || python3 -m venv "$venv"
"$venv/bin/pip" install --quiet --requirement "$here/requirements.txt"
cargo build --release --manifest-path "$root/Cargo.toml"
cargo bench --no-run --bench plan --manifest-path "$root/Cargo.toml"
exec "$venv/bin/python" "$here/compare.py" "$@"
