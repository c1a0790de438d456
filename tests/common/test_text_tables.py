"""Tables as CSV, Markdown and LaTeX; texts that a spreadsheet would compute are made text, and come back."""

from __future__ import annotations

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.text_tables import (
    csv_rows,
    latex_escaped,
    latex_table,
    markdown_table,
    spreadsheet_escaped,
    spreadsheet_unescaped,
)


def test_csv_quotes_where_it_must() -> None:
    assert csv_rows([("a", "b, c"), (1, None)]) == 'a,"b, c"\n1,\n'


def test_markdown_sets_numbers_right() -> None:
    assert markdown_table("Errors", ("device", "mean"), [("LG", "0.31")], texts=1) == (
        "**Errors**\n\n| device | mean |\n| --- | ---: |\n| LG | 0.31 |\n"
    )


def test_latex_has_a_rule_before_each_group() -> None:
    groups = [[("LG", "0.31"), ("S20", "0.25")], [(latex_escaped("a_b & c"), "-")]]
    assert latex_table("Errors", [("Device", "Mean")], groups, texts=1).splitlines() == [
        "% Errors",
        r"\begin{tabular}{lr}",
        r"\toprule",
        r"Device & Mean \\",
        r"\midrule",
        r"LG & 0.31 \\",
        r"S20 & 0.25 \\",
        r"\midrule",
        r"a\_b \& c & - \\",
        r"\bottomrule",
        r"\end{tabular}",
    ]


FORMULAS: list[str | None] = ["=1+1", "+1", "-1", "@SUM(A1)", "\tx", "\r=x"]
OTHERS = ["", "eduroam", "a=b", "'quoted'", " =1", None]


def test_formulas_get_an_apostrophe_and_others_none() -> None:
    table = pl.DataFrame({"ssid": FORMULAS + OTHERS, "number": range(12)})
    assert spreadsheet_escaped(table)["ssid"].to_list() == [f"'{text}" for text in FORMULAS] + OTHERS
    assert spreadsheet_escaped(table, formulas=False).equals(table)


@pytest.mark.parametrize("formulas", [True, False])
@given(texts=st.lists(st.none() | st.text(st.sampled_from("'=+-@\t\ra \n"), max_size=5)))
def test_every_text_comes_back(formulas: bool, texts: list[str | None]) -> None:
    table = pl.DataFrame({"ssid": texts}, schema={"ssid": pl.String})
    assert spreadsheet_unescaped(spreadsheet_escaped(table, formulas=formulas)).equals(table)
