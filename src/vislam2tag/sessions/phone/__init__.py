"""Parts of the phone app's format: record, tables, camera."""
