"""Many bundles, calibrations and studies on the machines of a Ray cluster.

Ray distributes the work, tries a task again whose worker was killed, and sends results back. Each result is
written to ``folder`` as it comes, so that the same call goes on where a broken one stopped. The answers are those
of one machine.

>>> import ray, cathforce.ray
>>> ray.init()
>>> cathforce.ray.diagnose(["rig-a", "rig-b"], folder="answers")
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ray

from ._command import Progress, answer
from .blind_test import _answer_file, _answers, _cases, _run_case
from .calibration import Calibration, _calibration
from .diagnosis import Diagnosis, Source, _diagnosis
from .errors import UsageError

#: Tries of a task whose worker was killed.
_TRIES = 5


@dataclass(frozen=True)
class _Task:
    """Work with a name under which its result is kept."""

    name: str
    #: Everything that the result depends on.
    key: str
    call: Callable[..., Any]
    arguments: tuple[Any, ...]


@ray.remote(max_retries=_TRIES, retry_exceptions=False)
def _do(call: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    return call(*arguments)


def _kept(folder: Path, task: _Task) -> Path:
    digest = hashlib.sha256(task.key.encode()).hexdigest()[:16]
    return folder / f"{task.name}-{digest}.json"


def _write(file: Path, result: Any) -> None:
    part = file.with_suffix(f".{os.getpid()}.part")
    part.write_text(json.dumps(result), encoding="utf-8")
    part.replace(file)


def _run(
    tasks: Sequence[_Task],
    folder: str | os.PathLike[str] | None,
    progress: Progress | None,
    cores: float,
) -> list[Any]:
    """Results in the order of the tasks. The first error is raised when all other tasks are done."""
    keep = None if folder is None else Path(folder)
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
    results: dict[int, Any] = {}
    for k, task in enumerate(tasks):
        if keep is not None and _kept(keep, task).exists():
            results[k] = json.loads(_kept(keep, task).read_text(encoding="utf-8"))
    if results and progress is not None:
        progress(f"{len(results)} of {len(tasks)} are there already")
    under_way = {
        _do.options(num_cpus=cores, name=task.name).remote(task.call, task.arguments): k
        for k, task in enumerate(tasks)
        if k not in results
    }
    failed: list[BaseException] = []
    try:
        while under_way:
            [done], _ = ray.wait(list(under_way))
            k = under_way.pop(done)
            try:
                results[k] = ray.get(done)
            except ray.exceptions.RayTaskError as error:
                failed.append(error.cause)
                continue
            if keep is not None:
                _write(_kept(keep, tasks[k]), results[k])
            if progress is not None:
                progress(f"{tasks[k].name}: {len(results)} of {len(tasks)}")
    except BaseException:
        for waiting in under_way:
            ray.cancel(waiting, force=True)
        raise
    if failed:
        raise failed[0]
    return [results[k] for k in range(len(tasks))]


def _fingerprint(path: Path) -> str:
    """Hash over the files of a bundle or over a recording."""
    found = hashlib.sha256()
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    for file in files:
        if file.is_file():
            found.update(str(file.relative_to(path)).encode())
            found.update(file.read_bytes())
    return found.hexdigest()


def _command(source: Source, command: Sequence[str], more: Sequence[str]) -> tuple[str, str, list[str]]:
    """Name and key of a command on a bundle, and its words for a worker, whose working folder is another one."""
    path = Path(source).absolute()
    if not path.exists():
        raise UsageError(f"{source}: there is no such bundle or recording")
    key = json.dumps([*command, *more, _fingerprint(path)])
    return path.stem, key, [*command, os.fspath(path), *more]


def _calibrate(words: Sequence[str], state: str | None) -> Any:
    """Goes on from what a killed worker has put down."""
    with tempfile.TemporaryDirectory() as own:
        file = state or os.path.join(own, "state.json")
        resume = ["--resume"] if os.path.exists(file) else []
        return answer([*words, "--state", file, *resume])


def diagnose(
    bundles: Iterable[Source],
    *,
    hold_back: Iterable[int] = (),
    effects: Iterable[str] = (),
    folder: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    cores: float = 1,
) -> list[Diagnosis]:
    """Diagnoses many bundles, each as :func:`cathforce.diagnose` does.

    Args:
        bundles: folders or recordings, at paths that every machine of the cluster reads.
        folder: where answers are kept; a call that was broken off goes on from there.
        progress: called with a line for each answer.
        cores: of a machine, for each diagnosis.
    """
    more = [word for number in hold_back for word in ("--hold-back", str(number))]
    more += [word for effect in effects for word in ("--effect", effect)]
    tasks = []
    for bundle in bundles:
        name, key, words = _command(bundle, ["gap", "diagnose"], more)
        tasks.append(_Task(name, key, answer, (words,)))
    return [_diagnosis(raw) for raw in _run(tasks, folder, progress, cores)]


def calibrate(
    bundles: Iterable[Source],
    parameters: Iterable[str],
    *,
    seed: int = 1,
    budget: int | None = None,
    folder: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    cores: float = 1,
) -> list[Calibration]:
    """Calibrates many bundles, each by itself, as :func:`cathforce.calibrate` does.

    With ``folder`` a calibration whose worker was killed goes on from the evaluations that it had done.
    """
    asked = ["--parameters", ",".join(parameters), "--seed", str(seed)]
    asked += [] if budget is None else ["--budget", str(budget)]
    tasks = []
    for bundle in bundles:
        name, key, words = _command(bundle, ["calibrate"], asked)
        task = _Task(name, key, _calibrate, (words, None))
        if folder is not None:
            state = _kept(Path(folder).absolute(), task).with_suffix(".state.json")
            task = replace(task, arguments=(words, os.fspath(state)))
        tasks.append(task)
    return [_calibration(raw) for raw in _run(tasks, folder, progress, cores)]


def run_blind_test(
    folder: Source,
    *,
    progress: Progress | None = None,
    cores: float = 1,
) -> dict[str, Diagnosis]:
    """Diagnoses every sealed case that has no answer yet, as :func:`cathforce.run_blind_test` does.

    Every case is a task. Its answer is written into ``folder/answers`` when it is whole, so that the same call goes
    on where a broken one stopped. :func:`cathforce.score_blind_test` scores the answers.

    Args:
        folder: of the blind test, at a path that every machine of the cluster reads and writes.
        progress: called with a line for each answer.
        cores: of a machine, for each case.

    Returns:
        The answer of each case.
    """
    path = os.fspath(Path(folder).absolute())
    cases = _cases(path)
    left = [case for case in cases if not _answer_file(path, case).exists()]
    if len(left) < len(cases) and progress is not None:
        progress(f"{len(cases) - len(left)} of {len(cases)} are there already")
    tasks = [_Task(f"case {case}", f"{path} {case}", _run_case, (path, case)) for case in left]
    _run(tasks, None, progress, cores)
    return _answers(path)


def study(
    measure: Callable[[dict[str, float]], Mapping[str, float]],
    points: Iterable[Mapping[str, float]],
    *,
    name: str = "study",
    folder: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    cores: float = 1,
) -> list[dict[str, float]]:
    """Calls ``measure`` with each set of parameters; each result is a dictionary of numbers.

    ``name`` must change when ``measure`` does, because a result that is kept in ``folder`` is not computed again.
    """
    tasks = [
        _Task(name, json.dumps([name, dict(point)], sort_keys=True), measure, (dict(point),))
        for point in points
    ]
    return [dict(of) for of in _run(tasks, folder, progress, cores)]
