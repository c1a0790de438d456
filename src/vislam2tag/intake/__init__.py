"""The door: the rules about values that enter, whatever file, form or network they come from.

A rule names the value, its unit, its range, and the finding with cause and cure that a value outside it gets. Readers
apply the rules; no reader has a range of its own, except where the specification of its format says otherwise.

``readings``: addresses, signal strengths, and which level of a table stands for "not heard"; ``time_units``: the unit
of times; ``pose_conventions``: whether poses are those of a walking person, and which other convention explains them if
not (what counts for each is in ``pose_evidence``); ``ids``: two sets of ids that should name the same things.
"""
