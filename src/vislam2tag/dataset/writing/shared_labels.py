"""Labels as an export shares them: without the sessions that come from outside their survey."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.common.findings import Finding
from vislam2tag.dataset.fingerprinting.labelled import LabelledSurvey, open_labelled, without_sessions
from vislam2tag.dataset.format_registry import ExportContext
from vislam2tag.sessions.registry import slugs_from_outside
from vislam2tag.survey.links import left_out_sessions


def shared_labels(labels: Path, context: ExportContext) -> tuple[LabelledSurvey, tuple[Finding, ...]]:
    """Open labels to be shared, and count what is left out.

    Raises DatasetError as :func:`open_labelled` does, SurveyError where the context's survey is none.
    """
    opened = open_labelled(labels, follow_links=context.follow_links)
    if context.survey is not None and not context.follow_links:
        opened = without_sessions(opened, slugs_from_outside(context.survey))
    if not opened.left_out:
        return opened, ()
    context.tell([left_out_sessions(opened.left_out, named=True)])
    return opened, (left_out_sessions(opened.left_out, named=False),)
