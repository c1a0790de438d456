"""Label errors at control points: a written route (``route_file``), which press belongs to which point
(``press_identity``), how late the finger was and how far the label then is (``press_truth``).
"""
