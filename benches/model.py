#!/usr/bin/env python3
"""A model of a step's time on graphics cards, from the kernels' machine code and from what their threads do.

    python3 benches/model.py                       # docs/results/machine_code.json
    python3 benches/model.py MENDED.json           # another file of benches/machine_code.py

A kernel takes the longest of four times: its instructions, its bytes of memory, those through the second-level cache,
and the starts of its workgroups. An NVIDIA H200 takes up to twice as long: docs/notebook/gpu.md. Instructions of each
part of a kernel are multiplied by how often subgroups run through it: RULES below, with the counts of the example
`lanes`. Reads of the world's tables are left out: neighbours read the same, so they stay in the first-level cache.
Standard library only.
"""

import argparse
import json
import re
import sys
from pathlib import Path
from typing import NamedTuple

RESULT = Path(__file__).resolve().parents[1] / "docs/results/machine_code.json"
CASES = ("low", "middle", "high")
# What is reached of each rate, and the time between two kernels of which one waits for the other (us).
REACHED = {
    "low": {"instructions": 0.55, "memory": 0.70, "cache": 0.6, "workgroups": 0.6, "wait": 5.0},
    "middle": {"instructions": 0.75, "memory": 0.82, "cache": 0.8, "workgroups": 1.0, "wait": 3.5},
    "high": {"instructions": 0.90, "memory": 0.90, "cache": 1.0, "workgroups": 4.0, "wait": 2.0},
}


class Card(NamedTuple):
    instructions: float  # of a subgroup, a ns, by data sheet
    memory: float  # TB/s, by data sheet
    cache: float  # TB/s of the second-level cache, assumed
    workgroups: float  # started a ns: assumed to be one a clock
    cache_size: float  # MB, by data sheet
    width: int  # threads of a subgroup
    resident: int  # threads at a time, with 64 registers each


CARDS = {
    "H100": Card(132 * 4 * 1.755, 3.35, 5.5, 1.755, 50, 32, 132 * 1024),
    "H200": Card(132 * 4 * 1.755, 4.8, 5.5, 1.755, 50, 32, 132 * 1024),
    # Its units take two clocks for a subgroup of 64.
    "7900 XTX": Card(96 * 2 * 2.5 / 2, 0.96, 3.5, 2.5, 96, 64, 96 * 2048),
}
# Columns that a kernel of a step reads and writes a truck, or bytes where it needs less than the row.
TOUCHED = {
    "draw": [32, 8, "action"],
    "steer": ["action", "truck", "control", "control"],
    "drive": ["control", "truck", "truck"],
    "follow": ["truck", "progress", "progress"],
    "advance": ["action", "control", "control", "truck", "truck", "progress", "progress"],
    "collide": ["truck", "clearance"],
    "sense": ["truck", "ranges"],
    "observe": ["truck", "progress", "ranges", "next_observation"],
    "copy_observation": [32, "next_observation", "next_extras", "observation", "extras"],
    "observe_both": ["truck", "progress", "ranges", "next_observation", "observation"],
    "judge": ["truck", "clearance", "progress", "ended", "terms", "reward", 32],
    "count": [32, "ended", "reward"],
    "judge_and_count": ["truck", "clearance", "progress", "ended", "terms", "reward", 32],
    "reset": [32, "ended"],
    "sense_after_reset": [32],
    "observe_after_reset": [32],
}
# What one kernel does instead of several, where it is there.
AT_ONCE = {
    "advance": ("steer", "drive", "follow"),
    "observe_both": ("observe", "copy_observation"),
    "judge_and_count": ("judge", "count"),
}
# The policy that is modelled: values and outputs of its layers, those of `attard2023`.
LAYERS = [69, 256, 256, 9]
# Threads side by side, each for four outputs; as many teams, each with trucks of its own. See policy/src/kernel.rs.
COLUMNS, TEAMS, TILE = 64, 2, 16
# Values that neighbouring threads write to sectors of their own, of 32 bytes; not by way of workgroup memory.
SCATTERED = {"observe": 69}
# Trucks of a workgroup where `sense` has workgroup memory: its threads take rays from a queue.
QUEUE = 32
# Functions that RULES count on.
KNOWN = {
    "sense": "field_sample",
    "collide": "sample_first 2",
    "drive": "driven",
    "advance": "driven",
    "observe": "observed",
    "observe_both": "compute",
}
# A part runs as often a truck as the first line says that its kernel and its functions match; a line with True is for
# instructions in loops alone. See `times`.
RULES = [
    # attard2023 has no disturbances and observes no extras.
    (".*", r"late_action|perceive|\bseen|observe_extras|noise|reading|exact_range 2|begun|copy_first", False, "never"),
    # Its trucks are alone and begin where their routes do; an episode follows in the same step, the last of three.
    (".*", r"start [12]|standing_at|free_route|n_free|drawn_below [23]", False, "never"),
    ("sense.*", r"block_sample 1", False, "ray block"),
    ("sense.*", r"block_sample 2", False, "ray second block"),
    ("sense.*", r"field_sample/interpolated", False, "ray own cell"),
    ("sense.*", r"rotated", True, "next ray"),
    ("sense.*", r"read_off", True, "range"),
    ("sense.*", r"", True, "ray sample"),
    ("sense.*", r"", False, "ray"),
    # Its first samples, a tractor's and then its trailer's, four at a time; then teams.
    ("collide", r"sample_first 1/sampled.*block_sample 1", False, "tractor's point block"),
    ("collide", r"sample_first 1/sampled.*block_sample 2", False, "tractor's point second block"),
    ("collide", r"sample_first 1/(sampled|point_of)", False, "tractor's point"),
    ("collide", r"sample_first 1", True, "tractor's line"),
    ("collide", r"sample_first 2/sampled.*block_sample 1", False, "trailer's point block"),
    ("collide", r"sample_first 2/sampled.*block_sample 2", False, "trailer's point second block"),
    ("collide", r"sample_first 2/(sampled|point_of)", False, "trailer's point"),
    ("collide", r"sample_first 2", True, "trailer's line"),
    ("collide", r"halve/sampled.*block_sample 1", False, "halving block"),
    ("collide", r"halve/sampled.*block_sample 2", False, "halving second block"),
    ("collide", r"halve/(whole_line|ends_of|is_undecided 1|line_of 1|sums_of 1|keep 1)", False, "lines of a pass"),
    ("collide", r"halve/(sampled|is_undecided|line_of|middle)", False, "halving"),
    ("collide", r"halve/(body_of|unit_field_at|n_points_of)|hand_over", False, "pass"),
    ("collide", r"halve", False, "round"),
    ("collide", r"^itself", True, "pass"),
    ("drive|advance", r"driven", True, "substep"),
    ("observe.*", r"followed", False, "truck"),
    ("observe_after_reset", r"^(itself|observed)(/preview_value)?$", True, "value begun"),
    ("observe_both", r"^(itself|observed)(/preview_value)?$", True, "value"),
    ("observe|observe_both", r"", True, "looked ahead"),
    ("(observe_after_)?reset", r"^(itself|index_of|has_begun|clear_list|n_listed_values)", False, "truck"),
    ("observe_after_reset", r"", True, "begun and looked ahead"),
    ("(observe_after_)?reset", r"", False, "begun"),
    ("copy_observation", r"", False, "value"),
    (".*", r"", False, "truck"),
]


def times(replay, width, is_queued):
    """How often subgroups of `width` threads run through parts of kernels, a truck."""
    rays = replay["sense"]["subgroups_of"][str(width)][f"queue of {QUEUE} trucks" if is_queued else "a thread a ray"]
    clearances = replay["collide"]["subgroups_of"][str(width)]
    points, halvings = clearances["first_samples"], clearances["halvings"]
    teams = replay["collide"]["by_teams"]
    begun = replay["trucks_that_have_just_begun"]

    def some(n_trucks):
        return 1 - (1 - begun) ** n_trucks

    # Of 24 points a tractor has 8, which each of four reads takes two of, and a trailer 16.
    parts = {"tractor's": 2 / 24, "trailer's": 4 / 24}
    of_points = {"point": "iterations", "point block": "blocks", "point second block": "second_blocks"}
    return {
        f"{whose} {what}": part * points[count] for whose, part in parts.items() for what, count in of_points.items()
    } | {
        "never": 0,
        "truck": 1 / width,
        "value": 69 / width,
        "substep": replay["substeps"] / width,
        # Five waypoints ahead; loops over more values are unrolled by four.
        "looked ahead": 5 / width,
        "begun": some(width) / width,
        "value begun": 69 * begun / width,
        "begun and looked ahead": 5 * some(width) / width,
        "ray": 64 / width / QUEUE if is_queued else 29 / width,
        "next ray": rays["refills"],
        "range": 29 / width,
        "ray sample": rays["iterations"],
        "ray own cell": rays["own_cells"],
        "ray block": rays["blocks"],
        "ray second block": rays["second_blocks"],
        "some ray": some(1 + width / 29),
        "tractor's line": 11 / width,
        "trailer's line": 19 / width,
        # All subgroups of a workgroup of 64 go through its passes, over 3 times 8 lines.
        "pass": teams["passes"] * 64 / width,
        "lines of a pass": teams["passes"] * 3 * 64 / width,
        "round": (teams["passes"] + teams["rounds"]) * 64 / width,
        "halving": halvings["iterations"],
        "halving block": halvings["blocks"],
        "halving second block": halvings["second_blocks"],
    }


def executed(name, kernel, counts):
    """Instructions of a subgroup, a truck."""
    if name in KNOWN and not any(re.search(KNOWN[name], part) for part in kernel["parts"]):
        sys.exit(f"{name} has no part {KNOWN[name]}: RULES do not say how often its parts run")
    n = 0
    for part, (n_all, n_in_loops) in kernel["parts"].items():
        for is_in_loop, n_part in ((True, n_in_loops), (False, n_all - n_in_loops)):
            of_part = (rule for rule in RULES if re.fullmatch(rule[0], name) and re.search(rule[1], part))
            time = counts[next(of for _, _, loops, of in of_part if is_in_loop or not loops)]
            # Of the rays only those of trucks that have begun are traced, if a subgroup has any.
            is_traced = name == "sense_after_reset" and not re.match(r"itself|index_of|has_begun|naga_", part)
            n += n_part * time * (counts["some ray"] if is_traced else 1)
    return n


def amounts(name, kernel, replay, card):
    """What a kernel needs a truck: instructions of a subgroup, bytes of memory and through the cache, workgroups."""
    of, spills = CARDS[card], kernel["stack"]
    is_queued = name.startswith("sense") and 0 < kernel["shared"]
    counts = times(replay, of.width, is_queued)
    memory = sum(what if isinstance(what, int) else replay["row_bytes"][what] for what in TOUCHED[name])
    # A thread's own memory goes out to the cards' where what all resident threads have is larger than the cache.
    missed = max(0, 1 - of.cache_size * 1e6 / (of.resident * spills)) if spills else 0
    threads = 29 if name.startswith("sense") else 69 if name == "copy_observation" else 1
    scattered = 0 if kernel["shared"] else 28 * SCATTERED.get(name, 0)
    return {
        "instructions": executed(name, kernel, counts),
        "memory": memory + missed * spills,
        "cache": memory + spills + scattered,
        "workgroups": 1 / QUEUE if is_queued else threads / 64,
    }


def modelled(result, card):
    """For each kernel of a step with random actions the ns a truck, low, middle and high."""
    kernels = list(result["nvidia"].values())[-1]
    found = {}
    for name, kernel in kernels.items():
        if name not in TOUCHED or any(name in parts for at_once, parts in AT_ONCE.items() if at_once in kernels):
            continue
        need = amounts(name, kernel, result["replay"], card)
        found[name] = {"need": need, "ns": longest(need, card)}
    return found


def acting(kernel, result, card):
    """The same of the kernel that acts: its multiply-adds, and each weight that a workgroup reads for its trucks."""
    of = CARDS[card]
    loops = sorted(kernel["multiplying_loops"], key=lambda loop: -loop["multiply_adds"])
    subgroups = TEAMS * COLUMNS / of.width
    n, read = 0, 0
    for inputs, outputs in zip(LAYERS, LAYERS[1:]):
        inputs, columns = -(-inputs // 4) * 4, -(-outputs // 4)
        # Where half of the threads would do, two share a column, and each has half of a team's trucks.
        is_shared = 2 * columns <= COLUMNS
        loop = loops[1 if is_shared else 0]
        needed = inputs * 4 * TILE / TEAMS / (2 if is_shared else 1)
        # Subgroups of a team in which any thread has a column.
        working = TEAMS * -(-columns * (2 if is_shared else 1) // of.width)
        n += needed * loop["instructions"] / loop["multiply_adds"] * working
        read += 16 * columns * (inputs + 1)
    # What is not in these loops runs once a layer, about.
    rest = sum(kernel["instructions"].values()) - sum(loop["instructions"] for loop in loops)
    memory = sum(result["replay"]["row_bytes"][what] for what in ("next_observation", "action"))
    need = {
        "instructions": (n + rest * subgroups * (len(LAYERS) - 1)) / TILE,
        "memory": memory,
        "cache": memory + read / TILE,
        "workgroups": 1 / TILE,
    }
    return {"need": need, "ns": longest(need, card)}


def by_policy(result, card):
    """The kernels of a step with the policy's actions; none of a result without its kernel."""
    kernel = list(result["nvidia"].values())[-1].get("act")
    if kernel is None:
        return {}
    others = {name: found for name, found in modelled(result, card).items() if name != "draw"}
    return others | {"act": acting(kernel, result, card)}


def longest(need, card):
    """The ns that is the longest of all needs, low, middle and high."""
    # A TB/s is 1,000 bytes a ns.
    scale = {"memory": 1000, "cache": 1000}
    rates = {what: getattr(CARDS[card], what) * scale.get(what, 1) for what in need}
    return [max(need[what] / (rates[what] * REACHED[case][what]) for what in need) for case in CASES]


def speed(found, n_envs):
    """M env steps/s of so many trucks."""
    steps = zip(*(kernel["ns"] for kernel in found.values()))
    waits = [1000 * REACHED[case]["wait"] * len(found) for case in CASES]
    return [1000 * n_envs / (n_envs * sum(ns) + wait) for ns, wait in zip(steps, waits)]


def three(values, digits):
    """Low, middle and high, as a document has them."""
    low, middle, high = (f"{value:.{digits}f}" for value in values)
    return f"{low}/**{middle}**/{high}"


def table(results):
    """The lines of a document's table: for each file instructions, H100 and 7900 XTX."""
    found = [{card: modelled(result, card) for card in ("H100", "7900 XTX")} for result in results]
    driven = [{card: by_policy(result, card) for card in cards} for result, cards in zip(results, found)]
    kernels = list(dict.fromkeys(name for cards in found for name in cards["H100"]))
    yield "| kernel |" + " instructions of a warp a truck | H100 | 7900 XTX |" * len(found)
    yield "|---|" + "---|---|---|" * len(found)
    for name in [*kernels, *(["act"] if any(any(cards.values()) for cards in driven) else [])]:
        row = [name]
        for cards in driven if name == "act" else found:
            if name in cards["H100"]:
                row.append(f"{cards['H100'][name]['need']['instructions']:,.0f}")
                row += [three(cards[card][name]["ns"], 2) for card in cards]
            else:
                row += ["", "", ""]
        yield f"| {' | '.join(row)} |"
    for n_envs, by, cards_of in ((1 << 20, "", found), (1 << 16, "", found), (1 << 20, ", the policy", driven)):
        row = [f"M env steps/s, {n_envs:,} trucks{by}"]
        for cards in cards_of:
            row += ["", *(three(speed(cards[card], n_envs), 0) if cards[card] else "" for card in cards)]
        yield f"| {' | '.join(row)} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("results", nargs="*", type=Path, default=[RESULT], help="files of benches/machine_code.py")
    parser.add_argument("--table", action="store_true", help="print a table for a document")
    args = parser.parse_args()
    results = [json.loads(file.read_text()) for file in args.results]
    if args.table:
        print("\n".join(table(results)))
        return
    for file, result in zip(args.results, results):
        print(f"{file.name}, {result['date']}, {result['commit']}: ns a truck on each card, low / middle / high")
        cards = {card: modelled(result, card) for card in CARDS}
        driven = {card: by_policy(result, card) for card in CARDS}
        for name in [*cards["H100"], *(["act"] if all(driven.values()) else [])]:
            of_cards = driven if name == "act" else cards
            columns = [" / ".join(f"{ns:.2f}" for ns in found[name]["ns"]) for found in of_cards.values()]
            need = of_cards["H100"][name]["need"]
            amount = f"{need['instructions']:7.1f} instr. {need['memory']:6.0f} B {need['workgroups']:.2f} workgroups"
            print(f"  {name:20}{amount}  " + "  ".join(columns))
        for n_envs in (16_384, 65_536, 1_048_576):
            rates = [f"{card} " + " / ".join(f"{rate:.0f}" for rate in speed(cards[card], n_envs)) for card in cards]
            print(f"  {n_envs:9,} trucks, M env steps/s: " + ";  ".join(rates))
        if all(driven.values()):
            rates = [f"{card} " + " / ".join(f"{rate:.0f}" for rate in speed(driven[card], 1 << 20)) for card in driven]
            print(f"  {1 << 20:9,} trucks by the policy: " + ";  ".join(rates))


if __name__ == "__main__":
    main()
