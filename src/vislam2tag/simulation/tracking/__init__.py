"""The simulated AR tracker.

``dead_reckoning`` exposes frames and drifts, ``sightings`` sees landmarks, ``faults`` and ``climbing_faults`` plan what
goes wrong, ``mapper`` keeps the tracker's map through all that and ``tracker`` logs it; ``anchors`` are set by the
phone app.
"""
