"""The smoother: odometry -> passes -> model -> equations -> chain -> reweighting -> slips and contradictions."""
