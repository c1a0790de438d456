"""Traces of the Indoor Location Competition 2.0: one text file a walk, taps on the plan, no poses."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.sessions.fixes import too_few_fixes
from vislam2tag.sessions.model import FileRecord, Session
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tables.ilc20_trace import parse_trace
from vislam2tag.sessions.tables.wifi_table import wifi_findings
from vislam2tag.sessions.without_poses import inertial_log, no_landmarks, track_without_poses
from vislam2tag.site.model import SessionRef


class Ilc20Format:
    """Reads trace files; times are Unix time, positions those of the taps' frame."""

    name = "ilc20"

    def recognises(self, folder: Path) -> bool:
        """A trace is a text file, not a folder."""
        return folder.suffix == ".txt" and folder.is_file()

    def input_files(self, folder: Path) -> list[Path]:
        """The trace itself."""
        return [folder]

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a trace whole; problems are findings. Raises SessionError where it has no inertial readings."""
        data = read_bytes(ref.folder)
        name = ref.folder.name
        trace = parse_trace(data, name)
        inertial = inertial_log(trace.sensors)
        if inertial is None:
            raise SessionError(f"{name}: no accelerometer and gyroscope readings; such a trace cannot be mapped")
        findings = [*trace.findings, *wifi_findings(trace.wifi, name, settings)]
        if len(trace.taps.time_ns) < 2:
            findings.append(too_few_fixes(name, "TYPE_WAYPOINT"))
        tables = {"wifi": trace.wifi, "sensors": trace.sensors}
        if trace.ble.height:
            tables["ble"] = trace.ble
        digest = hashlib.sha256(data).hexdigest()
        return Session(
            key=ref.key,
            camera=track_without_poses(inertial, trace.sensors, trace.taps),
            landmarks=no_landmarks(),
            presses_ns=np.empty(0, dtype=np.int64),
            tables=tables,
            files=(FileRecord(name, "trace", len(data), digest, trace.lines, trace.records),),
            findings=tuple(findings),
        )


register(Ilc20Format())
