"""Sessions: what one walk recorded, and one reader per raw format."""

from vislam2tag.sessions.corrected import corrected_session
from vislam2tag.sessions.registry import format_module, format_of, hash_inputs, open_survey, read_session

__all__ = ["corrected_session", "format_module", "format_of", "hash_inputs", "open_survey", "read_session"]
