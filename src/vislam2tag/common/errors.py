"""The exceptions that users can meet: one family, one clear message each."""


class Vislam2tagError(Exception):
    """Base of every error this package raises on bad input.

    The message names the file (and line or row), what was expected and what to do.
    """


class SurveyError(Vislam2tagError):
    """The folder is not a survey, or one of its site files cannot be used."""


class SessionError(Vislam2tagError):
    """One session cannot be read or mapped; the others go on."""


class DatasetError(Vislam2tagError):
    """The folder or file is no data set, or holds what a data set cannot be."""


class ModelError(Vislam2tagError):
    """The file is no positioning model, damaged, or of a version that cannot be used."""


class OutputError(Vislam2tagError):
    """The output folder cannot be written, or belongs to something else."""


class StoreError(Vislam2tagError):
    """An object store cannot be read or written, or does not do what is needed."""


class StoreConflictError(StoreError):
    """Another program has written the object meanwhile."""


class UsageError(Vislam2tagError):
    """An option has a value that cannot work."""


def first_line(error: Exception) -> str:
    """What a library's error says, for a message of ours: its first line, or its kind where it says nothing."""
    return (str(error).splitlines() or [type(error).__name__])[0]
