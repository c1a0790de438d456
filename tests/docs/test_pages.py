from __future__ import annotations

import ast
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

import vislam2tag
from tests.cli.command import vislam2tag as command
from tests.docs.finding_pages import finding_texts
from tests.docs.pages import DOCS, PAGES, TUTORIALS
from tests.docs.program_pages import TASKS
from tests.docs.tutorial_pages import tutorial_page
from vislam2tag.common import findings
from vislam2tag.common.findings import Severity
from vislam2tag.core.status import STATUS_LABELS


@pytest.mark.parametrize("name", PAGES)
def test_pages_that_the_program_makes_are_current(name: str) -> None:
    assert (DOCS / name).read_text(encoding="utf-8") == PAGES[name](), "`make docs-pages` makes it again"


def test_every_kind_of_finding_is_explained() -> None:
    texts = finding_texts()
    for kind, entry in texts:
        assert set(entry) == {"where", "severity", "meaning", "cure"}, kind
        assert all(entry.values()), kind
        assert entry["severity"].split(":")[0] in set(Severity), kind
        assert entry["cure"] != "No action needed.", f"{kind}: say why"
        for text in (entry["meaning"], entry["cure"]):
            assert re.match(r"[A-Z`]", text), kind
            assert text.endswith("."), kind


def texts_in(*nodes: ast.AST) -> set[str]:
    constants = (each for node in nodes for each in ast.walk(node) if isinstance(each, ast.Constant))
    return {each.value for each in constants if isinstance(each.value, str)}


def kinds_taken(source: ast.AST) -> dict[str, dict[str, int]]:
    """By function and class of a module: its parameters or fields that are kinds of findings, with their places."""
    found: dict[str, dict[str, int]] = {}
    for node in ast.walk(source):
        fields: list[tuple[str, ast.expr | None]] = []
        if isinstance(node, ast.FunctionDef):
            given = [*node.args.args, *node.args.kwonlyargs]
            fields = [(each.arg, each.annotation) for each in given if each.arg not in ("self", "cls")]
        elif isinstance(node, ast.ClassDef):
            inside = [each for each in node.body if isinstance(each, ast.AnnAssign)]
            fields = [(ast.unparse(each.target), each.annotation) for each in inside]
        for at, (name, annotation) in enumerate(fields):
            if annotation and ast.unparse(annotation) == "FindingKind":
                found.setdefault(node.name, {})[name] = at  # type: ignore[attr-defined]
    return found


def kinds_named_in(source: ast.AST, taking: dict[str, dict[str, int]]) -> Iterator[str]:
    """Texts that are given as kinds of findings, to calls and in what is annotated as one or several."""
    for node in ast.walk(source):
        given: list[ast.expr] = []
        if isinstance(node, ast.Call) and (names := taking.get(ast.unparse(node.func).rpartition(".")[2])):
            given = [each.value for each in node.keywords if each.arg in names]
            given += [node.args[at] for at in names.values() if at < len(node.args)]
        elif isinstance(node, ast.AnnAssign) and node.value and "FindingKind" in ast.unparse(node.annotation):
            given = [node.value]
        yield from (text for text in texts_in(*given) if re.fullmatch("[a-z]+(_[a-z]+)+", text))


def test_every_kind_of_finding_can_come_up_and_no_other() -> None:
    listed = {kind for kind, _ in finding_texts()}
    sources = Path(vislam2tag.__file__).parent.rglob("*.py")
    parsed = {str(source): ast.parse(source.read_text(encoding="utf-8")) for source in sources}
    assert listed <= texts_in(*parsed.values())
    everywhere = kinds_taken(parsed[str(Path(findings.__file__))])
    named = {kind for source in parsed.values() for kind in kinds_named_in(source, everywhere | kinds_taken(source))}
    assert len(named) > 0.8 * len(listed)
    assert named <= listed


def test_every_status_has_a_cause_and_a_cure() -> None:
    text = (DOCS / "reference" / "statuses.md").read_text(encoding="utf-8")
    for label in STATUS_LABELS:
        _, _, section = text.partition(f"\n## `{label}`\n")
        assert "**What to do**" in section.split("\n## ")[0], label


def test_versions_that_are_cited_are_that_of_the_program() -> None:
    cited = yaml.safe_load((DOCS.parent / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == vislam2tag.__version__
    assert f"version = {{{vislam2tag.__version__}}}" in (DOCS / "project" / "citing.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("name", TUTORIALS)
def test_tutorials_run_and_say_what_their_pages_say(name: str, tmp_path: Path) -> None:
    """Pictures are drawn, but not compared: their bytes are the machine's."""
    page = (DOCS / "tutorials" / f"{name}.md").read_text(encoding="utf-8")
    assert tutorial_page(name, tmp_path) == page
    assert bool(list(tmp_path.glob(f"{name}_*.png"))) == ("![" in page)


@pytest.mark.slow
def test_examples_of_the_interface_run_one_after_the_other(tmp_path: Path) -> None:
    script = "\n".join(example for _, example in TASKS.values())
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "weighted-knn" in done.stdout


@pytest.mark.slow
def test_commands_of_the_model_tutorial_print_what_it_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "tutorials" / "trained_model.md").read_text(encoding="utf-8").split("## On the command line")[1]
    commands, shown = (re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL) for language in ("sh", "text"))
    (scans,) = (text for text in shown if text.startswith("scan_id,bssid"))
    Path("scans.csv").write_text(scans, encoding="utf-8")
    printed = []
    for line in "".join(commands).replace("\\\n", "").splitlines():
        done = command(*shlex.split(line)[1:])
        assert done.returncode == 0, (line, done.stdout, done.stderr)
        printed += done.stdout.splitlines()
    promised = [line.removesuffix("...") for text in shown if text != scans for line in text.splitlines()]
    assert promised
    assert [line for line in promised if not any(each.startswith(line) for each in printed)] == []
