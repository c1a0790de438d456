"""docs/project/status.md names a test, a page of results or "never run" for each claim."""

from __future__ import annotations

import re

from tests.docs.named_tests import ROOT, missing_tests, named_tests

STATUS = ROOT / "docs" / "project" / "status.md"


def test_every_test_that_a_claim_names_exists() -> None:
    assert len(named_tests(STATUS)) > 15
    assert missing_tests(STATUS) == []


def test_every_row_names_its_evidence() -> None:
    rows = [line for line in STATUS.read_text("utf-8").splitlines() if re.match(r"\| (?!---|claim|item)", line)]
    assert len(rows) > 15
    assert [row for row in rows if not re.search(r"`tests/|\]\(\.\./results/|never run", row)] == []


def test_what_was_never_run_is_the_same_in_the_readme() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    sentence = re.search(r"\*\*Never run:\*\* ([^.]+(?:\.\d[^.]+)*)\.\n", readme)
    assert sentence
    never = STATUS.read_text("utf-8").split("## Never run")[1].split("\n## ")[0]
    names = (
        "real phone",
        "real ARCore recording",
        "printed sheets",
        "original giaIndoorLoc",
        "Python 3.12",
        "macOS",
        "Windows",
        "Slurm",
        "Kubernetes",
    )
    assert [name for name in names if name not in sentence[1] or name not in never] == []
