"""From a survey folder to an output folder."""

from vislam2tag.pipeline.run import Selection, process
from vislam2tag.pipeline.session import Outcome

__all__ = ["Outcome", "Selection", "process"]
