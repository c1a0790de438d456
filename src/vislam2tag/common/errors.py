"""The exceptions that users can meet: one family, one clear message each.

:class:`MissingExtraError` names the extra to install for a feature that the base installation does not include.
"""

from __future__ import annotations

import importlib
import re
from types import ModuleType


class Vislam2tagError(Exception):
    """Base of every error this package raises on bad input.

    The message names the file (and line or row), what was expected and what to do.
    """


class SurveyError(Vislam2tagError):
    """The folder is not a survey, or one of its site files cannot be used."""


class SessionError(Vislam2tagError):
    """One session cannot be read or mapped; the others go on."""


class DatasetError(Vislam2tagError):
    """The folder or file is not a data set, or contains something else."""


class ModelError(Vislam2tagError):
    """The file is not a positioning model, damaged, or of a version that cannot be used."""


class OutputError(Vislam2tagError):
    """The output folder cannot be written, or belongs to something else."""


class StoreError(Vislam2tagError):
    """An object store cannot be read or written, or does not do what is needed."""


class StoreConflictError(StoreError):
    """Another program has written the object meanwhile."""


class StoreUnansweredError(StoreError):
    """No one knows whether what was asked for was done."""


class UsageError(Vislam2tagError):
    """An option has a value that cannot work."""


def first_line(error: Exception) -> str:
    """What a library's error says, for a message of ours: its first line, or its kind where it says nothing.

    Errors of Polars speak of its schemas and expressions: they are said in words about the file.
    """
    if not type(error).__module__.startswith("polars"):
        return (str(error).splitlines() or [type(error).__name__])[0]
    matches = ((re.match(pattern, str(error)), words) for pattern, words in _TABLE_ERRORS.items())
    return next((found.expand(words) for found, words in matches if found), "its content is damaged or of another kind")


_TABLE_ERRORS = {
    r"a quote in its last field is not closed|parquet: .*": r"\g<0>",
    r"found more fields than defined": "a line has more fields than the first line",
    r"could not parse `([^`\n]*)` as dtype `[iu]\d+` at column '([^']*)'": r"'\1' in column \2 is not a whole number",
    r"could not parse `([^`\n]*)` as dtype `f\d+` at column '([^']*)'": r"'\1' in column \2 is not a number",
    r"could not parse `\"": "a quote is not closed",
    r"unable to find column \"([^\"]*)\"": r"there is no column \1",
    r"conversion from .* failed in column '([^']*)'": r"column \1 contains values of another kind",
    r"could not find an appropriate format to parse dates": "the dates have another form",
    r"empty CSV": "it is empty",
    r"invalid utf-8": "it is not UTF-8 text",
}
"""Beginnings of errors of Polars, and what they mean for a file."""
_EXTRAS = {
    "tables": ("openpyxl",),
    "pandas": ("pandas", "pyarrow"),
    "plans": ("ezdxf", "pypdfium2", "resvg_py"),
    "ifc": ("ifcopenshell",),
    "prepare": ("cv2", "reportlab", "skimage"),
    "receive": ("segno", "starlette", "uvicorn"),
    "positioning": ("safetensors", "sklearn", "tifffile"),
    "gis": ("pyarrow", "pyogrio"),
    "hdf5": ("h5py",),
    "mcap": ("google", "mcap", "mcap_protobuf"),
    "fleet": ("dask", "distributed", "obstore"),
    "models": ("onnx", "onnxscript", "torch"),
}
"""By extra (pyproject.toml), the packages that identify it if they are missing; segno is in ``prepare``, too."""


class MissingExtraError(UsageError):
    """What was asked for needs a package that an extra brings."""


def missing_extra(error: ModuleNotFoundError) -> str | None:
    """Say what to install, to end a sentence, where a package of an extra was not found; else None."""
    package = (error.name or "").partition(".")[0]
    for extra, packages in _EXTRAS.items():
        if package in packages:
            smaller = " (without a GPU, first install PyTorch's CPU build, which is much smaller)"
            return f"needs {package}: pip install 'vislam2tag[{extra}]'{smaller if extra == 'models' else ''}"
    return None


def import_extra(module: str) -> ModuleType:
    """Import a module that needs packages of an extra; raises MissingExtraError if they are missing."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        lacks = missing_extra(error)
        if lacks is None:
            raise
        raise MissingExtraError(f"this {lacks}") from error
