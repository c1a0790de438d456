from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import get_args

import pytest
import yaml

import vislam2tag
from tests.docs.finding_pages import finding_texts
from tests.docs.pages import DOCS, PAGES, TUTORIALS
from tests.docs.tutorial_pages import tutorial_page
from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Severity
from vislam2tag.core.status import STATUS_LABELS


@pytest.mark.parametrize("name", PAGES)
def test_pages_that_the_program_makes_are_current(name: str) -> None:
    assert (DOCS / name).read_text(encoding="utf-8") == PAGES[name](), "`make docs-pages` makes it again"


def test_every_kind_of_finding_is_explained() -> None:
    texts = finding_texts()
    assert {kind for kind, _ in texts} == set(get_args(FindingKind))
    for kind, entry in texts:
        assert set(entry) == {"where", "severity", "meaning", "cure"}, kind
        assert all(entry.values()), kind
        assert entry["severity"].split(":")[0] in set(Severity), kind


def test_every_kind_of_finding_can_come_up() -> None:
    """The types say that no other kind is told; this, that the program has a place for each that is listed."""
    sources = Path(vislam2tag.__file__).parent.rglob("*.py")
    told = {
        node.value
        for source in sources
        if source.name != "finding_kinds.py"
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    assert set(get_args(FindingKind)) <= told


def test_every_status_has_a_cause_and_a_cure() -> None:
    text = (DOCS / "reference" / "statuses.md").read_text(encoding="utf-8")
    for label in STATUS_LABELS:
        _, _, section = text.partition(f"\n## `{label}`\n")
        assert "**What to do**" in section.split("\n## ")[0], label


MADE_BY = re.compile(r"^\*Made by `[^`]+`; .*\b20\d\d-\d\d-\d\d\b.* Data needed: .+\*$", re.MULTILINE)


def test_every_page_of_results_says_what_made_it_when_and_of_what() -> None:
    for page in (DOCS / "results").glob("*.md"):
        said = re.search(
            r"^\*Made by `[^`]+`; .*\b20\d\d-\d\d-\d\d\b.* Data needed: .+\*$", page.read_text(encoding="utf-8"), re.M
        )
        assert said or page.stem == "index", page.name


def test_versions_that_are_cited_are_that_of_the_program() -> None:
    cited = yaml.safe_load((DOCS.parent / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == vislam2tag.__version__
    assert f"version = {{{vislam2tag.__version__}}}" in (DOCS / "project" / "citing.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("name", TUTORIALS)
def test_tutorials_run_and_say_what_their_pages_say(name: str, tmp_path: Path) -> None:
    """Pictures are drawn, but not compared: their bytes are the machine's."""
    assert tutorial_page(name, tmp_path) == (DOCS / "tutorials" / f"{name}.md").read_text(encoding="utf-8")
    assert list(tmp_path.glob(f"{name}_*.png"))
