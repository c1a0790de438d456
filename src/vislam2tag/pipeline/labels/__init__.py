"""From raw sessions to labels and reports: process, check, diagnose, evaluate, survey-landmarks.

Each command has a module that goes over a survey (``process`` with ``label_run``, ``check``, ``diagnose``,
``evaluate``, ``landmark_survey``); where a worker's part, one session, is long, it has its own (``session``,
``evaluate_session``). ``together`` adds constraints between walks. A processed session is reduced by
``session_result``, with ``findings`` and a ``drawing``. ``process`` does the same with one walk whose tables are in
memory.
"""
