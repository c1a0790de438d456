"""Cross-validation over walks: nobody answers who walked along."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from positioning_settings import cross_validated, training_part

from tests.dataset.factory import small_dataset
from vislam2tag.common.errors import UsageError
from vislam2tag.dataset.folder import write_dataset
from vislam2tag.dataset.splitting.splits import standard_splits


def test_walks_are_left_out_whole(tmp_path: Path) -> None:
    small = small_dataset()
    write_dataset(replace(small, splits=standard_splits(small)), tmp_path / "set")
    data = training_part(tmp_path / "set", "random")
    assert len(data) == 32
    error_m, right = cross_validated(data, "weighted-knn:k=1,distance=cosine")
    assert error_m > 4.9  # the phones walked 5 m apart
    assert right == 1
    with pytest.raises(UsageError, match="has no parameter 'kk'"):
        cross_validated(data, "knn:kk=1")
