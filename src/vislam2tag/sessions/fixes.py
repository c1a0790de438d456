"""Known positions of walks without poses: too few of them, or given in degrees."""

from __future__ import annotations

from dataclasses import dataclass

from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import FixLog
from vislam2tag.site.georeference import from_wgs84
from vislam2tag.site.model import Floor


@dataclass(frozen=True)
class GeographicFixes:
    """Positions that are placed on the floor once its georeference is known.

    ``time_ns`` (k,) increasing strictly; ``position`` (k, 2) longitude and latitude, degrees; ``floor`` (k,) as the
    log numbers them; ``name`` (k,). ``file`` is where they stand.
    """

    file: str
    time_ns: IntArray
    position: FloatArray
    floor: IntArray
    name: tuple[str, ...]

    def on(self, floor: Floor) -> tuple[FixLog | None, list[Finding]]:
        """Place those of one floor; None, with the reason, where it has no georeference."""
        if floor.georeference is None:
            message = (
                f"its positions are in degrees, and floor {floor.number} has no georeference: give "
                "[georeference] in site.toml (docs/how-to/site.md)"
            )
            return None, [_error("fixes_without_georeference", self.file, message)]
        here = self.floor == floor.number
        names = tuple(name for name, taken in zip(self.name, here.tolist(), strict=True) if taken)
        fixes = FixLog(self.time_ns[here], from_wgs84(self.position[here], floor.georeference), names)
        return fixes, [] if len(names) > 1 else [too_few_fixes(self.file, f"POSI rows of floor {floor.number}")]


def too_few_fixes(file: str, what: str) -> Finding:
    """Report a session of whose places fewer than two are known; ``what`` is how its file says one."""
    message = f"fewer than two known positions ({what}): it is not known where the walk was"
    return _error("too_few_fixes", file, message)


def _error(kind: FindingKind, file: str, message: str) -> Finding:
    return Finding(kind=kind, file=file, count=1, message=message, severity=Severity.ERROR)
