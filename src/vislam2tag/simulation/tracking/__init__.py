"""The simulated AR tracker: odometry, map, sightings, faults."""
