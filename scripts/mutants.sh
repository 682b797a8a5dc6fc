#!/usr/bin/env bash
# Compare mutants of the shaders with the CPU: all of them, or a given number drawn with a fixed seed. Prints the share
# that is detected and the survivors, and fails if one survives that the table of the test does not explain.
set -euo pipefail
cd "$(dirname "$0")/.."
BONDLINE_MUTANTS=${1:-100000} cargo test --profile work --lib march::gpu::tests::mutation -- --nocapture
