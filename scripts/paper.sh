#!/usr/bin/env bash
# Make figures 6 to 31 of the paper anew, as docs/images/paper/figure-06.svg to figure-31.svg. Which figure of a report
# repeats which of the paper is in [paper_figures] of its case; Figure 8 estimates other factors than its case states.
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --profile work --quiet --bin bondline
bondline="${CARGO_TARGET_DIR:-target}/work/bondline"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
images=docs/images/paper
mkdir -p "$images"

run() { # name of the report, arguments
    local name=$1
    shift
    echo "bondline $*"
    "$bondline" "$@" --out "$folder/$name" --quiet >"$folder/$name.txt"
}

figure() { # number in the paper, report, figure of the report
    cp "$folder/$2/figures/$3.svg" "$images/$(printf 'figure-%02d.svg' "$1")"
}

of_case() { # case: its figures of the paper, from its report
    sed -n '/^\[paper_figures\]/,/^$/s/^\(.*\) = \([0-9]*\)$/\1 \2/p' "cases/$1/case.toml" |
        while read -r id number; do figure "$number" "$1" "$id"; done
}

for case in lcat-2259 lcat-2330 lcat-2259-tc3; do
    run "$case" study "cases/$case"
    of_case "$case"
done
run twin-tc3 estimate cases/twin-tc3 --minimiser paper
of_case twin-tc3
run seven estimate cases/lcat-2259 --bounds small \
    --factors f_eps_OF,f_k_OF,f_cp_OF,f_k_INS,f_cp_INS,f_rho_INS,f_cp_GB
figure 8 seven fit-TC4
ls "$images"
