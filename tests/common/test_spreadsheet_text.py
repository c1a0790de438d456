"""Texts that a spreadsheet would compute are made text, and come back as they were."""

from __future__ import annotations

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.spreadsheet_text import escaped, unescaped

FORMULAS: list[str | None] = ["=1+1", "+1", "-1", "@SUM(A1)", "\tx", "\r=x"]
OTHERS = ["", "eduroam", "a=b", "'quoted'", " =1", None]


def test_formulas_get_an_apostrophe_and_others_none() -> None:
    table = pl.DataFrame({"ssid": FORMULAS + OTHERS, "number": range(12)})
    assert escaped(table)["ssid"].to_list() == [f"'{text}" for text in FORMULAS] + OTHERS
    assert escaped(table, formulas=False).equals(table)


@pytest.mark.parametrize("formulas", [True, False])
@given(texts=st.lists(st.none() | st.text(st.sampled_from("'=+-@\t\ra \n"), max_size=5)))
def test_every_text_comes_back(formulas: bool, texts: list[str | None]) -> None:
    table = pl.DataFrame({"ssid": texts}, schema={"ssid": pl.String})
    assert unescaped(escaped(table, formulas=formulas)).equals(table)
