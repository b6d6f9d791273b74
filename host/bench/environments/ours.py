"""Steps a second of `cathforce/Navigate-v0`, and of a batch by the number of catheters. Prints JSON."""

from __future__ import annotations

import argparse
import json
import resource
import time

import cathforce
import cathforce.gym
import gymnasium
import numpy as np

#: Catheters that an environment steps at once.
ENVIRONMENTS = 64
#: Seconds after which a measurement ends.
SECONDS = 8.0
#: Length of a link [m] with which all of them together end within the vessel.
LINK_M = 1.2e-3


def steps_per_s(control_hz: float) -> float:
    """Of the environment, with random actions, resets included."""
    ticks = round(1000 / control_hz)
    environments = gymnasium.make_vec(
        cathforce.gym.ID, ENVIRONMENTS, vectorization_mode="vector_entry_point", ticks_per_step=ticks
    )
    environments.reset(seed=1)
    environments.action_space.seed(1)
    steps, began = 0, time.perf_counter()
    while time.perf_counter() - began < SECONDS:
        environments.step(environments.action_space.sample())
        steps += ENVIRONMENTS
    return steps / (time.perf_counter() - began)


def processor_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def batch_of(n: int, ticks: int) -> dict[str, float]:
    """A batch whose links are all inside: the fastest of a few rounds, since a disturbance only slows one down."""
    model = cathforce.Model(cathforce.gym.FORK, link_length_m=LINK_M)
    near = model.reach_m - 2e-4
    batch = cathforce.Batch(model, n)
    batch.reset([[near, 0.0]] * n)
    inside = int(np.isfinite(batch.shape_m[0, :, 0]).sum())
    assert inside == model.MAX_LINKS, f"{inside} links"
    share = np.sin(np.linspace(0, np.pi, ticks))
    rows = np.empty((n, ticks, 2))
    rows[..., 0] = near - 1e-4 * share
    rows[..., 1] = np.linspace(0.0, 0.2, n)[:, None] * share
    fastest = least = np.inf
    for _ in range(6):
        began, before = time.perf_counter(), processor_s()
        found = batch.step_many(rows)
        fastest = min(fastest, time.perf_counter() - began)
        least = min(least, processor_s() - before)
        assert not found.fault.any(), f"fault {found.fault.max()}"
    return {"n": n, "catheter_ms_per_s": n * ticks / fastest, "processor_us": 1e6 * least / (n * ticks)}


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--control-hz", type=float, action="append", default=[])
    given = asked.parse_args()
    batches = [batch_of(n, max(100, 12800 // n)) for n in (2, 16, 32, 64, 128, 256)]
    rates = given.control_hz or [20.0]
    rows = [{"control_hz": rate, "steps_per_s": steps_per_s(rate)} for rate in rates]
    print(json.dumps({"version": cathforce.__version__, "rates": rows, "batches": batches}))


if __name__ == "__main__":
    main()
