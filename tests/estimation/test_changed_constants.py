"""Each constant of the smoother that decides a result is held by a test: with another value some test fails.

A copy of the program gets one constant or comparison changed; then the tests of that module run against it.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from shutil import copytree, ignore_patterns

import pytest

import vislam2tag

PROGRAM, ROOT = Path(vislam2tag.__file__).parent, Path(__file__).parents[2]
TESTS_FAILED = 1
CHANGES = [
    # In a module, the text that is changed, and into what; and whose tests notice it, if those of another module.
    ("observations", "PAUSE_S = 2.0", "PAUSE_S = 8.0", ""),
    ("tracker_errors", "DriftSource.HEADING: 4.0", "DriftSource.HEADING: 40.0", "reweighting"),
    ("tracker_errors", "DriftSource.SCALE: 20.0", "DriftSource.SCALE: 2.0", "reweighting"),
    ("tracker_errors", "LANDMARK_DOF = 2.0", "LANDMARK_DOF = 20.0", "reweighting"),
    ("odometry", "JUMP_SHARE = 0.1", "JUMP_SHARE = 0.3", ""),
    ("odometry", "UNKNOWN_TURN_RAD = 0.1", "UNKNOWN_TURN_RAD = 1.0", ""),
    ("odometry", "TURN_SIGMA_RAD = 0.03", "TURN_SIGMA_RAD = 0.3", ""),
    ("odometry", "UNDONE = 0.3", "UNDONE = 0.6", ""),
    ("odometry", "LEAST_UPDATE_M = 0.005", "LEAST_UPDATE_M = 0.05", ""),
    ("odometry", "HOLE_S = 2.0", "HOLE_S = 1.0", ""),
    ("smoother", "LEAST_BASE_M = 0.5", "LEAST_BASE_M = 2.0", ""),
    ("smoother", "AWAY_S = 0.5", "AWAY_S = 5.0", ""),
    ("frame_states", "refused >= FEWEST_REFUSED", "refused > FEWEST_REFUSED", ""),
    ("frame_states", "2 * refused > count", "2 * refused >= count", ""),
    ("map_moves", "IN_VIEW_M = 4.0", "IN_VIEW_M = 8.0", ""),
    ("map_moves", "LEVER_M = 1.0", "LEVER_M = 5.0", ""),
    ("fault_detection", "UNUSUAL_SIGMAS = 4.0", "UNUSUAL_SIGMAS = 2.0", ""),
    ("fault_detection", "WORTH_ASKING_M = 0.15", "WORTH_ASKING_M = 0.6", ""),
    ("steps", "STANDING_M_S = 0.3", "STANDING_M_S = 0.6", ""),
    ("steps", "FASTEST_M_S = 3.0", "FASTEST_M_S = 9.0", ""),
    ("steps", "LEAST_JUMP_M = 0.3", "LEAST_JUMP_M = 1.5", ""),
    ("observations", "METRES_PER_RAD = 4.0", "METRES_PER_RAD = 20.0", ""),
    ("observations", "GREATEST_TURN_RAD = 0.3", "GREATEST_TURN_RAD = 3.0", ""),
    ("observations", "METRES_PER_S = 0.02", "METRES_PER_S = 0.1", ""),
    ("landmark_priors", "AROUND_M = 2.0", "AROUND_M = 10.0", ""),
]


@pytest.fixture(scope="module")
def changed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the program, whose modules may be changed."""
    copy = tmp_path_factory.mktemp("changed") / "vislam2tag"
    return copytree(PROGRAM, copy, ignore=ignore_patterns("page"))


def run(copy: Path, *modules: str) -> subprocess.CompletedProcess[str]:
    """Run tests of some modules of the smoother, until one fails, with a copy of the program."""
    tests = [f"tests/estimation/test_{module}.py" for module in modules]
    own = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    path = os.pathsep.join((str(copy.parent), str(ROOT)))
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-n0", "-x", *tests],
        cwd=ROOT,
        env={**own, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(("module", "before", "after", "held_by"), CHANGES)
def test_there_is_what_is_changed(module: str, before: str, after: str, held_by: str) -> None:
    text = (PROGRAM / "estimation" / f"{module}.py").read_text(encoding="utf-8")
    assert len(re.findall(rf"\b{re.escape(before)}\b", text)) == 1
    assert (ROOT / "tests/estimation" / f"test_{held_by or module}.py").exists()


@pytest.mark.campaign
def test_all_tests_pass_where_nothing_is_changed(changed: Path) -> None:
    done = run(changed, *sorted({held_by or module for module, _, _, held_by in CHANGES}))
    assert done.returncode == 0, done.stdout


@pytest.mark.campaign
@pytest.mark.parametrize(("module", "before", "after", "held_by"), CHANGES)
def test_a_changed_constant_fails_a_test(
    changed: Path,
    module: str,
    before: str,
    after: str,
    held_by: str,
    record_property: Callable[[str, object], None],
) -> None:
    file = changed / "estimation" / f"{module}.py"
    text = file.read_text(encoding="utf-8")
    file.write_text(re.sub(rf"\b{re.escape(before)}\b", after, text), encoding="utf-8")
    try:
        done = run(changed, held_by or module)
    finally:
        file.write_text(text, encoding="utf-8")
    assert done.returncode == TESTS_FAILED, done.stdout
    caught = re.findall(r"^FAILED \S+?::(\S+)", done.stdout, re.MULTILINE)
    record_property("caught by", ", ".join(caught))
    assert caught
