"""Floor plans: one file per format, all of them turned into one :class:`FloorPlan` in the BCS.

``source`` (from ``site.toml``) names a floor's file; ``registry`` finds the format in ``formats`` that reads it to a
``drawing`` in the file's own coordinates; ``placing`` brings it to the BCS and ``images`` draws it; ``load`` takes all
these steps to a ``model``. Formats on GeoJSON share ``geojson_features``.
"""
