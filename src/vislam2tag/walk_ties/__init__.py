"""What walks of a floor tell one another of where they led, besides the landmarks that they share.

A mapped walk is thinned (:mod:`~vislam2tag.walk_ties.traces`); what it shares with the others then says where it was.
"""
