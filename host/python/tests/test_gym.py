"""Navigation."""

from __future__ import annotations

import warnings

import cathforce
import cathforce.gym
import gymnasium
import numpy as np
import pytest
from cathforce.gym import ID, Navigation
from cathforce.randomisation import Randomisation
from gymnasium.utils.env_checker import check_env


def test_gymnasiums_own_checker_says_nothing() -> None:
    environment = gymnasium.make(ID, randomise="catalogue").unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(environment)


def steer(navigation: Navigation, turn_rad: float) -> dict[str, np.ndarray]:
    """Turns the bent tip and feeds."""
    turned = 0.0
    for _ in range(navigation.max_steps):
        missing = (turn_rad - navigation._at[0, 1] + np.pi) % (2 * np.pi) - np.pi
        turned = float(np.clip(missing / navigation._step[1], -1.0, 1.0))
        found = navigation.step(np.array([[0.0 if abs(turned) == 1.0 else 1.0, turned]]))
        if found["terminated"][0] or found["truncated"][0]:
            return found
    raise AssertionError("a run ends")


def test_a_turned_tip_reaches_its_branch_and_the_other_way_does_not() -> None:
    ends = {}
    for branch in ("left", "right"):
        navigation = Navigation(1, targets=[branch])
        for turn_rad in (0.0, np.pi):
            navigation.reset(np.array([0]), np.random.default_rng(3))
            ends[branch, turn_rad] = bool(steer(navigation, turn_rad)["is_success"][0])
    # `up` is +y, where the left branch is.
    assert ends["left", 0.0] != ends["left", np.pi]
    assert ends["right", 0.0] != ends["right", np.pi]
    assert ends["left", 0.0] != ends["right", 0.0]


def test_the_same_seed_is_the_same_run_alone_and_together() -> None:
    one = gymnasium.make_vec(ID, 3, vectorization_mode="vector_entry_point", randomise="catalogue")
    other = gymnasium.make_vec(ID, 3, vectorization_mode="vector_entry_point", randomise="catalogue")
    for environments in (one, other):
        environments.reset(seed=7)
        environments.action_space.seed(7)
    rewards = []
    for _ in range(40):
        actions = one.action_space.sample()
        first, second = one.step(actions), other.step(actions)
        rewards.append(first[1])
        for name in first[0]:
            assert np.array_equal(first[0][name], second[0][name])
        assert np.array_equal(first[1], second[1])
    assert np.std(rewards) > 0.0


def test_a_run_that_ended_begins_anew() -> None:
    environments = gymnasium.make_vec(
        ID, 2, vectorization_mode="vector_entry_point", max_steps=5, targets=["left"]
    )
    environments.reset(seed=1)
    ends = [environments.step(np.zeros((2, 2), np.float32))[3].all() for _ in range(12)]
    assert ends == [False] * 4 + [True] + [False] * 5 + [True] + [False]


def test_a_contact_above_the_limit_ends_the_run() -> None:
    environment = gymnasium.make(ID, force_limit_n=0.02)
    environment.reset(seed=1)
    for _ in range(200):
        _, reward, terminated, _, info = environment.step(np.array([1.0, 0.0], np.float32))
        if terminated:
            break
    assert info["is_unsafe"] and not info["is_success"] and reward < -0.9


def test_every_effect_of_the_catalogue_can_be_met() -> None:
    navigation = Navigation(1, randomise="catalogue", nominal_share=0.0)
    random = np.random.default_rng(5)
    met = set()
    for _ in range(300):
        navigation.reset(np.array([0]), random)
        told = navigation.told(0)
        met.add(told["effect"])
        for name, value in told["parameters"].items():
            own = cathforce.settings()[name]
            assert own.low <= value <= own.high, name
    drawn = set(navigation.randomisation.effects)
    assert len(met) > 20 and met <= drawn
    only = Randomisation(navigation.model, ["contact.friction"], 0.0)
    assert only.draw(random, navigation.tree.positions_m).effect == "contact.friction"
    with pytest.raises(cathforce.UsageError, match=r"cannot have contact\.fricton"):
        Randomisation(navigation.model, ["contact.fricton"])
