"""What the studio refuses to work on."""

from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.settings import Settings
from vislam2tag.studio.workspace import Workspace


def test_walks_mapped_together_are_refused_before_anything_is_looked_at(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="maps each walk alone"):
        Workspace(tmp_path / "survey", tmp_path / "labels", Settings(together=True))
