"""Data flows one way: no module imports one further down the line."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import vislam2tag

ROOT = Path(vislam2tag.__file__).parent
LAYERS = (
    ("csv_rows", "errors", "findings", "settings", "whole_file", "whole_folder"),
    ("core",),
    ("survey",),
    ("walkable",),
    ("sessions",),
    ("mapping",),
    ("labeling",),
    ("results",),
    ("evaluation",),
    ("planning",),
    ("sheets",),
    ("registration",),
    ("receiving",),
    ("dataset",),
    ("positioning",),
    ("figures",),
    ("simulation",),
    ("report",),
    ("pipeline",),
    ("cli",),
)
RANK = {name: rank for rank, names in enumerate(LAYERS) for name in names}
MODULES = sorted(path for path in ROOT.rglob("*.py") if path.parent != ROOT or path.stem in RANK)


def imported_layers(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    names += [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    return {name.split(".")[1] for name in names if name.startswith("vislam2tag.")}


def layer_of(path: Path) -> str:
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def test_every_package_has_its_place() -> None:
    layers = {layer_of(path) for path in ROOT.rglob("*.py")} - {"__init__", "__main__", "api"}
    assert layers == set(RANK)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_module_imports_a_later_layer(path: Path) -> None:
    own = RANK[layer_of(path)]
    later = {name for name in imported_layers(path) if RANK[name] > own}
    assert not later


def test_core_knows_no_files_tables_or_plots() -> None:
    for path in (ROOT / "core").glob("*.py"):
        text = path.read_text(encoding="utf-8")
        for word in ("polars", "pathlib", "plotly", "open("):
            assert word not in text, f"{path.name} mentions {word}"
