#!/usr/bin/env bash
# Measure a Vulkan device: parity with the CPU, both kernels and where they cross, share of peak, derivatives of 15
# members and of one, and a large sweep with its statistics. Writes a page of Markdown tables to standard output.
#   scripts/device.sh [--device NAME] [--members N] [--programs FOLDER]
#   --device    part of the name of the device [default: the one that bondline chooses]
#   --members   of the large sweep [default: 1000000]
#   --programs  a folder with `bondline` and the benches `march` and `jacobian`, for a machine without Rust; on one with
#               Rust, `scripts/device.sh --collect FOLDER` builds them and copies them there
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'scripts/device.sh: %s\n' "$*" >&2; exit 1; }

device=() members=1000000 programs= collect=
while [ $# -gt 0 ]; do
    [ $# -ge 2 ] || fail "$1 needs a value"
    case "$1" in
        --device) device=(--device "$2") ;;
        --members) members=$2 ;;
        --programs) programs=$2 ;;
        --collect) collect=$2 ;;
        *) fail "unknown option $1: expected --device, --members, --programs or --collect" ;;
    esac
    shift 2
done

# The path of a bench that cargo built.
bench() {
    cargo bench --no-run --bench "$1" --message-format json 2>/dev/null |
        python3 -c 'import json, sys
for line in sys.stdin:
    made = json.loads(line)
    if made.get("executable") and made["target"]["name"] == sys.argv[1]:
        print(made["executable"])' "$1"
}

if [ -z "$programs" ]; then
    command -v cargo >/dev/null || fail 'cargo not found: give the programs by --programs'
    programs=${collect:-$(mktemp -d)}
    mkdir -p "$programs"
    cargo build --release --quiet --bin bondline
    cp "${CARGO_TARGET_DIR:-target}/release/bondline" "$(bench march)" "$(bench jacobian)" "$programs"
    for name in march jacobian; do mv "$programs/$name"-* "$programs/$name"; done
    [ -z "$collect" ] || exit 0
fi
for name in bondline march jacobian; do
    [ -x "$programs/$name" ] || fail "$programs/$name not found: make it by scripts/device.sh --collect FOLDER"
done
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

commit=$(git rev-parse --short HEAD 2>/dev/null || echo unknown)
printf '# Measurements of a device\n\n%s, commit %s\n\n' "$(date -u +%F)" "$commit"
printf '```text\n'
"$programs/bondline" devices
printf '```\n\n## Parity\n\n```text\n'
"$programs/bondline" verify --group cross-backend "${device[@]}" || parity=failed
printf '```\n\n## March\n\n'
"$programs/march" --bench | tee "$folder/march"
printf '\nCrossing of the kernels: '
# Rows are `| members | march | s | ...`; a device has a row for each kernel.
python3 - "$folder/march" <<'PYTHON'
import re, sys
COOPERATIVE = ", a workgroup a member,"
lines = [line for line in open(sys.argv[1]) if re.match(r"\| \d+ \|", line)]
rows = [[cell.strip() for cell in line.strip("|\n ").split("|")] for line in lines]
seconds = {(row[1], int(row[0])): float(row[2]) for row in rows}
texts = []
for title in sorted({title for title, _ in seconds if COOPERATIVE in title}):
    other = title.replace(COOPERATIVE, "")
    both = [size for one, size in seconds if one == title and (other, size) in seconds]
    faster = [str(size) for size in both if seconds[title, size] < seconds[other, size]]
    texts.append(f"{other}: a workgroup per member is faster for {', '.join(faster) or 'no number of'} members")
print("; ".join(texts) or "no device", end=".\n")
PYTHON
printf '\n## Derivatives\n\n'
"$programs/jacobian" --bench
printf '\n## Sweep of %s members\n\n' "$members"
printf '| backend | march, s | statistics, s | whole, s | largest resident set, MiB |\n|---|---|---|---|---|\n'
for backend in gpu cpu; do
    chosen=(--backend "$backend")
    [ "$backend" = cpu ] || chosen+=("${device[@]}")
    python3 - "$programs/bondline" uncertainty cases/lcat-2259 -n "$members" --quiet --out "$folder/$backend" \
        "${chosen[@]}" <<'PYTHON'
import json, resource, subprocess, sys
done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL)
if done.returncode:
    sys.exit(f"exit code {done.returncode}: {' '.join(sys.argv[1:])}")
summary = json.load(open(sys.argv[sys.argv.index("--out") + 1] + "/summary.json"))
seconds, backend = summary["seconds"], summary["backend"]
peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
times = " | ".join(f"{seconds[part]:.2f}" for part in ("march", "reduce", "total"))
print(f"| {backend['name']} {backend['precision']} | {times} | {peak:.0f} |")
PYTHON
done
[ "${parity:-passed}" = passed ] || fail 'the device and the CPU differ: see Parity'
