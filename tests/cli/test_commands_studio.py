"""The command ``docs``: the offline copy of the documentation. tests/studio has those of ``studio``."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.docs.offline import installed_site


def test_a_page_of_the_documentation_is_printed_and_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = list[str]()
    monkeypatch.setattr("webbrowser.open", opened.append)
    with installed_site(tmp_path, "index") as site:
        assert vislam2tag("docs").stdout == f"{site / 'index.html'}\n"
        assert opened == [(site / "index.html").as_uri()]
        assert vislam2tag("docs", "--no-browser").returncode == 0
        assert len(opened) == 1
        wrong = vislam2tag("docs", "no-such-page")
        assert (wrong.returncode, the_error(wrong).count("vislam2tag docs")) == (2, 1)


def test_without_the_extra_a_page_is_printed() -> None:
    done = vislam2tag("docs", "help/faq")
    assert done.returncode == 0
    assert "Can I use an iPhone?" in done.stdout
