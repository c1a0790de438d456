"""What a host of repositories would run is what ``.ci/run`` runs: the same make targets."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[1]
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
COMMAND = re.compile(r"^\W*(?:as_newcomer )?make ([^&|;#\n]*)", re.MULTILINE)
WORDS = re.compile(r'\S+="[^"]*"|\S+')


def targets(script: str) -> set[str]:
    """Make targets that a shell script makes, without options, variables and files."""
    words = [word for command in COMMAND.findall(script) for word in WORDS.findall(command)]
    return {word for word in words if not re.search(r"^-|[=/]", word)}


def jobs() -> Iterator[tuple[str, dict[str, Any]]]:
    for file in WORKFLOWS:
        for name, job in yaml.safe_load(file.read_text(encoding="utf-8"))["jobs"].items():
            yield f"{file.name}: {name}", job


def test_workflows_make_what_the_script_of_ci_makes() -> None:
    of_workflows = {step["run"] for _, job in jobs() for step in job.get("steps", ()) if "run" in step}
    of_script = [(ROOT / ".ci" / name).read_text(encoding="utf-8") for name in ("run", "newcomer")]
    made = targets("\n".join(of_script))
    assert targets("\n".join(of_workflows)) == made
    assert {"demo", "test", "test-all", "release", "check-page"} <= made


def test_targets_are_those_of_the_makefile() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    there = {name for names in re.findall(r"^([a-z][a-z -]*):", makefile, re.MULTILINE) for name in names.split()}
    assert targets((ROOT / ".ci/run").read_text(encoding="utf-8")) <= there


@pytest.mark.parametrize("system", ["macos", "windows"])
def test_a_job_of_a_system_that_was_never_tried_says_so(system: str) -> None:
    names = [job["name"] for _, job in jobs() if system in str(job.get("runs-on"))]
    assert names
    assert all("never run" in name for name in names)


def test_every_step_of_a_workflow_runs_or_uses_one_thing() -> None:
    for name, job in jobs():
        for step in job.get("steps", ()):
            assert ("run" in step) != ("uses" in step), name
        assert job.get("steps") or job["uses"].startswith("./.github/workflows/"), name


def test_an_artifact_that_is_published_is_one_that_was_uploaded() -> None:
    steps = [step for _, job in jobs() for step in job.get("steps", ()) if "uses" in step]
    names = {
        kind: {step["with"]["name"] for step in steps if step["uses"].startswith(f"actions/{kind}-artifact@")}
        for kind in ("upload", "download")
    }
    assert names["download"] == names["upload"] == {"dist"}


def test_the_file_of_passed_tests_is_one_word_with_its_option() -> None:
    """Otherwise pytest looks for tests where the file is, and does not know the option."""
    for file in ("Makefile", ".ci/run", ".ci/newcomer"):
        assert "--passed " not in (ROOT / file).read_text(encoding="utf-8"), file
