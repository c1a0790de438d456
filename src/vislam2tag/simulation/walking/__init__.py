"""Simulated true walks: ``route`` over a floor or ``floor_tour`` over several, ``gait`` along it, together a ``walk``.

``sampling`` gives position and orientation at any time.
"""
