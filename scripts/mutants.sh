#!/usr/bin/env bash
# Hold mutants of the shaders against the processor: all of them, or a number given, drawn with a fixed seed. Prints the
# share that is noticed and the survivors, and fails where one survives that the table of the test does not explain.
set -euo pipefail
cd "$(dirname "$0")/.."
BONDLINE_MUTANTS=${1:-100000} cargo test --profile work --lib march::gpu::tests::mutation -- --nocapture
