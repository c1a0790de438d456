"""Labels checked without truth: each landmark left out in turn, what one more would gain, which are bad.

``left_out`` gives a session's errors at left-out landmarks, ``accuracy`` makes of them how good its labels are, and
``bad_landmarks`` pools them over sessions; ``landmark_gain`` tells what one more landmark would gain a session,
``gain_map`` adds that up by floor. ``record`` is what is written.
"""
