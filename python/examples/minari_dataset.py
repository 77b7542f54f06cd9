"""Episodes of a policy as a data set of Minari, for imitation and offline learning, and read back.

    python minari_dataset.py --policy attard2023 --episodes 20

Needs ``offtrack-sim``, ``minari[arrow]`` and ``pillow``. The data set, ``offtrack/attard2023-attard2023-v0`` or
``--name``, lies where Minari keeps its own (``MINARI_DATASETS_PATH``), and none is overwritten: observations float32
``[steps + 1, n_values]``, actions, rewards and both flags ``[steps]``, and of each episode its route and why it ended.
The trucks are stepped together, on routes and from starts that are drawn; what is written of each is its first
``--episodes`` episodes, so that short ones, which are failures more often, are not drawn more often.
"""

from __future__ import annotations

import argparse
import copy

import gymnasium
import minari
import numpy as np
from minari.data_collector import EpisodeBuffer
from minari.storage import get_dataset_path

import offtrack_sim
from offtrack_sim.single import action_space, observation_space


def driven(policy: offtrack_sim.Policy, batch: offtrack_sim.Batch, n_episodes: int) -> list[EpisodeBuffer]:
    """The first episodes of each truck, truck by truck."""
    n = batch.num_envs
    policy.check(batch)
    rows: list[list[tuple[np.ndarray, np.int64, float, bool, bool]]] = [[] for _ in range(n)]
    found: list[list[EpisodeBuffer]] = [[] for _ in range(n)]
    observations = batch.observation()
    while any(len(episodes) < n_episodes for episodes in found):
        actions = policy.act(observations)
        following, rewards, terminated, truncated = batch.step(actions)
        for env, step in enumerate(zip(observations, actions, rewards, terminated, truncated)):
            rows[env].append(step)
        ends = batch.ended()
        for env, code, route, last, _ in zip(*ends) if ends else ():
            seen, acted, rewarded, terminations, truncations = (np.array(values) for values in zip(*rows[env]))
            options = {"env": int(env), "route": batch.route_names[route], "ended": int(code)}
            if len(found[env]) < n_episodes:
                episode = EpisodeBuffer(
                    id=int(env) * n_episodes + len(found[env]),
                    options=options,
                    observations=np.concatenate([seen, last[None]]),
                    actions=acted,
                    rewards=rewarded.tolist(),
                    terminations=terminations.tolist(),
                    truncations=truncations.tolist(),
                )
                found[env].append(episode)
            rows[env] = []
        observations = following
    return [episode for episodes in found for episode in episodes]


def main() -> None:
    parser = argparse.ArgumentParser(
        description="Episodes of a policy as a Minari data set", formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("--policy", default="attard2023", help="the name of a shipped policy, or a policy file")
    parser.add_argument("--benchmark", default="attard2023", help="a benchmark's name, or the path of its file")
    parser.add_argument("--split", default="train", help="routes: train, validation or test")
    parser.add_argument("--trucks", type=int, default=64, help="trucks that are stepped together")
    parser.add_argument("--episodes", type=int, default=4, help="episodes of each truck")
    parser.add_argument("--seed", type=int, default=0, help="seed of routes and starts")
    parser.add_argument("--name", help="the data set's name (default: those of benchmark and policy)")
    args = parser.parse_args()
    is_file = args.policy.endswith(".safetensors")
    policy = offtrack_sim.Policy.load(args.policy) if is_file else offtrack_sim.Policy.shipped(args.policy)
    batch = offtrack_sim.Batch(args.benchmark, args.trucks, split=args.split, seed=args.seed)
    name = args.policy.rsplit("/", 1)[-1].removesuffix(".safetensors")
    dataset_id = f"offtrack/{args.name or f'{batch.scenario}-{name}'}-v0"
    folder = get_dataset_path(dataset_id)
    if folder.exists():
        parser.error(f"--name: {dataset_id}; {folder} exists and is never overwritten: choose another, or remove it")
    episodes = driven(policy, batch, args.episodes)
    spec = copy.deepcopy(gymnasium.spec("offtrack/Roundabout-v0"))
    spec.kwargs |= {"scenario": args.benchmark, "split": args.split}
    evaluated = copy.deepcopy(spec)
    evaluated.kwargs |= {"split": "test"}
    dataset = minari.create_dataset_from_buffers(
        dataset_id,
        episodes,
        env=spec,
        eval_env=evaluated,
        action_space=action_space(batch),
        observation_space=observation_space(len(batch.extras), vehicles=batch.observes_vehicles),
        algorithm_name=f"offtrack policy {policy.name}",
        author="The offtrack authors",
        data_format="arrow",
        description=f"{policy.name} on the {args.split} routes of {batch.scenario}, seed {args.seed}",
    )
    # Read back by Minari, it is what was driven.
    for episode, read in zip(episodes, minari.load_dataset(dataset.spec.dataset_id).iterate_episodes()):
        np.testing.assert_array_equal(read.observations, episode.observations)
        np.testing.assert_array_equal(read.actions, episode.actions)
        np.testing.assert_array_equal(read.rewards, episode.rewards)
    env = minari.load_dataset(dataset.spec.dataset_id).recover_environment()
    assert env.observation_space.shape == (batch.n_values,)
    steps = dataset.total_steps
    arrived = sum(episode.options["ended"] == offtrack_sim.Ended.ARRIVED for episode in episodes if episode.options)
    print(f"{dataset.spec.dataset_id}: {len(episodes)} episodes, {steps:,} steps, {arrived} arrived")


if __name__ == "__main__":
    main()
