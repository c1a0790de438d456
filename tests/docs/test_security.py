"""SECURITY.md names a test for each promise: all of them are there."""

from __future__ import annotations

from tests.docs.named_tests import ROOT, missing_tests, named_tests


def test_every_test_that_a_promise_names_exists() -> None:
    document = ROOT / "SECURITY.md"
    assert len(named_tests(document)) > 20
    assert missing_tests(document) == []
