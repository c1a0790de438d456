"""Formats of the field: one file each, found by import, that registers how it is read, written, or both."""

from vislam2tag.dataset.format_registry import (
    ExportContext,
    ExportFormat,
    ImportContext,
    ImportFormat,
    export_formats,
    export_named,
    import_format_of,
    import_formats,
    import_named,
)

__all__ = [
    "ExportContext",
    "ExportFormat",
    "ImportContext",
    "ImportFormat",
    "export_formats",
    "export_named",
    "import_format_of",
    "import_formats",
    "import_named",
]
