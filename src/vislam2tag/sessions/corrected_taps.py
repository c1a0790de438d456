"""Taps of walks without tracker, as ``corrections.toml`` places, moves and takes them out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vislam2tag.core.context import FixLog
from vislam2tag.sessions.fixes import too_few_fixes
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.without_poses import without_tracker
from vislam2tag.site.corrections.file import CORRECTIONS_FILE, SetTap

SAME_TAP_S = 0.25
"""An entry means the tap within this of its moment: nobody taps two places so quickly."""
_NO_FIXES = FixLog(np.empty(0, dtype=np.int64), np.empty((0, 2)), ())


def with_taps_corrected(session: Session, entries: Sequence[SetTap]) -> tuple[Session, tuple[str, ...]]:
    """Apply entries to a session's fixes, and give one sentence for each use.

    One entry after the other: each moves the tap of its moment, takes it out, or places one where none is. A session
    with poses stays as it is; one without fixes, too, is walked by dead reckoning from then on.
    """
    if not entries or session.camera.tracked:
        return session, ()
    if not session.camera.without_poses:
        begun = without_tracker(session, _NO_FIXES)
        if begun is None:
            return session, ()
        session = begun
    fixes, uses = session.camera.fixes or _NO_FIXES, list[str]()
    for entry in entries:
        fixes = _with_tap(fixes, entry, int(session.camera.time_ns[0]), uses)
    return _with_fixes_judged_again(session, fixes), tuple(uses)


def _with_tap(fixes: FixLog, entry: SetTap, start_ns: int, uses: list[str]) -> FixLog:
    at_ns = start_ns + round(entry.at_s * 1e9)
    away_ns = np.abs(fixes.time_ns - at_ns)
    place = int(away_ns.argmin()) if len(away_ns) and away_ns.min() <= SAME_TAP_S * 1e9 else None
    kept = np.arange(len(fixes.time_ns)) != place
    times, positions = fixes.time_ns[kept], fixes.position_bcs[kept]
    names = tuple(name for name, stays in zip(fixes.name, kept.tolist(), strict=True) if stays)
    sigma_m = None if fixes.sigma_m is None else fixes.sigma_m[kept]
    if entry.x is None or entry.y is None:
        if place is not None:
            uses.append(f"The tap at {entry.at_s:g} s is left out{entry.because()}.")
        return FixLog(times, positions, names, sigma_m)
    uses.append(f"The walk is taken to be at ({entry.x:g}, {entry.y:g}) at {entry.at_s:g} s{entry.because()}.")
    time_ns = at_ns if place is None else int(fixes.time_ns[place])
    row = int(np.searchsorted(times, time_ns))
    return FixLog(
        np.insert(times, row, time_ns),
        np.insert(positions, row, (entry.x, entry.y), axis=0),
        (*names[:row], f"tap at {entry.at_s:g} s", *names[row:]),
        None if sigma_m is None else np.insert(sigma_m, row, np.nan),
    )


def _with_fixes_judged_again(session: Session, fixes: FixLog) -> Session:
    findings = [each for each in session.findings if each.kind != "too_few_fixes"]
    if len(fixes.time_ns) < 2:
        findings.append(too_few_fixes(CORRECTIONS_FILE, "taps on the plan"))
    return replace(session, camera=replace(session.camera, fixes=fixes), findings=tuple(findings))
