"""One catheter."""

from __future__ import annotations

import _thread
import pickle
import threading
import time
from pathlib import Path

import cathforce
import numpy as np
import pytest
from conftest import BEND, EXAMPLES


def path(ticks: int, to_m: float = 0.06) -> np.ndarray:
    """A feed with a turn on the way, (ticks, 2)."""
    share = np.linspace(0.0, 1.0, ticks)
    return np.stack([to_m * share, 0.8 * np.sin(2 * np.pi * share)], axis=1)


def test_every_tick_has_the_digest_that_the_device_sent(recording: Path) -> None:
    """The recorded device is another process, fed over a bus; the digest covers every bit of every output."""
    recorded = cathforce.read(recording)
    ticks = recorded.ticks
    simulator = cathforce.Simulator(BEND)
    simulator.clear()
    compared = 0
    for k, (insertion_m, rotation_rad, command, digest) in enumerate(
        zip(
            ticks["insertion_m"],
            ticks["rotation_rad"],
            ticks["command"],
            ticks["digest"],
            strict=True,
        )
    ):
        found = simulator.step(insertion_m, rotation_rad, command=command or None)
        if not np.isnan(digest):
            assert found.digest == int(digest), f"tick {k}"
            compared += 1
    assert compared > 300
    assert np.max(ticks["peak_contact_force_N"]) > 0.02, "it touched the wall"


def test_a_step_at_a_time_is_many_at_once(model: cathforce.Model) -> None:
    one, many = cathforce.Simulator(model), cathforce.Simulator(model)
    rows = path(1500)
    at_once = many.step_many(rows)
    singly = [one.step(*row).digest for row in rows]
    assert np.array_equal(at_once.digest, np.array(singly))
    assert at_once.force_on_vessel_n.shape == (1500, 3)
    assert at_once.force_on_vessel_n.dtype == np.float32
    assert np.linalg.norm(at_once.force_on_vessel_n, axis=1).max() > 0.01
    # The sum over the nodes is the total.
    total = many.contact_forces_n.sum(axis=0)
    assert np.allclose(total, at_once.force_on_vessel_n[-1], atol=1e-5)
    assert np.array_equal(many.shape_m[0], at_once.tip_m[-1])


def test_a_snapshot_is_a_state_to_come_back_to(model: cathforce.Model) -> None:
    simulator = cathforce.Simulator(model)
    rows = path(1200)
    simulator.step_many(rows[:700])
    snapshot = simulator.snapshot()
    first = simulator.step_many(rows[700:]).digest
    for _ in range(2):
        simulator.restore(snapshot)
        assert np.array_equal(simulator.step_many(rows[700:]).digest, first)
    other = cathforce.Simulator(BEND, settings={"wall.friction_coefficient": 0.1})
    with pytest.raises(cathforce.UsageError, match="another model"):
        other.restore(snapshot)


def test_double_precision_is_close_and_is_not_rounded(model: cathforce.Model) -> None:
    rows = path(1500)
    single = cathforce.Simulator(model).step_many(rows)
    double = cathforce.Simulator(BEND, dtype="float64").step_many(rows)
    assert double.tip_m.dtype == np.float64
    assert np.abs(double.tip_m - single.tip_m)[-1].max() < 1e-4
    forces = double.force_on_vessel_n
    assert np.any(forces != forces.astype(np.float32))


def test_settings_and_effects_go_by_their_names(model: cathforce.Model) -> None:
    name = "effects.wall.stiffness.factor"
    soft = cathforce.Simulator(BEND, settings={name: 0.25})
    assert soft.model.value(name) == 0.25 and model.value(name) == 1.0
    rows = path(1500)
    tips = [sim.step_many(rows).tip_m for sim in (soft, cathforce.Simulator(model))]
    assert np.nanmax(np.abs(tips[0] - tips[1])) > 1e-5
    assert cathforce.settings()[name].default == 1.0
    with pytest.raises(cathforce.UsageError, match="write `effects.wall.stiffness.factor`"):
        cathforce.Model(BEND, settings={"effects.wall.stifness.factor": 0.5})
    with pytest.raises(cathforce.UsageError, match="must be a number"):
        cathforce.Model(BEND, settings={name: "soft"})  # type: ignore[dict-item]


def test_guidewire_and_tendons_have_columns_of_their_own() -> None:
    wired = cathforce.Simulator(EXAMPLES / "bend-guidewire")
    names = ["insertion_m", "rotation_rad", "guidewire_insertion_m", "guidewire_rotation_rad"]
    assert wired.model.columns == names
    ticks = wired.move_to([0.03, 0.0, 0.06, 0.0], 1500)
    assert np.abs(ticks.guidewire_force_n).max() > 0.0
    pulled = cathforce.Simulator(EXAMPLES / "two-tendons")
    assert pulled.model.columns[2:] == ["tendon_1_m", "tendon_2_m"]
    pulled.move_to([0.05, 0.0, 0.0, 0.0], 1000)
    pulled.move_to([0.05, 0.0, 0.002, 0.0], 500)
    assert pulled.tendon_tensions_n.shape == (2, 2)
    assert pulled.tendon_tensions_n[0, 0] > 0.1
    with pytest.raises(cathforce.UsageError, match="2 driven tendons"):
        pulled.step(0.05, tendons_m=[0.0])
    with pytest.raises(cathforce.UsageError, match="no guidewire"):
        pulled.step(0.05, guidewire_insertion_m=0.1)


def test_wrong_shapes_and_units_are_refused_by_name(model: cathforce.Model) -> None:
    simulator = cathforce.Simulator(model)
    with pytest.raises(cathforce.UsageError, match=r"takes \(ticks, 2\): insertion_m, rotation_rad"):
        simulator.step_many(np.zeros((5, 3)))
    with pytest.raises(cathforce.UsageError, match="insertion_m = 60 m.*\n.*not millimetres"):
        simulator.move_to([60.0, 0.0], 100)
    with pytest.raises(cathforce.UsageError, match="row 1: rotation_rad is NaN"):
        simulator.step_many([[0.0, 0.0], [0.0, np.nan]])
    with pytest.raises(cathforce.UsageError, match="give an array of numbers"):
        simulator.step_many([["a", "b"]])
    with pytest.raises(TypeError):
        simulator.step(insertion_mm=1.0)  # type: ignore[call-arg]


def test_a_drive_that_jumps_is_no_number(model: cathforce.Model) -> None:
    simulator = cathforce.Simulator(model)
    for _ in range(3):
        with pytest.raises(cathforce.FaultError, match="refuses the position.*\n.*move_to"):
            simulator.step(0.02)
    # Then the device begins anew where the drives are, and has no forces until it is at rest.
    with pytest.raises(cathforce.FaultError, match="computes no forces"):
        simulator.step(0.02)
    simulator.reset(0.02)
    assert simulator.step(0.02).links > 0
    reported = cathforce.Simulator(model, faults="report").step_many(np.full((20, 2), 0.02))
    assert reported.refused[0] and reported.mode[-1] == 2


def test_a_bundle_that_is_wrong_has_the_text_of_the_command_line(
    tmp_path: Path, program: str
) -> None:
    import shutil
    import subprocess

    broken = tmp_path / "broken"
    shutil.copytree(BEND, broken)
    rig = broken / "rig.toml"
    rig.write_text(rig.read_text().replace("friction_coefficient", "friction_coeficient"))
    with pytest.raises(cathforce.InputError) as raised:
        cathforce.Simulator(broken)
    said = subprocess.run([program, "info", str(broken)], capture_output=True, text=True)
    assert said.returncode == 3
    assert str(raised.value) in said.stderr
    assert "rig.toml:" in str(raised.value)


def test_ctrl_c_ends_a_long_call(model: cathforce.Model) -> None:
    simulator = cathforce.Simulator(model)
    simulator.reset(0.06)
    # Five minutes of the catheter's time. Were it not for Ctrl-C, the exception would come after the call.
    rows = np.tile([0.06, 0.0], (300_000, 1))
    timer = threading.Timer(0.5, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        simulator.step_many(rows)
    # The state is that after a whole tick.
    assert simulator.step(0.06).fault == 0


def test_the_interpreter_goes_on_meanwhile_and_threads_do_not_mix(model: cathforce.Model) -> None:
    rows = path(4000)
    alone = cathforce.Simulator(model).step_many(rows).digest[-1]
    counted = 0
    done = threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0.001)

    found: list[int] = []
    simulators = [cathforce.Simulator(model) for _ in range(3)]
    work = [
        threading.Thread(target=lambda own=own: found.append(own.step_many(rows).digest[-1]))
        for own in simulators
    ]
    counter = threading.Thread(target=count)
    for thread in [counter, *work]:
        thread.start()
    for thread in work:
        thread.join()
    done.set()
    counter.join()
    assert found == [alone] * 3
    assert counted > 20, "the lock was not released"


def test_one_simulator_in_two_threads_takes_whole_ticks(model: cathforce.Model) -> None:
    simulator = cathforce.Simulator(model)
    still = np.tile([0.0, 0.0], (2000, 1))
    threads = [threading.Thread(target=simulator.step_many, args=(still,)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    other = cathforce.Simulator(model)
    other.step_many(np.tile([0.0, 0.0], (4000, 1)))
    assert simulator.step(0.0).digest == other.step(0.0).digest


def test_a_model_goes_to_another_process(model: cathforce.Model) -> None:
    copy = pickle.loads(pickle.dumps(model))
    assert copy.image == model.image and copy.name == model.name
