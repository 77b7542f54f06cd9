"""One policy from several: on each route it imitates the teacher that drives it best.

    python distil.py NEAR.safetensors SAFE.safetensors --out distilled

Needs ``offtrack-sim`` and ``torch``. Teachers are policy files, the most wanted first. They drive the
training routes of ``--scenario`` a few times, and a route's teacher is the one that arrives most often; of equal ones
the one that keeps ``--margin`` from the kerbs more often, for a student never does quite what its teacher does; of
equal ones the first. Then a student drives all routes at once, every second truck with sampled actions, and learns from
each step what the route's teacher would have done there: DAgger (Ross, Gordon and Bagnell, "A reduction of imitation
learning and structured prediction to no-regret online learning", AISTATS 2011) with probabilities in place of actions.
So it sees the states that it gets into itself, and every step says which action is right, so that it takes in many more
roads than a learner by trial and error.

    python distil.py runs/traffic-*/policy.safetensors --together --scenario distil_traffic.toml \\
        --validation traffic2026-random

With ``--together`` it imitates the mean of all teachers' probabilities on every route and chooses no teacher. Where
they are seeds of one training they err at different places, and their mean less than any of them.

Writes ``distilled.safetensors``, which ``offtrack evaluate --policy`` drives, and ``distilled.json`` with the curve and
the success on the validation routes. Ctrl-C ends the training early; what was learned is kept.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from results import about, write_json
from torch import nn

import offtrack_sim
from offtrack_sim import Batch, Benchmark, Ended, Policy, export

HERE = Path(__file__).resolve().parent


class Network(nn.Module):
    """A policy as a PyTorch module: ``[n, n_values]`` to logits ``[n, n_actions]``, see docs/policies.md."""

    def __init__(self, policy: Policy) -> None:
        super().__init__()
        parts = export.network(policy)
        assert parts.normalisation is not None, "policies of the project's own learner normalise what they observe"
        self.mean, self.factor = (torch.from_numpy(array.copy()) for array in parts.normalisation)
        activation = nn.Tanh if parts.activation == "tanh" else nn.ReLU
        layers: list[nn.Module] = []
        for weight, bias in parts.layers:
            linear = nn.Linear(*weight.shape)
            linear.load_state_dict({"weight": torch.from_numpy(weight.T.copy()), "bias": torch.from_numpy(bias.copy())})
            layers += [linear, activation()]
        self.actor = nn.Sequential(*layers[:-1])

    def normalised(self, observation: torch.Tensor) -> torch.Tensor:
        return ((observation - self.mean) * self.factor).clamp(-export.CLIP, export.CLIP)

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        return self.actor(self.normalised(observation))

    def save(self, file: Path, scenario: Path | Benchmark) -> None:
        variance = 1 / self.factor.double().numpy() ** 2
        export.save(file, self.actor, scenario=scenario, mean=self.mean.numpy(), variance=variance, epsilon=0.0)


def survey(policy: Policy, batch: Batch, routes: list[str], starts: np.ndarray, margin: float) -> np.ndarray:
    """Drives ``routes`` from ``starts``, ``[k, episodes, 2]``. Returns of each episode whether it arrived, whether it
    did so at least ``margin`` from the kerbs, and its mean distance to the lane's centre [m]: ``[k, episodes, 3]``."""
    n_episodes = starts.shape[1]
    n = len(routes) * n_episodes
    # What each episode came to, and which one each truck drives: -1 after the last.
    ended = np.zeros(n, dtype=np.int64)
    clearance, distance, n_steps = np.full(n, np.inf), np.zeros(n), np.zeros(n)
    episode = np.full(batch.num_envs, -1)
    n_begun, n_shown = 0, 0
    free = np.arange(batch.num_envs)
    while True:
        begun = np.arange(n_begun, min(n_begun + len(free), n))
        episode[free] = -1
        episode[free[: len(begun)]] = begun
        if len(begun):
            names, errors = [routes[e // n_episodes] for e in begun], starts.reshape(-1, 2)[begun]
            batch.begin(free[: len(begun)], routes=names, starts=[tuple(error) for error in errors])
            n_begun += len(begun)
        driving = np.flatnonzero(episode >= 0)
        if not len(driving):
            break
        actions = np.zeros(batch.num_envs, dtype=np.int64)
        actions[driving] = policy.act(batch.observation()[driving])
        batch.step(actions)
        columns = batch.columns("clearance", "progress")
        least = np.minimum(columns["clearance"]["tractor"], columns["clearance"]["trailer"])
        of = episode[driving]
        clearance[of] = np.minimum(clearance[of], least[driving])
        distance[of] += columns["progress"]["lane_distance"][driving]
        n_steps[of] += 1
        free = np.arange(0)
        if (ends := batch.ended()) is not None:
            first_ends = episode[ends.envs] >= 0
            free = ends.envs[first_ends]
            ended[episode[free]] = ends.codes[first_ends]
        if n_begun >= n_shown + 10_000:
            n_shown = n_begun
            print(f"{policy.name} has begun {n_begun:,} of {n:,} episodes", flush=True)
    arrived = ended == Ended.ARRIVED
    found = np.stack([arrived, arrived & (clearance >= margin), distance / n_steps], axis=-1)
    return found.reshape(-1, n_episodes, 3)


def choose(policies: list[Policy], args: Any) -> tuple[list[str], np.ndarray, list[dict[str, Any]]]:
    """Lets the teachers drive. Returns the names of the routes, the index of each one's teacher, and what each teacher
    did; of a later one only on the routes on which no earlier one was without fault."""
    # In this mode a truck's columns are those after its last step until the next one.
    batch = Batch(args.scenario, args.envs, split="train", seed=args.seed, autoreset="next_step")
    names = batch.split_routes
    starts = np.random.default_rng(args.seed).uniform(-args.starts, args.starts, (len(names), args.episodes, 2))
    scores = np.full((len(policies), len(names)), -1)
    left, surveys = np.arange(len(names)), []
    for teacher, policy in enumerate(policies):
        found = survey(policy, batch, [names[route] for route in left], starts[left], args.margin)
        arrived, kept = found[..., 0].sum(axis=1).astype(int), found[..., 1].sum(axis=1).astype(int)
        scores[teacher, left] = arrived * (args.episodes + 1) + kept
        surveys.append(
            {
                "teacher": args.teachers[teacher].name,
                "episodes": found[..., 0].size,
                "arrived": int(arrived.sum()),
                "with_margin": int(kept.sum()),
                "lane_distance_mean_arrived": float(found[..., 2][found[..., 0] > 0].mean()) if arrived.any() else None,
            }
        )
        print("  ".join(f"{name} {value}" for name, value in surveys[-1].items()), flush=True)
        left = left[kept < args.episodes]
        if not len(left):
            break
    chosen = np.argmax(scores, axis=0)
    for teacher, row in enumerate(surveys):
        row["routes_taught"] = int((chosen == teacher).sum())
    print("routes of each teacher:", [row["routes_taught"] for row in surveys], flush=True)
    return names, chosen, surveys


class Mean(nn.Module):
    """Logits of the mean of several policies' probabilities."""

    def __init__(self, policies: list[Network]) -> None:
        super().__init__()
        self.policies = nn.ModuleList(policies)

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        return torch.stack([policy(observation).softmax(-1) for policy in self.policies]).mean(0).log()


def distil(teachers: list[nn.Module], student: Network, of_route: np.ndarray, batch: Batch, args: Any) -> list[Any]:
    """Lets the student imitate ``teachers[of_route[r]]`` on route r of ``batch.route_names``; returns the curve."""
    rng = np.random.default_rng(args.seed)
    rare = [batch.route_names[route] for route in np.flatnonzero(of_route > 0)]
    optimizer = torch.optim.Adam(student.actor.parameters(), lr=args.learning_rate)
    average = torch.optim.swa_utils.AveragedModel(
        student.actor, multi_avg_fn=torch.optim.swa_utils.get_ema_multi_avg_fn(0.99)
    )
    capacity = max(1, args.capacity // args.envs) * args.envs
    # A ring of the latest steps: observations and the teachers' probabilities.
    observations, targets = torch.zeros(capacity, batch.n_values), torch.zeros(capacity, len(batch.action_table))
    greedy = torch.arange(args.envs) % 2 == 0
    observation = batch.observation()
    curve: list[dict[str, float]] = []
    ended: list[int] = []
    divergences: list[float] = []
    start, env_steps, updates = time.perf_counter(), 0, 0
    try:
        while env_steps < args.steps:
            seen = torch.from_numpy(observation)
            place = slice(env_steps % capacity, env_steps % capacity + args.envs)
            observations[place] = seen
            with torch.no_grad():
                which = torch.from_numpy(of_route[batch.routes()])
                for index, teacher in enumerate(teachers):
                    rows = torch.nonzero(which == index).squeeze(-1)
                    targets[place.start + rows] = teacher(seen[rows]).softmax(-1)
                logits = student(seen)
                drawn = torch.multinomial(logits.softmax(-1), 1).squeeze(-1)
                action = torch.where(greedy, logits.argmax(-1), drawn)
            observation = batch.step(action.numpy())[0]
            env_steps += args.envs
            if (ends := batch.ended()) is not None:
                ended += ends.codes.tolist()
                again = ends.envs[rng.random(len(ends.envs)) < args.rare]
                if rare and len(again):
                    batch.begin(again, routes=[rare[n] for n in rng.integers(len(rare), size=len(again))])
                    observation = batch.observation()
            left = max(0.0, 1 - env_steps / args.steps)
            optimizer.param_groups[0]["lr"] = args.learning_rate * left
            while updates * args.minibatch < args.passes * env_steps:
                updates += 1
                rows = torch.randint(min(env_steps, capacity), (args.minibatch,))
                log_probs = student(observations[rows]).log_softmax(-1)
                loss = nn.functional.kl_div(log_probs, targets[rows], reduction="batchmean")
                optimizer.zero_grad()
                loss.backward()
                optimizer.step()
                average.update_parameters(student.actor)
                divergences.append(float(loss.detach()))
            if divergences and (len(divergences) >= 500 or left == 0):
                row = {
                    "env_steps": env_steps,
                    "seconds": round(time.perf_counter() - start, 1),
                    "divergence": round(float(np.mean(divergences)), 4),
                    "success": round(float(np.mean(np.array(ended) == Ended.ARRIVED)), 4) if ended else 0.0,
                }
                curve.append(row)
                print("  ".join(f"{name} {value:,}" for name, value in row.items()), flush=True)
                divergences, ended = [], []
    except KeyboardInterrupt:
        print("interrupted: what was learned is kept", flush=True)
    if updates:
        student.actor.load_state_dict(average.module.state_dict())
    return curve


def main() -> None:
    parser = argparse.ArgumentParser(
        description="One policy from several, by imitation", formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("teachers", nargs="+", type=Path, help="policy files, the most wanted first")
    parser.add_argument(
        "--scenario", type=Path, default=HERE / "distil_roads.toml", help="benchmark on whose training routes"
    )
    parser.add_argument(
        "--together",
        action="store_true",
        help="imitate the mean of all teachers on every route: no --episodes, --starts, --margin, --rare",
    )
    parser.add_argument("--validation", default="random2026", help="benchmark on whose validation routes it is judged")
    parser.add_argument("--episodes", type=int, default=2, help="episodes of each teacher on a route, to choose by")
    parser.add_argument(
        "--starts", type=float, default=0.4, help="largest errors of their starts, as a fraction of the benchmark's"
    )
    parser.add_argument("--margin", type=float, default=0.1, help="clearance [m] that a teacher should keep")
    parser.add_argument("--steps", type=int, default=12_000_000, help="env steps of all trucks together")
    parser.add_argument("--envs", type=int, default=2048, help="number of trucks")
    parser.add_argument(
        "--rare", type=float, default=0.1, help="fraction of the episodes on routes that are not the first teacher's"
    )
    parser.add_argument("--capacity", type=int, default=1_000_000, help="steps that are held")
    parser.add_argument("--minibatch", type=int, default=2048)
    parser.add_argument("--passes", type=float, default=2.0, help="times that a step is learned from, on the mean")
    parser.add_argument("--learning-rate", type=float, default=1e-3, help="at the beginning; it falls to zero linearly")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("distilled"), help="files to write, without their endings")
    args = parser.parse_args()
    # Networks this small gain little from more threads, and wait for them on a busy machine.
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    start = time.perf_counter()
    if args.envs < 1 or args.steps < 1 or args.episodes < 1 or args.minibatch < 1:
        parser.error("--envs, --steps, --episodes, --minibatch: must be at least 1")
    if args.envs < args.episodes:
        parser.error("--envs: must be at least --episodes")
    if not 0 <= args.starts <= 1:
        parser.error("--starts: must lie in 0..1")
    args.out.parent.mkdir(parents=True, exist_ok=True)
    try:
        policies = [Policy.load(file) for file in args.teachers]
        batch = Batch(args.scenario, args.envs, split="train", seed=args.seed)
        # What the student is judged on in the end.
        judged = Batch(args.validation, 1, split="validation")
        for policy in policies:
            policy.check(batch)
            policy.check(judged)
    except ValueError as error:
        raise SystemExit(str(error)) from None
    # The student begins as the first teacher.
    teachers, student = [Network(policy) for policy in policies], Network(policies[0])
    of_route, surveys = np.zeros(len(batch.route_names), dtype=np.int64), []
    if not args.together:
        names, chosen, surveys = choose(policies, args)
        by_name = dict(zip(names, chosen.tolist()))
        of_route = np.array([by_name.get(name, 0) for name in batch.route_names])
    curve = distil([Mean(teachers)] if args.together else teachers, student, of_route, batch, args)
    file = Path(f"{args.out}.safetensors")
    student.save(file, args.scenario)
    found = offtrack_sim.evaluate(Policy.load(file), args.validation, split="validation", episodes=4)
    result = {
        "example": "distil",
        **about("numpy", "torch"),
        "settings": {**vars(args), "teachers": [str(file) for file in args.teachers], "scenario": args.scenario.name}
        | {"out": str(args.out)},
        "seconds": round(time.perf_counter() - start, 1),
        "survey": surveys,
        "evaluation": found.as_dict(),
        "curve": curve,
    }
    write_json(f"{args.out}.json", result)
    print(found)
    print(f"wrote {file} and {args.out}.json")


if __name__ == "__main__":
    main()
