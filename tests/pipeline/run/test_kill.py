"""Killed at any step, a run is finished by the next one to the same bytes as if nothing had happened."""

from __future__ import annotations

import math
import signal
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.struck import MAIN, Strike, moments, struck
from tests.surveys import bytes_of, make_survey
from vislam2tag.pipeline.labels.process import process

COUNTING = f"import atexit\natexit.register(lambda: print(watch.seen))\n{MAIN}"
MOMENTS = 10


class Whole(NamedTuple):
    """An undisturbed run: how many steps of writing it took, and what it wrote."""

    steps: int
    files: dict[str, str]


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four sessions, not all of which can be mapped."""
    return make_survey(tmp_path_factory.mktemp("kill") / "survey", floors=2, seconds=20.0, severity="default")


@pytest.fixture(scope="module")
def whole(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Whole:
    out = tmp_path_factory.mktemp("whole") / "out"
    done = struck(out, Strike(0), "process", survey, "--out", out, "--jobs", "1", main=COUNTING)
    return Whole(int(done.stdout.splitlines()[-1]), bytes_of(out))


def killed_and_continued(survey: Path, out: Path, step: int, jobs: int) -> dict[str, str]:
    """What is there after a run was killed at a step and another ended."""
    done = struck(out, Strike(step), "process", survey, "--out", out, "--jobs", str(jobs))
    assert done.returncode == -signal.SIGKILL, done.stderr
    process(survey, out)
    return bytes_of(out)


@pytest.mark.parametrize("moment", moments(MOMENTS))
def test_killed_at_moments_spread_over_the_run(survey: Path, whole: Whole, tmp_path: Path, moment: int) -> None:
    step = math.ceil(whole.steps * moment / MOMENTS)
    assert killed_and_continued(survey, tmp_path / "out", step, jobs=1) == whole.files


@pytest.mark.campaign
@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("block", range(10))
def test_killed_at_every_step(
    survey: Path, whole: Whole, tmp_path: Path, block: int, jobs: int, record_property: Callable[[str, object], None]
) -> None:
    """With two workers the main process has fewer steps: then it may come to its end before it is killed."""
    steps = range(block + 1, whole.steps + 1, 10)
    killed = 0
    for step in steps:
        out = tmp_path / str(step)
        done = struck(out, Strike(step), "process", survey, "--out", out, "--jobs", str(jobs))
        killed += done.returncode == -signal.SIGKILL
        process(survey, out)
        assert bytes_of(out) == whole.files, step
    assert killed == len(steps) or jobs == 2
    record_property("kills", killed)


@pytest.mark.slow
@pytest.mark.parametrize("step", [10, 15])
def test_killed_while_a_worker_is_busy(survey: Path, whole: Whole, tmp_path: Path, step: int) -> None:
    assert killed_and_continued(survey, tmp_path / "out", step, jobs=2) == whole.files
