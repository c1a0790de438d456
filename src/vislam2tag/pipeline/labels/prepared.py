"""One session as strategies are to see it: read, corrected, with the landmarks that it may use."""

from __future__ import annotations

from vislam2tag.core.tracks import Landmarks
from vislam2tag.sessions import corrected_session, read_session
from vislam2tag.sessions.floors_walked import considered_landmarks, landmarks_of_session
from vislam2tag.sessions.model import Session
from vislam2tag.settings import Settings
from vislam2tag.survey.corrections import Corrections, corrected_landmarks
from vislam2tag.survey.frame_change import in_frame_of
from vislam2tag.survey.model import SessionRef, Site


def mappable_session(
    ref: SessionRef, site: Site, corrections: Corrections, settings: Settings
) -> tuple[Session, Landmarks]:
    """Read a session and its landmarks, corrections applied; raises SessionError where it cannot be read."""
    session, _ = corrected_session(read_session(ref, settings.findings), corrections)
    key, log = ref.key, session.landmarks
    considered = considered_landmarks(site, key.floor, log.ids)
    corrected, _ = corrected_landmarks(considered, corrections, key, settings.default_landmark_sigma_m)
    here = in_frame_of(corrected, site, key.floor)
    return session, landmarks_of_session(here, key, session.camera, log).landmarks
