#!/usr/bin/env bash
# Builds the wheel to publish into python/dist: for any Linux since glibc 2.17, with the engine for graphics devices, and
# without paths of the machine that built it. Needs Rust and Python 3.10 or later.
set -euo pipefail
cd "$(dirname "$0")"

cache="${XDG_CACHE_HOME:-$HOME/.cache}"
venv="$cache/offtrack-wheel"
[ -x "$venv/bin/maturin" ] || { python3 -m venv "$venv" && "$venv/bin/pip" install --quiet 'maturin>=1.9,<2' ziglang; }

export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$cache/offtrack-wheel-target}"
root="$(cd .. && pwd)"
export RUSTFLAGS="--remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo --remap-path-prefix=$root=offtrack"
# The linker of zig knows old versions of glibc.
PATH="$venv/bin:$PATH" maturin build --release --locked --zig --compatibility manylinux_2_17 --out dist
ls -l dist
