"""What users are told of errors: one line, and how to install what lacks."""

from __future__ import annotations

import sys

import pytest

from vislam2tag.common.errors import UsageError, first_line, import_extra


@pytest.mark.parametrize(
    ("error", "words"), [(ValueError("no number\nline 2"), "no number"), (OSError(), "OSError"), (KeyError("x"), "'x'")]
)
def test_an_error_is_told_in_one_line(error: Exception, words: str) -> None:
    assert first_line(error) == words


def test_what_lacks_is_named_and_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("torch", "torch.nn"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(UsageError, match=r"this needs torch: pip install 'vislam2tag\[models\]'"):
        import_extra("torch.nn")


def test_a_module_of_ours_that_is_not_there_is_a_bug() -> None:
    with pytest.raises(ModuleNotFoundError):
        import_extra("vislam2tag.positioning.not_there")


def test_what_is_there_is_imported() -> None:
    assert import_extra("json").loads("1") == 1
