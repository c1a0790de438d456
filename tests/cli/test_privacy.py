from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.cli.options import privacy_of
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.privacy import Privacy


def test_without_options_only_networks_that_opted_out_go() -> None:
    assert privacy_of(False, None, False) == Privacy()


def test_each_option_says_one_thing(tmp_path: Path) -> None:
    (tmp_path / "key").write_text("0123456789abcdef\n")
    assert privacy_of(True, tmp_path / "key", True) == Privacy(
        include_nomap=True, hash_key=b"0123456789abcdef", keep_ssids=False
    )


def test_a_key_that_cannot_be_used_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError):
        privacy_of(False, tmp_path / "nowhere", False)
