#!/usr/bin/env bash
# Builds what bakes roads in the live page, as WebAssembly: web/build.sh baker.wasm, then
# offtrack web --baker baker.wasm -o trucks.html. Needs rustup target add wasm32-unknown-unknown.
set -euo pipefail
out=$(realpath -m "${1:?the file to write}")
cd "$(dirname "$0")/.."
# Panics name places in the sources of dependencies: not by the folders of this machine.
flags=
for folder in "${CARGO_HOME:-$HOME/.cargo}"/registry/src/*; do flags+=" --remap-path-prefix=$folder=registry"; done
export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="$flags"
cargo build --profile web --locked --target wasm32-unknown-unknown --package offtrack-web
cp "${CARGO_TARGET_DIR:-target}/wasm32-unknown-unknown/web/offtrack_web.wasm" "$out"
