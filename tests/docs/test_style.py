"""No text has a fault of style."""

from __future__ import annotations

from tests.docs.style import faults_of, sources


def test_no_text_has_a_fault_of_style() -> None:
    faults = [fault for path in sources() for fault in faults_of(path)]
    assert not faults, "`python -m tests.docs.style` prints them"
