"""Learns `cathforce/Navigate-v0` by PPO and says how often it succeeds safely: a job of minutes, on request.

    pip install cathforce[gym] stable-baselines3
    python host/python/examples/learn.py --steps 200000

It prints JSON: the share of runs that reach their target without a contact above the limit, of a policy that knows
nothing and of the one that was learned, on runs that it was not trained on, with effects of the catalogue.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import Any

import cathforce.gym  # noqa: F401
import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecNormalize
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

N = 16
#: Largest allowed contact force at a node [N]; a run with a larger one is no safe success.
FORCE_LIMIT_N = 0.5


class Together(VecEnv):
    """`NavigateVectorEnv` as stable-baselines3 has it: a run that has ended begins anew in the same step."""

    def __init__(self, seed: int, task: dict[str, Any]) -> None:
        made = gymnasium.make_vec(
            "cathforce/Navigate-v0", N, vectorization_mode="vector_entry_point", force_limit_n=FORCE_LIMIT_N, **task
        )
        self.navigation = made.unwrapped.navigation
        self.random = np.random.default_rng(seed)
        super().__init__(N, self.navigation.observation_space, self.navigation.action_space)

    def reset(self):
        self.navigation.reset(np.arange(N), self.random)
        return self.navigation.observe()

    def step_async(self, actions):
        self.actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        found = self.navigation.step(self.actions)
        observed = self.navigation.observe()
        ended = found["terminated"] | found["truncated"]
        told = [{name: of[k].item() for name, of in found.items()} for k in range(N)]
        for k in np.flatnonzero(ended):
            told[k]["terminal_observation"] = {name: of[k] for name, of in observed.items()}
            told[k]["TimeLimit.truncated"] = bool(found["truncated"][k])
        if ended.any():
            self.navigation.reset(np.flatnonzero(ended), self.random)
            observed = self.navigation.observe()
        return observed, found["reward"], ended, told

    def close(self):
        pass

    def get_attr(self, attr_name, indices=None):
        return [getattr(self, attr_name, None)] * N

    def set_attr(self, attr_name, value, indices=None):
        raise NotImplementedError

    def env_method(self, method_name, *arguments, indices=None, **keywords):
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False] * N


def judged(policy: PPO, environments: VecNormalize, runs: int) -> dict[str, float]:
    """Shares of runs of the policy's means."""
    observed = environments.reset()
    success, unsafe, largest_n = [], [], []
    while len(success) < runs:
        actions, _ = policy.predict(observed, deterministic=True)
        observed, _, ended, told = environments.step(actions)
        for k in np.flatnonzero(ended):
            success.append(told[k]["is_success"])
            unsafe.append(told[k]["is_unsafe"])
            largest_n.append(told[k]["largest_force_n"])
    return {
        "runs": len(success),
        "safe_success": float(np.mean(success)),
        "unsafe": float(np.mean(unsafe)),
        "median_largest_force_n": float(np.median(largest_n)),
    }


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--steps", type=int, default=200_000)
    asked.add_argument("--runs", type=int, default=200)
    asked.add_argument("--seed", type=int, default=1)
    asked.add_argument("--target", action="append", help="name of a branch; all but the first one otherwise")
    asked.add_argument("--nominal", action="store_true", help="without effects of the catalogue")
    given = asked.parse_args()
    task = {"targets": given.target, "randomise": None if given.nominal else "catalogue"}
    environments = VecNormalize(Together(given.seed, task))
    policy = PPO(
        "MultiInputPolicy",
        environments,
        n_steps=128,
        batch_size=512,
        n_epochs=10,
        gamma=0.99,
        learning_rate=5e-4,
        seed=given.seed,
        device="cpu",
    )
    fresh = VecNormalize(Together(given.seed + 1000, task), training=False, norm_reward=False)
    fresh.obs_rms, fresh.training = environments.obs_rms, False
    before = judged(policy, fresh, given.runs)
    began = time.monotonic()
    policy.learn(given.steps)
    seconds = time.monotonic() - began
    fresh.obs_rms = environments.obs_rms
    after = judged(policy, fresh, given.runs)
    steps_per_s = given.steps / seconds
    said = {"force_limit_n": FORCE_LIMIT_N, "before": before, "after": after}
    print(json.dumps({**said, "steps": given.steps, "steps_per_s": steps_per_s}))


if __name__ == "__main__":
    main()
