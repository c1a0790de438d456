"""Windows of inertial readings with the way walked in them: series of sensors, their level frame, the building's."""
