from __future__ import annotations

import polars as pl
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.dataset.splitting.splits import dealt, draw_order, drawn

NAMES = st.lists(st.text("abcdef/0123", min_size=1, max_size=6), unique=True, max_size=40)


def table_of(names: list[str]) -> pl.DataFrame:
    stratum = [len(name) % 3 for name in names]
    return pl.DataFrame({"id": names, "stratum": stratum}, schema={"id": pl.String, "stratum": pl.Int64})


def test_the_order_is_sha_256_of_seed_and_name() -> None:
    known = "681ebd31f1942012739312a095442ff5c473d0896902e122a989b3b7f9fadc9f"  # printf 7/a | sha256sum
    assert draw_order(pl.Series(["a"]), 7)[0] == known


@given(NAMES, st.sampled_from((0.1, 0.3, 0.5, 0.77)), st.integers(0, 5))
def test_shares_are_exact_in_each_stratum(names: list[str], share: float, seed: int) -> None:
    table = table_of(names)
    found = table.with_columns(drawn(table, "id", ("stratum",), share, seed))
    for _, rows in found.group_by("stratum"):
        assert rows["drawn"].sum() == int(share * rows.height + 0.5)


@given(NAMES, st.integers(0, 5))
def test_the_order_of_rows_does_not_matter(names: list[str], seed: int) -> None:
    table = table_of(names)
    turned = table.reverse()
    for first, second in (
        (drawn(table, "id", ("stratum",), 0.3, seed), drawn(turned, "id", ("stratum",), 0.3, seed)),
        (dealt(table, "id", ("stratum",), 3, seed), dealt(turned, "id", ("stratum",), 3, seed)),
    ):
        assert first.to_list() == second.reverse().to_list()


@given(NAMES.filter(bool), st.integers(0, 5))
def test_a_row_more_moves_at_most_one_other_of_its_stratum(names: list[str], seed: int) -> None:
    *before, added = names
    table, longer = table_of(before), table_of(names)
    old = dict(zip(table["id"], drawn(table, "id", ("stratum",), 0.3, seed), strict=True))
    new = dict(zip(longer["id"], drawn(longer, "id", ("stratum",), 0.3, seed), strict=True))
    moved = [name for name in before if old[name] != new[name]]
    assert len(moved) <= 1
    assert all(len(name) % 3 == len(added) % 3 for name in moved)


@given(NAMES, st.integers(1, 6), st.integers(0, 5))
def test_hands_are_as_equal_as_can_be_over_all_and_in_each_stratum(names: list[str], hands: int, seed: int) -> None:
    table = table_of(names)
    found = table.with_columns(hand=dealt(table, "id", ("stratum",), hands, seed))
    for rows in (found, *(rows for _, rows in found.group_by("stratum"))):
        counts = [rows.filter(pl.col("hand") == hand).height for hand in range(hands)]
        assert sum(counts) == rows.height
        assert max(counts) - min(counts) <= 1


def test_another_seed_draws_others() -> None:
    table = table_of([f"scan {index:03d}" for index in range(60)])
    first, second = (drawn(table, "id", ("stratum",), 0.3, seed) for seed in (0, 1))
    assert first.sum() == second.sum()
    assert (first != second).any()
