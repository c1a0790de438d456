"""Positions of landmarks and control points in the BCS from what surveyors measured."""
