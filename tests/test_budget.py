"""The size of the program stays within ``budget.toml``, which may only be raised with a reason."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]
SOURCE = PROJECT / "src" / "vislam2tag"
LIMITS = {name: entry["limit"] for name, entry in tomllib.loads((PROJECT / "budget.toml").read_text()).items()}
MAX_PARAMETERS = 8
MAX_DEPTH = 2
"""Levels of packages below ``vislam2tag``."""


def code_lines(text: str, nodes: Iterable[ast.AST]) -> int:
    """Lines that are not blank, and not only comment or docstring; ``nodes`` are those of the text."""
    lines = {number for number, line in enumerate(text.splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"}
    for node in nodes:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(lines)


def texts(folder: Path) -> dict[Path, str]:
    return {path: path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.py"))}


def parameters(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    return len(node.args.posonlyargs + node.args.args + node.args.kwonlyargs)


@cache
def measured() -> dict[str, int]:
    """What the budget limits, by name."""
    source = texts(SOURCE)
    nodes = {path: list(ast.walk(ast.parse(text))) for path, text in source.items()}
    found = [node for each in nodes.values() for node in each]
    functions = [node for node in found if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    reference = PROJECT / "docs" / "reference"  # generated, so that it has all options and settings
    options = re.findall(
        r"^\| (?:`-[a-zA-Z]`, )?`(--[a-z][a-z0-9-]+)", (reference / "commands.md").read_text(encoding="utf-8"), re.M
    )
    settings = re.findall(r"^\| `[a-z0-9_.]+`", (reference / "settings.md").read_text(encoding="utf-8"), re.M)
    return {
        "modules": len(source),
        "packages": sum((path / "__init__.py").is_file() for path in SOURCE.iterdir()),
        "packages_nested_deeper_than_two": sum(
            len(path.parent.relative_to(SOURCE).parts) > MAX_DEPTH for path in SOURCE.rglob("__init__.py")
        ),
        "modules_over_400_lines": sum(text.count("\n") > 400 for text in source.values()),
        "code_lines": sum(code_lines(text, nodes[path]) for path, text in source.items()),
        "classes": sum(isinstance(node, ast.ClassDef) for node in found),
        "functions_with_more_than_8_parameters": sum(parameters(node) > MAX_PARAMETERS for node in functions),
        "settings": len(settings),
        "options": len(set(options)),
        "test_code_lines": sum(
            code_lines(text, ast.walk(ast.parse(text))) for text in texts(PROJECT / "tests").values()
        ),
        "benchmark_scripts": len(texts(PROJECT / "benchmarks")),
    }


def test_all_that_is_measured_has_a_limit() -> None:
    assert LIMITS.keys() == measured().keys()


@pytest.mark.parametrize("name", LIMITS)
def test_the_program_is_within_its_budget(name: str) -> None:
    assert measured()[name] <= LIMITS[name], "make it smaller, or raise the limit and add the reason"


def test_a_line_counts_if_it_has_code() -> None:
    text = '"""A docstring,\nof two lines."""\n\n# a comment\ndef f():  # another\n    return """a\nb"""\n'
    assert code_lines(text, ast.walk(ast.parse(text))) == 3
