"""The exit codes of all commands, which docs/reference/commands.md lists, too."""

from __future__ import annotations

import errno
from enum import IntEnum

from vislam2tag.common.errors import StoreConflictError, StoreUnansweredError

_MAY_PASS = frozenset(
    {errno.EADDRINUSE, errno.EAGAIN, errno.EBUSY, errno.EDQUOT, errno.ENETUNREACH, errno.ENOSPC, errno.ESTALE}
)
"""Errors of the operating system that may be gone later: an address in use, a full disk, a network that is down."""
_TRIES_LATER = (StoreConflictError, StoreUnansweredError, ConnectionError, TimeoutError)


class ExitCode(IntEnum):
    """How a command ended."""

    DONE = 0
    FAILURES = 1
    USAGE = 2
    NOTHING = 3
    RETRY = 75
    """``EX_TEMPFAIL`` of sysexits.h."""
    INTERRUPTED = 130
    """As shells report Ctrl-C."""

    @property
    def meaning(self) -> str:
        """What a script can conclude, a sentence."""
        return _MEANINGS[self]


_MEANINGS = {
    ExitCode.DONE: "Done. Warnings do not change the exit code.",
    ExitCode.FAILURES: "Done, but a part failed or a check found something wrong. Also for an error in the program.",
    ExitCode.USAGE: "Not done: wrong usage, or files that cannot be used. The same command would fail again.",
    ExitCode.NOTHING: "Nothing useful was done: for example no session has a position, or nothing could be judged.",
    ExitCode.RETRY: "Not done, but the same command may work later: another program is writing, or the disk is full.",
    ExitCode.INTERRUPTED: "Interrupted. Finished parts stay, and the same command goes on from there.",
}
OUTPUT_IS_WHOLE = frozenset({ExitCode.DONE, ExitCode.FAILURES, ExitCode.NOTHING})
"""Codes of commands that came to their end."""


def code_of_error(error: BaseException) -> ExitCode:
    """The code for an error of ours, or of a file: whether what caused it may pass."""
    cause: BaseException | None = error
    while cause is not None:
        passing = isinstance(cause, OSError) and cause.errno in _MAY_PASS
        if passing or isinstance(cause, _TRIES_LATER):
            return ExitCode.RETRY
        cause = cause.__cause__
    return ExitCode.USAGE
