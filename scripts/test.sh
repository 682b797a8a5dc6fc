#!/usr/bin/env bash
# The full check of a change: format, lints, tests, documentation. Installs missing requirements of the tests: the
# software Vulkan driver (lavapipe), against which shaders are compared bit for bit, and a browser for the report.
#   --all    also the slow parts: 300 random cases, 300 mutants of the kernels, slow blocks and verification tables of
#            the documentation
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\n== %s\n' "$*"; }
fail() { printf 'scripts/test.sh: %s\n' "$*" >&2; exit 1; }

check=
for option in "$@"; do
    case "$option" in
        --all) export BONDLINE_ALL=1 BONDLINE_RANDOM_CASES=300 BONDLINE_MUTANTS=300 check=--check ;;
        *) fail "unknown option $option: expected --all" ;;
    esac
done

install() {
    local what=$1
    shift
    command -v apt-get >/dev/null ||
        fail "$what not found, and no apt-get to install it: install $* (or the packages that your system has for it)"
    local root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "$what not found, and no sudo: as root, apt-get install $*"
        root=(sudo)
    fi
    say "install $what: $*"
    "${root[@]}" apt-get update -qq
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

has_lavapipe() {
    case "${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}" in
        *lvp_icd*) return 0 ;;
        ?*) return 1 ;;
    esac
    compgen -G '/usr/share/vulkan/icd.d/lvp_icd*.json' >/dev/null ||
        compgen -G '/usr/local/share/vulkan/icd.d/lvp_icd*.json' >/dev/null ||
        compgen -G '/etc/vulkan/icd.d/lvp_icd*.json' >/dev/null ||
        { command -v vulkaninfo >/dev/null && vulkaninfo --summary 2>/dev/null | grep -qi llvmpipe; }
}

has_browser() {
    command -v chromium || command -v chromium-browser || command -v google-chrome || command -v google-chrome-stable
}

command -v cargo >/dev/null || fail 'cargo not found: install Rust from https://rustup.rs'
has_lavapipe || install 'the software Vulkan driver' mesa-vulkan-drivers libvulkan1
has_browser >/dev/null || install 'a browser' chromium
for component in rustfmt clippy; do
    cargo "${component/rustfmt/fmt}" --version >/dev/null 2>&1 && continue
    command -v rustup >/dev/null || fail "$component not found, and no rustup to add it"
    say "add $component"
    rustup component add "$component"
done

say 'format'
cargo fmt --check
say 'lints'
cargo clippy --profile work --all-targets -- -D warnings
for features in '' gpu serde report gpu,report; do
    cargo clippy --profile work --lib --no-default-features --features "$features" -- -D warnings
done
cargo clippy --profile work --benches --features internals -- -D warnings
cargo tree --edges normal --no-default-features | grep -E ' (wgpu|naga|parquet|clap|plotters|serde_json) ' &&
    fail 'the library without features depends on crates of devices, reports or the command'
say 'tests'
cargo test --profile work
say 'documentation'
RUSTDOCFLAGS='-D warnings' cargo doc --profile work --no-deps
# JSON of the documentation is not stable yet; its format is that of the toolchain at hand.
RUSTC_BOOTSTRAP=1 cargo rustdoc --profile work --lib --quiet -- -Z unstable-options --output-format json
python3 scripts/public_api.py "${CARGO_TARGET_DIR:-target}/doc/bondline.json" docs/reference/public-api.txt
scripts/docs.sh $check
say 'all passed'
