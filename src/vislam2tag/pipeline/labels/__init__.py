"""From raw sessions to labels and what is told of them.

Each command (``process``, ``check``, ``evaluate``, ``landmark_survey``) hands sessions to workers and reduces what
comes back. In a worker, ``session`` maps and labels one and ``session_result`` makes its result: ``findings``,
``marks``, ``statistics``, ``accuracy`` and ``drawing``. ``check_session``, ``evaluate_session`` and
``evaluate_station`` are the workers' parts of the others; ``landmark_results`` is what the joint survey of landmarks
found.
"""
