"""The public Python interface: what a script needs, in one place.

    from vislam2tag.api import Settings, process

    summary = process("site", "labels", Settings(strategy="local"))

Each command has a function of the same name (``import_`` for ``import``, ``site_init`` for ``site init``), except
``receive``, which is a server. Paths may be ``str`` or ``Path``: that is what ``AnyPath`` means.

Results have tables: ``to_pandas()`` returns the main one for pandas, ``to_frame()`` for Polars, and ``table_names()``
lists all. Tables that you pass may be of pandas, Polars or Arrow.

You can also use the parts alone. They are plain functions over frozen dataclasses: ``open_survey`` and ``read_session``
read files, ``strategy_named`` returns a mapping strategy, and ``label_readings`` labels readings. ``build_dataset``
makes a data set from labels, ``import_format`` makes one from files in another format, and ``open_dataset`` opens one.
Its tables are lazy Polars frames. ``benchmark`` trains and tests positioning models on a data set.

Each name is imported when it is first used, so a script loads only what it needs. ``api.pyi`` contains the imports for
type checkers.
"""

from __future__ import annotations

from vislam2tag import __version__ as __version__
from vislam2tag.common.errors import import_extra

NAMES_BY_MODULE = {
    "common.errors": "DatasetError ModelError OutputError SessionError SurveyError UsageError Vislam2tagError",
    "common.findings": "Finding",
    "common.progress": "Stage",
    "core.status": "Status",
    "core.tracks": "CameraTrack LandmarkLog Landmarks Trajectory",
    "datasets.changes": "SurveyChanges",
    "datasets.comparison": "Comparison verify=compare",
    "datasets.coverage": "CoverageRecord",
    "datasets.description": "Description",
    "datasets.folder": "open_dataset write_dataset",
    "datasets.model": "Dataset Split Storey",
    "datasets.privacy": "Privacy",
    "datasets.settings": "CoverageSettings DatasetSettings ImuWindowSettings RadioMapSettings SplitKind SplitSettings",
    "datasets.splits": "split=make_split",
    "datasets.statistics_record": "FieldWork",
    "estimation.settings": "HeightSettings MappingSettings SmootherSettings",
    "estimation.strategy": "MappingStrategy strategies_for_poses strategy_named strategy_names",
    "intake.ids": "IdShift",
    "intake.level_scales": "LevelScale",
    "labeling.mapped_walk": "MappedWalk",
    "labeling.results": "SessionResult Summary",
    "labeling.settings": "GivenSettings LabelRule LabelSettings ProcessSettings",
    "labeling.tables": "label_readings mark_uncertain",
    "pipeline.datasets.build": "BuildOptions SessionStep build_dataset dataset=build_dataset",
    "pipeline.datasets.figures": "figures=make_dataset_figures",
    "pipeline.datasets.finish": "add_split",
    "pipeline.datasets.import_export": "ExportOptions ExportRecord ImportOptions export import_format "
    "import_=import_format",
    "pipeline.datasets.join": "join",
    "pipeline.datasets.radio_maps": "RadioMapIndex radio_maps=write_radio_maps",
    "pipeline.demo": "demo=run_demo",
    "pipeline.fleet.add": "fleet_add=add_surveys",
    "pipeline.fleet.catalogue": "FleetTotals fleet_list fleet_status",
    "pipeline.fleet.process": "SessionOutcome fleet_process=process_fleet",
    "pipeline.fleet.raw_copy": "AddedSurvey",
    "pipeline.fleet.reduction": "SurveyOutcome fleet_report=write_fleet_report",
    "pipeline.labels.attach": "Attached attach",
    "pipeline.labels.check": "check",
    "pipeline.labels.diagnose": "DiagnosedSession MappedShare diagnose",
    "pipeline.labels.evaluate": "evaluate",
    "pipeline.labels.label_table": "TableLabels TableTimesRead label",
    "pipeline.labels.landmark_survey": "JointSurvey ReducedSession survey_landmarks",
    "pipeline.labels.process": "map_walk process",
    "pipeline.labels.session": "Outcome",
    "pipeline.labels.sightings": "SightingsFound sightings",
    "pipeline.paper.reproduce": "ReproducedPaper paper=reproduce",
    "pipeline.positioning.benchmark": "BenchmarkPlan benchmark public_dataset",
    "pipeline.positioning.locate": "LocatedScans WalkPlan locate",
    "pipeline.positioning.train": "TrainPlan TrainedModel train",
    "pipeline.run.selection": "ProcessArguments ProcessChoices RunChoices Selection SurveyRunArguments",
    "pipeline.run.workers": "Executor",
    "pipeline.site.change": "FloorChanges SiteChange site_align=align_floor site_remove=remove_floor "
    "site_renumber=renumber_floor site_set=change_site",
    "pipeline.site.init": "NewFloor site_init=add_floor",
    "pipeline.site.plan": "PlanRequest plan=write_plans",
    "pipeline.site.rebase": "site_rebase=rebase site_write=write_published",
    "pipeline.site.register": "FloorFiles register",
    "pipeline.site.show": "SiteSummary WalkableFloor site_show=summarise_site site_walkable=write_walkable",
    "pipeline.survey_run": "SurveyRun run_survey run=run_survey",
    "positioning.benchmark": "Benchmark ModelChoice",
    "positioning.learning_data": "LearningData ModelUpdate learning_data",
    "positioning.model_files": "ModelOrigin SavedModel load_model save_model",
    "positioning.model_scores": "ModelTrial TriedModel",
    "positioning.registry": "Positioner model_named",
    "positioning.tracks": "Tracks",
    "positioning.settings": "SequenceMethod",
    "preparation.planning.records": "PlanSummary",
    "preparation.planning.settings": "CameraSettings PlanSettings",
    "preparation.registration.names": "NameRules",
    "preparation.registration.point_columns": "PointColumn",
    "preparation.registration.record": "Registration RegistrationSettings",
    "preparation.sheets.sheet_folder": "SheetOptions SheetsRecord sheets=make_sheets",
    "quality.diagnosis.alignment": "WalkPasses",
    "quality.diagnosis.record": "Diagnosis",
    "quality.diagnosis.stream_faults": "StreamSigns",
    "quality.diagnosis.wifi_clock": "ClockOffset HeardOnWalk",
    "quality.evaluation.metrics": "ErrorSummary",
    "quality.evaluation.record": "SessionEvaluation SurveyEvaluation",
    "quality.self_check_record": "SessionCheck SurveyCheck",
    "sessions.companion_ties": "TableColumns Tie",
    "sessions.foreign_tables": "Clock",
    "sessions.inspection": "Inspection inspect=inspect_survey",
    "sessions.model": "Attachment Session",
    "sessions.registry": "open_survey read_session",
    "sessions.settings": "FindingSettings",
    "settings": "Settings read_settings",
    "simulation.scenario": "FurtherChoices Scenario paper_evaluation regular_survey",
    "simulation.settings": "BuildingSettings Climb Locale SessionLayout SiteColumn WalkSettings",
    "simulation.survey": "WritingOptions simulate",
    "site.frame_change": "FrameChanges",
    "site.model": "Floor SessionKey SessionRef Site Survey",
    "site.settings": "SurveySettings WalkableSettings",
    "site.site_file": "GeoreferencePart SiteFile",
}
"""Names by module; ``NAME=ORIGINAL`` if the function of a command has another name in its module."""

_PLACES = {
    name: (f"vislam2tag.{module}", original or name)
    for module, names in NAMES_BY_MODULE.items()
    for name, _, original in (each.partition("=") for each in names.split())
}
__all__ = sorted(_PLACES)


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> object:
    """Import a public name; raises MissingExtraError if it needs an extra that is not installed."""
    if name not in _PLACES:
        raise AttributeError(f"module 'vislam2tag.api' has no attribute '{name}'")
    module, original = _PLACES[name]
    globals()[name] = value = getattr(import_extra(module), original)
    return value
