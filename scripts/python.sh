#!/usr/bin/env bash
# Build the Python package and run its tests. Python packages go into a virtual environment under target/.
#   --release  build the wheel as it is published, and print its path
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'scripts/python.sh: %s\n' "$*" >&2; exit 1; }

profile=work
for option in "$@"; do
    case "$option" in
        --release) profile=release ;;
        *) fail "unknown option $option: expected --release" ;;
    esac
done
command -v python3 >/dev/null || fail 'python3 not found: install Python 3.10 or later with its venv module'

target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target"
target=$(cd "$target" && pwd)
environment=$target/python/environment
wheels=$target/python/$profile
if ! cmp -s python/tests/requirements.txt "$environment/requirements.txt"; then
    python3 -m venv --clear "$environment" ||
        fail 'python3 -m venv failed: on Debian and Ubuntu, apt-get install python3-venv'
    "$environment/bin/pip" install --quiet --disable-pip-version-check -r python/tests/requirements.txt
    cp python/tests/requirements.txt "$environment/requirements.txt"
fi
rm -rf "$wheels"
# Packages of a system are linked to its own libraries; a published wheel is linked to older ones.
"$environment/bin/maturin" build --quiet --manifest-path python/Cargo.toml --profile "$profile" \
    --compatibility linux --strip --out "$wheels"
wheel=$(echo "$wheels"/*.whl)
"$environment/bin/pip" install --quiet --disable-pip-version-check --no-deps --force-reinstall "$wheel"
cd python
"$environment/bin/mypy" --strict python/bondline tests
"$environment/bin/python" -m pytest --quiet
printf '%s: %s bytes\n' "$wheel" "$(stat -c %s "$wheel")"
