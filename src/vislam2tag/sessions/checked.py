"""A session with what its poses say against themselves, whatever format it was read from."""

from __future__ import annotations

from dataclasses import replace

from vislam2tag.intake.poses import pose_findings
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.without_poses import inertial_log


def with_pose_findings(session: Session) -> Session:
    """Add findings about poses that cannot be those of a walking person; other sessions stay as they are."""
    camera = session.camera
    if camera.without_poses or not camera.usable.any():
        return session
    if camera.inertial is None and "sensors" in session.tables and "sensors" not in session.attached:
        camera = replace(camera, inertial=inertial_log(session.tables["sensors"]))
    file = next((record.name for record in session.files if record.role == "poses"), "")
    return replace(session, findings=(*session.findings, *pose_findings(camera, session.landmarks, file)))
