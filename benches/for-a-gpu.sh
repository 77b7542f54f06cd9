#!/usr/bin/env bash
# Builds what benches/on-a-gpu.sh runs, and packs it for a machine that cannot build: the program, the simulator's test
# binary and, where apt has it, the Vulkan loader.
#
#     benches/for-a-gpu.sh ARCHIVE.tar.xz
#
# There, in a copy of this repository: benches/on-a-gpu.sh ARCHIVE.tar.xz OUT
set -euo pipefail
if [ $# -ne 1 ] || [[ $1 != *.tar.xz ]]; then
    sed -n '2,/^set /p' "$0" | sed -n 's/^# \{0,1\}//p' >&2
    exit 2
fi
archive=$(realpath -- "$1")
cd "$(dirname "$0")/.."
packed=$(mktemp -d)
trap 'rm -rf -- "$packed"' EXIT
cargo build --release --locked --features gpu
cp "${CARGO_TARGET_DIR:-target}/release/offtrack" "$packed/offtrack"
# Its tests read files of the folder where they are compiled, and a build folder may hold those of another clone.
touch tests/simulator/main.rs
tests=$(cargo test --release --locked --features gpu --test simulator --no-run 2>&1 | sed -n 's/.*(\(.*simulator-[0-9a-f]*\))$/\1/p')
cp "$tests" "$packed/simulator"
strip "$packed/offtrack" "$packed/simulator"
pwd >"$packed/built-at"
git rev-parse --short=12 HEAD >"$packed/commit"
# What NVIDIA's driver needs beside the loader, too.
(cd "$packed" && apt-get download -qq libvulkan1 libegl1 libgl1 libglvnd0 libglx0) ||
    echo "no Vulkan loader is packed: apt-get cannot download it" >&2
tar -C "$packed" -cJf "$archive" .
ls -l "$archive"
