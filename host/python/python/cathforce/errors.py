"""What goes wrong, with the texts of the command line: what, where, why, and the fix."""


class CathforceError(Exception):
    """Anything that this package refuses or that fails in it."""


class UsageError(CathforceError, ValueError):
    """An argument is wrong: its shape, its unit, its name or its value."""


class InputError(CathforceError, ValueError):
    """A file, a bundle or a recording is wrong; the text names the file and the line."""


class FaultError(CathforceError, RuntimeError):
    """The device stopped, or cannot follow; the text says why."""


class CommandError(CathforceError, RuntimeError):
    """A command of ``cathforce`` failed otherwise; ``code`` is its exit code."""

    def __init__(self, message: str, code: int = 1) -> None:
        super().__init__(message)
        self.code = code


class CathforceWarning(UserWarning):
    """Something looks wrong but prevents nothing."""
