"""The public Python interface: what a script needs, in one place.

    from vislam2tag.api import Settings, process

    summary = process(Path("survey"), Path("labels"), Settings(strategy="local"))

Lower-level pieces (readers, strategies, labels) are plain functions over frozen dataclasses and may be used alone:
``open_survey`` and ``read_session`` read, ``strategy_named`` maps, ``label_readings`` labels. ``build_dataset`` makes a
data set of labels, ``import_format`` one of others' files, ``open_dataset`` opens one: its tables are Polars' lazy
frames. ``benchmark`` trains and tests positioning models on one.
"""

from vislam2tag.common.errors import (
    DatasetError,
    ModelError,
    OutputError,
    SessionError,
    SurveyError,
    UsageError,
    Vislam2tagError,
)
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.core.uncertainty import mark_uncertain
from vislam2tag.dataset.description import Description
from vislam2tag.dataset.folder import open_dataset, write_dataset
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.settings import DatasetSettings, ImuWindowSettings
from vislam2tag.dataset.statistics.record import FieldWork
from vislam2tag.dataset.transmitters.privacy import Privacy
from vislam2tag.evaluation.record import SessionEvaluation, SurveyEvaluation
from vislam2tag.labeling.readings import label_readings
from vislam2tag.labeling.results import SessionResult, Summary
from vislam2tag.labeling.settings import LabelRule, LabelSettings
from vislam2tag.mapping.registry import MappingStrategy, strategy_named, strategy_names
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset
from vislam2tag.pipeline.datasets.export import ExportOptions, ExportRecord, export
from vislam2tag.pipeline.datasets.import_format import ImportOptions, import_format
from vislam2tag.pipeline.labels.check import check
from vislam2tag.pipeline.labels.evaluate import evaluate
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session import Outcome
from vislam2tag.pipeline.positioning.benchmark import BenchmarkPlan, benchmark, public_dataset
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.positioning.benchmark.protocol import ModelChoice
from vislam2tag.positioning.benchmark.record import Benchmark
from vislam2tag.positioning.model_file import ModelOrigin, SavedModel
from vislam2tag.positioning.model_file import load as load_model
from vislam2tag.positioning.model_file import save as save_model
from vislam2tag.positioning.registry import Positioner, model_named
from vislam2tag.positioning.scans.learning_data import LearningData, learning_data
from vislam2tag.self_check.record import SessionCheck, SurveyCheck
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import Scenario, paper_evaluation, regular_survey
from vislam2tag.simulation.sensors.devices import Locale
from vislam2tag.simulation.settings import BuildingSettings, WalkSettings
from vislam2tag.simulation.survey import Layout, WritingOptions, simulate
from vislam2tag.simulation.walking.tour import Climb
from vislam2tag.simulation.writing.site_files import SiteColumn
from vislam2tag.smoother.settings import SmootherSettings
from vislam2tag.survey.model import SessionKey, SessionRef, Site, Survey
from vislam2tag.survey.settings import SurveySettings

__all__ = [
    "Benchmark",
    "BenchmarkPlan",
    "BuildOptions",
    "BuildingSettings",
    "CameraTrack",
    "Climb",
    "Dataset",
    "DatasetError",
    "DatasetSettings",
    "Description",
    "ExportOptions",
    "ExportRecord",
    "FieldWork",
    "FindingSettings",
    "ImportOptions",
    "ImuWindowSettings",
    "LabelRule",
    "LabelSettings",
    "LandmarkLog",
    "Landmarks",
    "Layout",
    "LearningData",
    "Locale",
    "MappingSettings",
    "MappingStrategy",
    "ModelChoice",
    "ModelError",
    "ModelOrigin",
    "Outcome",
    "OutputError",
    "Positioner",
    "Privacy",
    "SavedModel",
    "Scenario",
    "Selection",
    "Session",
    "SessionCheck",
    "SessionError",
    "SessionEvaluation",
    "SessionKey",
    "SessionRef",
    "SessionResult",
    "Settings",
    "Site",
    "SiteColumn",
    "SmootherSettings",
    "Status",
    "Summary",
    "Survey",
    "SurveyCheck",
    "SurveyError",
    "SurveyEvaluation",
    "SurveySettings",
    "Trajectory",
    "UsageError",
    "Vislam2tagError",
    "WalkSettings",
    "WritingOptions",
    "benchmark",
    "build_dataset",
    "check",
    "evaluate",
    "export",
    "import_format",
    "label_readings",
    "learning_data",
    "load_model",
    "mark_uncertain",
    "model_named",
    "open_dataset",
    "open_survey",
    "paper_evaluation",
    "process",
    "public_dataset",
    "read_session",
    "regular_survey",
    "save_model",
    "simulate",
    "strategy_named",
    "strategy_names",
    "write_dataset",
]
