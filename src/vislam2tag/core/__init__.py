"""The numeric core: arrays in frozen dataclasses; no files, no data frames, no plots."""
