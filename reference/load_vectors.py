"""Writes tests/data/load_vectors.json: open-loop cases with target speeds, loads and lags.

An integrator of its own, in steps of 0.1 ms, that shares no line with the simulator. The equations are those of
src/engine/cpu/drive.rs and steer.rs in continuous time. Run at the root: python3 reference/load_vectors.py
"""

from __future__ import annotations

import json
import math
from pathlib import Path

G = 9.81
STEP = 1e-4
CONTROL_STEP = 0.1
TRUCKS = {
    "daf_xf": {"L1": 3.543, "a": 0.408, "L2": 7.756},
    "eu_4x2_13m6": {"L1": 3.6, "a": 0.55, "L2": 7.7},
}
# Mass of the truck, slip, strongest drive, roll of the trailer.
LOADS = {
    "empty": (14.6e3, 0.0136, 1.5, {"T2": 2.0, "h2": 1.25, "hr2": 0.75, "Rphi2": 0.10, "fn2": 1.2, "zeta2": 0.20}),
    "half": (26.8e3, 0.0185, 1.0, {"T2": 2.0, "h2": 1.60, "hr2": 0.78, "Rphi2": 0.18, "fn2": 0.9, "zeta2": 0.18}),
    "laden": (40e3, 0.0185, 0.7, {"T2": 1.95, "h2": 2.0, "hr2": 0.8, "Rphi2": 0.30, "fn2": 0.65, "zeta2": 0.15}),
    "laden_high": (40e3, 0.0185, 0.7, {"T2": 1.95, "h2": 2.2, "hr2": 0.8, "Rphi2": 0.33, "fn2": 0.55, "zeta2": 0.12}),
}
TRACTOR = {"T1": 1.95, "h1": 1.1, "hr1": 0.7, "Rphi1": 0.09, "fn1": 1.5, "zeta1": 0.25}


def clamp(value: float, low: float, high: float) -> float:
    return max(low, min(high, value))


class Roll:
    """One degree of freedom: a mass above a roll centre."""

    def __init__(self, truck: dict, unit: str) -> None:
        keys = ("T", "h", "hr", "Rphi", "fn", "zeta")
        track, height, centre, self.gain, frequency, self.damping = (truck[k + unit] for k in keys)
        self.natural, lever = math.tau * frequency, height - centre
        self.direct = 2 * centre / (track * G)
        self.of_angle = 2 * lever * (1 + 1 / self.gain) / track
        self.of_rate = 4 * self.damping * lever / (self.gain * self.natural * track)
        self.static = 2 * (height + self.gain * lever) / track / G
        self.angle = self.rate = 0.0

    def step(self, lateral: float) -> None:
        # Semi-implicit midpoint.
        def slope(angle: float, rate: float) -> float:
            return self.natural**2 * (self.gain * lateral / G - angle) - 2 * self.damping * self.natural * rate

        middle_angle = self.angle + 0.5 * STEP * self.rate
        middle_rate = self.rate + 0.5 * STEP * slope(self.angle, self.rate)
        self.angle += STEP * middle_rate
        self.rate += STEP * slope(middle_angle, middle_rate)

    def ratio(self, lateral: float) -> float:
        return self.direct * lateral + self.of_angle * self.angle + self.of_rate * self.rate


def motion(
    truck: dict, v: float, curvature: float, acceleration: float, gamma: float, slips: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Yaw rates of both units, side speed of the drive axle, speed of the trailer's axle."""
    grip = truck["mu"] * G
    if truck["ellipse"]:
        grip *= math.sqrt(max(1 - (acceleration / grip) ** 2, 0))
    most = grip / max(v * v, 0.01)
    r1 = v * clamp(curvature, -most, most)
    vy = -min(slips[0] * v * v, truck["lever_max"]) * r1
    vh = vy + truck["a"] * r1
    v2 = v * math.cos(gamma) - vh * math.sin(gamma)
    r2 = (v * math.sin(gamma) + vh * math.cos(gamma)) / (truck["L2"] - min(slips[1] * v2 * v2, truck["lever_max"]))
    return r1, r2, vy, v2


def steered_wheelbase(truck: dict, v: float) -> float:
    return truck["L1"] + truck["understeer"] * v * v


def leaning_on(truck: dict, own: float, trailers: float) -> float:
    """The tractor's load transfer ratio where the trailer leans on it."""
    return own + truck["fifth_wheel_load"] * (trailers - own)


def drive(truck: dict, init: dict, commands: list[dict], times: list[float]) -> tuple[list[dict], dict]:
    x, y, p1, p2, v, delta = (init[k] for k in ("x", "y", "psi1", "psi2", "v", "delta"))
    curvature, a, integral, asked, holds = math.tan(delta) / steered_wheelbase(truck, v), 0.0, 0.0, 0.0, False
    slips = (truck["K"], truck["K"])
    tractor, trailer = Roll(truck, "1"), Roll(truck, "2")
    peak = dict.fromkeys(("ay1", "ay2", "ltr1_qs", "ltr2_qs", "ltr1_dyn", "ltr2_dyn", "gamma"), 0.0)
    states, wanted = [], list(times)
    per_control, n_steps = round(CONTROL_STEP / STEP), round(times[-1] / STEP)
    delay = round(truck["delta_delay"] / STEP)
    starts = [round(command["t"] / STEP) for command in commands]
    for n in range(n_steps + 1):
        r1, r2, vy, v2 = motion(truck, v, curvature, a, p1 - p2, slips)
        ay1, ay2 = v * r1, v2 * r2
        fall = truck["crossfall"] * G
        found = {"ay1": ay1, "ay2": ay2, "ltr2_qs": ay2 * trailer.static, "gamma": p1 - p2}
        found["ltr2_dyn"] = trailer.ratio(ay2 + fall)
        found["ltr1_qs"] = leaning_on(truck, ay1 * tractor.static, found["ltr2_qs"])
        found["ltr1_dyn"] = leaning_on(truck, tractor.ratio(ay1 + fall), found["ltr2_dyn"])
        slips = tuple(truck["K"] * (1 + truck["slip_growth"] * abs(found[key])) for key in ("ltr1_dyn", "ltr2_dyn"))
        peak = {key: max(value, abs(found[key])) for key, value in peak.items()}
        if wanted and n == round(wanted[0] / STEP):
            hitch = [x + truck["a"] * math.cos(p1), y + truck["a"] * math.sin(p1)]
            axle = [hitch[0] - truck["L2"] * math.cos(p2), hitch[1] - truck["L2"] * math.sin(p2)]
            state = {"t": wanted.pop(0), "x": x, "y": y, "psi1": p1, "psi2": p2, "v": v, "delta": delta, "hitch": hitch}
            states.append(state | {"trailer_axle": axle} | {k: found[k] for k in found if k != "ltr1_dyn"})
        command = commands[max(i for i, start in enumerate(starts) if start <= n)]
        steered = [i for i, start in enumerate(starts) if start + delay <= n]
        target_delta = commands[max(steered)]["delta_cmd"] if steered else delta
        strongest = min(truck["a_max"], truck["power"] / max(v, 1.0))
        if n % per_control == 0:
            error = command["v_cmd"] - v
            near = abs(error) <= truck["band"]
            held = integral if near else 0.0
            grown = held + error * CONTROL_STEP if near else 0.0
            within = truck["brake"] <= truck["kp"] * error + truck["ki"] * grown <= strongest
            integral = grown if within else held
            asked = truck["kp"] * error + truck["ki"] * integral
            holds = command["v_cmd"] == 0
            if holds:
                asked, integral = min(asked, -0.5), 0.0
            asked = clamp(asked, truck["brake"], strongest)
        wish = min(max(asked, truck["a_min"]), strongest)
        lag = truck["brake_lag"] if wish < 0 else truck["drive_lag"]
        after = wish + (a - wish) * math.exp(-STEP / lag) if lag else wish
        mean = 0.5 * (a + after) if lag else wish
        speed = v + STEP * mean
        if (holds or v > 0) and v * speed <= 0:
            after, mean, speed = 0.0, 0.0, 0.0
        within_lock, largest = clamp(target_delta, -truck["delta_max"], truck["delta_max"]), truck["delta_rate"] * STEP
        turned = delta + clamp(within_lock - delta, -largest, largest)
        rolling = math.tan(turned) / steered_wheelbase(truck, speed)
        tau = truck["yaw_lag"] * truck["K"] * abs(v)
        bent = rolling + (curvature - rolling) * math.exp(-STEP / tau) if tau > 1e-9 else rolling
        bend = p1 - p2 + 0.5 * STEP * (r1 - r2)
        middle = motion(truck, 0.5 * (v + speed), 0.5 * (curvature + bent), mean, bend, slips)
        m1, m2, my, mv2 = middle
        half, mid = p1 + 0.5 * STEP * r1, 0.5 * (v + speed)
        x += STEP * (mid * math.cos(half) - my * math.sin(half))
        y += STEP * (mid * math.sin(half) + my * math.cos(half))
        p1, p2 = p1 + STEP * m1, p2 + STEP * m2
        tractor.step(mid * m1 + fall)
        trailer.step(mv2 * m2 + fall)
        v, a, delta, curvature = speed, after, turned, bent
    return states, peak


def courses() -> dict[str, tuple[float, list[tuple[float, float, float]], float, dict]]:
    """Speed at the start [km/h], commands (time, steer angle [deg], target speed [km/h]), end, what differs."""
    s_bend = [(0, 0, 20), (0.5, 6, 20), (4, -6, 20), (7.5, 0, 20)]
    fast_bend = [(0, 0, 30), (0.5, 6, 30), (4, -6, 27), (7.5, 0, 27)]
    return {
        "slows_into_bend": (30, [(0, 0, 15), (4, 8, 15)], 12, {}),
        "leaves_bend": (15, [(0, 8, 15), (4, 2, 30)], 12, {}),
        "s_bend": (20, s_bend, 12, {"delta_delay": 0.1}),
        "stop_and_go": (20, [(0, 3, 0), (9, 6, 20)], 16, {}),
        "from_50": (50, [(0, 0, 20), (6, 7, 20)], 12, {"ellipse": True, "mu": 0.5, "delta_delay": 0.05}),
        "tilted": (25, [(0, 4, 25), (5, -4, 18)], 12, {"crossfall": 0.025}),
        "real_tyres": (30, fast_bend, 12, {"slip_growth": 1.0, "understeer": 0.0021, "fifth_wheel_load": 0.26}),
    }


def cases() -> list[dict]:
    found = []
    for number, (load, (mass, slip, strongest, roll)) in enumerate(LOADS.items()):
        for course, (speed, steps, end, changes) in courses().items():
            name = list(TRUCKS)[number % 2]
            truck = TRUCKS[name] | roll | TRACTOR
            truck |= {"K": slip, "mu": 0.7, "delta_max": math.radians(40), "delta_rate": math.radians(20)}
            truck |= {"a_max": strongest, "a_min": -6.0, "lever_max": 4.0, "yaw_lag": 1.0, "drive_lag": 0.45}
            truck |= {"brake_lag": 0.35, "delta_delay": 0.0, "power": 330e3 / mass, "ellipse": False}
            truck |= {"crossfall": 0.0, "kp": 0.8, "ki": 0.05, "band": 0.5 / 3.6, "brake": -2.5}
            truck |= {"slip_growth": 0.0, "understeer": 0.0, "fifth_wheel_load": 0.0} | changes
            init = {"x": 3.0, "y": -2.0, "psi1": 0.4, "psi2": 0.4, "v": speed / 3.6, "delta": 0.0}
            commands = [{"t": t, "delta_cmd": math.radians(steer), "v_cmd": target / 3.6} for t, steer, target in steps]
            times = [float(t) for t in range(0, end + 1, 2)]
            states, peak = drive(truck, init, commands, times)
            case = {"id": f"{load}_{course}", "kind": "trajectory", "vehicle": truck, "dt": 0.05}
            case |= {"control_step": CONTROL_STEP}
            case |= {"init": init, "commands": commands, "t_end": times[-1], "expected": states, "expected_peak": peak}
            tolerance = {"pos": 0.02, "trailer_pos": 0.02, "psi1": 0.002, "gamma": 0.002, "v": 0.005, "delta": 1e-3}
            tolerance |= {"ay": 0.03, "ltr": 0.01, "peak_rel": 0.02}
            found.append(case | {"tolerance": tolerance, "t_jackknife": None})
    return found


def rounded(value: object) -> object:
    if isinstance(value, float):
        return float(f"{value:.9g}")
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return [rounded(item) for item in value] if isinstance(value, list) else value


if __name__ == "__main__":
    lines = ",\n".join(json.dumps(rounded(case)) for case in cases())
    Path("tests/data/load_vectors.json").write_text(f'{{"cases": [\n{lines}\n]}}\n')
