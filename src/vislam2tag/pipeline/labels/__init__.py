"""From raw sessions to labels and what is reported of them: process, check, evaluate, survey-landmarks.

Each command has a module that goes over a survey (``process``, those of ``checking``, ``evaluating`` and ``joining``)
and one for a worker's part, one session (``session``, ``check_session``, ...). A processed session is reduced by
``session_result``: to ``statistics``, ``marks``, ``findings``, a ``drawing`` and its ``accuracy``.
``map_walk`` does the same with one walk whose tables are in memory.
"""
