"""Every sentence that the server can say about a survey has a German one on the page."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

from vislam2tag.common.palette import STATUS_STYLES
from vislam2tag.core.status import Status
from vislam2tag.studio.corrections_view import correction_tables

ROOT = Path(__file__).parents[2]
GERMAN = ROOT / "studio" / "src" / "words" / "sentences.de.json"
PACKAGES = (
    *("site", "intake", "sessions", "quality/diagnosis", "pipeline/labels", "labeling", "studio"),
    *("preparation/registration", "preparation/planning"),
)
"""Whose findings, faults and uses of corrections the page shows."""
NAMES = {"message", "summary", "evidence", "told", "words", "problem"}
"""Variables and arguments that hold sentences."""
MAKERS = {"Finding", "at_lines", "Fault"}
REFUSING = (
    "preparation/planning",
    "preparation/registration",
    "preparation/sheets",
    "studio/preparing.py",
    "studio/planning.py",
    "studio/jobs.py",
    "pipeline/site/change.py",
    "pipeline/site/plan.py",
    "pipeline/site/register.py",
)
"""What refuses while a building is prepared, and jobs that fail."""
REFUSALS = {"SurveyError", "UsageError", "OutputError"}
ELSEWHERE = {"ilc20.py", "getsensordata.py", "evaluate.py", "evaluate_session.py"}
"""Of formats that are imported and of other commands."""
OF_ILC20 = {
    "the folder's name contains no floor number, so its traces are skipped; "
    "rename the folder to F1, F2, ... or B1, ...",
    'the file cannot be read; expected {"map_info": {"width": ..., "height": ...}}, metres; '
    "the floor's extent is taken from the data",
    "{1} is read instead; remove one of the two",
}
"""Of floors in the layout of the Indoor Location Competition 2.0, which is imported, not prepared."""
PLACING = ROOT / "src" / "vislam2tag" / "pipeline" / "labels" / "placing_findings.py"
"""Its sentences are put together from parts."""
NOT_ON_THE_PAGE = {
    "every access point is heard in every row. No action needed if that is right; if a level means 'not heard', "
    "pass it with --not-heard LEVEL": "of wide tables, which are imported by a command",
    "no level is {1}, which is stated as 'not heard'{2}. Correct --not-heard, or leave it out": "as above",
    "'{1}' is not a paper size; available are: {2}": "the page offers a choice",
    "--columns {1}: a column appears twice": "the page has no such option",
    "--columns {1}: required columns are missing: {2}": "the page has no such option",
    "--columns {1}: '{2}' is not a column; columns are {3} and {4}": "the page has no such option",
    "no landmarks are given; pass a site's folder, a file of landmarks, --ids or --images": "the page names the site",
    "--mask corrects one floor; choose it with --floor": "the page always names a floor",
    "--floor: the site has several floors ({1}); choose one": "the page always names a floor",
    "{1}: this folder is among the site's own files; choose another name, or use --write": "the page names no folder",
    "nothing to change is given; pass --name, --elevation-m, --building, or a size or place": "it always gives a name",
    "--include-room {1}: this room is not excluded; excluded are: {2}": "only excluded rooms can be clicked",
    "--onto {1}: this is the same floor; choose another one": "of site align, which the page does not have",
    "two common points at different places are needed; pass --pair twice": "of site align",
    "the points are {1} times as far apart on floor {2} as on floor {3}: one of the plans has a wrong size, or the "
    "points are not the same places. Correct the size with vislam2tag site set --width-m, then measure the points "
    "again": "of site align",
}
"""Sentences of these modules that no request of the page can cause, with the reason."""


def templates(tree: ast.AST) -> Iterator[str]:
    """Sentences in a module, what varies as {1}, {2}, ..."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AugAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if any(isinstance(target, ast.Name) and target.id in NAMES for target in targets):
                yield from filter(None, map(template, choices(node.value)))
        elif isinstance(node, ast.Call):
            maker = getattr(node.func, "attr", None) or getattr(node.func, "id", None)
            values = [word.value for word in node.keywords if word.arg in NAMES]
            of_uses = maker == "append" and ast.unparse(node.func).startswith("uses.")
            for value in (*(node.args if maker in MAKERS or of_uses else ()), *values):
                yield from filter(None, map(template, choices(value)))


def refusals(tree: ast.AST) -> Iterator[str]:
    """Sentences of the errors that a module raises."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and ast.unparse(node.exc.func) in REFUSALS:
            for value in node.exc.args:
                yield from filter(None, map(template, choices(value)))


def choices(node: ast.expr) -> list[ast.expr]:
    return [*choices(node.body), *choices(node.orelse)] if isinstance(node, ast.IfExp) else [node]


def template(node: ast.expr) -> str | None:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if not isinstance(node, ast.JoinedStr):
        return None
    parts, varying = list[str](), 0
    for value in node.values:
        varying += isinstance(value, ast.FormattedValue)
        parts.append(str(value.value) if isinstance(value, ast.Constant) else f"{{{varying}}}")
    return "".join(parts)


def test_every_sentence_about_a_survey_is_there_in_german() -> None:
    whole = {renumbered(english) for english in json.loads(GERMAN.read_text(encoding="utf-8"))}
    known = whole | {sentence.removeprefix("{}") for sentence in whole}  # some are put on to others
    spoken = {
        sentence: file.name
        for package in PACKAGES
        for file in sorted((ROOT / "src" / "vislam2tag" / package).rglob("*.py"))
        if "receiving" not in file.parts and file.name not in ELSEWHERE
        for sentence in templates(ast.parse(file.read_text(encoding="utf-8")))
        if " " in sentence and re.search(r"[a-z]{2,}", sentence)
    }
    assert len(spoken) > 90
    missing = {sentence: name for sentence, name in spoken.items() if renumbered(sentence) not in known}
    assert missing.keys() - OF_ILC20 - NOT_ON_THE_PAGE.keys() == set()


def test_every_reason_why_a_plan_does_not_place_a_walk_is_there_in_german() -> None:
    known = {renumbered(english) for english in json.loads(GERMAN.read_text(encoding="utf-8"))}
    styles = [STATUS_STYLES[status.label] for status in Status if status >= Status.AMBIGUOUS]
    tree = ast.parse(PLACING.read_text(encoding="utf-8"))
    tables = [node.values for node in ast.walk(tree) if isinstance(node, ast.Dict)]
    parts = [template(value) for values in tables for value in values]
    ends = [template(node.value) for node in ast.walk(tree) if isinstance(node, ast.Return) and node.value]
    spoken = {renumbered(part) for part in [*parts, *ends] if part and " " in part}
    assert len(spoken) > 9
    assert (spoken | {style.meaning for style in styles}) - known == set()


def test_every_refusal_while_a_building_is_prepared_is_there_in_german() -> None:
    known = {renumbered(english) for english in json.loads(GERMAN.read_text(encoding="utf-8"))}
    places = (ROOT / "src" / "vislam2tag" / place for place in REFUSING)
    spoken = {
        sentence: file.name
        for place in places
        for file in ([place] if place.is_file() else sorted(place.rglob("*.py")))
        for sentence in refusals(ast.parse(file.read_text(encoding="utf-8")))
    }
    assert len(spoken) > 40
    missing = {sentence: name for sentence, name in spoken.items() if renumbered(sentence) not in known}
    assert missing.keys() - NOT_ON_THE_PAGE.keys() == set()


def test_every_kind_of_correction_is_explained_in_german() -> None:
    known = json.loads(GERMAN.read_text(encoding="utf-8"))
    assert {table.summary for table in correction_tables().tables} <= known.keys()


def test_a_german_sentence_has_what_varies_in_the_english_one() -> None:
    for english, german in json.loads(GERMAN.read_text(encoding="utf-8")).items():
        assert set(re.findall(r"\{\d+\}", german)) <= set(re.findall(r"\{\d+\}", english)), english


def renumbered(sentence: str) -> str:
    """Without the numbers of what varies: where a sentence is put together, they begin anew."""
    return re.sub(r"\{\d*\}", "{}", sentence)
