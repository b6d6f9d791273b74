"""Many catheters."""

from __future__ import annotations

import cathforce
import numpy as np
import pytest
from conftest import BEND


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


def test_lanes_that_differ_in_everything_have_the_bits_of_a_single_catheter(model: cathforce.Model) -> None:
    # Lengths, materials, an effect in the recursion, a beginning at another tick, and a drive that is too fast.
    n, ticks = 13, 500
    random = np.random.default_rng(4)
    to_m = random.uniform(0.0, model.reach_m, n)
    rows = np.empty((n, ticks, 2))
    share = np.linspace(0, 1, ticks)
    rows[..., 0] = np.linspace(0.001, 0.06, n)[:, None] + (to_m - np.linspace(0.001, 0.06, n))[:, None] * 0.15 * share
    rows[..., 1] = random.uniform(-2, 2, n)[:, None] * np.sin(3 * share)
    rows[5, 300:, 0] += 0.03
    friction = np.where(np.arange(n) % 3 == 0, 0.05, 0.4)
    relaxing = np.where(np.arange(n) == 7, 0.5, 0.0)
    parameters = {
        "wall.friction_coefficient": friction,
        "effects.wall.viscoelastic.ratio": relaxing,
    }
    batch = cathforce.Batch(model, n, parameters=parameters)
    batch.reset(rows[:, 0])
    batch.step_many(np.repeat(rows[3:4, :1], n, axis=0)[:, :0])
    late = [2, 6, 11]
    batch.step_many(rows[:, :1])
    batch.reset(rows[late, 0], which=late, parameters={name: of[late] for name, of in parameters.items()})
    together = batch.step_many(rows)
    after = batch.step(rows[:, -1])
    for k in range(n):
        own = {name: float(of[k]) for name, of in parameters.items()}
        alone = cathforce.Batch(model, 1, parameters={name: [value] for name, value in own.items()})
        alone.reset(rows[k : k + 1, 0])
        if k not in late:
            alone.step_many(rows[k : k + 1, :1])
        found = alone.step_many(rows[k : k + 1])
        assert np.array_equal(found.digest[0], together.digest[k]), k
        assert np.array_equal(found.tip_m[0], together.tip_m[k], equal_nan=True), k
        assert alone.step(rows[k : k + 1, -1]).digest[0] == after.digest[k], k
        assert np.array_equal(alone.shape_m[0], batch.shape_m[k], equal_nan=True), k
    assert together.refused[5].any() and not np.delete(together.refused, 5, axis=0).any()


@pytest.mark.parametrize("solver", [{}, {"solver.solves": 2.0}])
def test_lanes_in_double_precision_and_with_more_solves_too(solver: dict[str, float]) -> None:
    n, ticks = 6, 700
    for dtype in ("float32", "float64"):
        model = cathforce.Model(BEND, dtype=dtype, settings=solver)
        rows = paths(n, ticks)
        together = cathforce.Batch(model, n).step_many(rows)
        for k in range(n):
            alone = cathforce.Simulator(model).step_many(rows[k])
            assert np.array_equal(together.force_on_vessel_n[k], alone.force_on_vessel_n)
            assert np.array_equal(together.tip_m[k], alone.tip_m, equal_nan=True)
            assert np.array_equal(together.peak_node[k], alone.peak_node)


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
