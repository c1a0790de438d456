from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.cli.options import PrivacyOptions
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.privacy import Privacy


def test_without_options_only_networks_that_opted_out_go() -> None:
    assert PrivacyOptions().privacy == Privacy()


def test_each_option_says_one_thing(tmp_path: Path) -> None:
    (tmp_path / "key").write_text("0123456789abcdef\n")
    options = PrivacyOptions(include_nomap=True, hash_bssid=tmp_path / "key", no_ssid=True)
    assert options.privacy == Privacy(include_nomap=True, hash_key=b"0123456789abcdef", keep_ssids=False)


def test_a_key_that_cannot_be_used_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError):
        _ = PrivacyOptions(hash_bssid=tmp_path / "nowhere").privacy
