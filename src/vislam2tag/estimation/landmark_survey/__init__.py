"""Landmarks without a survey, placed from all walks together (docs/explanation/landmarks.md).

In reading order: each walk becomes a ``local_map`` in its own frame, and the maps are put together roughly;
``landmark_map`` adjusts them and the survey at once. ``comparison`` says how a survey, or what walks saw, fits all
others; ``device_metre`` does so for what devices take for a metre; ``odd_one_out`` finds what contradicts most.
"""
