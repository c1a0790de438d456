"""What was made of a survey to be given away, as the page tells of it."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from vislam2tag.studio.export import shared_view


def test_only_what_is_whole_is_told_and_what_is_older_than_the_labels(tmp_path: Path) -> None:
    workspace: Any = SimpleNamespace(root=tmp_path / "survey", out=tmp_path / "labels")
    page, dataset, result = tmp_path / "survey-page", tmp_path / "survey-dataset", tmp_path / "labels" / "sessions"
    for folder, names in ((page, ("index.html",)), (dataset, ("report.html", "dataset.json")), (result, ("a.json",))):
        folder.mkdir(parents=True)
        for name in names:
            (folder / name).write_text("text")
    assert shared_view(workspace).page is None
    (page / "export.json").write_text("{}")
    os.utime(result / "a.json", ns=(10, 10))
    os.utime(dataset / "report.html", ns=(9, 9))
    os.utime(page / "index.html", ns=(10, 10))
    found = shared_view(workspace)
    assert found.dataset is not None
    assert found.page is not None
    assert (found.dataset.folder, found.dataset.files, found.dataset.size_bytes) == (str(dataset), 2, 8)
    assert (found.dataset.stale, found.page.stale) == (True, False)
