"""What a terminal would obey is spelled out; everything else stays."""

from __future__ import annotations

import json
import logging

import pytest

from vislam2tag.common.visible_text import VisibleFormatter, excerpt, visible


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b]0;title\x07", r"\u001b]0;title\u0007"),
        ("\x9b31m", r"\u009b31m"),
        ("a\rb\x7f\b", r"a\u000db\u007f\u0008"),
        ("fig\u202egpj.exe", r"fig\u202egpj.exe"),
        ("\udcff.csv", r"\udcff.csv"),
        ("two\nlines\tand Größe 楼 👩\u200d🔬", "two\nlines\tand Größe 楼 👩\u200d🔬"),
    ],
)
def test_only_what_is_obeyed_is_spelled_out(text: str, shown: str) -> None:
    assert visible(text) == shown
    assert visible(shown) == shown


def test_json_stays_what_it_was() -> None:
    value = {"name": "".join(map(chr, range(0x20, 0x300))) + "\u202e\u2028"}
    assert json.loads(visible(json.dumps(value, ensure_ascii=False))) == value


def test_what_is_logged_is_spelled_out_with_its_traceback() -> None:
    try:
        raise ValueError("\x1b[2J")
    except ValueError as error:
        record = logging.LogRecord("x", 40, "", 0, "floor \x1b[31m", (), (ValueError, error, None))
    text = VisibleFormatter("%(levelname)s %(message)s").format(record)
    assert text.startswith(r"ERROR floor \u001b[31m")
    assert text.endswith(r"ValueError: \u001b[2J")


def test_an_excerpt_is_one_short_line_without_markup() -> None:
    assert excerpt('7,<a href="x">1</a>,\x1b[2J\n 2') == r"7, 1 ,\u001b[2J 2"
    assert excerpt("<" + 9999 * "x") == ""
    assert excerpt(100 * "ab") == 28 * "ab" + "a..."
