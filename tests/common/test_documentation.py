"""Pages that messages name: where readers find them."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import vislam2tag
from vislam2tag.common.documentation import ADDRESS_VARIABLE, offline_page, page_of, with_pages
from vislam2tag.common.errors import UsageError

SOURCE = Path(vislam2tag.__file__).parent
DOCS = SOURCE.parents[1] / "docs"


def test_a_page_is_an_address_where_a_site_is_known_and_a_command_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(ADDRESS_VARIABLE, raising=False)
    assert page_of("how-to/iphone") == "`vislam2tag docs how-to/iphone`"
    monkeypatch.setenv(ADDRESS_VARIABLE, "https://docs.hospital.test/v2t/")
    assert page_of("how-to/iphone") == "https://docs.hospital.test/v2t/how-to/iphone.html"
    assert with_pages("see docs/how-to/iphone.md.") == "see https://docs.hospital.test/v2t/how-to/iphone.html."


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The site of an extra that is installed."""
    site = tmp_path / "vislam2tag_docs" / "site"
    for page in ("index", "how-to/index", "how-to/iphone", "help/faq"):
        (site / page).parent.mkdir(parents=True, exist_ok=True)
        (site / f"{page}.html").write_text("", encoding="utf-8")
    (site.parent / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    return site


def test_pages_and_sections_are_found_in_the_offline_copy(installed: Path) -> None:
    assert offline_page("how-to/iphone") == installed / "how-to" / "iphone.html"
    assert offline_page("how-to") == installed / "how-to" / "index.html"
    with pytest.raises(UsageError, match=r"has no page iphone\. Did you mean how-to/iphone\?"):
        offline_page("iphone")
    with pytest.raises(UsageError, match="for the start page"):
        offline_page("nothing")


def docstrings(tree: ast.AST) -> set[ast.AST]:
    """Docstrings of modules, classes, functions and fields."""
    return {node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)}


def test_messages_name_no_file_that_an_installation_does_not_contain() -> None:
    """Commands' docstrings are help, in which the program puts the addresses; ``with_pages`` does so elsewhere."""
    found = set()
    for path in SOURCE.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
        replaced = {part for call in calls if ast.unparse(call.func) == "with_pages" for part in ast.walk(call)}
        cited = {
            node
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant) and re.search(r"docs/[\w-]+/[\w-]+\.md", str(node.value))
        }
        found |= {(path.name, node.lineno) for node in cited - docstrings(tree) - replaced}
    assert not found


def test_pages_that_the_source_cites_exist() -> None:
    cited = set()
    for path in [*SOURCE.rglob("*.py"), *SOURCE.rglob("*.toml")]:
        text = path.read_text(encoding="utf-8")
        cited |= set(re.findall(r"\bdocs/([\w-]+/[\w-]+)\.md", text))
        cited |= set(re.findall(r"page_of\(\\?[\"']([\w/-]+)\\?[\"']\)", text))
    assert len(cited) > 20
    assert sorted(page for page in cited if not (DOCS / f"{page}.md").is_file()) == []
