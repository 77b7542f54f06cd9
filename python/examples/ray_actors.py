"""PPO with actors of Ray: each drives a batch of trucks of its own, on one machine or on several.

    python ray_actors.py --out ray

Needs ``offtrack-sim``, ``ray`` and ``torch`` on every machine, in the same versions. Over several machines, start Ray
on each and then this program on one of them:

    export RAY_AUTH_MODE=token                                         # on all of them
    ray get-auth-token --generate                                      # on the first; copy ~/.ray/auth_token to each
    ray start --head --port 6380                                       # on the first
    ray start --address FIRST:6380                                     # on each other
    python ray_actors.py --address FIRST:6380 --actors 16 --out ray    # on the first

Two ``ray start`` on one machine, the second with ``--address 127.0.0.1:6380``, make two nodes too.

Each actor steps its trucks with one thread and hands back fragments of 64 steps, which the simulator writes straight
into the arrays that Ray moves. The learner, here on the driver, waits for the fragments of all actors, so each is one
of the present policy; an actor whose machine fails is started anew. Writes ``ray.safetensors``, which
``offtrack evaluate --policy ray.safetensors`` drives, and ``ray.json`` with the curve and the success on the test
routes. Ctrl-C ends the training early; what was learned is kept.

Rewards are multiplied by ``--reward-scale`` in the actors, as in cleanrl_ppo.py, whose learner this is.
"""

from __future__ import annotations

import time
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
import ray
import torch
from cleanrl_ppo import Agent, Fragment, Progress, arguments, update
from results import prepare

from offtrack_sim import Batch, Ended


class Driven(NamedTuple):
    """What an actor hands back."""

    fragment: Fragment
    successes: list[float]
    """Of each episode that ended: 1 for an arrival."""
    stepping: float
    """Time in the simulator [s]."""
    driving: float
    """Time altogether [s]."""


@ray.remote(num_cpus=1, max_restarts=-1, max_task_retries=-1)
class Actor:
    """Drives a batch of trucks with the weights that it is given."""

    def __init__(self, scenario: str, n_envs: int, seed: int, hidden: int, reward_scale: float) -> None:
        torch.set_num_threads(1)
        torch.manual_seed(seed)
        self.batch = Batch(scenario, n_envs, seed=seed, num_threads=1)
        self.observation = self.batch.observation()
        self.agent = Agent(self.observation.shape[1], len(self.batch.action_table), hidden)
        self.reward_scale = reward_scale

    def node(self) -> str:
        return str(ray.get_runtime_context().get_node_id())

    def drive(self, weights: dict[str, torch.Tensor], n_steps: int) -> Driven:
        """The next steps of all trucks."""
        self.agent.load_state_dict(weights)
        fragment = Fragment(n_steps, *self.observation.shape)
        fragment.observation[0] = self.observation
        successes: list[float] = []
        stepping, start = 0.0, time.perf_counter()
        for step in range(n_steps):
            with torch.no_grad():
                action, log_prob = self.agent.act(torch.from_numpy(fragment.observation[step]))
            fragment.action[step], fragment.log_prob[step] = action, log_prob
            before = time.perf_counter()
            self.batch.step_into(
                fragment.action[step],
                fragment.observation[step + 1],
                fragment.reward[step],
                fragment.terminated[step],
                fragment.truncated[step],
            )
            stepping += time.perf_counter() - before
            if (ends := self.batch.ended()) is not None:
                successes += (ends.codes == Ended.ARRIVED).astype(float).tolist()
                limits = ends.codes == Ended.TIMED_OUT
                fragment.limits += [
                    (step, int(env), last) for env, last in zip(ends.envs[limits], ends.observations[limits])
                ]
        fragment.reward *= self.reward_scale
        self.observation = fragment.observation[-1].copy()
        return Driven(fragment, successes, stepping, time.perf_counter() - start)


def main() -> None:
    parser = arguments("PPO with actors of Ray, each with a batch of trucks")
    parser.set_defaults(out=Path("ray"), envs=128)
    parser.add_argument(
        "--actors", type=int, default=2, help="number of actors; --envs is the number of trucks of each"
    )
    parser.add_argument("--address", help="of a running Ray, HOST:PORT or auto; without it one is started for this run")
    args = parser.parse_args()
    prepare(args)
    torch.manual_seed(args.seed)
    # Arrays that Ray hands over are read-only, and are only read here.
    warnings.filterwarnings("ignore", message="The given NumPy array is not writable")
    # Workers import this file's neighbours wherever they run.
    ray.init(
        address=args.address, runtime_env={"working_dir": str(Path(__file__).resolve().parent)}, log_to_driver=False
    )
    made = Actor.options(scheduling_strategy="SPREAD")
    # Each actor's trucks draw from streams of their own: another seed each.
    seeds = [args.seed + 1000 * index for index in range(args.actors)]
    actors = [made.remote(args.scenario, args.envs, seed, args.hidden, args.reward_scale) for seed in seeds]
    nodes = ray.get([actor.node.remote() for actor in actors])
    print(f"{args.actors} actors on {len(set(nodes))} Ray nodes, {args.envs} trucks each", flush=True)

    batch = Batch(args.scenario, 1)
    agent = Agent(batch.observation().shape[1], len(batch.action_table), args.hidden)
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)
    progress = Progress(args)
    times = {"stepping": [], "driving": [], "waiting": [], "learning": []}  # of each round [s]; the first two by actor
    try:
        while progress.left() > 0:
            optimizer.param_groups[0]["lr"] = args.learning_rate * progress.left()
            start = time.perf_counter()
            weights = ray.put(agent.state_dict())
            driven: list[Driven] = ray.get([actor.drive.remote(weights, args.fragment) for actor in actors])
            waited = time.perf_counter()
            entropy = update(agent, optimizer, [each.fragment for each in driven], args)
            successes = [success for each in driven for success in each.successes]
            progress.add(sum(each.fragment.reward.size for each in driven), successes, entropy)
            times["stepping"].append(float(np.mean([each.stepping for each in driven])))
            times["driving"].append(float(np.mean([each.driving for each in driven])))
            times["waiting"].append(waited - start)
            times["learning"].append(time.perf_counter() - waited)
    except KeyboardInterrupt:
        print("interrupted: what was learned is kept", flush=True)
    n_steps = args.actors * args.envs * args.fragment
    medians = {name: float(np.median(values)) for name, values in times.items() if values}
    # What the actors would give a learner that takes no time.
    speeds = {
        f"env_steps_per_second_{name}": round(n_steps / medians[name])
        for name in ("stepping", "driving", "waiting")
        if name in medians
    }
    ray.shutdown()
    progress.finish(
        agent,
        "ray_actors",
        "ray",
        extra={"actors": args.actors, "nodes": len(set(nodes)), "round_seconds": medians, **speeds},
    )


if __name__ == "__main__":
    main()
