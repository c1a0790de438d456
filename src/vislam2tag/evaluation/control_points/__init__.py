"""Label errors at control points: which press belongs to which point, and how late the finger was."""
