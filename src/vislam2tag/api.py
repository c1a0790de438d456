"""The public Python interface: what a script needs, in one place.

    from vislam2tag.api import Settings, process

    summary = process(Path("survey"), Path("labels"), Settings(strategy="local"))

Lower-level pieces (readers, strategies, labels) are plain functions over frozen dataclasses and may be used alone:
``open_survey`` and ``read_session`` read, ``strategy_named`` maps, ``label_readings`` labels. ``build_dataset`` makes a
data set of labels, ``import_format`` one of others' files, ``open_dataset`` opens one: its tables are Polars' lazy
frames. ``benchmark`` trains and tests positioning models on one.

A name is imported when it is first used, so that a script loads only what it takes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vislam2tag.common.extras import import_extra

if TYPE_CHECKING:
    from vislam2tag.common.errors import DatasetError as DatasetError
    from vislam2tag.common.errors import ModelError as ModelError
    from vislam2tag.common.errors import OutputError as OutputError
    from vislam2tag.common.errors import SessionError as SessionError
    from vislam2tag.common.errors import SurveyError as SurveyError
    from vislam2tag.common.errors import UsageError as UsageError
    from vislam2tag.common.errors import Vislam2tagError as Vislam2tagError
    from vislam2tag.common.findings import Finding as Finding
    from vislam2tag.common.progress import Stage as Stage
    from vislam2tag.core.status import Status as Status
    from vislam2tag.core.tracks import CameraTrack as CameraTrack
    from vislam2tag.core.tracks import LandmarkLog as LandmarkLog
    from vislam2tag.core.tracks import Landmarks as Landmarks
    from vislam2tag.core.tracks import Trajectory as Trajectory
    from vislam2tag.dataset.description import Description as Description
    from vislam2tag.dataset.folder import open_dataset as open_dataset
    from vislam2tag.dataset.folder import write_dataset as write_dataset
    from vislam2tag.dataset.model import Dataset as Dataset
    from vislam2tag.dataset.settings import CoverageSettings as CoverageSettings
    from vislam2tag.dataset.settings import DatasetSettings as DatasetSettings
    from vislam2tag.dataset.settings import ImuWindowSettings as ImuWindowSettings
    from vislam2tag.dataset.settings import RadioMapSettings as RadioMapSettings
    from vislam2tag.dataset.settings import SplitSettings as SplitSettings
    from vislam2tag.dataset.statistics.record import FieldWork as FieldWork
    from vislam2tag.dataset.transmitters.privacy import Privacy as Privacy
    from vislam2tag.evaluation.record import SessionEvaluation as SessionEvaluation
    from vislam2tag.evaluation.record import SurveyEvaluation as SurveyEvaluation
    from vislam2tag.heights.settings import HeightSettings as HeightSettings
    from vislam2tag.labeling.clocks import Clock as Clock
    from vislam2tag.labeling.readings import label_readings as label_readings
    from vislam2tag.labeling.readings import mark_uncertain as mark_uncertain
    from vislam2tag.labeling.results import SessionResult as SessionResult
    from vislam2tag.labeling.results import Summary as Summary
    from vislam2tag.labeling.settings import LabelRule as LabelRule
    from vislam2tag.labeling.settings import LabelSettings as LabelSettings
    from vislam2tag.labeling.settings import ProcessSettings as ProcessSettings
    from vislam2tag.mapping.registry import MappingStrategy as MappingStrategy
    from vislam2tag.mapping.registry import strategy_named as strategy_named
    from vislam2tag.mapping.registry import strategy_names as strategy_names
    from vislam2tag.mapping.settings import MappingSettings as MappingSettings
    from vislam2tag.pipeline.datasets.build import BuildOptions as BuildOptions
    from vislam2tag.pipeline.datasets.build import SessionStep as SessionStep
    from vislam2tag.pipeline.datasets.build import build_dataset as build_dataset
    from vislam2tag.pipeline.datasets.export import ExportOptions as ExportOptions
    from vislam2tag.pipeline.datasets.export import ExportRecord as ExportRecord
    from vislam2tag.pipeline.datasets.export import export as export
    from vislam2tag.pipeline.datasets.import_format import ImportOptions as ImportOptions
    from vislam2tag.pipeline.datasets.import_format import import_format as import_format
    from vislam2tag.pipeline.labels.check import check as check
    from vislam2tag.pipeline.labels.evaluate import evaluate as evaluate
    from vislam2tag.pipeline.labels.label_table import TableLabels as TableLabels
    from vislam2tag.pipeline.labels.label_table import label as label
    from vislam2tag.pipeline.labels.process import process as process
    from vislam2tag.pipeline.labels.session import Outcome as Outcome
    from vislam2tag.pipeline.positioning.benchmark import BenchmarkPlan as BenchmarkPlan
    from vislam2tag.pipeline.positioning.benchmark import benchmark as benchmark
    from vislam2tag.pipeline.positioning.benchmark import public_dataset as public_dataset
    from vislam2tag.pipeline.run.selection import Selection as Selection
    from vislam2tag.pipeline.survey_run import SurveyRun as SurveyRun
    from vislam2tag.pipeline.survey_run import run_survey as run_survey
    from vislam2tag.planning.settings import CameraSettings as CameraSettings
    from vislam2tag.planning.settings import PlanSettings as PlanSettings
    from vislam2tag.positioning.benchmark.protocol import ModelChoice as ModelChoice
    from vislam2tag.positioning.benchmark.record import Benchmark as Benchmark
    from vislam2tag.positioning.model_file import ModelOrigin as ModelOrigin
    from vislam2tag.positioning.model_file import SavedModel as SavedModel
    from vislam2tag.positioning.model_file import load_model as load_model
    from vislam2tag.positioning.model_file import save_model as save_model
    from vislam2tag.positioning.registry import Positioner as Positioner
    from vislam2tag.positioning.registry import model_named as model_named
    from vislam2tag.positioning.scans.learning_data import LearningData as LearningData
    from vislam2tag.positioning.scans.learning_data import learning_data as learning_data
    from vislam2tag.registration.settings import RegistrationSettings as RegistrationSettings
    from vislam2tag.self_check.record import SessionCheck as SessionCheck
    from vislam2tag.self_check.record import SurveyCheck as SurveyCheck
    from vislam2tag.sessions.model import Session as Session
    from vislam2tag.sessions.registry import open_survey as open_survey
    from vislam2tag.sessions.registry import read_session as read_session
    from vislam2tag.sessions.settings import FindingSettings as FindingSettings
    from vislam2tag.settings import Settings as Settings
    from vislam2tag.settings import read_settings as read_settings
    from vislam2tag.simulation.choices import Climb as Climb
    from vislam2tag.simulation.choices import Locale as Locale
    from vislam2tag.simulation.choices import SessionLayout as SessionLayout
    from vislam2tag.simulation.choices import SiteColumn as SiteColumn
    from vislam2tag.simulation.scenario import Scenario as Scenario
    from vislam2tag.simulation.scenario import paper_evaluation as paper_evaluation
    from vislam2tag.simulation.scenario import regular_survey as regular_survey
    from vislam2tag.simulation.settings import BuildingSettings as BuildingSettings
    from vislam2tag.simulation.settings import WalkSettings as WalkSettings
    from vislam2tag.simulation.survey import WritingOptions as WritingOptions
    from vislam2tag.simulation.survey import simulate as simulate
    from vislam2tag.smoother.settings import SmootherSettings as SmootherSettings
    from vislam2tag.survey.model import SessionKey as SessionKey
    from vislam2tag.survey.model import SessionRef as SessionRef
    from vislam2tag.survey.model import Site as Site
    from vislam2tag.survey.model import Survey as Survey
    from vislam2tag.survey.settings import SurveySettings as SurveySettings

_NAMES = {
    "common.errors": "DatasetError ModelError OutputError SessionError SurveyError UsageError Vislam2tagError",
    "common.findings": "Finding",
    "common.progress": "Stage",
    "core.status": "Status",
    "core.tracks": "CameraTrack LandmarkLog Landmarks Trajectory",
    "dataset.description": "Description",
    "dataset.folder": "open_dataset write_dataset",
    "dataset.model": "Dataset",
    "dataset.settings": "CoverageSettings DatasetSettings ImuWindowSettings RadioMapSettings SplitSettings",
    "dataset.statistics.record": "FieldWork",
    "dataset.transmitters.privacy": "Privacy",
    "evaluation.record": "SessionEvaluation SurveyEvaluation",
    "heights.settings": "HeightSettings",
    "labeling.clocks": "Clock",
    "labeling.readings": "label_readings mark_uncertain",
    "labeling.results": "SessionResult Summary",
    "labeling.settings": "LabelRule LabelSettings ProcessSettings",
    "mapping.registry": "MappingStrategy strategy_named strategy_names",
    "mapping.settings": "MappingSettings",
    "pipeline.datasets.build": "SessionStep BuildOptions build_dataset",
    "pipeline.datasets.export": "ExportOptions ExportRecord export",
    "pipeline.datasets.import_format": "ImportOptions import_format",
    "pipeline.labels.check": "check",
    "pipeline.labels.evaluate": "evaluate",
    "pipeline.labels.label_table": "TableLabels label",
    "pipeline.labels.process": "process",
    "pipeline.survey_run": "SurveyRun run_survey",
    "pipeline.labels.session": "Outcome",
    "pipeline.positioning.benchmark": "BenchmarkPlan benchmark public_dataset",
    "pipeline.run.selection": "Selection",
    "planning.settings": "CameraSettings PlanSettings",
    "positioning.benchmark.protocol": "ModelChoice",
    "positioning.benchmark.record": "Benchmark",
    "positioning.model_file": "ModelOrigin SavedModel load_model save_model",
    "positioning.registry": "Positioner model_named",
    "positioning.scans.learning_data": "LearningData learning_data",
    "registration.settings": "RegistrationSettings",
    "self_check.record": "SessionCheck SurveyCheck",
    "sessions.model": "Session",
    "sessions.registry": "open_survey read_session",
    "sessions.settings": "FindingSettings",
    "settings": "Settings read_settings",
    "simulation.choices": "Climb Locale SessionLayout SiteColumn",
    "simulation.scenario": "Scenario paper_evaluation regular_survey",
    "simulation.settings": "BuildingSettings WalkSettings",
    "simulation.survey": "WritingOptions simulate",
    "smoother.settings": "SmootherSettings",
    "survey.model": "SessionKey SessionRef Site Survey",
    "survey.settings": "SurveySettings",
}
"""What each module of the package holds of the interface; the same as above."""
_MODULE_OF = {name: f"vislam2tag.{module}" for module, names in _NAMES.items() for name in names.split()}
__all__ = sorted(_MODULE_OF)


def __dir__() -> list[str]:
    return __all__


if not TYPE_CHECKING:  # type checkers take the imports above, and report names that are not there

    def __getattr__(name: str) -> object:
        """Import a public name; raises MissingExtraError where it needs an extra that is not installed."""
        if name not in _MODULE_OF:
            raise AttributeError(f"module 'vislam2tag.api' has no attribute '{name}'")
        globals()[name] = value = getattr(import_extra(_MODULE_OF[name]), name)
        return value
