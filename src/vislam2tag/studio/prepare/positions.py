"""Positions of landmarks from dropped files of surveyors, as by ``vislam2tag register``."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.pipeline.site.register import FloorFiles, floor_of, register, write_into_site
from vislam2tag.preparation.registration.names import NameRules
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.studio.prepare.dropped import DroppedFiles
from vislam2tag.studio.prepare.messages import RegisterRequest, RegistrationView


def registered(
    root: Path, dropped: DroppedFiles, request: RegisterRequest, settings: RegistrationSettings
) -> RegistrationView:
    """Adjust what the files say, and write it into the site where that is asked for; raises what registering raises."""
    site, floor = floor_of(root, request.floor)

    def path(number: int | None) -> Path | None:
        return None if number is None else dropped.path(number)

    sources = FloorFiles(
        stations=[dropped.path(number) for number in request.stations],
        control=path(request.control),
        known=request.known,
        tape=path(request.tape),
        targets=path(request.targets),
        clicks=path(request.clicks),
        rules=NameRules(landmarks=request.landmark_names),
        free_scale=request.free_scale,
    )
    found = register(site, floor, sources, settings)
    written = write_into_site(root, floor, found, replace=request.replace) if request.write else []
    return RegistrationView(found=found, written=[path.relative_to(root).as_posix() for path in written])
