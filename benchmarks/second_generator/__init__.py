"""A second generator of tracker walks with truth, which shares nothing with ``vislam2tag.simulation``.

It imitates habits measured in logs of the published layout and in real walks, and mixes them at random far beyond what
was measured. Horizontal planes are complex numbers, ``x + iy`` of the BCS or ``tx - i tz`` of the ACS, in metres. A
walk is a route over a floor, frames along it, odometry with drift, and a tracker that goes from event to event.
"""

from second_generator.habits import Severity
from second_generator.styles import iphone
from second_generator.two_frames import surveyed_in_two_frames
from second_generator.walk import MadeWalk, make_walk

__all__ = ["MadeWalk", "Severity", "iphone", "make_walk", "surveyed_in_two_frames"]
