"""Figures of the documentation: benchmarks measure them, ``benchmarks/results`` keeps them, pages show them.

    python -m tests.docs.figures NAME               measure again with the command of benchmarks/results/NAME.json
    python -m tests.docs.figures NAME COMMAND ...   measure for the first time; then list by hand what it depends on
    python -m tests.docs.figures --stale            list results whose code changed since; fails if there are any

A result keeps every number of the tables that its command prints, as ``table / row / column``. Pages are made
from templates beside the results: ``{NAME: table / row / column}`` is a figure, ``{NAME}`` the command that
measured it, with version and date. A place that ends in ``?`` shows ``-`` if there is no such figure.
"""

from __future__ import annotations

import ast
import datetime
import hashlib
import json
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from itertools import islice
from pathlib import Path
from typing import TypedDict

from vislam2tag import __version__
from vislam2tag.common.commit import commit_of_checkout

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "benchmarks" / "results"
NUMBER = re.compile(r"(?<![\w.-])[+-]?\d+(?:\.\d+)?(?![\w.]*\d| ?%:)")
MAX_NUMBERS = 8
"""Of a cell: a cell with more is a list."""
PLACE = re.compile(r"\{([a-z0-9-]+)(?:: ([^{}]+))?\}")


class Result(TypedDict):
    """What one command measured."""

    made_by: str
    version: str
    commit: str
    date: str
    data: str
    depends_on: dict[str, str]
    """Files and folders of code, each with the digest that it had; empty if that is not known."""
    figures: dict[str, str]


def results() -> dict[str, Result]:
    """All results, by name; the digest of outputs is kept in the same folder, and is not one."""
    paths = [path for path in sorted(RESULTS.glob("*.json")) if path.stem != "snapshot"]
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in paths}


def filled(name: str) -> str:
    """A page of the documentation from its template."""
    found = results()

    def shown(place: re.Match[str]) -> str:
        result = found[place[1]]
        if not place[2]:
            return source(result)
        key = place[2].removesuffix("?")
        return result["figures"].get(key, "-") if key != place[2] else result["figures"][key]

    return PLACE.sub(shown, (RESULTS / f"{name}.md").read_text(encoding="utf-8"))


def source(result: Result) -> str:
    """Which command measured figures, with version, commit and date."""
    return f"`{result['made_by']}` (version {result['version']}, {result['commit']}, {result['date']})"


def figures_in(printed: str) -> dict[str, str]:
    """The numbers of all printed tables; a second number of a cell has `` (2)`` after the name of its column."""
    figures: dict[str, str] = {}
    title, table = "", list[list[str]]()
    rules = re.compile(r"(?=.*[-─])[-─| :]+")  # below the head of a table
    for line in [*(line for line in printed.splitlines() if not rules.fullmatch(line)), ""]:
        if cells := _cells(line):
            table.append(cells)
            continue
        for name, number in _in_table(table):
            key = " / ".join(filter(None, (title, name)))
            assert figures.setdefault(key, number) == number, f"two figures are named {key}"
        table = []
        if line.strip():
            title, _, more = line.strip("# ").partition(":")
            title = title.partition("(")[0].strip()
            if counted := NUMBER.search(more.partition("(")[0]):
                figures[title] = counted[0]
    return figures


def _cells(line: str) -> list[str]:
    """Cells of a row of a Markdown table, or of one whose columns are two spaces apart; none of other lines."""
    if line.startswith("|"):
        return [cell.strip() for cell in line.strip().strip("|").split("|")]
    cells = re.split(" {2,}", line.strip())
    return cells if len(cells) > 3 else []


def _in_table(table: list[list[str]]) -> Iterator[tuple[str, str]]:
    rows = table[1:]
    names = next((n for n in range(1, 4) if len({tuple(row[:n]) for row in rows}) == len(rows)), 1)
    columns = table[0] if table else []
    seen = [columns[: at + 1].count(head) for at, head in enumerate(columns)]
    heads = [head if count == 1 else f"{head} {count}" for head, count in zip(columns, seen, strict=True)]
    for row in rows:
        for head, cell in zip(heads[names:], row[names:], strict=False):
            for at, number in enumerate(islice(NUMBER.finditer(cell), MAX_NUMBERS), 1):
                yield " / ".join((*row[:names], head if at == 1 else f"{head} ({at})")), number[0]


def measure(name: str, command: str) -> None:
    """Run a command and write what it measured."""
    path = RESULTS / f"{name}.json"
    before: Result | None = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None
    made_by = command or (before["made_by"] if before else "")
    commit = commit_of_checkout(ROOT) or "unknown"
    words = [sys.executable if word == "python" else word for word in shlex.split(made_by)]
    done = subprocess.run(words, cwd=ROOT, check=True, stdout=subprocess.PIPE, encoding="utf-8")
    print(done.stdout)
    result = Result(
        made_by=made_by,
        version=__version__,
        commit=commit,
        date=datetime.datetime.now(datetime.UTC).date().isoformat(),
        data=before["data"] if before else "",
        depends_on={part: digest(ROOT / part) for part in before["depends_on"]} if before else {},
        figures=figures_in(done.stdout),
    )
    path.write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def digest(part: Path) -> str:
    """Digest of the code of a file or folder, without comments, docstrings and messages; empty if it is gone."""
    files = sorted(part.rglob("*.py")) if part.is_dir() else [part] if part.is_file() else []
    code = "\n".join(_without_words(path.read_text(encoding="utf-8")) for path in files)
    return hashlib.sha256(code.encode()).hexdigest()[:12] if code else ""


class _WordsRemoved(ast.NodeTransformer):
    """Removes docstrings and texts of several words, also those with values."""

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        return None if isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.AST:
        texts = (part.value for part in node.values if isinstance(part, ast.Constant))
        return ast.Constant("") if any(re.search(r"\s", str(text)) for text in texts) else node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        return ast.Constant("") if isinstance(node.value, str) and re.search(r"\s", node.value) else node


@cache
def _without_words(code: str) -> str:
    """Code whose comments, docstrings and texts of several words are gone."""
    return ast.unparse(_WordsRemoved().visit(ast.parse(code)))


def stale() -> list[str]:
    """A line for each result that code has outdated."""
    lines = []
    for name, result in results().items():
        changed = [part for part, was in result["depends_on"].items() if was != digest(ROOT / part)]
        if changed:
            at = f"{result['date']}, {result['commit']}"
            lines.append(f"{name} ({at}) was measured with other code: {', '.join(changed)}")
    return lines


if __name__ == "__main__":
    if sys.argv[1:] == ["--stale"]:
        outdated = stale()
        print("\n".join(outdated) or "All figures are those of this code.")
        sys.exit(bool(outdated))
    measure(sys.argv[1], shlex.join(sys.argv[2:]))
