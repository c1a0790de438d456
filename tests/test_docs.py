"""What docs say of the code and of each other is there: modules, names, links, and the picture of the packages."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import vislam2tag
from tests.test_layers import LAYERS, ROOT, imported, layer_of

PROJECT = Path(vislam2tag.__file__).parents[2]
DOCS = sorted([*PROJECT.glob("*.md"), *(PROJECT / "docs").rglob("*.md")])
SITE = PROJECT / "docs"
FILE_TYPES = ("csv", "html", "json", "parquet", "pdf", "py", "times", "toml", "txt", "zip")
OF_READER = re.compile(r"NAME|^my\.py$")
MODULE = re.compile(r"(?<![\w/.*-])((?:[\w-]+/)*\w+\.py)\b")
FOLDER = re.compile(r"`((?:[a-z_0-9]+/)+)`")
DOTTED = re.compile(r"`(?:vislam2tag\.)?([a-z_]\w*(?:\.[A-Za-z_]\w*)+)`")
LINK = re.compile(r"\]\((?!\w+:)([^)#\s]*)(?:#([^)\s]*))?\)")
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)


def existing_modules() -> set[str]:
    """Every way in which a module may be named: by its whole path, or from any of its folders on."""
    roots = ("src", "tests", "benchmarks", "examples", "docs")
    paths = [path.relative_to(PROJECT).parts for root in roots for path in (PROJECT / root).rglob("*.py")]
    return {"/".join(parts[start:]) for parts in paths for start in range(len(parts))}


def test_modules_and_folders_that_docs_name_exist() -> None:
    """NAME and my stand for what a reader is to add."""
    there = existing_modules()
    packages = {path.name for path in ROOT.iterdir() if path.is_dir()}
    missing = set()
    for document in DOCS:
        text = document.read_text(encoding="utf-8")
        missing |= {
            (document.name, name) for name in MODULE.findall(text) if name not in there and not OF_READER.search(name)
        }
        missing |= {
            (document.name, folder)
            for folder in FOLDER.findall(text)
            if folder.split("/")[0] in packages and not ((ROOT / folder).is_dir() or (PROJECT / folder).is_dir())
        }
    assert not missing


def names_in(dotted: str) -> bool:
    """Whether a name like ``core.status.Status`` leads to a module and something in it."""
    path, parts = ROOT, dotted.split(".")
    while parts and (path / parts[0]).is_dir():
        path = path / parts.pop(0)
    if parts and (path / f"{parts[0]}.py").is_file():
        path = path / f"{parts.pop(0)}.py"
    if not parts:
        return True
    module = path if path.is_file() else path / "__init__.py"
    stub = module.with_suffix(".pyi")
    tree = ast.parse((stub if stub.is_file() else module).read_text(encoding="utf-8"))
    found = {node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    found |= {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    found |= {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    return parts[0] in found


def settings_names() -> set[str]:
    """First parts of the settings' names, which look like modules: ``dataset.wifi_window_s``."""
    text = (PROJECT / "docs" / "reference" / "settings.md").read_text(encoding="utf-8")
    return set(re.findall(r"`([a-z_]+(?:\.[a-z_]\w*)+)`", text))


def test_dotted_names_that_docs_mention_exist() -> None:
    modules = {layer_of(path) for path in ROOT.rglob("*.py")}
    settings = settings_names()
    mentioned = {
        (document.name, name)
        for document in DOCS
        for name in DOTTED.findall(document.read_text(encoding="utf-8"))
        if name.split(".")[0] in modules and name.rpartition(".")[2] not in FILE_TYPES and name not in settings
    }
    assert not {(document, name) for document, name in mentioned if not names_in(name)}


def test_relative_links_of_docs_resolve() -> None:
    broken = set()
    for document in DOCS:
        text = re.sub(r"```.*?```", "", document.read_text(encoding="utf-8"), flags=re.DOTALL)
        broken |= {
            (document.name, f"{target}#{anchor}")
            for target, anchor in LINK.findall(text)
            if not (document.parent / target).exists()
            or (anchor and anchor not in anchors(document.parent / target if target else document))
        }
    assert not broken


def anchors(document: Path) -> set[str]:
    """Names of a document's headings in links, as GitHub makes them."""
    headings = HEADING.findall(document.read_text(encoding="utf-8"))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def package_picture() -> str:
    """The packages' imports as Mermaid text, without those that others imply."""
    uses: dict[str, set[str]] = defaultdict(set)
    for path in ROOT.rglob("*.py"):
        if layer_of(path) in LAYERS:
            uses[layer_of(path)] |= imported(path) - {layer_of(path)}
    behind = {name: set[str]() for name in LAYERS}
    for name in LAYERS:
        behind[name] = uses[name].union(*(behind[used] for used in uses[name]))
    lines = ["flowchart TB"]
    for name in LAYERS:
        direct = uses[name].difference(*(behind[used] for used in uses[name]))
        lines += [f"    {used} --> {name}" for used in sorted(direct, key=LAYERS.index)]
    return "\n".join(lines)


def test_the_picture_of_the_packages_is_that_of_the_imports() -> None:
    text = (PROJECT / "docs" / "project" / "architecture.md").read_text(encoding="utf-8")
    assert package_picture() in text


def test_the_table_of_packages_holds_each_in_its_place() -> None:
    text = (PROJECT / "docs" / "project" / "architecture.md").read_text(encoding="utf-8")
    assert tuple(re.findall(r"^\| `(\w+)/?` \|", text, re.MULTILINE)) == LAYERS


def pages() -> dict[str, str]:
    """Every page of the site and its text; what other files hold of it is theirs."""
    return {path.relative_to(SITE).as_posix(): path.read_text(encoding="utf-8") for path in SITE.rglob("*.md")}


def test_the_navigation_holds_each_page_once() -> None:
    def listed(entry: object) -> list[str]:
        if isinstance(entry, str):
            return [entry]
        entries = entry.values() if isinstance(entry, dict) else entry
        assert isinstance(entries, Iterable)
        return [page for each in entries for page in listed(each)]

    nav = tomllib.loads((PROJECT / "zensical.toml").read_text(encoding="utf-8"))["project"]["nav"]
    assert sorted(listed(nav)) == sorted(pages())
