"""Preparation of a survey before it is walked.

``planning`` finds places for landmarks, ``sheets`` prints them, ``registration`` turns surveyors' measurements into
positions; ``sightings`` finds printed landmarks in a session's pictures.
"""
