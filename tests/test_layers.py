"""Data flows one way: no module imports one further down the line."""

from __future__ import annotations

import ast
from pathlib import Path

import vislam2tag

ROOT = Path(vislam2tag.__file__).parent
LAYERS = (
    "core",
    "common",
    "intake",
    "estimation",
    "site",
    "sessions",
    "labeling",
    "quality",
    "preparation",
    "datasets",
    "positioning",
    "views",
    "simulation",
    "settings",
    "pipeline",
    "studio",
    "cli",
)
"""Packages and modules in the order in which data meets them."""
FACE = {"__init__", "__main__", "api"}


def imported(path: Path) -> set[str]:
    """Packages of ours that a module imports, at its top or within a function."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    names += [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    return {name.split(".")[1] for name in names if name.startswith("vislam2tag.")}


def layer_of(path: Path) -> str:
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def test_no_module_imports_a_later_layer() -> None:
    rank = {name: place for place, name in enumerate(LAYERS)}
    modules = [path for path in ROOT.rglob("*.py") if layer_of(path) not in FACE]
    assert {layer_of(path) for path in modules} == set(LAYERS)
    later = {
        f"{path.relative_to(ROOT)} imports {name}"
        for path in modules
        for name in imported(path)
        if rank[name] > rank[layer_of(path)]
    }
    assert not later


def test_core_knows_no_files_tables_or_plots() -> None:
    for package in ("core", "estimation", "estimation/landmark_survey"):
        for path in (ROOT / package).glob("*.py"):
            text = path.read_text(encoding="utf-8")
            for word in ("polars", "pathlib", "plotly", "open("):
                assert word not in text, f"{path.name} mentions {word}"
