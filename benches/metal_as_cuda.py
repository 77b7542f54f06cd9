"""naga's Metal of a compute module as CUDA, which NVIDIA's compiler takes without a card or a toolkit.

A buffer's bounds check compares the element's index with a count that the kernel is given, as robustBufferAccess2
compares an offset with a size. Workgroup memory is not cleared: a Vulkan driver does that by means of its own.
"""

import re
from pathlib import Path

HEADER = Path(__file__).with_name("metal.cuh")
# Parameters of a Metal kernel by their attribute, as CUDA has them.
BUILT_IN = {
    "threadgroup_position_in_grid": "metal::uint3 {} {{blockIdx.x, blockIdx.y, blockIdx.z}};",
    "threadgroups_per_grid": "metal::uint3 {} {{gridDim.x, gridDim.y, gridDim.z}};",
    "thread_index_in_threadgroup": "metal::uint {} = threadIdx.x;",
    "thread_position_in_threadgroup": "metal::uint3 {} {{threadIdx.x, threadIdx.y, threadIdx.z}};",
    "thread_index_in_simdgroup": "metal::uint {} = threadIdx.x & 31;",
    "threads_per_simdgroup": "metal::uint {} = 32;",
}
KERNEL = re.compile(r"\[\[max_total_threads_per_threadgroup\((\d+)\)\]\] kernel void (\w+)\(\n(.*?)\n\) \{\n", re.S)
# What one thread does to clear workgroup memory, at the beginning of a kernel, after the variables of its own.
CLEARED = re.compile(
    r"(?P<own>(?:    \w+ \w+ = \{\};\n)*)    if \(\w+ == 0u\) \{\n.*?\n    \}\n    metal::threadgroup_barrier\(.*?\);\n",
    re.S,
)


def translated(metal):
    """The CUDA source of a module that naga wrote as Metal."""
    text = re.sub(r"#include <.*?>\n|using metal::uint;\n", "", metal)
    text = re.sub(r"1 \+ \(_buffer_sizes\.(size\d+) - \d+ - \d+\) / \d+", r"_buffer_sizes.\1", text)
    # A number without a suffix is a double in CUDA.
    text = re.sub(r"(?<![\w.])(\d+\.\d+(?:e[-+]?\d+)?)(?![\w.])", r"\1f", text)
    text = re.sub(r"(?<![:\w])uint2\b", "metal::uint2", text)
    # Arrays of unknown length are declared with one element.
    text = re.sub(r"^typedef (.*)\[1\];", r"typedef \1[1 << 24];", text, flags=re.M)
    text = re.sub(r"^constant (\w[\w:]* \w+ = )", r"static __device__ const \1", text, flags=re.M)
    text = re.sub(r"return (\w+)\.yx;", r"return metal::float2(\1.y, \1.x);", text)
    for pair in ("xy", "zw"):
        text = re.sub(rf"\b(\w+)\.{pair}\b", rf"metal::float2(\1.{pair[0]}, \1.{pair[1]})", text)
    function = r"^((?!struct|typedef|kernel|using|static|\[\[|template)[\w:]+(?: const)?&? \w+\()$"
    text = re.sub(function, r"static __device__ __forceinline__ \1", text, flags=re.M)
    out, at = [HEADER.read_text()], 0
    for kernel in KERNEL.finditer(text):
        out.append(text[at : kernel.start()])
        out.append(signature(*kernel.groups()))
        cleared = CLEARED.match(text, kernel.end()) if "\n, threadgroup " in kernel.group(3) else None
        if cleared:
            out.append(cleared["own"])
        at = cleared.end() if cleared else kernel.end()
    return "".join([*out, text[at:]])


def signature(n_threads, name, parameters):
    """The beginning of a kernel in CUDA."""
    given, declared = [], []
    for line in parameters.split("\n"):
        line = re.sub(r"^[\s,]*", "", line)
        parameter = re.search(r"(\w+)(?: \[\[|$)", line).group(1)
        attribute = re.search(r"\[\[(\w+)", line)
        if attribute and attribute.group(1) in BUILT_IN:
            declared.append(BUILT_IN[attribute.group(1)].format(parameter))
        elif shared := re.match(r"threadgroup ([\w:]+)& ", line):
            declared.append(f"__shared__ {shared.group(1)} {parameter};")
        elif uniform := re.match(r"constant ([\w:]+)& ", line):
            given.append(f"const __grid_constant__ {uniform.group(1)} {parameter}")
        elif buffer := re.match(r"device ([\w:]+(?: const)?)& ", line):
            given.append(f"{buffer.group(1)}* __restrict__ {parameter}_at")
            declared.append(f"{buffer.group(1)}& {parameter} = *{parameter}_at;")
        else:
            raise SystemExit(f"{name}: no translation of the parameter `{line}`")
    head = f'extern "C" __global__ __launch_bounds__({n_threads}) void {name}({", ".join(given)}) {{\n'
    return head + "".join(f"    {line}\n" for line in declared)
