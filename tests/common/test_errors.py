from __future__ import annotations

import pytest

from vislam2tag.common.errors import first_line


@pytest.mark.parametrize(
    ("error", "words"), [(ValueError("no number\nline 2"), "no number"), (OSError(), "OSError"), (KeyError("x"), "'x'")]
)
def test_an_error_is_told_in_one_line(error: Exception, words: str) -> None:
    assert first_line(error) == words
