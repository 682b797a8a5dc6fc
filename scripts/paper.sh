#!/usr/bin/env bash
# Make figures 6 to 31 of the paper anew, as docs/images/paper/figure-06.svg to figure-31.svg.
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

figures() { # report; on standard input a line per figure: its number in the paper, its name in the report
    local number id
    while read -r number id; do
        cp "$folder/$1/figures/$id.svg" "$images/$(printf 'figure-%02d.svg' "$number")"
    done
}

run lcat-2259 study cases/lcat-2259
figures lcat-2259 <<END
6 nominal
9 spread-TC1
10 spread-TC2
11 spread-TC3
12 spread-TC4
13 shares-TC1
14 shares-TC2
15 shares-TC3
16 shares-TC4
17 sensitivity-TC1
18 sensitivity-TC2
19 sensitivity-TC3
20 sensitivity-TC4
21 fit-TC4
END
run lcat-2330 study cases/lcat-2330
figures lcat-2330 <<END
7 nominal
END
run seven estimate cases/lcat-2259 --bounds small \
    --factors f_eps_OF,f_k_OF,f_cp_OF,f_k_INS,f_cp_INS,f_rho_INS,f_cp_GB
figures seven <<END
8 fit-TC4
END
run lcat-2259-tc3 study cases/lcat-2259-tc3
figures lcat-2259-tc3 <<END
26 spread-TC4
27 shares-TC4
28 sensitivity-TC4
29 objective
30 fit-TC4
31 fit-window-TC4
END
run twin-tc3 estimate cases/twin-tc3 --minimiser paper
figures twin-tc3 <<END
22 design-space
23 design-space-path
24 objective
25 fit-TC4
END
ls "$images"
