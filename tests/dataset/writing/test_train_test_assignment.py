"""Training and test parts by split and fold."""

from __future__ import annotations

import pytest

from tests.dataset.factory import SCANS, small_dataset
from tests.dataset.formats.round_trip import with_split
from vislam2tag.common.errors import UsageError
from vislam2tag.dataset.format_registry import ExportContext
from vislam2tag.dataset.writing.train_test_assignment import train_test_assignment


def counts(parts: object) -> dict[str, int]:
    return dict(parts.part.group_by("part").len().rows())  # type: ignore[attr-defined]


def test_the_official_split_counts_where_none_is_chosen() -> None:
    parts = train_test_assignment(with_split(small_dataset(), kind="official"), ExportContext())
    assert counts(parts) == {"train": 3 * (SCANS - 1), "test": SCANS - 1}
    assert parts.findings == ()


def test_no_choice_among_others_is_told() -> None:
    parts = train_test_assignment(with_split(small_dataset()), ExportContext())
    assert counts(parts) == {"train": 4 * SCANS}
    assert parts.findings[0].message.endswith("all is training data; there are: by_walk")


@pytest.mark.parametrize(
    ("split", "fold", "said"),
    [
        ("nope", None, "--split nope: the data set has no such split; there are: by_walk"),
        ("by_walk", "nope", "--fold nope: split by_walk has no such fold; there are: floor_0.Galaxy.walk/x"),
        (None, "nope", "--fold nope: say of which split by --split"),
    ],
)
def test_what_is_not_there(split: str | None, fold: str | None, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        train_test_assignment(with_split(small_dataset()), ExportContext(split=split, fold=fold))


def test_a_set_without_splits() -> None:
    with pytest.raises(UsageError, match="no such split; there are: none"):
        train_test_assignment(small_dataset(), ExportContext(split="random"))
