"""Steps a second of CathSim's environment with random actions, resets included. Prints JSON."""

from __future__ import annotations

import importlib.metadata
import json
import time

import cathsim.gym.envs  # noqa: F401
import gymnasium

SECONDS = 20.0


def main() -> None:
    environment = gymnasium.make("cathsim/CathSim-v0", phantom="phantom3", target="bca", use_pixels=False)
    environment.reset(seed=1)
    environment.action_space.seed(1)
    steps, began = 0, time.perf_counter()
    while time.perf_counter() - began < SECONDS:
        _, _, terminated, truncated, _ = environment.step(environment.action_space.sample())
        steps += 1
        if terminated or truncated:
            environment.reset()
    took = time.perf_counter() - began
    rate = float(environment.unwrapped.metadata["render_fps"])
    version = importlib.metadata.version("cathsim")
    print(json.dumps({"version": version, "rates": [{"control_hz": rate, "steps_per_s": steps / took}]}))


if __name__ == "__main__":
    main()
