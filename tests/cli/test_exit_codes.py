"""One table of exit codes for all commands."""

from __future__ import annotations

import errno
import re

import pytest

from tests.docs.program_pages import commands_page
from vislam2tag.cli.exit_codes import ExitCode, code_of_error
from vislam2tag.common.errors import OutputError, StoreConflictError, SurveyError


def caused_by(cause: Exception) -> Exception:
    error = OutputError("labels: cannot be written")
    error.__cause__ = cause
    return error


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (SurveyError("not a survey"), ExitCode.USAGE),
        (caused_by(PermissionError(errno.EACCES, "denied")), ExitCode.USAGE),
        (caused_by(OSError(errno.ENOSPC, "full")), ExitCode.RETRY),
        (caused_by(TimeoutError()), ExitCode.RETRY),
        (StoreConflictError("written meanwhile"), ExitCode.RETRY),
    ],
)
def test_errors_that_may_pass_have_a_code_of_their_own(error: Exception, code: ExitCode) -> None:
    assert code_of_error(error) is code


def test_no_command_names_another_code() -> None:
    page = commands_page()
    named = {int(code) for line in re.findall("^Exit code: .*", page, re.M) for code in re.findall(r"\b\d+\b", line)}
    assert named <= set(ExitCode)
    assert all(f"| {code.value} `{code.name}` | {code.meaning} |" in page for code in ExitCode)
