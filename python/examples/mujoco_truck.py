"""Lets a policy drive a multibody truck that shares no equation with the simulator it was trained in.

    python mujoco_truck.py --validate
    python mujoco_truck.py --policy laden2026 --load empty half laden laden_high --starts 10 --json truck.json

The truck is made of MuJoCo's bodies and of tyre forces, see multibody.py; ``offtrack_sim.Observer`` sees for the policy
and judges. ``--validate`` compares the truck with published figures and with its vehicle file first. Needs
``offtrack-sim``, ``mujoco`` and Python 3.11; ``--film`` needs pillow.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from multibody import Array, SpeedControl, Trucks
from multibody_parts import GROUPS, read
from results import about, write_json

import offtrack_sim
from offtrack_sim import Ended

VEHICLES = Path(__file__).resolve().parents[2] / "scenarios" / "vehicles"
RANGES = slice(30, 59)
"""Of an observation's values the distances to kerbs, see ``offtrack_sim.OBSERVATION``."""
OVER = math.radians(29)
"""Roll of the trailer beyond which no truck comes back [rad]."""


@dataclass
class Outcome:
    """What became of the episodes with one load, n of them."""

    routes: list[str]
    ended: Array
    """Why each ended, as :class:`offtrack_sim.Ended`."""
    seconds: Array
    lane_distance: Array
    """Distance of the middle of the wheelbase to the lane's centre, summed over the steps [m]."""
    load_transfer_ratio: Array
    """Largest of the trailer, in magnitude."""
    poses: list[dict[str, Any]] = field(default_factory=list)
    """The first truck after each step, with the names that a state of the simulator has; ranges as observed."""

    def add(self, running: npt.NDArray[np.bool_], trucks: Trucks, seen: Any) -> None:
        """A step of those that were running."""
        codes = np.where(np.abs(trucks.trailer_roll) > OVER, Ended.ROLLED_OVER, seen.ended)
        self.ended[running] = codes[running]
        self.seconds[running] += SpeedControl.PERIOD
        self.lane_distance[running] += np.abs(seen.lane_distance[running])
        ratio = np.maximum(self.load_transfer_ratio, np.abs(trucks.load_transfer_ratio))
        self.load_transfer_ratio[running] = ratio[running]
        names = "position", "heading", "trailer_heading", "speed", "steering"
        pose = {name: getattr(trucks, name)[:1].astype(np.float32) for name in names}
        self.poses.append(pose | {"ranges": seen.values[0, RANGES]})

    def summary(self) -> dict[str, Any]:
        """The same for a table and a file."""
        arrived = self.ended == Ended.ARRIVED
        causes = Counter(Ended(int(code)).name.lower() for code in self.ended[~arrived])
        return {
            "episodes": len(self.ended),
            "arrived": int(arrived.sum()),
            "success": float(arrived.mean()),
            "failures": dict(causes.most_common()),
            "seconds_mean": float(self.seconds[arrived].mean()) if arrived.any() else None,
            "lane_distance_mean": float((self.lane_distance / self.seconds).mean() * SpeedControl.PERIOD),
            "load_transfer_ratio_median": float(np.median(self.load_transfer_ratio)),
            "load_transfer_ratio_max": float(self.load_transfer_ratio.max()),
            "failed": dict(Counter(route for route, ended in zip(self.routes, arrived) if not ended)),
        }


class Starts:
    """Starts on each route, drawn with a seed, and what the policy does from them in the simulator itself."""

    def __init__(self, args: argparse.Namespace, load: str) -> None:
        self.routes = [name for name in args.names for _ in range(args.starts)]
        n = len(self.routes)
        self.batch = batch = offtrack_sim.Batch(args.benchmark, n, split="test", routes=args.names)
        # A benchmark with one vehicle does not name it.
        kinds = [kind for kind in [(args.vehicle, load), ("", load)] if kind in batch.classes]
        if not kinds:
            known = ", ".join(" ".join(kind).strip() for kind in batch.classes)
            raise SystemExit(f"--load: {args.vehicle} {load}; {batch.scenario} has {known}")
        self.kind = kinds[0]
        rows = np.flatnonzero(batch.vehicle_classes == batch.classes.index(self.kind)).tolist()
        drawn = np.random.default_rng(args.seed).uniform(-1, 1, (n, 3)).tolist()
        vehicles = [rows[index % len(rows)] for index in range(n)]
        starts = [offtrack_sim.Start(x, y, z, vehicle) for (x, y, z), vehicle in zip(drawn, vehicles)]
        batch.begin(routes=self.routes, starts=starts)
        truck = batch.columns("truck")["truck"]
        self.position, self.heading = truck["position"].astype(float), truck["heading"].astype(float)
        self.speed = truck["speed"].astype(float)

    def drive(self, policy: offtrack_sim.Policy) -> int:
        """Lets the policy drive the simulator's own trucks; returns how many of them arrive."""
        ended = np.zeros(len(self.routes), dtype=np.int64)
        while (running := ended == Ended.RUNNING).any():
            self.batch.step(policy.act(self.batch.observation()))
            if (ends := self.batch.ended()) is not None:
                first = running[ends.envs]
                ended[ends.envs[first]] = ends.codes[first]
        return int((ended == Ended.ARRIVED).sum())


class Late:
    """Steer commands that arrive a while after they were given."""

    def __init__(self, delay: float, timestep: float, period: float) -> None:
        self.steps, late = round(period / timestep), round(delay / timestep)
        self._whole, self._rest = divmod(late, self.steps)
        self._given: list[Array] = []

    def drive(self, trucks: Trucks, steering: Array, acceleration: Array) -> None:
        """One period, in which what was given earlier still arrives."""
        if not self._given:
            self._given = [np.zeros_like(steering)] * (self._whole + 2)
        self._given = [*self._given[1:], steering]
        if self._rest:
            trucks.advance(self._given[-2 - self._whole], acceleration, self._rest)
        trucks.advance(self._given[-1 - self._whole], acceleration, self.steps - self._rest)


def drive(policy: offtrack_sim.Policy, starts: Starts, args: argparse.Namespace, load: str) -> Outcome:
    """Lets the policy drive the multibody trucks, from all starts at once."""
    n = len(starts.routes)
    observer = offtrack_sim.Observer(args.benchmark, routes=starts.routes, vehicles=[starts.kind] * n)
    policy.check(observer)
    parts = read(VEHICLES / f"{args.vehicle}.toml", load)
    length = observer.dimensions()["trailer_wheelbase"]
    if abs(length - parts.trailer_wheelbase) > 0.001:
        raise SystemExit(
            f"--vehicle: {args.vehicle}; {args.benchmark} has a trailer with a wheelbase of {length:.3f} m"
        )
    trucks, control = Trucks(parts, n, mu=args.mu), SpeedControl(parts, n)
    late = Late(args.delay, trucks.model.opt.timestep, SpeedControl.PERIOD)
    trucks.place(np.arange(n), starts.position, starts.heading, starts.heading, starts.speed)
    seen = observer.begin(trucks.position, trucks.heading, trucks.trailer_heading, trucks.speed)
    found = Outcome(starts.routes, np.zeros(n, dtype=np.int64), np.zeros(n), np.zeros(n), np.zeros(n))
    target = starts.speed
    while (running := found.ended == Ended.RUNNING).any():
        before = trucks.speed
        steering, target = (part.astype(float) for part in observer.command(policy.act(seen.values), target))
        late.drive(trucks, steering, control(before, target))
        seen = observer.observe(
            trucks.position,
            trucks.heading,
            trucks.trailer_heading,
            trucks.speed,
            steering=trucks.steering,
            target_speed=target,
            acceleration=(trucks.speed - before) / SpeedControl.PERIOD,
            lateral_acceleration=trucks.trailer_lateral_acceleration,
            trailer_roll=trucks.trailer_roll,
            trailer_roll_rate=trucks.trailer_roll_rate,
        )
        found.add(running, trucks, seen)
        # A truck whose episode has ended stands where it is: one that rolls over would go on rolling.
        done = np.flatnonzero(found.ended != Ended.RUNNING)
        trucks.place(done, trucks.position[done], trucks.heading[done], trucks.heading[done], np.zeros(len(done)))
        if len(found.poses) % 50 == 0:
            print(f"{load}: {len(found.poses) / 10:.0f} s, {running.sum()} of {n} drive", file=sys.stderr, flush=True)
    return found


def film(args: argparse.Namespace, policy: offtrack_sim.Policy, starts: Starts, poses: list[dict[str, Any]]) -> None:
    """The first truck in the simulator, left, beside the multibody truck on the same route, as a GIF."""
    from PIL import Image

    batch = starts.batch
    shown = offtrack_sim.Batch(args.benchmark, 1, split="test", routes=starts.routes[:1], autoreset="disabled")
    state = shown.state()
    reach = (state["ranges"] / shown.observation()[:, RANGES]).max()
    frames, running = [], True
    left = batch.render(0)
    for pose in poses:
        if running:
            batch.step(policy.act(batch.observation()))
            ends = batch.ended()
            running = ends is None or 0 not in ends.envs
            left = batch.render(0) if running else left
        state["ranges"][0] = reach * pose["ranges"]
        for name in pose.keys() - {"ranges"}:
            state["truck"][name] = pose[name]
        shown.restore(state)
        frames.append(Image.fromarray(np.concatenate([left, shown.render(0)], axis=1)).quantize(64))
    frames[0].save(args.film, save_all=True, append_images=frames[1:], duration=100, loop=0)


def validate() -> list[dict[str, Any]]:
    """Prints the table of checks as it is made."""
    from multibody_checks import CHECKS

    print("| check | multibody truck | expected | | expected by |\n|---|---|---|---|---|")
    rows = []
    for check in CHECKS:
        for row in check(VEHICLES):
            print(f"| {row.what} | {row.found:.3f} | {row.expected:.3f} | {row.unit} | {row.source} |", flush=True)
            rows.append(row._asdict())
    return rows


def table(results: dict[str, dict[str, Any]]) -> str:
    """The results as Markdown, a row for each load."""
    lines = [
        "| load | simulator's truck | multibody truck | time | lane distance | LTR: median, most | failures |",
        "|---|" + "---|" * 6,
    ]
    for load, row in results.items():
        failures = ", ".join(f"{name} {count}" for name, count in row["failures"].items())
        time = "" if row["seconds_mean"] is None else f"{row['seconds_mean']:.1f} s"
        own = row["arrived_in_simulator"] / row["episodes"]
        ratios = f"{row['load_transfer_ratio_median']:.2f}, {row['load_transfer_ratio_max']:.2f}"
        lines.append(
            f"| {load} | {own:.1%} | {row['success']:.1%} ({row['arrived']} of {row['episodes']}) "
            f"| {time} | {row['lane_distance_mean']:.2f} m | {ratios} | {failures} |"
        )
    return "\n".join(lines)


def made_with() -> dict[str, Any]:
    """What a figure was measured with; MuJoCo comes as a package of this name or as ``mujoco-core``."""
    made = about("numpy")
    made["versions"]["mujoco"] = mujoco.__version__
    return made


def check_files(args: argparse.Namespace) -> None:
    """Ends the program where a file could not be written, before anything is driven."""
    for file in filter(None, (args.json, args.film)):
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            is_new = not file.exists()
            file.open("ab").close()
            if is_new:
                file.unlink()
        except OSError as error:
            raise SystemExit(str(error)) from None


def main() -> None:
    parser = argparse.ArgumentParser(
        description="A policy in a multibody truck", formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("--validate", action="store_true", help="compare the truck with what is known, and end")
    parser.add_argument("--policy", default="laden2026", help="a shipped policy's name, or a policy file")
    parser.add_argument("--benchmark", help="whose test routes it drives and as which it observes; else the policy's")
    parser.add_argument("--vehicle", default="daf_xf", choices=list(GROUPS))
    parser.add_argument("--load", nargs="+", default=["laden"], help="loads of the vehicle file")
    parser.add_argument("--routes", nargs="+", default=["test"], help="names of routes, or test for all of them")
    parser.add_argument("--starts", type=int, default=3, help="episodes on each route")
    parser.add_argument("--seed", type=int, default=0, help="of the starts")
    parser.add_argument("--mu", type=float, default=0.75, help="peak friction of the tyres")
    parser.add_argument("--delay", type=float, default=0.0, help="from a steer command to the wheels [s]")
    parser.add_argument("--json", type=Path, help="file to write the results to")
    parser.add_argument("--film", type=Path, help="GIF of the first episode beside the simulator's own")
    args = parser.parse_args()
    if args.film and args.film.suffix != ".gif":
        parser.error("--film: a name that ends in .gif is needed")
    if args.validate:
        check_files(args)
        rows = validate()
        if args.json:
            write_json(args.json, made_with() | {"checks": rows})
        return
    if args.starts < 1 or args.seed < 0 or not 0 <= args.delay <= 2 or not 0.05 <= args.mu <= 2:
        parser.error("--starts: at least 1; --seed: at least 0; --delay: 0..2; --mu: 0.05..2")
    try:
        is_file = args.policy.endswith(".safetensors")
        policy = offtrack_sim.Policy.load(args.policy) if is_file else offtrack_sim.Policy.shipped(args.policy)
        args.benchmark = args.benchmark or policy.benchmark
        named = None if args.routes == ["test"] else args.routes
        args.names = offtrack_sim.Batch(args.benchmark, 1, split="test", routes=named).split_routes
    except ValueError as error:
        hint = "; --benchmark names another one" if str(error).startswith("benchmark: ") else ""
        raise SystemExit(f"{error}{hint}") from None
    check_files(args)
    results: dict[str, dict[str, Any]] = {}
    for load in args.load:
        starts = Starts(args, load)
        outcome = drive(policy, starts, args, load)
        if args.film and not results:
            film(args, policy, Starts(args, load), outcome.poses)
        results[load] = outcome.summary() | {"arrived_in_simulator": starts.drive(policy)}
    print(table(results))
    if args.json:
        settings = {name: getattr(args, name) for name in ("vehicle", "starts", "seed", "mu", "delay")}
        made = made_with() | {
            "policy": policy.name,
            "benchmark": args.benchmark,
            "settings": settings,
        }
        write_json(args.json, made | {"routes": args.names, "loads": results})


if __name__ == "__main__":
    main()
