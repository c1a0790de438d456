"""Imports of the names in ``api.py`` for type checkers; ``api.py`` imports each name when it is first used."""

from vislam2tag import __version__ as __version__
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
from vislam2tag.datasets.changes import SurveyChanges as SurveyChanges
from vislam2tag.datasets.comparison import Comparison as Comparison
from vislam2tag.datasets.comparison import compare as _compare
from vislam2tag.datasets.coverage import CoverageRecord as CoverageRecord
from vislam2tag.datasets.description import Description as Description
from vislam2tag.datasets.folder import open_dataset as open_dataset
from vislam2tag.datasets.folder import write_dataset as write_dataset
from vislam2tag.datasets.model import Dataset as Dataset
from vislam2tag.datasets.model import Split as Split
from vislam2tag.datasets.model import Storey as Storey
from vislam2tag.datasets.privacy import Privacy as Privacy
from vislam2tag.datasets.settings import CoverageSettings as CoverageSettings
from vislam2tag.datasets.settings import DatasetSettings as DatasetSettings
from vislam2tag.datasets.settings import ImuWindowSettings as ImuWindowSettings
from vislam2tag.datasets.settings import RadioMapSettings as RadioMapSettings
from vislam2tag.datasets.settings import SplitKind as SplitKind
from vislam2tag.datasets.settings import SplitSettings as SplitSettings
from vislam2tag.datasets.splits import make_split as _make_split
from vislam2tag.datasets.statistics_record import FieldWork as FieldWork
from vislam2tag.estimation.settings import HeightSettings as HeightSettings
from vislam2tag.estimation.settings import MappingSettings as MappingSettings
from vislam2tag.estimation.settings import SmootherSettings as SmootherSettings
from vislam2tag.estimation.strategy import MappingStrategy as MappingStrategy
from vislam2tag.estimation.strategy import strategies_for_poses as strategies_for_poses
from vislam2tag.estimation.strategy import strategy_named as strategy_named
from vislam2tag.estimation.strategy import strategy_names as strategy_names
from vislam2tag.intake.ids import IdShift as IdShift
from vislam2tag.intake.level_scales import LevelScale as LevelScale
from vislam2tag.labeling.mapped_walk import MappedWalk as MappedWalk
from vislam2tag.labeling.results import SessionResult as SessionResult
from vislam2tag.labeling.results import Summary as Summary
from vislam2tag.labeling.settings import GivenSettings as GivenSettings
from vislam2tag.labeling.settings import LabelRule as LabelRule
from vislam2tag.labeling.settings import LabelSettings as LabelSettings
from vislam2tag.labeling.settings import ProcessSettings as ProcessSettings
from vislam2tag.labeling.tables import label_readings as label_readings
from vislam2tag.labeling.tables import mark_uncertain as mark_uncertain
from vislam2tag.pipeline.datasets.build import BuildOptions as BuildOptions
from vislam2tag.pipeline.datasets.build import SessionStep as SessionStep
from vislam2tag.pipeline.datasets.build import build_dataset as _build_dataset
from vislam2tag.pipeline.datasets.build import build_dataset as build_dataset
from vislam2tag.pipeline.datasets.figures import make_dataset_figures as _make_dataset_figures
from vislam2tag.pipeline.datasets.finish import add_split as add_split
from vislam2tag.pipeline.datasets.import_export import ExportOptions as ExportOptions
from vislam2tag.pipeline.datasets.import_export import ExportRecord as ExportRecord
from vislam2tag.pipeline.datasets.import_export import ImportOptions as ImportOptions
from vislam2tag.pipeline.datasets.import_export import export as export
from vislam2tag.pipeline.datasets.import_export import import_format as _import_format
from vislam2tag.pipeline.datasets.import_export import import_format as import_format
from vislam2tag.pipeline.datasets.join import join as join
from vislam2tag.pipeline.datasets.radio_maps import RadioMapIndex as RadioMapIndex
from vislam2tag.pipeline.datasets.radio_maps import write_radio_maps as _write_radio_maps
from vislam2tag.pipeline.demo import run_demo as _run_demo
from vislam2tag.pipeline.fleet.add import add_surveys as _add_surveys
from vislam2tag.pipeline.fleet.catalogue import FleetTotals as FleetTotals
from vislam2tag.pipeline.fleet.catalogue import fleet_list as fleet_list
from vislam2tag.pipeline.fleet.catalogue import fleet_status as fleet_status
from vislam2tag.pipeline.fleet.process import SessionOutcome as SessionOutcome
from vislam2tag.pipeline.fleet.process import process_fleet as _process_fleet
from vislam2tag.pipeline.fleet.raw_copy import AddedSurvey as AddedSurvey
from vislam2tag.pipeline.fleet.reduction import SurveyOutcome as SurveyOutcome
from vislam2tag.pipeline.fleet.reduction import write_fleet_report as _write_fleet_report
from vislam2tag.pipeline.labels.attach import Attached as Attached
from vislam2tag.pipeline.labels.attach import attach as attach
from vislam2tag.pipeline.labels.check import check as check
from vislam2tag.pipeline.labels.diagnose import DiagnosedSession as DiagnosedSession
from vislam2tag.pipeline.labels.diagnose import MappedShare as MappedShare
from vislam2tag.pipeline.labels.diagnose import diagnose as diagnose
from vislam2tag.pipeline.labels.evaluate import evaluate as evaluate
from vislam2tag.pipeline.labels.label_table import TableLabels as TableLabels
from vislam2tag.pipeline.labels.label_table import TableTimesRead as TableTimesRead
from vislam2tag.pipeline.labels.label_table import label as label
from vislam2tag.pipeline.labels.landmark_survey import JointSurvey as JointSurvey
from vislam2tag.pipeline.labels.landmark_survey import ReducedSession as ReducedSession
from vislam2tag.pipeline.labels.landmark_survey import survey_landmarks as survey_landmarks
from vislam2tag.pipeline.labels.process import map_walk as map_walk
from vislam2tag.pipeline.labels.process import process as process
from vislam2tag.pipeline.labels.session import Outcome as Outcome
from vislam2tag.pipeline.labels.sightings import SightingsFound as SightingsFound
from vislam2tag.pipeline.labels.sightings import sightings as sightings
from vislam2tag.pipeline.paper.reproduce import ReproducedPaper as ReproducedPaper
from vislam2tag.pipeline.paper.reproduce import reproduce as _reproduce
from vislam2tag.pipeline.positioning.benchmark import BenchmarkPlan as BenchmarkPlan
from vislam2tag.pipeline.positioning.benchmark import benchmark as benchmark
from vislam2tag.pipeline.positioning.benchmark import public_dataset as public_dataset
from vislam2tag.pipeline.positioning.locate import LocatedScans as LocatedScans
from vislam2tag.pipeline.positioning.locate import WalkPlan as WalkPlan
from vislam2tag.pipeline.positioning.locate import locate as locate
from vislam2tag.pipeline.positioning.train import TrainedModel as TrainedModel
from vislam2tag.pipeline.positioning.train import TrainPlan as TrainPlan
from vislam2tag.pipeline.positioning.train import train as train
from vislam2tag.pipeline.run.selection import ProcessArguments as ProcessArguments
from vislam2tag.pipeline.run.selection import ProcessChoices as ProcessChoices
from vislam2tag.pipeline.run.selection import RunChoices as RunChoices
from vislam2tag.pipeline.run.selection import Selection as Selection
from vislam2tag.pipeline.run.selection import SurveyRunArguments as SurveyRunArguments
from vislam2tag.pipeline.run.workers import Executor as Executor
from vislam2tag.pipeline.site.change import FloorChanges as FloorChanges
from vislam2tag.pipeline.site.change import SiteChange as SiteChange
from vislam2tag.pipeline.site.change import align_floor as _align_floor
from vislam2tag.pipeline.site.change import change_site as _change_site
from vislam2tag.pipeline.site.change import remove_floor as _remove_floor
from vislam2tag.pipeline.site.change import renumber_floor as _renumber_floor
from vislam2tag.pipeline.site.init import NewFloor as NewFloor
from vislam2tag.pipeline.site.init import add_floor as _add_floor
from vislam2tag.pipeline.site.plan import PlanRequest as PlanRequest
from vislam2tag.pipeline.site.plan import write_plans as _write_plans
from vislam2tag.pipeline.site.rebase import rebase as _rebase
from vislam2tag.pipeline.site.rebase import write_published as _write_published
from vislam2tag.pipeline.site.register import FloorFiles as FloorFiles
from vislam2tag.pipeline.site.register import register as register
from vislam2tag.pipeline.site.show import SiteSummary as SiteSummary
from vislam2tag.pipeline.site.show import WalkableFloor as WalkableFloor
from vislam2tag.pipeline.site.show import summarise_site as _summarise_site
from vislam2tag.pipeline.site.show import write_walkable as _write_walkable
from vislam2tag.pipeline.survey_run import SurveyRun as SurveyRun
from vislam2tag.pipeline.survey_run import run_survey as _run_survey
from vislam2tag.pipeline.survey_run import run_survey as run_survey
from vislam2tag.positioning.benchmark import Benchmark as Benchmark
from vislam2tag.positioning.benchmark import ModelChoice as ModelChoice
from vislam2tag.positioning.learning_data import LearningData as LearningData
from vislam2tag.positioning.learning_data import ModelUpdate as ModelUpdate
from vislam2tag.positioning.learning_data import learning_data as learning_data
from vislam2tag.positioning.model_files import ModelOrigin as ModelOrigin
from vislam2tag.positioning.model_files import SavedModel as SavedModel
from vislam2tag.positioning.model_files import load_model as load_model
from vislam2tag.positioning.model_files import save_model as save_model
from vislam2tag.positioning.model_scores import ModelTrial as ModelTrial
from vislam2tag.positioning.model_scores import TriedModel as TriedModel
from vislam2tag.positioning.registry import Positioner as Positioner
from vislam2tag.positioning.registry import model_named as model_named
from vislam2tag.positioning.settings import SequenceMethod as SequenceMethod
from vislam2tag.positioning.tracks import Tracks as Tracks
from vislam2tag.preparation.planning.records import PlanSummary as PlanSummary
from vislam2tag.preparation.planning.settings import CameraSettings as CameraSettings
from vislam2tag.preparation.planning.settings import PlanSettings as PlanSettings
from vislam2tag.preparation.registration.names import NameRules as NameRules
from vislam2tag.preparation.registration.point_columns import PointColumn as PointColumn
from vislam2tag.preparation.registration.record import Registration as Registration
from vislam2tag.preparation.registration.record import RegistrationSettings as RegistrationSettings
from vislam2tag.preparation.sheets.sheet_folder import SheetOptions as SheetOptions
from vislam2tag.preparation.sheets.sheet_folder import SheetsRecord as SheetsRecord
from vislam2tag.preparation.sheets.sheet_folder import make_sheets as _make_sheets
from vislam2tag.quality.diagnosis.alignment import WalkPasses as WalkPasses
from vislam2tag.quality.diagnosis.record import Diagnosis as Diagnosis
from vislam2tag.quality.diagnosis.stream_faults import StreamSigns as StreamSigns
from vislam2tag.quality.diagnosis.wifi_clock import ClockOffset as ClockOffset
from vislam2tag.quality.diagnosis.wifi_clock import HeardOnWalk as HeardOnWalk
from vislam2tag.quality.evaluation.metrics import ErrorSummary as ErrorSummary
from vislam2tag.quality.evaluation.record import SessionEvaluation as SessionEvaluation
from vislam2tag.quality.evaluation.record import SurveyEvaluation as SurveyEvaluation
from vislam2tag.quality.self_check_record import SessionCheck as SessionCheck
from vislam2tag.quality.self_check_record import SurveyCheck as SurveyCheck
from vislam2tag.sessions.companion_ties import TableColumns as TableColumns
from vislam2tag.sessions.companion_ties import Tie as Tie
from vislam2tag.sessions.foreign_tables import Clock as Clock
from vislam2tag.sessions.inspection import Inspection as Inspection
from vislam2tag.sessions.inspection import inspect_survey as _inspect_survey
from vislam2tag.sessions.model import Attachment as Attachment
from vislam2tag.sessions.model import Session as Session
from vislam2tag.sessions.registry import open_survey as open_survey
from vislam2tag.sessions.registry import read_session as read_session
from vislam2tag.sessions.settings import FindingSettings as FindingSettings
from vislam2tag.settings import Settings as Settings
from vislam2tag.settings import read_settings as read_settings
from vislam2tag.simulation.scenario import FurtherChoices as FurtherChoices
from vislam2tag.simulation.scenario import Scenario as Scenario
from vislam2tag.simulation.scenario import paper_evaluation as paper_evaluation
from vislam2tag.simulation.scenario import regular_survey as regular_survey
from vislam2tag.simulation.settings import BuildingSettings as BuildingSettings
from vislam2tag.simulation.settings import Climb as Climb
from vislam2tag.simulation.settings import Locale as Locale
from vislam2tag.simulation.settings import SessionLayout as SessionLayout
from vislam2tag.simulation.settings import SiteColumn as SiteColumn
from vislam2tag.simulation.settings import WalkSettings as WalkSettings
from vislam2tag.simulation.survey import WritingOptions as WritingOptions
from vislam2tag.simulation.survey import simulate as simulate
from vislam2tag.site.frame_change import FrameChanges as FrameChanges
from vislam2tag.site.model import Floor as Floor
from vislam2tag.site.model import SessionKey as SessionKey
from vislam2tag.site.model import SessionRef as SessionRef
from vislam2tag.site.model import Site as Site
from vislam2tag.site.model import Survey as Survey
from vislam2tag.site.settings import SurveySettings as SurveySettings
from vislam2tag.site.settings import WalkableSettings as WalkableSettings
from vislam2tag.site.site_file import GeoreferencePart as GeoreferencePart
from vislam2tag.site.site_file import SiteFile as SiteFile

dataset = _build_dataset
demo = _run_demo
figures = _make_dataset_figures
fleet_add = _add_surveys
fleet_process = _process_fleet
fleet_report = _write_fleet_report
import_ = _import_format
inspect = _inspect_survey
paper = _reproduce
plan = _write_plans
radio_maps = _write_radio_maps
run = _run_survey
sheets = _make_sheets
site_align = _align_floor
site_init = _add_floor
site_rebase = _rebase
site_remove = _remove_floor
site_renumber = _renumber_floor
site_set = _change_site
site_show = _summarise_site
site_walkable = _write_walkable
site_write = _write_published
split = _make_split
verify = _compare

__all__: list[str]
