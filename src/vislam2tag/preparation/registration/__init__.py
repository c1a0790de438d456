"""Positions of landmarks from what surveyors measured.

Files come in by ``point_file`` (total-station exports and known points; ``names``) and ``tape_and_clicks``, as a
``text_table`` (``point_columns``) or from ``instrument_files``; ``foreign_files`` names other formats. Shots and
known points: ``network`` adjusts them by ``least_squares``; ``network_search`` finds rough frames of the stations and
leaves out gross errors. Distances: ``distance_equations`` and ``trilateration``. ``register`` takes all these steps for
a floor; ``record`` and ``results`` write what came out.
"""
