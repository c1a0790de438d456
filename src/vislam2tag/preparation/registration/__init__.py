"""Positions of landmarks from what surveyors measured.

Files come in by ``text_table``: total-station exports and known points (``point_file``, ``names``, ``measurements``),
tape distances (``tape_file``), clicks on a plan (``clicks``). Shots and known points: ``consensus`` finds rough frames
of the stations, ``network`` adjusts them by ``least_squares``, ``network_search`` leaves out ``gross_errors``,
``heights`` adjusts heights. Distances: ``distance_equations`` and ``trilateration``. ``register`` takes all these steps
for a floor; ``result_rows`` and ``record`` hold the result, ``site_output`` writes it into the site's own files.
"""
