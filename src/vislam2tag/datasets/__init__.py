"""Data sets of fingerprints: what they are, made of labels or of others' files, described, compared and given away.

In the order in which data meet the modules: ``schema`` and ``model`` say what a data set is, ``folder`` how it lies on
disk. ``labelled`` opens labels, of which ``fingerprints``, ``sensor_series`` and ``sensor_windows`` make its rows;
``access_points`` makes its table of them (``privacy`` hides whose they are), ``splits`` its training and test parts,
which ``leakage`` judges. ``statistics``, ``coverage`` and ``radio_maps`` (over ``map_process``) say what it amounts to,
``description`` and ``card`` tell others. ``formats`` read and write those of the field, with what several share in
``wide_tables``, ``point_fingerprints``, ``logged_walks`` and ``writing``; ``comparison`` tells two sets apart,
``joining`` joins them, and ``changes`` (over ``place_sums``) tells what happened in between.
"""
