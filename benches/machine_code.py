#!/usr/bin/env python3
"""The kernels as machine code of graphics cards, without a card: what two compilers made of each.

    cargo install naga-cli --version 30.0.1 --locked
    pip download --no-deps --dest wheels nvidia-cuda-nvrtc==13.0.88 nvidia-cuda-nvdisasm==13.5.37 \
        nvidia-cuda-cuobjdump==13.5.37
    for wheel in wheels/*.whl; do unzip -qo "$wheel" -d cuda; done; chmod +x cuda/nvidia/cu13/bin/*
    python3 benches/machine_code.py --cuda cuda --json docs/results/machine_code.json

For NVIDIA's chips naga writes the shaders as Metal, that is compiled as CUDA by NVRTC, and its code is taken apart by
nvdisasm: registers, stack, instructions by kind, and by the function of the shader that they come from. The drivers'
compiler of Vulkan shaders has the same back end but is another. For AMD's RDNA 3 the tests of machine code print what
RADV made of each kernel, which is the driver itself. What threads of a kernel do side by side the example `lanes`
counts on real trucks; its numbers are kept beside the others. Neither says how long a kernel takes: see
benches/model.py. Standard library only.
"""

import argparse
import ctypes
import datetime
import json
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from metal_as_cuda import translated
from model import AT_ONCE, TOUCHED

REPOSITORY = Path(__file__).resolve().parents[1]
CARGO = ["--release", "--locked", "--manifest-path", REPOSITORY / "Cargo.toml"]
TEST = ["cargo", "test", *CARGO, "--features", "gpu", "-p", "offtrack", "--test", "simulator"]
LANES = ["cargo", "run", *CARGO, "--quiet", "--example", "lanes"]
ACTING = ["cargo", "run", *CARGO, "--quiet", "--features", "gpu", "--example", "acting", "--", "shader"]
# Kinds of instructions by the beginning of their names.
KINDS = {
    "load": ("LDG",),
    "store": ("STG",),
    "local load": ("LDL",),
    "local store": ("STL",),
    "shared load": ("LDS",),
    "shared store": ("STS",),
    "constant load": ("LDC", "ULDC"),
    "atomic": ("ATOM", "RED"),
    "special function": ("MUFU",),
    "conversion": ("I2F", "F2I", "FRND", "F2F"),
    "branch": ("BRA", "BSSY", "BSYNC", "BREAK", "EXIT", "WARPSYNC", "CALL", "RET"),
    "barrier": ("BAR",),
    "float": ("FADD", "FMUL", "FFMA", "FMNMX", "FSETP", "FSEL", "FSET", "FCHK"),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--naga", default="naga", help="the program of naga-cli")
    parser.add_argument("--cuda", type=Path, required=True, help="the folder where NVIDIA's wheels were unpacked")
    parser.add_argument(
        "--chips", default="sm_80,sm_89,sm_90", help="NVIDIA's chips; of the last one where its instructions come from"
    )
    parser.add_argument("--shaders", type=Path, default=REPOSITORY / "shaders", help="another folder of the same files")
    parser.add_argument("--tests", type=Path, help="the simulator's test binary with the feature gpu; else it is built")
    parser.add_argument("--lanes", type=Path, help="the example lanes; else it is built")
    parser.add_argument("--acting", type=Path, help="the example acting; else it is built")
    parser.add_argument("--json", type=Path, help="write the result to this file")
    args = parser.parse_args()
    cuda = args.cuda / "nvidia/cu13"
    if not (cuda / "bin/nvdisasm").is_file():
        sys.exit(f"{cuda}/bin/nvdisasm: no such file; unpack NVIDIA's wheels as the head of this script says")

    acts = output([args.acting, "shader"] if args.acting else ACTING)
    sources = [translated(metal(args.naga, module)) for module in (step(args.shaders), acts)]
    nvidia = {chip: kernels(sources[0], cuda, chip) | kernels(sources[1], cuda, chip) for chip in args.chips.split(",")}
    alone = {part for parts in AT_ONCE.values() for part in parts}
    for chip, found in nvidia.items():
        for name, kernel in found.items():
            # The model counts on those of the last chip, and on kernels that do at once what others do alone.
            if chip != list(nvidia)[-1] or name not in TOUCHED or name in alone:
                del kernel["parts"]
    for chip, found in nvidia.items():
        print(f"{chip}: kernel, registers, stack (bytes), shared memory (bytes), instructions")
        for name, kernel in found.items():
            print(f"  {name:20} {kernel['registers']:4} {kernel['stack']:6} {kernel['shared']:6} {sum_of(kernel):6}")
    driver, amd = radv(args.tests)
    result = {
        "date": datetime.date.today().isoformat(),
        "commit": output(["git", "-C", REPOSITORY, "rev-parse", "--short=12", "HEAD"]).strip(),
        "command": "python3 benches/machine_code.py --cuda cuda --json docs/results/machine_code.json",
        "compilers": ["naga " + output([args.naga, "--version"]).split()[-1], "NVRTC " + version(cuda), driver],
        "nvidia": nvidia,
        "amd": {"RDNA 3": amd},
        "replay": json.loads(output([args.lanes] if args.lanes else LANES)),
    }
    if args.json:
        text = json.dumps(result, indent=1)
        # What holds no table stands in one line.
        for innermost in (r"\[[^][{}]*\]", r"\{[^{}]*\}"):
            text = re.sub(innermost, lambda found: " ".join(found[0].split()), text)
        args.json.write_text(text + "\n")


def sum_of(kernel):
    return sum(kernel["instructions"].values())


def output(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def step(shaders):
    """The module of a step."""
    listed = (REPOSITORY / "src/engine/stages/shaders.rs").read_text()
    files = re.findall(r'include_str!\("(?:\.\./)+shaders/(.*?)"\)', listed)
    if not files:
        sys.exit("src/engine/stages/shaders.rs names no shader")
    return "".join((shaders / file).read_text() + "\n" for file in files)


def metal(naga, module):
    """A module in Metal, with the checks that are asked for on Vulkan."""
    with tempfile.TemporaryDirectory() as folder:
        wgsl, written = Path(folder) / "module.wgsl", Path(folder) / "module.metal"
        wgsl.write_text(module)
        checks = ["--index-bounds-check-policy", "Restrict", "--buffer-bounds-check-policy", "ReadZeroSkipWrite"]
        output([naga, *checks, "--metal-version", "3.1", wgsl, written])
        return written.read_text()


def library(cuda):
    # The compiler looks for its other half by name and takes one that is loaded.
    ctypes.CDLL(str(next((cuda / "lib").glob("libnvrtc-builtins.so.*"))), ctypes.RTLD_GLOBAL)
    return ctypes.CDLL(str(cuda / "lib/libnvrtc.so.13"))


def version(cuda):
    numbers = [ctypes.c_int(), ctypes.c_int()]
    library(cuda).nvrtcVersion(*map(ctypes.byref, numbers))
    return ".".join(str(number.value) for number in numbers)


def compiled(source, cuda, chip):
    """The binary of a CUDA source."""
    compiler = library(cuda)

    def got(what):
        size = ctypes.c_size_t()
        getattr(compiler, f"nvrtcGet{what}Size")(program, ctypes.byref(size))
        bytes_of = ctypes.create_string_buffer(size.value)
        getattr(compiler, f"nvrtcGet{what}")(program, bytes_of)
        return bytes_of.raw

    program = ctypes.c_void_p()
    compiler.nvrtcCreateProgram(ctypes.byref(program), source.encode(), b"module.cu", 0, None, None)
    options = [
        f"--gpu-architecture={chip}",
        "--std=c++17",
        "--use_fast_math",
        "-lineinfo",
        "-diag-suppress=177",
        "--device-as-default-execution-space",
    ]
    array = (ctypes.c_char_p * len(options))(*map(str.encode, options))
    if compiler.nvrtcCompileProgram(program, len(options), array) != 0:
        sys.exit(got("ProgramLog").decode())
    return got("CUBIN")


def kernels(source, cuda, chip):
    """What the compiler made of each kernel of a CUDA source."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "module.cubin"
        file.write_bytes(compiled(source, cuda, chip))
        usage = output([cuda / "bin/cuobjdump", "-res-usage", file])
        code = output([cuda / "bin/nvdisasm", "-gi", "-c", file])
    functions = functions_of(source)
    found = {}
    for name, registers, stack, shared in re.findall(r"Function (\w+):\s*REG:(\d+) STACK:(\d+) SHARED:(\d+)", usage):
        section = re.search(rf"^\.text\.{name}:\n(.*?)(?=^\t\.section|\Z)", code, re.M | re.S).group(1)
        # From sm_90 on the system keeps some of it to itself.
        reserved = 1024 if 90 <= int(chip[3:]) and 1024 <= int(shared) else 0
        used = {"registers": int(registers), "stack": int(stack), "shared": int(shared) - reserved}
        found[name] = used | counted(instructions_of(section, functions))
    return dict(sorted(found.items()))


def functions_of(source):
    """For each line of a CUDA source the function that it is part of, by the shader's name."""
    functions, name = [""], ""
    for line in source.split("\n"):
        if head := re.match(
            r"(?:static __device__ __forceinline__|extern \"C\" __global__|\w+ (?=naga_)).*?(\w+)\((?:$|\w)", line
        ):
            # naga numbers what would else have the same name.
            name = re.sub(r"_\d*$", "", head.group(1))
        functions.append(name)
    return functions


def instructions_of(section, functions):
    """Of each instruction its name, where it jumps to, and the functions from the kernel inwards, each with a line."""
    found, labels, places, is_new = [], {}, [], True
    for line in section.split("\n"):
        if place := re.findall(r"line (\d+)", line) if "//## File" in line else None:
            places, is_new = [*([] if is_new else places), int(place[0])], False
        elif label := re.match(r"(\.L_\w+):", line):
            labels[label.group(1)] = len(found)
        elif code := re.search(r"/\*[0-9a-f]{4,}\*/\s+(?:@!?U?P\w+ )?([A-Z0-9_]+)\S*(.*);", line):
            is_new = True
            target = re.search(r"`\((\.L_\w+)\)", code.group(2)) if code.group(1) == "BRA" else None
            chain = [(functions[number], number) for number in reversed(places)]
            # What the header does is its caller's.
            chain = chain[: next((at for at, (function, _) in enumerate(chain) if not function), len(chain))]
            found.append((code.group(1), target and target.group(1), chain))
    return [(name, target and labels.get(target), chain) for name, target, chain in found]


def counted(instructions):
    """Instructions of a kernel by kind, and by function: all, and those in loops."""
    # Behind its end the code jumps to itself for ever.
    loops = [(to, at) for at, (_, to, _) in enumerate(instructions) if to is not None and to < at]
    names = [name for name, _, _ in instructions]
    multiplying = [inner for loop in loops if (inner := multiply_adds(names, loop, loops))]
    kinds, parts = Counter(), {}
    for at, (name, to, chain) in enumerate(instructions):
        if name == "NOP" or to == at:
            continue
        kinds[next((kind for kind, names in KINDS.items() if name.startswith(names)), "other")] += 1
        # Each function with the line that calls it.
        part = tuple((function, line) for (function, _), (_, line) in zip(chain[1:], chain))
        count = parts.setdefault(part, [0, 0])
        count[0] += 1
        count[1] += any(begin <= at <= end for begin, end in loops)
    found = {"instructions": dict(kinds.most_common()), "parts": named(parts)}
    return found | ({"multiplying_loops": multiplying} if multiplying else {})


def multiply_adds(names, loop, loops):
    """Of a loop that is nothing else than multiplying and adding its instructions and those; None of others."""
    begin, end = loop
    if any(other != loop and begin <= other[0] and other[1] <= end for other in loops):
        return None
    inside = [name for name in names[begin : end + 1] if name != "NOP"]
    n = sum(name.startswith("FFMA") for name in inside)
    return {"instructions": len(inside), "multiply_adds": n} if len(inside) < 3 * n else None


def named(parts):
    """Counts by the functions' names from the kernel inwards; calls from different lines are numbered."""
    calls = {}
    for part in parts:
        for depth, (function, line) in enumerate(part):
            calls.setdefault((part[:depth], function), set()).add(line)
    counts = {}
    for part, (n, in_loops) in parts.items():
        names = []
        for depth, (function, line) in enumerate(part):
            lines = sorted(calls[part[:depth], function])
            names.append(function if len(lines) == 1 else f"{function} {lines.index(line) + 1}")
        counts["/".join(names) or "itself"] = [n, in_loops]
    return dict(sorted(counts.items()))


def radv(tests):
    """The driver, and what it made of each kernel, as the tests of machine code print it."""
    printed = output([*([tests] if tests else [*TEST, "--"]), "machine_code::no_kernel", "--nocapture"])
    found = {}
    for line in re.findall(r"^Code \{ (.*) \}$", printed, re.M):
        numbers = dict(re.findall(r"(\w+): (\d+)", line))
        found[re.search(r'kernel: "(\w+)"', line).group(1)] = {key: int(value) for key, value in numbers.items()}
    if not found:
        sys.exit(f"the tests printed no machine code:\n{printed}")
    return re.search(r"^driver: (.*)$", printed, re.M).group(1), found


if __name__ == "__main__":
    main()
