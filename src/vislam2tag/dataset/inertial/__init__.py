"""Windows of inertial readings, gravity-aligned, with the way walked in them."""
