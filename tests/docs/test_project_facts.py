"""What the project states of itself is true, and no placeholder waits to be filled in."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLACEHOLDER = re.compile(
    r"<(?:this|the|your)[ -]\w+>|<(?:owner|organi[sz]ation|user(?:name)?|repo(?:sitory)?|url)>"
    r"|\b(?:OWNER|ORG|USER)/REPO\b|github\.com/(?:owner|org|user(?:name)?|your|example)\b|\b(?:TODO|FIXME|TBD)\b",
    re.IGNORECASE,
)
OURS = (
    "README.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "CITATION.cff",
    "Containerfile",
    "pyproject.toml",
    "zensical.toml",
)
"""Files in which even an address that is an example would be one of ours."""
TEXTS = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in ("*.md", "*.toml", "*.cff", "Containerfile", ".github/**/*.yml", "docs/**/*.md")
    for path in ROOT.glob(pattern)
)


@pytest.mark.parametrize("name", TEXTS)
def test_no_text_has_a_placeholder(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    assert [found[0] for found in PLACEHOLDER.finditer(text)] == []
    if name in OURS or name.startswith(".github"):
        assert re.findall(r"\S*example\.(?:org|com|net)\S*", text) == []


def project() -> dict[str, list[str]]:
    """The table of the project file."""
    facts: dict[str, list[str]] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return facts


def test_classifiers_name_what_was_tried() -> None:
    for page in ("docs/how-to/install.md", "README.md"):
        assert re.search(r"Linux\b.*\b3\.11\b", (ROOT / page).read_text(encoding="utf-8"))
    named = {name for name in project()["classifiers"] if name.startswith(("Operating System", "Programming Language"))}
    assert named == {"Operating System :: POSIX :: Linux", "Programming Language :: Python :: 3.11"}


def test_addresses_of_the_project_are_those_of_its_repository() -> None:
    """No repository has been published: until a remote is known, there is no address to state."""
    stated = [*project().get("urls", [])]
    stated += re.findall(
        r"^(?:url|repository[\w-]*):.*", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert stated == []
