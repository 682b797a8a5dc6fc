#!/usr/bin/env bash
# Build the book into target/book/html, warnings denied. Python packages go into a virtual environment under target/.
#   --renew    first renew the generated pages: the command line from clap's help, the Python package from its
#              docstrings, the verification tables
#   --check    the same, and fail if a verification table of the CPU was out of date
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'scripts/docs.sh: %s\n' "$*" >&2; exit 1; }

renew=false
check=false
for option in "$@"; do
    case "$option" in
        --renew) renew=true ;;
        --check) renew=true check=true ;;
        *) fail "unknown option $option: expected --renew or --check" ;;
    esac
done
command -v python3 >/dev/null || fail 'python3 not found: install Python 3.11 or later with its venv module'

target=${CARGO_TARGET_DIR:-target}
environment=$target/book/environment
if ! cmp -s docs/requirements.txt "$environment/requirements.txt"; then
    python3 -m venv --clear "$environment" ||
        fail 'python3 -m venv failed: on Debian and Ubuntu, apt-get install python3-venv'
    "$environment/bin/pip" install --quiet --disable-pip-version-check -r docs/requirements.txt
    cp docs/requirements.txt "$environment/requirements.txt"
fi
if "$renew"; then
    before=$(mktemp -d)
    trap 'rm -rf "$before"' EXIT
    cp -r docs/verification "$before"
    cargo build --profile work --workspace --quiet --bin bondline
    program=$target/work/bondline
    "$environment/bin/python" docs/generate/command_line.py "$program"
    "$environment/bin/python" docs/generate/verification.py "$program"
    "$environment/bin/python" docs/generate/python_api.py
    # Results of a device, and the plot, depend on its driver.
    if "$check" && ! diff -r -x cross-backend.csv -x ratios.svg "$before/verification" docs/verification; then
        fail 'docs/verification was out of date and is renewed: look at the difference'
    fi
fi
"$environment/bin/python" docs/generate/python_api.py --check
"$environment/bin/sphinx-build" -W --keep-going -n -q -j auto -b html -d "$target/book/doctrees" \
    docs "$target/book/html"
printf 'the book: %s/book/html/index.html\n' "$target"
