#!/usr/bin/env bash
# Measures and tests everything on a machine with a graphics device, with programs that were built elsewhere, in under
# eight minutes: the list of devices, the simulator's tests, speed against the number of trucks with random actions, a
# policy and training, one step a submission beside eight, each kernel beside its model, five roads beside 200, and a
# training run. One file has it all, OUT/on-a-gpu.json. A part that fails or takes too long is named at the end; the
# others still run.
#
#     benches/on-a-gpu.sh ARCHIVE OUT
#     benches/on-a-gpu.sh OFFTRACK TESTS OUT
#
# ARCHIVE   what benches/for-a-gpu.sh packed: the two programs below, and what stands in the first three variables
# OFFTRACK  the program, from `cargo build --release --features gpu`
# TESTS     the simulator's test binary, named in the last line of
#           `cargo test --release --features gpu -p offtrack --test simulator --no-run`
# OUT       a folder for all results
#
# Environment variables, all optional:
# VULKAN_DEBS      a folder of Debian packages with the Vulkan loader (libvulkan1, and what drivers need: libegl1 libgl1
#                  libglvnd0 libglx0), used where the system has no loader; they are unpacked into a temporary folder
# BUILT_AT         path of this repository when the programs were built: the tests read its files there, so the script
#                  makes a link at that path if nothing is there
# OFFTRACK_COMMIT  the commit that the programs were built from, for the results, where git cannot tell
# ADAPTER          part of an adapter's name, see `offtrack devices`; the tests take the first adapter
# FILTER           test name filters separated by spaces, such as `device parity`; without it all tests run
# TRAINING_OPTIONS more options for the training run, such as `--set replay_buffer.capacity=100000` for an adapter with
#                  little memory
# ENVS, FEWER_ENVS, MODES, SECONDS_EACH, MANY_ROADS, TRAINING, MINUTES   what is measured, as below
set -uo pipefail
packed='' loader=''
trap 'rm -rf -- ${packed:+"$packed"} ${loader:+"$loader"}' EXIT
if [ $# -eq 2 ] && [ -f "$1" ]; then
    packed=$(mktemp -d)
    tar -C "$packed" -xf "$1" || exit 2
    export VULKAN_DEBS=${VULKAN_DEBS:-$packed} BUILT_AT=${BUILT_AT:-$(cat "$packed/built-at")}
    export OFFTRACK_COMMIT=${OFFTRACK_COMMIT:-$(cat "$packed/commit")}
    set -- "$packed/offtrack" "$packed/simulator" "$2"
fi
if [ $# -ne 3 ]; then
    sed -n '2,/^set /p' "$0" | sed -n 's/^# \{0,1\}//p' >&2
    exit 2
fi
offtrack=$(realpath -- "$1") || exit 2
tests=$(realpath -- "$2") || exit 2
mkdir -p -- "$3" && out=$(realpath -- "$3") || exit 2
cd "$(dirname "$0")/.." || exit 2
repository=$PWD
envs=${ENVS:-1024..4194304}
fewer=${FEWER_ENVS:-1024..1048576}
filter=${FILTER:-}
modes=${MODES:-policy,large-policy,training}
many=${MANY_ROADS:-random2026-training}
seconds=${SECONDS_EACH:-2}
training=${TRAINING:-learner/configs/gpu.toml}
minutes=${MINUTES:-1}
read -ra options <<<"${TRAINING_OPTIONS:-}"
adapter=(${ADAPTER:+--adapter "$ADAPTER"})
failed=() config=()

# part NAME SECONDS COMMAND...: runs a command with a time limit; its output goes to OUT/NAME.txt.
part() {
    local name=$1 limit=$2 begun=$SECONDS code
    shift 2
    echo "== $name: $*"
    timeout --kill-after=10 "$limit" "$@" 2>&1 | tee "$out/$name.txt"
    code=${PIPESTATUS[0]}
    [ "$code" -eq 124 ] && echo "stopped after $limit s" | tee -a "$out/$name.txt"
    echo "== $name: exit code $code after $((SECONDS - begun)) s"
    [ "$code" -eq 0 ] || failed+=("$name (exit code $code)")
}

# The loader: the system's, or one from packages.
if ! ldconfig -p | grep -q 'libvulkan\.so\.1'; then
    if [ -d "${VULKAN_DEBS:-}" ]; then
        loader=$(mktemp -d)
        for package in "$VULKAN_DEBS"/*.deb; do dpkg -x "$package" "$loader"; done
        for folder in "$loader"/usr/lib/*-linux-gnu "$loader"/lib/*-linux-gnu; do
            [ -d "$folder" ] && export LD_LIBRARY_PATH="$folder${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
        done
    else
        echo "no Vulkan loader: install libvulkan1, or set VULKAN_DEBS to a folder of its package" >&2
    fi
fi
# The driver: what the loader finds by itself, else the places where NVIDIA's driver puts its description.
is_hardware() { "$offtrack" devices 2>/dev/null | grep -qE '  (discrete|integrated|virtual)  '; }
if [ -z "${VK_DRIVER_FILES:-}" ] && ! is_hardware; then
    for description in {/usr/share,/etc,/usr/local/share,/usr/local/nvidia/share}/vulkan/icd.d/nvidia_icd*.json; do
        [ -f "$description" ] || continue
        export VK_DRIVER_FILES=$description
        is_hardware && echo "driver: $description" && break
        unset VK_DRIVER_FILES
    done
fi
# The files that the tests read.
if [ -n "${BUILT_AT:-}" ] && [ ! -e "$BUILT_AT" ]; then
    mkdir -p -- "$(dirname "$BUILT_AT")" && ln -s -- "$repository" "$BUILT_AT"
fi

part devices 30 "$offtrack" devices
# shellcheck disable=SC2086 # each word is a filter
part tests 150 "$tests" $filter --nocapture
grep -q '^running 0 tests' "$out/tests.txt" && failed+=("tests (none was run)")
smi=
if command -v nvidia-smi >/dev/null; then
    nvidia-smi --query-gpu=timestamp,name,driver_version,memory.used,utilization.gpu,power.draw --format=csv -l 1 >"$out/nvidia-smi.csv" 2>&1 &
    smi=$!
fi
# scale NAME LIMIT ENVS OPTIONS...: speed against the number of trucks, into OUT/NAME.json and a picture.
scale() {
    local name=$1 limit=$2 trucks=$3
    shift 3
    part "$name" "$limit" "$offtrack" scale --device gpu "${adapter[@]}" --envs "$trucks" \
        --seconds "$seconds" --json "$out/$name.json" --plot "$out/$name.svg" "$@"
}
scale random 45 "$envs"
scale random-one-a-submission 30 "$fewer" --submission 1
[[ $modes == *training* ]] && config=(--config "$training")
scale networks 80 "$fewer" --mode "$modes" "${config[@]}"
scale many-roads 60 "$fewer" --benchmark "$many"
# As many steps as the time allows.
part training 100 "$offtrack" train "$training" "${adapter[@]}" --minutes "$minutes" --steps 1000000000000 --out "$out" --name training "${options[@]}"
[ -n "$smi" ] && kill "$smi"
part joined 20 python3 benches/on_a_gpu.py "$out"

echo
echo "$SECONDS s; everything is in $out"
if [ ${#failed[@]} -ne 0 ]; then
    printf 'failed: %s\n' "${failed[@]}" | tee "$out/failed.txt"
    exit 1
fi
