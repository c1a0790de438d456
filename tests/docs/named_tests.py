"""Tests that a document names as evidence: `tests/FILE.py` or `tests/FILE.py::test_name` in backticks."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def named_tests(document: Path) -> list[tuple[str, str]]:
    """File and function (empty for a whole file) of every test that the document names."""
    return re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", document.read_text("utf-8"))


def missing_tests(document: Path) -> list[str]:
    """Return those of the named tests that do not exist."""
    return [
        f"{file}::{test}"
        for file, test in named_tests(document)
        if not (ROOT / file).is_file() or (test and f"def {test}(" not in (ROOT / file).read_text("utf-8"))
    ]
