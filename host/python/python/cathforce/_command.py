"""The program ``cathforce``: diagnoses and calibrations run in it, so that their texts are those of the command
line and Ctrl-C ends them."""

from __future__ import annotations

import ctypes
import json
import os
import queue
import shutil
import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from .errors import CathforceWarning, CommandError, FaultError, InputError, UsageError

Progress = Callable[[str], None]

#: How long an interrupted program may take to put down what it knows [s]; then it is ended.
_PATIENCE_S = 20.0
#: How long an interruption waits at most to be noticed [s].
_WAIT_S = 0.1
#: Names the program to be used, before any other.
_VARIABLE = "CATHFORCE_PROGRAM"


def _packaged() -> Path:
    return Path(__file__).parent / "bin" / ("cathforce.exe" if os.name == "nt" else "cathforce")


def _program() -> str:
    given = os.environ.get(_VARIABLE)
    if given:
        return given
    if _packaged().exists():
        return str(_packaged())
    # The script that this package installs would only look for the program again.
    beside = Path(sys.executable).parent
    path = [folder for folder in os.get_exec_path() if Path(folder) != beside]
    found = shutil.which("cathforce", path=os.pathsep.join(path))
    if found is None:
        raise CommandError(
            "the program `cathforce` is not there, and this package was built without it\n  fix: build a "
            f"wheel with `cargo xtask wheel`, or name the program in {_VARIABLE}"
        )
    return found


def main() -> NoReturn:
    """The command ``cathforce`` that this package installs."""
    try:
        program = _program()
    except CommandError as error:
        sys.exit(f"error: {error}")
    os.execv(program, [program, *sys.argv[1:]])


def _error(code: int, said: list[str]) -> Exception:
    text = "".join(said)
    at = text.rfind("error: ")
    message = (text[at + len("error: ") :] if at >= 0 else text).strip()
    if code < 0:
        return CommandError(f"cathforce was ended by {signal.Signals(-code).name}", code)
    if code == 2:
        return UsageError(message)
    if code == 3:
        return InputError(message)
    if code == 5:
        return FaultError(message)
    return CommandError(message, code)


def _ends_with_its_caller() -> None:
    """On Linux the program is ended when the process that wants its answer is killed."""
    if _LIBC is not None:
        _LIBC.prctl(1, signal.SIGKILL)


_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None


def _next(lines: queue.SimpleQueue[str | None]) -> str | None:
    """The next line. Python looks for a signal between two waits."""
    while True:
        try:
            return lines.get(timeout=_WAIT_S)
        except queue.Empty:
            continue


def run(
    arguments: Sequence[str | os.PathLike[str]],
    *,
    progress: Progress | None = None,
    folder: str | os.PathLike[str] | None = None,
) -> str:
    """Runs ``cathforce`` and returns what it prints on stdout.

    ``progress`` is called with every line that it says meanwhile. Warnings become :class:`CathforceWarning`.
    On Ctrl-C the program is told to stop and may put down what it knows, as ``calibrate`` does.
    """
    words = [_program(), *(os.fspath(word) for word in arguments)]
    # A group of its own: a terminal's Ctrl-C would reach the program twice, which ends it at once.
    child = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        start_new_session=True,
        preexec_fn=_ends_with_its_caller if _LIBC is not None else None,
    )
    said: list[str] = []
    out: list[str] = []
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    assert child.stdout is not None and child.stderr is not None
    stdout, stderr = child.stdout, child.stderr

    def forward() -> None:
        for line in stderr:
            lines.put(line)
        lines.put(None)

    # Threads read, so that this one may be interrupted at any moment.
    readers = [threading.Thread(target=forward, daemon=True)]
    readers.append(threading.Thread(target=lambda: out.append(stdout.read()), daemon=True))
    for reader in readers:
        reader.start()
    try:
        while (line := _next(lines)) is not None:
            said.append(line)
            if progress is not None and not line.startswith(("error:", "warning:", "  fix:")):
                progress(line.rstrip())
        code = child.wait()
    except BaseException:
        child.send_signal(signal.SIGINT)
        try:
            child.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            child.kill()
        raise
    finally:
        for reader in readers:
            reader.join(_PATIENCE_S)
    if code != 0:
        raise _error(code, said)
    for line in said:
        if line.startswith("warning: "):
            warnings.warn(line[len("warning: ") :].strip(), CathforceWarning, stacklevel=3)
    return "".join(out)


def answer(
    arguments: Sequence[str | os.PathLike[str]],
    *,
    progress: Progress | None = None,
    folder: str | os.PathLike[str] | None = None,
) -> Any:
    """What a command answers with ``--json``."""
    return json.loads(run([*arguments, "--json"], progress=progress, folder=folder))
