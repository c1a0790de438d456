"""The protocol of mapping strategies, their registry, and the trajectory that a strategy builds.

A session in several parts is mapped part by part.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from inspect import signature
from typing import Protocol

import numpy as np

from vislam2tag.common import plugins
from vislam2tag.common.errors import SessionError, UsageError
from vislam2tag.common.plugins import Registry, called_of_user, where_it_failed
from vislam2tag.core.arrays import FloatArray, IntArray, StatusArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import (
    CameraTrack,
    LandmarkLog,
    Landmarks,
    Segment,
    Trajectory,
    Visit,
    one_section,
    section_numbers,
)
from vislam2tag.core.transforms import Affine2, Similarity2, camera_to_bcs
from vislam2tag.estimation.settings import WITHOUT_TRACKER, MappingSettings


class MappingStrategy(Protocol):
    """Maps one session from the tracker's frame (ACS) to the building's (BCS). It uses no files and has no state."""

    @property
    def needs(self) -> str:
        """What a walk needs to be mapped, as the end of a sentence: "visits to two different landmarks"."""
        ...

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Give each frame a position in the BCS, or a status with the reason why it has none."""
        ...


Factory = Callable[[MappingSettings], MappingStrategy]
STRATEGIES: Registry[Factory] = Registry(plugins.STRATEGIES)
register = STRATEGIES.add
strategy_names = STRATEGIES.names


def strategies_for_poses() -> tuple[str, ...]:
    """Return the names of the strategies for sessions with poses of a tracker."""
    return tuple(name for name in strategy_names() if name != WITHOUT_TRACKER)


def strategy_named(name: str, settings: MappingSettings) -> MappingStrategy:
    """Make the strategy of this name with these settings; raises UsageError for an unknown name.

    Sessions in several parts are mapped part by part.
    """
    return MappingBySection(_made(name, settings))


def strategy_modules(name: str, settings: MappingSettings) -> tuple[str, str]:
    """Names of the modules in which a strategy is registered and implemented; raises UsageError for an unknown name."""
    factory = STRATEGIES.named(name)
    made = _made(name, settings)
    return factory.__module__, type(made.strategy if isinstance(made, _OwnStrategy) else made).__module__


def strategy_known_as(given: str | Factory | MappingStrategy) -> str:
    """The name of a strategy for the settings; a class, a function or an object of a notebook gets its own name.

    That of a file is ``NAME.py:CLASS``, so that worker processes find it, too. Raises UsageError for another value, or
    if the name is that of a strategy of ours.
    """
    if isinstance(given, str):
        return given
    defined = given if callable(given) and hasattr(given, "__name__") else type(given)
    name = str(defined.__name__)
    file = getattr(sys.modules.get(defined.__module__), "__file__", None)
    if file and defined is given and file.endswith(".py") and defined.__qualname__ == name:
        return f"{file}:{name}"
    if not callable(given) and not callable(getattr(given, "map", None)):
        raise UsageError(
            f"strategy: {given!r} is neither a name nor a strategy; expected a name, NAME.py:CLASS, or a class with "
            "the method map(camera, log, landmarks)"
        )
    STRATEGIES.add_here(name, given if defined is given else _always(given))  # type: ignore[arg-type]
    return name


def refuse_elsewhere(name: str) -> None:
    """Raise UsageError for a strategy that worker processes cannot find: that of a notebook."""
    if STRATEGIES.is_only_here(name):
        raise UsageError(
            f"{called_of_user(name)} exists only in this notebook or prompt, so other processes cannot find it; use "
            f'jobs=1, or save it as a file and pass strategy="NAME.py:{name}"'
        )


def _always(strategy: MappingStrategy) -> Factory:
    """A factory of a user's object, in whose module errors are looked for."""

    def made(_: MappingSettings) -> MappingStrategy:
        return strategy

    made.__module__ = type(strategy).__module__
    return made


def _made(name: str, settings: MappingSettings) -> MappingStrategy:
    """Make a strategy; of other code than ours, one that says whose errors are."""
    factory = STRATEGIES.named(name)
    if factory.__module__.startswith("vislam2tag."):
        return factory(settings)
    return _OwnStrategy.of(name, factory, settings)


@dataclass(frozen=True)
class _OwnStrategy:
    """A strategy of a user's file, notebook or package: its errors name it, its line and what it returned."""

    name: str
    strategy: MappingStrategy

    @classmethod
    def of(cls, name: str, factory: Factory, settings: MappingSettings) -> _OwnStrategy:
        """Make it with the settings, or without them if it takes none; raises UsageError if that fails."""
        try:
            made = factory(settings) if signature(factory).parameters else factory()  # type: ignore[call-arg]
        except Exception as error:  # whatever a user's code raises
            raise UsageError(where_it_failed(called_of_user(name), error)) from error
        if not callable(getattr(made, "map", None)):
            raise UsageError(f"{called_of_user(name)} has no method map(camera, log, landmarks); see MappingStrategy")
        return cls(name, made)

    @property
    def needs(self) -> str:
        """What it says that it needs; it may say nothing."""
        return str(getattr(self.strategy, "needs", f"what {called_of_user(self.name)} expects"))

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Map; raises SessionError that names the user's code if it fails or returns something else."""
        try:
            mapped = self.strategy.map(camera, log, landmarks)
        except Exception as error:  # whatever a user's code raises
            raise SessionError(where_it_failed(called_of_user(self.name), error)) from error
        found = f"{len(mapped.status)} frames" if isinstance(mapped, Trajectory) else type(mapped).__name__
        if found != f"{len(camera.time_ns)} frames":
            expected = f"expected a Trajectory of {len(camera.time_ns)} frames"
            raise SessionError(f"{called_of_user(self.name)} returned {found}; {expected} (this is your code)")
        return mapped


@dataclass(frozen=True)
class MappingBySection:
    """A strategy that maps the parts of a session one by one."""

    strategy: MappingStrategy

    @property
    def needs(self) -> str:
        """What each part needs."""
        return self.strategy.needs

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Map each part and join the frames."""
        sections = section_numbers(camera)
        if camera.state is None or len(sections) < 2:
            return self.strategy.map(camera, log, landmarks)
        mapped = [self.strategy.map(*one_section(camera, log, int(section)), landmarks) for section in sections]
        # Unusable frames of any part are unusable in the trajectory of each.
        return _together(mapped, np.searchsorted(sections, camera.state.section).clip(0, len(sections) - 1))


def _together(mapped: Sequence[Trajectory], chosen: IntArray) -> Trajectory:
    """Take each frame from the trajectory chosen for it, (n,), and everything else from all."""
    frame = np.arange(len(chosen))

    def stacked(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.generic]]:
        return np.asarray(np.stack([getattr(section, name) for section in mapped])[chosen, frame])

    with_floors = all(len(section.floor) for section in mapped)
    return Trajectory(
        time_ns=mapped[0].time_ns,
        position_bcs=stacked("position_bcs").astype(np.float64),
        orientation_bcs=stacked("orientation_bcs").astype(np.float64),
        covariance_bcs=stacked("covariance_bcs").astype(np.float64),
        status=stacked("status").astype(np.int8),
        segments=tuple(segment for section in mapped for segment in section.segments),
        visits=tuple(sorted((visit for section in mapped for visit in section.visits), key=lambda visit: visit.frame)),
        floor=stacked("floor").astype(np.int64) if with_floors else np.empty(0, dtype=np.int64),
        events=tuple(sorted((event for section in mapped for event in section.events), key=lambda event: event.frame)),
        contradictions=tuple(
            sorted((found for section in mapped for found in section.contradictions), key=lambda found: -found.size_m)
        ),
        fix_contradiction_m=max(section.fix_contradiction_m for section in mapped),
        passes_left_out=sum(section.passes_left_out for section in mapped),
        not_converged=tuple(dict.fromkeys(what for section in mapped for what in section.not_converged)),
    )


@dataclass(frozen=True)
class TrajectoryBuilder:
    """Arrays of a trajectory under construction, one entry for each frame."""

    position_bcs: FloatArray
    orientation_bcs: FloatArray
    covariance_bcs: FloatArray
    """(n, 2, 2) covariances; the paper's strategies have none."""
    status: StatusArray

    @classmethod
    def blank(cls, camera: CameraTrack, cause: Status) -> TrajectoryBuilder:
        """Give every usable frame the same cause; the others keep their own."""
        n = len(camera.time_ns)
        status = np.where(camera.usable, np.int8(cause), camera.status).astype(np.int8)
        position, orientation, covariance = (np.full((n, *shape), np.nan) for shape in ((3,), (4,), (2, 2)))
        return cls(position, orientation, covariance, status)

    def map_stretch(self, camera: CameraTrack, start: int, stop: int, bcs_T_acs: Similarity2 | Affine2) -> None:
        """Fill frames ``start`` (included) to ``stop`` (excluded) by one transformation of the plane."""
        frames = start + np.flatnonzero(camera.usable[start:stop])
        self.position_bcs[frames, :2] = bcs_T_acs @ camera.plane_acs[frames]
        self.orientation_bcs[frames] = camera_to_bcs(camera.orientation_acs[frames], bcs_T_acs.rotation_rad)
        self.status[frames] = Status.OK

    def discard(self, camera: CameraTrack, start: int, stop: int, cause: Status) -> None:
        """Give the usable frames ``start`` to ``stop`` (excluded) a cause instead of a position."""
        frames = start + np.flatnonzero(camera.usable[start:stop])
        self.position_bcs[frames] = np.nan
        self.orientation_bcs[frames] = np.nan
        self.status[frames] = cause

    def finish(self, camera: CameraTrack, segments: tuple[Segment, ...], visits: tuple[Visit, ...]) -> Trajectory:
        """Freeze into a trajectory."""
        poses = self.position_bcs, self.orientation_bcs, self.covariance_bcs
        return Trajectory(camera.time_ns, *poses, self.status, segments, visits)


def not_converged(what: str, unreached: float, unit: str) -> tuple[str, ...]:
    """Entry of :attr:`~vislam2tag.core.tracks.Trajectory.not_converged` for a part so far from its limit; none if 0."""
    if unreached == 0:
        return ()
    where = f"about {unreached:.2g} {unit} from its limit" if np.isfinite(unreached) else "no limit in sight"
    return (f"{what} ({where})",)


def surveyed_rows(log: LandmarkLog, landmarks: Landmarks) -> LandmarkLog:
    """Drop the rows of landmarks without a surveyed position."""
    return log.select([i for i, landmark_id in enumerate(log.ids) if landmark_id in landmarks.surveyed_ids])
