"""What users are told of errors: one line, and how to install what lacks."""

from __future__ import annotations

import re
import sys

import polars as pl
import pytest

from vislam2tag.common.errors import UsageError, first_line, import_extra


@pytest.mark.parametrize(
    ("error", "words"), [(ValueError("no number\nline 2"), "no number"), (OSError(), "OSError"), (KeyError("x"), "'x'")]
)
def test_an_error_is_told_in_one_line(error: Exception, words: str) -> None:
    assert first_line(error) == words


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"a,b\n1,2\n1,2,3\n", "a line has more fields than the first line"),
        (b"a,b\n1,x\n", "'x' in column b is not a whole number"),
        (b"", "it is empty"),
        (b"a\n1\n", "there is no column b"),
        (b'a,b\n"1,2\n3,4\n', "a quote is not closed"),
    ],
)
def test_errors_of_polars_are_told_in_words_about_the_file(content: bytes, words: str) -> None:
    with pytest.raises(pl.exceptions.PolarsError) as caught:
        pl.read_csv(content, schema_overrides={"a": pl.Int64, "b": pl.Int64}).select("a", "b")
    assert first_line(caught.value) == words


@pytest.mark.parametrize(("value", "failing"), [(1e300, pl.col("a").cast(pl.Int64)), (1, pl.col("a").str.len_chars())])
def test_other_errors_of_polars_do_not_speak_of_its_types(value: float, failing: pl.Expr) -> None:
    with pytest.raises(pl.exceptions.PolarsError) as caught:
        pl.DataFrame({"a": [value]}).select(failing)
    assert not re.search("dtype|conversion from|expression|[Ss]chema|[if]64", first_line(caught.value))


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
