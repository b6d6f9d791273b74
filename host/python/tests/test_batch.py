"""Many catheters."""

from __future__ import annotations

import cathforce
import numpy as np
import pytest


def paths(n: int, ticks: int) -> np.ndarray:
    """Feeds of different speed with different turns, (n, ticks, 2)."""
    share = np.linspace(0.0, 1.0, ticks)
    to_m = np.linspace(0.03, 0.08, n)
    turn = np.linspace(-1.5, 1.5, n)
    rows = np.empty((n, ticks, 2))
    rows[..., 0] = to_m[:, None] * share
    rows[..., 1] = turn[:, None] * np.sin(np.pi * share)
    return rows


def test_each_has_the_bits_of_a_single_catheter(model: cathforce.Model) -> None:
    n, ticks = 7, 1200
    rows = paths(n, ticks)
    together = cathforce.Batch(model, n).step_many(rows)
    assert together.force_on_vessel_n.shape == (n, ticks, 3)
    for k in range(n):
        alone = cathforce.Simulator(model).step_many(rows[k])
        assert np.array_equal(together.digest[k], alone.digest)
        assert np.array_equal(together.force_on_vessel_n[k], alone.force_on_vessel_n)
    assert len(set(together.digest[:, -1])) == n, "they moved differently"


def test_company_and_parameters_change_no_bit(model: cathforce.Model) -> None:
    name, factors = "effects.wall.stiffness.factor", np.array([0.5, 1.0, 2.0])
    rows = paths(3, 1200)
    batch = cathforce.Batch(model, 3, parameters={name: factors})
    together = batch.step_many(rows)
    for k, factor in enumerate(factors):
        settings = {} if factor == 1.0 else {name: float(factor)}
        own = cathforce.Simulator(model.bundle, settings=settings)
        assert np.array_equal(own.step_many(rows[k]).digest, together.digest[k])


def test_move_to_is_the_ticks_on_the_way(model: cathforce.Model) -> None:
    n, ticks = 4, 900
    goals = paths(n, 2)[:, -1]
    goals[:, 1] = [0.3, -0.3, 0.0, 1.0]
    batch = cathforce.Batch(model, n)
    moved = batch.move_to(goals, ticks)
    for k in range(n):
        alone = cathforce.Simulator(model).move_to(goals[k], ticks)
        assert moved.digest[k] == alone.digest[-1]
        assert moved.peak_contact_force_n[k] == alone.peak_contact_force_n.max()
        assert moved.unresolved[k] == alone.unresolved.any()
    assert np.array_equal(batch.positions, goals)
    assert batch.shape_m.shape == (n, cathforce.Model.MAX_LINKS, 3)
    assert np.array_equal(batch.shape_m[:, 0], moved.tip_m)


def test_some_begin_anew_and_others_go_on(model: cathforce.Model) -> None:
    rows = paths(3, 600)
    batch, other = cathforce.Batch(model, 3), cathforce.Batch(model, 3)
    batch.step_many(rows[:, :300])
    other.step_many(rows[:, :300])
    batch.reset(which=[1])
    held = rows[:, 300:].copy()
    held[1] = rows[1, :300]
    found, expected = batch.step_many(held), other.step_many(rows[:, 300:])
    assert np.array_equal(found.digest[[0, 2]], expected.digest[[0, 2]])
    assert found.digest[1, -1] == cathforce.Simulator(model).step_many(held[1]).digest[-1]


def test_particles_are_copied_with_their_state(model: cathforce.Model) -> None:
    rows = paths(4, 800)
    batch = cathforce.Batch(model, 4)
    batch.step_many(rows)
    positions = batch.positions
    batch.select([2, 2, 0, 3])
    assert np.array_equal(batch.positions, positions[[2, 2, 0, 3]])
    digests = batch.step(batch.positions).digest
    assert digests[0] == digests[1] != digests[2]
    snapshot = batch.snapshot(3)
    batch.reset(snapshot=snapshot)
    assert len(set(batch.step(batch.positions).digest)) == 1


def test_what_is_wrong_is_refused_by_name(model: cathforce.Model) -> None:
    batch = cathforce.Batch(model, 3)
    with pytest.raises(cathforce.UsageError, match=r"takes \(3, 2\)"):
        batch.step(np.zeros((2, 2)))
    with pytest.raises(cathforce.UsageError, match="one number for all, or"):
        batch.reset(parameters={"wall.friction_coefficient": [0.1, 0.2]})
    with pytest.raises(cathforce.UsageError, match="a setting of the operator"):
        batch.reset(parameters={"force_gain": 2.0})
    with pytest.raises(cathforce.UsageError, match="the catheters are 0 to 2"):
        batch.reset(which=[5])
    with pytest.raises(cathforce.UsageError, match="friction_coefficient"):
        batch.reset(parameters={"wall.friction_coefficient": -1.0})
    with pytest.raises(cathforce.UsageError, match="at least one"):
        cathforce.Batch(model, 0)
