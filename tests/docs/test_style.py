"""No text has a fault of style; files that still do are in a list that may only shrink."""

from __future__ import annotations

from pathlib import Path

from tests.docs.style import ROOT, faults_of, sources

ALLOWED = Path(__file__).with_name("style_allowed.txt")


def test_files_without_faults_keep_none_and_those_that_lost_them_leave_the_list() -> None:
    failing = {path.relative_to(ROOT).as_posix() for path in sources() if faults_of(path)}
    allowed = set(ALLOWED.read_text(encoding="utf-8").split())
    assert failing == allowed, "`python -m tests.docs.style` prints the faults"
