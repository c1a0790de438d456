"""A site as a drawing, or as a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.whole_file import write_file
from vislam2tag.common.findings import Finding, Severity, count_of
from vislam2tag.common.judgement import Judgement, counted
from vislam2tag.common.text_paths import AnyPath
from vislam2tag.survey.discover import read_site
from vislam2tag.survey.landmark_states import LandmarkCounts
from vislam2tag.survey.links import site_name
from vislam2tag.survey.model import Floor, Site
from vislam2tag.survey.plans.load import floor_plan
from vislam2tag.views.page import data_uri, write_page
from vislam2tag.views.panels import rendered
from vislam2tag.views.site_figures import site_plan

KINDS = ("png", "pdf", "svg", "html")


@dataclass(frozen=True)
class FloorSummary:
    """What is known of a floor, and how fine its plan is."""

    floor: Floor
    pixel_m: float | None
    """Width of a pixel of the plan, metres; None where it cannot be drawn."""
    landmarks: LandmarkCounts


@dataclass(frozen=True)
class SiteSummary:
    """A site with what is odd about its files and plans."""

    site: Site
    floors: tuple[FloorSummary, ...]
    findings: tuple[Finding, ...]

    @property
    def judgement(self) -> Judgement:
        """Whether something is wrong with the site's files, and what was there to look at."""
        plans = sum(one.pixel_m is not None for one in self.floors)
        marks = sum(one.landmarks.total for one in self.floors)
        wrong, warnings = (count_of(severity, self.findings) for severity in (Severity.ERROR, Severity.WARNING))
        missing = len(self.floors) - plans
        why = f"{counted(missing, 'floor')} without a plan: whether landmarks are on it could not be judged"
        looked_at = f"{counted(len(self.floors), 'floor')}, {counted(plans, 'plan')}, {counted(marks, 'landmark')}"
        return Judgement.of(wrong, plans + marks, looked_at, why if missing else "", warnings)


def summarise_site(root: AnyPath, floors: Sequence[int] = (), *, follow_links: bool = False) -> SiteSummary:
    """Read a site and load its plans, without what comes from outside unless ``follow_links``; ``floors``: only these.

    Raises SurveyError where it is none, UsageError where it has no such floor.
    """
    root = Path(root)
    site, findings = read_site(root, follow_links=follow_links)
    chosen = [floor for floor in site.floors if not floors or floor.number in floors]
    for number in floors:
        if number not in {floor.number for floor in chosen}:
            there = ", ".join(str(floor.number) for floor in site.floors)
            raise UsageError(f"--floor {number}: the site has no such floor; there are: {there}")
    summaries, odd = [], []
    for floor in chosen:
        pixel_m, problems = _pixel(root, floor)
        odd += problems
        counts = LandmarkCounts.of(site.landmarks.on_floor(floor.number))
        summaries.append(FloorSummary(floor, pixel_m, counts))
    return SiteSummary(site, tuple(summaries), (*findings, *odd))


def _pixel(root: Path, floor: Floor) -> tuple[float | None, list[Finding]]:
    """Size of the plan's pixels, and what only loading it tells."""
    if floor.plan is None or floor.extent_m is None:
        return None, []
    try:
        return floor_plan(floor).pixel_m[0], []
    except SurveyError as error:
        message = str(error).removeprefix(f"{floor.plan}: ")
        name = floor.plan.relative_to(root).as_posix()
        return None, [Finding(kind="unusable_plan", file=name, count=1, message=message, severity=Severity.WARNING)]


def title_of(root: Path, *, follow_links: bool = False) -> str:
    """What the building is called, else the folder."""
    return site_name(root, follow_links=follow_links) or root.resolve().name


def draw_site(summary: SiteSummary, title: str, out: Path) -> None:
    """Draw a site to a file whose suffix is one of :data:`KINDS`.

    Raises UsageError for any other suffix, OutputError where the file cannot be written.
    """
    kind = out.suffix.lower().removeprefix(".")
    if kind not in KINDS:
        raise UsageError(f"--out {out}: its name must end with {', '.join(f'.{each}' for each in KINDS)}")
    figure = site_plan([each.floor for each in summary.floors], summary.site.landmarks)
    if kind == "html":
        image = data_uri(rendered(figure, "png"))
        write_page(out, "site.html.j2", {"title": title, "summary": summary, "image": image})
        return
    write_file(out, rendered(figure, kind))
