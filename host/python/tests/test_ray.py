"""A local cluster of two workers."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import cathforce
import pytest
from conftest import BEND

# On a computer with other load Ray's own processes take longer to start than it waits by default.
os.environ.update(RAY_agent_register_timeout_ms="300000", RAY_raylet_start_wait_time_s="300", RAY_USAGE_STATS_ENABLED="0")
import cathforce.ray  # noqa: E402
import ray  # noqa: E402


@pytest.fixture(scope="module", autouse=True)
def cluster() -> Iterator[None]:
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, configure_logging=False)
    yield
    ray.shutdown()


def test_a_study_on_two_workers_is_that_on_one_machine(tmp_path: Path) -> None:
    def measure(point: dict[str, float]) -> dict[str, float]:
        simulator = cathforce.Simulator(BEND, settings=point)
        ticks = simulator.move_to([0.06, 0.5], 1500)
        peak_n = float(ticks.peak_contact_force_n.max())
        return {"digest": float(ticks.digest[-1]), "peak_n": peak_n}

    points = [{"wall.friction_coefficient": friction} for friction in (0.1, 0.2, 0.3, 0.4)]
    lines: list[str] = []
    found = cathforce.ray.study(measure, points, folder=tmp_path, progress=lines.append)
    assert found == [measure(point) for point in points]
    assert len({own["digest"] for own in found}) == 4
    assert lines[-1].endswith("4 of 4") and len(list(tmp_path.iterdir())) == 4


def test_a_worker_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    def once_killed(point: dict[str, float]) -> dict[str, float]:
        mark = tmp_path / f"begun-{point['k']}"
        if point["k"] == 1 and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return {"k": point["k"], "worker": float(os.getpid())}

    found = cathforce.ray.study(once_killed, [{"k": float(k)} for k in range(3)], name="killed")
    assert [own["k"] for own in found] == [0.0, 1.0, 2.0]
    assert (tmp_path / "begun-1.0").exists(), "it was killed"


def test_what_was_computed_is_not_computed_again(tmp_path: Path) -> None:
    answers = tmp_path / "answers"

    def fragile(point: dict[str, float]) -> dict[str, float]:
        (tmp_path / f"call-{point['k']}-{os.urandom(4).hex()}").touch()
        if point["k"] == 2 and not (tmp_path / "repaired").exists():
            raise cathforce.InputError("rig.toml:3: is wrong")
        return point

    points = [{"k": float(k)} for k in range(3)]
    with pytest.raises(cathforce.InputError, match="rig.toml:3: is wrong"):
        cathforce.ray.study(fragile, points, folder=answers)
    assert len(list(answers.iterdir())) == 2
    (tmp_path / "repaired").touch()
    lines: list[str] = []
    found = cathforce.ray.study(fragile, points, folder=answers, progress=lines.append)
    assert found == points and lines[0] == "2 of 3 are there already"
    assert len(list(tmp_path.glob("call-*"))) == 4


def test_a_blind_test_is_that_of_one_machine(tmp_path: Path) -> None:
    from cathforce._command import run

    here, there = tmp_path / "here", tmp_path / "there"
    make = ["gap", "blind-test", "make", here, "--seed", "7", "--cases", "2", "--bundle", BEND]
    run(make)
    run(["gap", "blind-test", "seal", here])
    shutil.copytree(here, there)
    cases = sorted(case.name for case in (here / "cases").iterdir())
    # The first case is answered before, as by a call that was broken off.
    cathforce.blind_test._run_case(os.fspath(there), cases[0])
    lines: list[str] = []
    found = cathforce.ray.run_blind_test(there, progress=lines.append)
    assert lines[0] == f"1 of {len(cases)} are there already"
    assert lines[-1].endswith("1 of 1") and sorted(found) == cases
    alone = cathforce.run_blind_test(here)
    # Times, and the folder in the command that repeats it.
    timed = {"cpu_seconds", "seconds", "reproduce"}
    for case in cases:
        own, other = ({**of[case].raw} for of in (found, alone))
        assert {name: own[name] for name in own.keys() - timed} == {name: other[name] for name in other.keys() - timed}
    assert cathforce.score_blind_test(there)["answers"] == cathforce.score_blind_test(here)["answers"]
    with pytest.raises(cathforce.UsageError, match="nothing is sealed"):
        cathforce.ray.run_blind_test(tmp_path)


def test_calibrations_are_those_of_one_machine_and_diagnoses_too(rough: Path, tmp_path: Path) -> None:
    name = "wall.friction_coefficient"
    [found] = cathforce.ray.calibrate([rough], [name], budget=20, folder=tmp_path)
    alone = cathforce.calibrate(rough, [name], budget=20, state=tmp_path / "state.json")
    assert found.parameters == alone.parameters and found.errors == alone.errors
    assert not list(tmp_path.glob("*.state.json"))
    [answer] = cathforce.ray.diagnose([rough], effects=["contact.friction"])
    own = cathforce.diagnose(rough, effects=["contact.friction"])
    assert answer.effects == own.effects and answer.gap == own.gap
    with pytest.raises(cathforce.UsageError, match="no such bundle"):
        cathforce.ray.diagnose(["nowhere"])
