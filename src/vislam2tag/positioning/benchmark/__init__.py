"""Positioning models compared: protocol -> record -> rows -> text, the paper's Table IV."""
