#!/usr/bin/env bash
# Build the Python package, run its tests, and check the solver of tests/oracle against exact solutions. Python packages
# go into a virtual environment under target/. The wheel shares the library with `cargo test --workspace`.
#   --release  build the wheel as it is published, and print its path
# With BONDLINE_ALL set also what takes minutes or heavier packages: all cases with all commands, a cluster whose
# workers are killed, all recipes and notebooks of the book, 500 random cases compared with the oracle.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'scripts/python.sh: %s\n' "$*" >&2; exit 1; }

profile=work
for option in "$@"; do
    case "$option" in
        --release) profile=wheel ;;
        *) fail "unknown option $option: expected --release" ;;
    esac
done
command -v python3 >/dev/null || fail 'python3 not found: install Python 3.10 or later with its venv module'

target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target"
target=$(cd "$target" && pwd)
wheels=$target/python/$profile
environment=$target/python/environment requirements=python/tests/requirements.txt
if [ -n "${BONDLINE_ALL:-}" ]; then
    environment+=-all requirements=python/tests/requirements-all.txt
fi
if ! cat python/tests/requirements*.txt | cmp -s - "$environment/requirements"; then
    python3 -m venv --clear "$environment" ||
        fail 'python3 -m venv failed: on Debian and Ubuntu, apt-get install python3-venv'
    "$environment/bin/pip" install --quiet --disable-pip-version-check --no-compile -r "$requirements"
    cat python/tests/requirements*.txt >"$environment/requirements"
fi
rm -rf "$wheels"
# Packages of a system are linked to its own libraries; a published wheel is linked to older ones. It is compressed
# again below; for tests, little compression is enough.
"$environment/bin/maturin" build --quiet --manifest-path python/Cargo.toml --profile "$profile" \
    --compatibility linux --strip --compression-level 1 --out "$wheels"
wheel=$(echo "$wheels"/*.whl)
[ "$profile" = work ] || "$environment/bin/python" scripts/compress_wheel.py "$wheel"
"$environment/bin/pip" install --quiet --disable-pip-version-check --no-deps --force-reinstall "$wheel"
cd python
"$environment/bin/mypy" --strict python/bondline tests
"$environment/bin/python" -m pytest --quiet
"$environment/bin/python" -m pytest --quiet ../tests/oracle/test_exact_solutions.py \
    ../tests/oracle/test_theory_march.py \
    ../tests/oracle/test_theory_problems.py
if [ -n "${BONDLINE_ALL:-}" ]; then
    "$environment/bin/python" -m pytest --quiet ../tests/oracle/test_random_cases.py
    # The kernel of a notebook is the Python that is first in the path.
    PATH=$environment/bin:$PATH "$environment/bin/python" -m pytest --quiet --nbmake --nbmake-timeout=1200 \
        ../docs/notebooks
fi
printf '%s: %s bytes\n' "$wheel" "$(stat -c %s "$wheel")"
