"""Faults of the survey as the page sees them: what brings most first, each with its place and the lines for it."""

from __future__ import annotations

import math
from collections.abc import Mapping

from vislam2tag.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.pipeline.labels.diagnosing.survey_evidence import thinned
from vislam2tag.pipeline.labels.process import kept_faults
from vislam2tag.pipeline.run.store import OutputFolder
from vislam2tag.studio.messages import Point
from vislam2tag.studio.outputs import LABELS
from vislam2tag.studio.work_messages import DiagnosisView, FaultPlace, FaultView
from vislam2tag.studio.workspace import Snapshot, Workspace
from vislam2tag.survey.corrections.edits import AddEntry


class Diagnoses:
    """The faults of a workspace: of the last whole diagnosis while nothing has changed since, else of the labels."""

    def __init__(self, workspace: Workspace) -> None:
        """Nothing is looked for before it is asked for."""
        self._workspace = workspace
        self._quick: tuple[str, list[Fault]] | None = None

    def view(self) -> DiagnosisView:
        """The list."""
        version, full = self._workspace.refresh().sessions, self._workspace.diagnosis
        if full is not None and full[1] == version:
            return DiagnosisView(state="full", stale=False, faults=fault_views(full[0].faults, self._workspace.now))
        if not self._workspace.outputs[LABELS].stamp():
            return DiagnosisView(state="none", stale=False, faults=[])
        if self._quick is None or self._quick[0] != version:
            now, folder = self._workspace.now, OutputFolder(self._workspace.out)
            refs = [ref for ref in now.survey.sessions if not now.corrections.excludes(ref.key)]
            results = folder.results(ref.slug for ref in thinned(refs))
            passes = {result.slug: result.passes for result in results if result.passes is not None}
            self._quick = version, kept_faults(now.survey, refs, passes)
        faults = fault_views(self._quick[1], self._workspace.now)
        return DiagnosisView(state="quick", stale=full is not None, faults=faults)


def fault_views(faults: list[Fault], now: Snapshot) -> list[FaultView]:
    """Faults in the order of what their corrections bring."""
    places = {
        (floor, name): (float(x), float(y))
        for name, floor, (x, y) in zip(
            now.survey.site.landmarks.ids,
            now.survey.site.landmarks.floor.tolist(),
            now.survey.site.landmarks.position_bcs.tolist(),
            strict=True,
        )
        if math.isfinite(x) and math.isfinite(y)
    }
    return [_fault_view(fault, places, now) for fault in sorted(faults, key=_order)]


def _order(fault: Fault) -> tuple[float, float, float]:
    """The greater share of frames labelled first, then the smaller error to expect, then the surer."""
    gain = fault.gain
    labelled = gain.labelled_after - gain.labelled_before if gain else 0.0
    before, after = (gain.expected_before_m, gain.expected_after_m) if gain else (None, None)
    better = before - after if before is not None and after is not None else 0.0
    return -labelled, -better, -(fault.odds or 0.0)


def _fault_view(fault: Fault, places: Mapping[tuple[int, str], Point], now: Snapshot) -> FaultView:
    return FaultView(
        id=f"{fault.kind.value}:{fault.floor}:{','.join(fault.landmarks)}:{','.join(fault.sessions)}",
        kind=fault.kind.value,
        floor=fault.floor,
        landmarks=fault.landmarks,
        sessions=[now.id_of_key[key] for key in fault.sessions if key in now.id_of_key],
        summary=fault.summary,
        evidence=fault.evidence,
        odds=fault.odds,
        gain=fault.gain,
        lines=fault.lines,
        changes=[AddEntry(table=entry.table, values=_plain_values(entry)) for entry in fault.corrections],
        places=_places(fault, places),
    )


def _plain_values(entry: CorrectionEntry) -> dict[str, object]:
    return {
        name: value.isoformat() if hasattr(value, "isoformat") else value
        for name, value in entry.values.items()
        if value is not None
    }


def _places(fault: Fault, places: Mapping[tuple[int, str], Point]) -> list[FaultPlace]:
    """Where its landmarks are by the table, and where they are by the walks, where that is told."""
    if fault.floor is None:
        return []
    to: dict[str, Point] = {
        str(entry.values["id"]): (float(entry.values["x"]), float(entry.values["y"]))
        for entry in fault.corrections
        if entry.table == "move_landmark"
    }
    known = [name for name in fault.landmarks if (fault.floor, name) in places]
    if fault.kind is FaultKind.SWAPPED:
        to = {name: places[fault.floor, after] for name, after in zip(known, [*known[1:], *known[:1]], strict=True)}
    found = []
    for name in known:
        x, y = places[fault.floor, name]
        to_x, to_y = to.get(name, (None, None))
        found.append(FaultPlace(floor=fault.floor, landmark=name, x=x, y=y, to_x=to_x, to_y=to_y))
    return found
