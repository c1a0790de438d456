"""Tables as CSV, Markdown and LaTeX."""

from __future__ import annotations

from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table, markdown_table


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
