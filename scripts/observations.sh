#!/usr/bin/env bash
# Renew the synthetic observations of the shipped cases from their truths. The same seeds give the same files.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release --quiet
bondline=target/release/bondline

# A case names its observations, so a placeholder file is needed until they are made.
make() { # truth, observations, further options
    local truth=$1 out=$2
    shift 2
    printf 'time_s,TC4_K\n0,300\n' > "$out"
    "$bondline" twin "$truth" --out "$out" --force --quiet "$@"
}

# The two runs: four thermocouples of a layup with more physics, with 2 K noise.
for run in 2259 2330; do
    make "cases/lcat-$run/truth.toml" "cases/lcat-$run/measured.csv" --noise "2 K" --seed "$run"
done

# Run 2259 from TC3 down: the same thermocouples, with TC3 as the driver.
awk -F, '{ print $1 "," $4 }' cases/lcat-2259/measured.csv > cases/lcat-2259-tc3/driver.csv
awk -F, '{ print $1 "," $5 }' cases/lcat-2259/measured.csv > cases/lcat-2259-tc3/measured.csv

# The test of the estimator: the nominal TC3 drives, TC4 has both factors at one, neither has noise.
made=$(mktemp)
trap 'rm -f "$made"' EXIT
make cases/lcat-2259 "$made"
awk -F, '{ print $1 "," $4 }' "$made" > cases/twin-tc3/driver.csv
make cases/twin-tc3 cases/twin-tc3/measured.csv
awk -F, '{ print $1 "," $3 }' cases/twin-tc3/measured.csv > "$made"
cp "$made" cases/twin-tc3/measured.csv

# The test of the tutorial: a case whose nominal factors are the true ones.
make cases/lamp-test/truth.toml cases/lamp-test/measured.csv --noise "1.5 K" --seed 3

# Readings of TC1 under a flux with two lumps.
make cases/lcat-2259-lumps/truth.toml "$made" --noise "1 K" --seed 1
cut -d, -f1,2 "$made" > cases/lcat-2259-lumps/measured.csv
