"""Data sets of fingerprints: made from labels or imported files, described, compared and published.

- ``schema`` and ``model`` define a data set, ``folder`` its files.
- ``labelled`` opens labels; ``fingerprints``, ``phone_motion``, ``sensor_series`` and ``sensor_windows`` make rows from
  them, and ``access_points`` makes the table of access points.
- ``privacy`` hides identifiers. ``splits`` makes training and test sets, and ``leakage`` judges them.
- ``statistics``, ``coverage`` and ``radio_maps`` (with ``map_process``) summarise a data set; ``description`` and
  ``card`` document it.
- ``technologies``: fingerprints of Wi-Fi, BLE and both. ``recordings`` points logs given to ``import`` to other
  commands.
- ``formats`` reads and writes other formats; ``wide_tables``, ``long_tables``, ``table_columns``,
  ``point_fingerprints``, ``logged_walks`` and ``writing`` contain what several formats share.
- ``comparison`` compares two data sets, ``joining`` joins them, and ``changes`` (with ``place_sums``) detects what
  changed in between.
"""
