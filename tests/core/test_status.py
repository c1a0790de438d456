from __future__ import annotations

from vislam2tag.core.status import labelled_share


def test_share_leaves_repeated_rows_out() -> None:
    assert labelled_share({"ok": 3, "gap": 1, "duplicate": 100}) == 0.75
    assert labelled_share({"gap": 2}) == 0.0
    assert labelled_share({"duplicate": 2}) is None
    assert labelled_share({}) is None
