"""Simulated sensors: radio, beacons, inertial, pressure, presses, total station."""
