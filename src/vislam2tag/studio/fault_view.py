"""Faults for the page: open, corrected and ignored ones, with corrections to choose from."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from datetime import date, time
from threading import Lock
from typing import TypeAlias

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Answer, FaultKind, Judgement
from vislam2tag.pipeline.labels.label_run import kept_faults
from vislam2tag.pipeline.labels.survey_evidence import thinned
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.quality.diagnosis.record import CorrectionEntry, Fault, answered
from vislam2tag.site.corrections import edits
from vislam2tag.studio import work_messages
from vislam2tag.studio.messages import Point, seen_as
from vislam2tag.studio.outputs import LABELS
from vislam2tag.studio.workspace import Snapshot, Workspace

_Identity: TypeAlias = tuple[object, ...]


class Diagnoses:
    """The faults of a workspace: of the last complete diagnosis if it is current, otherwise from the labels.

    Faults of an earlier complete diagnosis stay open until the next one. Corrected ones stay in the list.
    """

    def __init__(self, workspace: Workspace) -> None:
        """Start without a search."""
        self._workspace = workspace
        self._last: tuple[str, list[Fault], Judgement] | None = None
        """The last search of labels that were up to date, and the version of what it searched."""
        self._named: dict[_Identity, Fault] = {}
        """All faults that were found so far."""
        self._kept: set[_Identity] = set()
        """Those that only a complete diagnosis closes: of the last one, and those that were corrected since."""
        self._lock = Lock()

    def view(self) -> work_messages.DiagnosisView:
        """The list; one request after the other, because each adds to what is known."""
        with self._lock:
            return self._view()

    def _view(self) -> work_messages.DiagnosisView:
        version, full = self._workspace.searched(), self._workspace.diagnosis
        before = [] if full is None else full[0].faults
        stale = full is not None and full[1] != version
        written = self._written()
        if full is not None and not stale:
            state, found, judgement = "full", before, full[0].judgement
            self._last = version, found, judgement
        elif not self._workspace.outputs[LABELS].stamp():
            state, found, judgement = "none", [], self._not_looked_at()
        else:
            state, (found, judgement) = "quick", self._of_labels(version, written)
        listed = _by_identity(found)
        self._named = self._named | _by_identity(before) | listed
        earlier = {name: fault for name, fault in self._named.items() if name not in listed}
        corrected = {name: fault for name, fault in earlier.items() if _is_corrected(fault, written)}
        self._kept = {*_by_identity(before), *corrected, *(() if state == "full" else self._kept)}
        left = [fault for name, fault in earlier.items() if name in self._kept and name not in corrected]
        judgement = _with_open(judgement, left)
        faults, judgement = answered([*found, *left], judgement, self._workspace.now.corrections.ignore_fault)
        views = fault_views([*faults, *corrected.values()], self._workspace.now)
        return work_messages.DiagnosisView.model_validate(
            {"state": state, "stale": stale, "faults": views, "judgement": judgement}
        )

    def _of_labels(self, version: str, written: Mapping[str, object]) -> tuple[list[Fault], Judgement]:
        """Faults that labels show: while some are outdated, those before, because old and new ones contradict."""
        if self._last is not None and self._last[0] != version and self._workspace.stale():
            _, found, judgement = self._last
            return [fault for fault in found if not _is_corrected(fault, written)], judgement
        if self._last is None or self._last[0] != version:
            now, folder = self._workspace.now, OutputFolder(self._workspace.out)
            refs = [ref for ref in now.survey.sessions if not now.corrections.excludes(ref.key)]
            results = folder.results(ref.slug for ref in thinned(refs))
            passes = {result.slug: result.passes for result in results if result.passes is not None}
            self._last = version, *kept_faults(now.survey, refs, passes)
        return self._last[1], self._last[2]

    def _written(self) -> Mapping[str, object]:
        """The entries of the file; none while it cannot be read."""
        try:
            return tomllib.loads(edits.corrections_text(self._workspace.root)[0])
        except (SurveyError, tomllib.TOMLDecodeError):
            return {}

    def _not_looked_at(self) -> Judgement:
        why = "no walk has labels yet" if self._workspace.now.survey.sessions else "the survey has no walks yet"
        return Judgement(answer=Answer.NOT_LOOKED_AT, why=why)


def _identity(fault: Fault) -> _Identity:
    """Also by the stream that a correction is about: two of one walk may have wrong clocks."""
    streams = [entry.values["table"] for entry in fault.corrections if "table" in entry.values]
    return fault.kind, fault.floor, *fault.landmarks, *fault.sessions, *streams


def _by_identity(faults: list[Fault]) -> dict[_Identity, Fault]:
    return {_identity(fault): fault for fault in faults}


def _with_open(judgement: Judgement, faults: list[Fault]) -> Judgement:
    """The answer, including faults of an earlier search that are still open."""
    return judgement.model_copy(update={"answer": Answer.WRONG}) if faults else judgement


def _is_corrected(fault: Fault, written: Mapping[str, object]) -> bool:
    """Whether a file's tables have a fault's corrections, or one of its alternatives."""
    if fault.corrections:
        return all(_is_written(entry, written) for entry in fault.corrections)
    return any(_is_written(entry, written) for entry in alternatives(fault))


def _is_written(entry: CorrectionEntry, written: Mapping[str, object]) -> bool:
    """Whether a file's tables have an entry, with any reason; the page writes dates as texts."""
    tables = written.get(entry.table, [])
    if not isinstance(tables, list):
        return False
    wanted = {name: value for name, value in _comparable(entry.values).items() if name != "reason"}
    found = (_comparable(table) for table in tables if isinstance(table, dict))
    return any(
        all(table.get(name) == value for name, value in wanted.items())
        and all(name in wanted or name not in table for name in _SELECTORS)
        for table in found
    )


_SELECTORS = ("session", "device", "from", "until")
"""An entry with one of these that a correction does not have holds for less than the correction."""


def _comparable(values: Mapping[str, object]) -> dict[str, object]:
    """Plain values; ids may be numbers in a file, and their order does not count."""
    found = _plain_values(values)
    for name, value in found.items():
        if name == "id":
            found[name] = str(value)
        elif name == "ids" and isinstance(value, list | tuple):
            found[name] = sorted(str(one) for one in value)
    return found


def alternatives(fault: Fault) -> list[CorrectionEntry]:
    """Corrections to choose from for a fault without a certain one."""
    if fault.corrections or fault.kind not in (FaultKind.ODD_REFERENCE, FaultKind.DOUBTFUL_FIX):
        return []
    entries = []
    of_session: dict[str, object] = {}
    if len(fault.sessions) == 1:
        floor, device, session = fault.sessions[0].split(" / ")
        of_session = {"device": device, "session": session}
    if len(fault.landmarks) == 1 and fault.floor is not None:
        landmark = {"id": fault.landmarks[0], "floor": fault.floor}
        if fault.by_walks is not None:
            entries.append(CorrectionEntry(table="move_landmark", values=landmark | fault.by_walks.correction))
        entries.append(CorrectionEntry(table="exclude_landmark", values=landmark | of_session))
    elif of_session:
        number = int(floor.removeprefix("floor "))
        entries.append(CorrectionEntry(table="exclude_session", values={"floor": number} | of_session))
    return entries


def fault_views(faults: list[Fault], now: Snapshot) -> list[work_messages.FaultView]:
    """Faults in the order of the gain of their corrections."""
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
    """Sort key: larger share of labelled frames, then smaller expected error, then higher certainty."""
    gain = fault.gain
    labelled = gain.labelled_after - gain.labelled_before if gain else 0.0
    before, after = (gain.expected_before_m, gain.expected_after_m) if gain else (None, None)
    better = before - after if before is not None and after is not None else 0.0
    return -labelled, -better, -(fault.odds or 0.0)


def _fault_view(fault: Fault, places: Mapping[tuple[int, str], Point], now: Snapshot) -> work_messages.FaultView:
    ignoring = {
        "kind": fault.kind.value,
        "floor": fault.floor,
        "landmarks": fault.landmarks or None,
        "sessions": fault.sessions or None,
    }
    return seen_as(
        work_messages.FaultView,
        fault,
        id=":".join(str(part) for part in _identity(fault) if part is not None),
        kind=fault.kind.value,
        sessions=[now.id_of_key[key] for key in fault.sessions if key in now.id_of_key],
        changes=[_added(entry) for entry in fault.corrections],
        alternatives=[_added(entry) for entry in alternatives(fault)],
        ignore=edits.AddEntry(table="ignore_fault", values=_plain_values(ignoring)),
        places=_places(fault, places),
    )


def _added(entry: CorrectionEntry) -> edits.AddEntry:
    return edits.AddEntry(table=entry.table, values=_plain_values(entry.values))


def _plain_values(values: Mapping[str, object]) -> dict[str, object]:
    """Values for JSON."""
    return {
        name: value.isoformat() if isinstance(value, date | time) else value
        for name, value in values.items()
        if value is not None
    }


def _places(fault: Fault, places: Mapping[tuple[int, str], Point]) -> list[work_messages.FaultPlace]:
    """Positions of its landmarks in the table and according to the walks, if known."""
    if fault.floor is None:
        return []
    known = [name for name in fault.landmarks if (fault.floor, name) in places]
    to: dict[str, Point] = {}
    if fault.by_walks is not None and len(known) == 1:
        to = {known[0]: (fault.by_walks.x_m, fault.by_walks.y_m)}
    elif fault.observed_m is not None and len(known) == 1:
        to = {known[0]: fault.observed_m}
    if fault.kind is FaultKind.SWAPPED:
        to = {name: places[fault.floor, after] for name, after in zip(known, [*known[1:], *known[:1]], strict=True)}
    found = []
    for name in known:
        x, y = places[fault.floor, name]
        to_x, to_y = to.get(name, (None, None))
        found.append(work_messages.FaultPlace(floor=fault.floor, landmark=name, x=x, y=y, to_x=to_x, to_y=to_y))
    return found
