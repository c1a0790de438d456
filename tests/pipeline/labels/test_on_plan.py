"""A survey without landmarks: placed on its plan, and again whenever a plan that counts has changed."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from PIL import Image, ImageDraw

from tests.cli.command import vislam2tag
from tests.surveys import make_survey
from vislam2tag.core.context import PlacingHints, PossiblePosition
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.process import dry_run, process
from vislam2tag.pipeline.labels.session import Reason, SessionJob, jobs_of
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.quality.self_check_record import SurveyCheck
from vislam2tag.sessions.registry import open_survey
from vislam2tag.settings import Settings
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.walkable.painted_cells import RED

Survey = Callable[[], Path]
SIDES_M = ("--width-m", "60", "--height-m", "32")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey of one walk of three minutes, with the landmarks and the plan of its floor."""
    folder = tmp_path_factory.mktemp("simulated") / "survey"
    return make_survey(folder, devices=("LG",), seconds=180.0, severity="default", seed=73)


@pytest.fixture(scope="module")
def without_landmarks(simulated: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A site from a plan's image, with the walk and nothing else."""
    root = tmp_path_factory.mktemp("planned") / "survey"
    add_floor(root, 0, simulated / "floor_0" / "floorplan.jpg")
    shutil.copytree(simulated / "floor_0" / "LG", root / "floor_0" / "LG")
    return root


def add_floor(root: Path, number: int, plan: Path) -> None:
    done = vislam2tag("site", "init", root, "--plan", plan, "--floor", str(number), *SIDES_M)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def placed(without_landmarks: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The labels of the walk without landmarks."""
    out = tmp_path_factory.mktemp("placed") / "labels"
    process(without_landmarks, out)
    return out


@pytest.fixture
def survey(without_landmarks: Path, tmp_path: Path) -> Path:
    """A copy that a test may change."""
    return Path(shutil.copytree(without_landmarks, tmp_path / "survey"))


def result_of(out: Path) -> SessionResult:
    (path,) = (out / "sessions").glob("*.json")
    return SessionResult.model_validate_json(path.read_bytes())


def reasons(survey: Path, out: Path, settings: ProcessSettings | None = None) -> tuple[Reason, ...]:
    """Why the walk would be processed again."""
    ((_, found),) = ((one.session, one.reasons) for one in dry_run(survey, out, settings))
    return found


def plan_of(survey: Path, number: int = 0) -> Path:
    (path,) = (survey / f"floor_{number}").glob("*.jpg")
    return path


def drawn_upon(survey: Path, number: int = 0) -> None:
    """Draw a wall across a floor."""
    image = Image.open(plan_of(survey, number)).convert("RGB")
    ImageDraw.Draw(image).line((900, 0, 900, 640), fill="black", width=4)
    image.save(plan_of(survey, number), quality=90)


def surveyed(simulated: Path, survey: Path, count: int) -> None:
    """Survey the first landmarks that the walk passes."""
    rows = (simulated / "floor_0" / "marker_dict.csv").read_text().splitlines()
    (folder,) = (survey / "floor_0" / "LG").iterdir()
    text = (folder / "initPoses.csv").read_text().splitlines()
    seen = list(dict.fromkeys(line.split(";")[0].strip() for line in text))
    by_id = {row.split(",")[0]: row for row in rows[1:]}
    kept = [by_id[name] for name in seen if name in by_id][:count]
    assert len(kept) == count
    (survey / "floor_0" / "marker_dict.csv").write_text("\n".join((rows[0], *kept)) + "\n")


def test_walks_of_a_site_without_landmarks_are_placed(placed: Path) -> None:
    result = result_of(placed)
    assert (result.error, result.strategy) == (None, "smoother")
    assert result.placing is not None
    assert result.placing.labelled_share > 0.65
    assert result.frames["ok"] > 0.65 * sum(result.frames.values())
    assert {finding.kind for finding in result.findings} >= {"placed_on_plan"}
    assert result.errors is not None
    assert result.sigma is not None
    assert result.sigma.median_m < 0.5
    table = pl.read_parquet(next((placed / "trajectory").glob("*.parquet")))
    assert table["x"].drop_nulls().is_between(0, 60).all()


def test_check_states_the_sigma_of_walks_without_landmarks(without_landmarks: Path, tmp_path: Path) -> None:
    done = vislam2tag("check", without_landmarks, "--out", tmp_path / "check")
    assert done.returncode == 0, (done.stdout, done.stderr)
    assert "could not be judged: no session has enough surveyed landmarks" in done.stdout
    assert "sigma alone gives the expected errors" in (tmp_path / "check" / "check.html").read_text()
    found = SurveyCheck.model_validate_json((tmp_path / "check" / "check.json").read_bytes())
    (session,) = found.sessions
    assert session.error is None
    assert session.stated_m is not None
    assert session.stated_m == session.estimated_m
    assert session.labelled > 0.65 * session.frames
    assert found.walked[0].walked
    assert found.walked[0].scanned


def test_check_and_diagnose_fail_without_landmarks_and_plan(survey: Path) -> None:
    plan_of(survey).unlink()
    done = vislam2tag("check", survey)
    assert done.returncode == 3
    assert "or a plan of its floor with walls" in done.stderr
    assert vislam2tag("diagnose", survey).returncode == 3
    assert vislam2tag("inspect", survey).returncode == 1


def test_diagnose_says_that_walks_without_landmarks_could_not_be_judged(without_landmarks: Path) -> None:
    done = vislam2tag("diagnose", without_landmarks)
    assert done.returncode == 0
    assert "could not be judged: no walk passes 3 surveyed landmarks" in done.stdout
    assert f"next: vislam2tag run {without_landmarks}" in done.stdout


def test_inspect_finds_nothing_wrong_where_a_plan_may_place_the_walks(survey: Path) -> None:
    (folder,) = (survey / "floor_0" / "LG").iterdir()
    for empty in (False, True):
        (folder / "initPoses.csv").unlink()
        if empty:
            (folder / "initPoses.csv").touch()
        done = vislam2tag("inspect", survey)
        assert done.returncode == 0, done.stdout
        assert "nothing is wrong" in done.stdout
        assert "cannot be mapped" not in done.stdout
        (folder / "initPoses.csv").touch()


def test_nothing_changed_nothing_to_do(without_landmarks: Path, placed: Path) -> None:
    assert reasons(without_landmarks, placed) == ()


def test_a_changed_plan_places_its_walks_again(survey: Path, placed: Path, tmp_path: Path) -> None:
    original = plan_of(survey).read_bytes()
    drawn_upon(survey)
    assert reasons(survey, placed) == (Reason.INPUTS,)
    out = Path(shutil.copytree(placed, tmp_path / "labels"))
    process(survey, out)
    before, after = result_of(placed), result_of(out)
    assert before.placing is not None
    assert after.placing is not None
    assert after.placing.misfit > before.placing.misfit
    assert reasons(survey, out) == ()
    plan_of(survey).write_bytes(original)
    assert reasons(survey, placed) == ()


def test_a_mask_and_the_plan_of_another_floor_count_too(survey: Path, placed: Path) -> None:
    mask = Image.new("RGB", (60, 32), "white")
    mask.paste(RED, (20, 10, 30, 20))
    mask.save(survey / "floor_0" / "floorplan.mask.png")
    assert reasons(survey, placed) == (Reason.INPUTS,)
    (survey / "floor_0" / "floorplan.mask.png").unlink()
    assert reasons(survey, placed) == ()
    add_floor(survey, 1, plan_of(survey))
    assert reasons(survey, placed) == (Reason.INPUTS,)


@pytest.fixture(scope="module")
def by_landmarks(
    simulated: Path, without_landmarks: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path]:
    """The survey with three landmarks, and its labels."""
    folder = tmp_path_factory.mktemp("landmarks")
    survey = Path(shutil.copytree(without_landmarks, folder / "survey"))
    surveyed(simulated, survey, 3)
    process(survey, folder / "labels")
    return survey, folder / "labels"


def test_walks_that_landmarks_connect_stay_when_the_plan_changes(
    by_landmarks: tuple[Path, Path], tmp_path: Path
) -> None:
    survey, out = Path(shutil.copytree(by_landmarks[0], tmp_path / "survey")), by_landmarks[1]
    assert result_of(out).placing is None
    assert result_of(out).frames.keys() <= {"ok", "uncertain"}
    drawn_upon(survey)
    assert reasons(survey, out) == ()


def test_the_strategy_floor_plan_depends_on_plans_with_any_landmarks(
    by_landmarks: tuple[Path, Path], tmp_path: Path
) -> None:
    survey, settings = Path(shutil.copytree(by_landmarks[0], tmp_path / "survey")), Settings(strategy="floor-plan")
    process(survey, tmp_path / "labels", settings)
    assert result_of(tmp_path / "labels").placing is not None
    assert reasons(survey, tmp_path / "labels", settings) == ()
    drawn_upon(survey)
    assert reasons(survey, tmp_path / "labels", settings) == (Reason.INPUTS,)


def test_strategies_that_use_no_plan_do_not_depend_on_it(survey: Path, tmp_path: Path) -> None:
    settings = Settings(strategy="local")
    process(survey, tmp_path / "labels", settings)
    assert result_of(tmp_path / "labels").frames.keys() == {"no_mapping"}
    drawn_upon(survey)
    assert reasons(survey, tmp_path / "labels", settings) == ()


def test_a_plan_that_is_added_later_places_what_could_not_be_mapped(survey: Path, tmp_path: Path) -> None:
    plan = plan_of(survey)
    plan.rename(tmp_path / "plan.jpg")
    process(survey, tmp_path / "labels")
    result = result_of(tmp_path / "labels")
    assert result.error is not None
    assert "or a plan of its floor with walls" in result.error
    assert {"too_few_landmarks", "unusable_plan"} <= {finding.kind for finding in result.findings}
    assert result.placing is None
    assert reasons(survey, tmp_path / "labels") == ()
    (tmp_path / "plan.jpg").rename(plan)
    assert reasons(survey, tmp_path / "labels") == (Reason.INPUTS,)


def truth_at(survey: Path, at_s: float) -> tuple[float, float]:
    """Where the walk was so many seconds after its first frame."""
    (folder,) = (survey / "floor_0" / "LG").iterdir()
    truth = pl.read_csv(folder / "truth.csv")
    start_ns = int((folder / "poses.csv").read_text().split(";", 1)[0])
    seconds = (truth["time_ns"].to_numpy() - start_ns) * 1e-9
    x, y = (float(np.interp(at_s, seconds, truth[axis].to_numpy())) for axis in ("x", "y"))
    return x, y


def test_the_tap_that_a_finding_asks_for_settles_a_short_walk(survey: Path, tmp_path: Path) -> None:
    (folder,) = (survey / "floor_0" / "LG").iterdir()
    short = f'[[exclude_span]]\nsession = "{folder.name}"\nfrom_s = 45.0\n'
    (survey / "corrections.toml").write_text(short)
    process(survey, tmp_path / "labels")
    vague = result_of(tmp_path / "labels")
    (message,) = [finding.message for finding in vague.findings if finding.kind == "not_placed"]
    assert vague.frames.keys() == {"too_short", "invalid"}
    found = re.search(r"\(at_s = (\d+)\)", message)
    assert found is not None
    at_s = float(found[1])
    assert vague.placing is not None
    assert vague.placing.best_tap_ns is not None
    x, y = truth_at(survey, at_s)
    tap = f'[[set_tap]]\nsession = "{folder.name}"\nat_s = {at_s}\nx = {x:.1f}\ny = {y:.1f}\n'
    (survey / "corrections.toml").write_text(short + tap)
    assert reasons(survey, tmp_path / "labels") == (Reason.INPUTS,)
    process(survey, tmp_path / "labels")
    settled = result_of(tmp_path / "labels")
    assert settled.frames.keys() == {"ok", "invalid"}
    assert any("The walk is placed at" in use for use in settled.corrections)


def test_what_other_walks_say_of_its_place_counts(without_landmarks: Path, placed: Path) -> None:
    opened = open_survey(without_landmarks)
    (ref,) = opened.sessions
    settings = Settings()
    (job,) = jobs_of([session_task(ref, opened, Corrections(), settings)], settings, OutputFolder(placed))
    assert job.reasons() == ()
    here = PossiblePosition(5, np.array([(1.0, 2.0)]), np.array([0.5]), 1.0)
    hints = [
        PlacingHints(),
        PlacingHints(north_rad=1.0),
        PlacingHints(places=(here,)),
        PlacingHints(places=(here, here)),
        PlacingHints(places=(replace(here, weight=np.array([0.4])),)),
    ]
    for one in hints:
        assert hinted(job, one).reasons() == (Reason.INPUTS,)


def hinted(job: SessionJob, hints: PlacingHints) -> SessionJob:
    return replace(job, task=replace(job.task, hints=hints))
