"""The door: the rules about values that enter, whatever file, form or network they come from.

A rule names the value, its unit, its range, and the finding with cause and cure that a value outside it gets. Readers
apply the rules; no reader has a range of its own, except where the specification of its format says otherwise.

``readings``: addresses and signal strengths; ``not_heard``: which level of a table stands for "not heard";
``time_units``: the unit of times; ``pose_evidence`` and ``poses``: conventions of poses; ``ids``: two sets of ids that
should name the same things.
"""
