"""The skeleton of walkable space: lines in the middle between walls, without spurs into corners."""

from __future__ import annotations

import cv2
import numpy as np
from skimage.morphology import skeletonize

from vislam2tag.core.arrays import BoolArray
from vislam2tag.site.walkable.network import Network
from vislam2tag.site.walkable.settings import GraphSettings
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.site.walkable.tracing import traced

_PILLAR_M = 1.0
"""What fits into a square of this side is walked round without thinking, metres."""
_SMOOTH_CELLS = 1.0
"""Spread of the blur that takes roughness off the walls, cells."""
_CORNER_M = 0.3
"""A line that ends nearer than this to the walls ends in a corner."""
_NICHE = 1.2
"""A niche is no dead end where it is less deep than this many times its half width."""


def skeleton(space: WalkableSpace, settings: GraphSettings) -> Network:
    """Make the network of lines in the middle between walls; every node is an end or joins three branches at least."""
    cells = np.argwhere(skeletonize(_smooth(space.area.mask, space.area.cell_m)))
    network = traced(cells, space.area.grid)
    clear_spurs(network, space, settings.spur_share)
    return network


def _smooth(mask: BoolArray, cell_m: float) -> BoolArray:
    """The mask (rows, columns) without pillars and with even walls: roughness makes spurs."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats((~np.pad(mask, 1)).astype(np.uint8), connectivity=8)
    sides = np.asarray(stats)[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1)
    whole = mask | (sides * cell_m < _PILLAR_M)[np.asarray(labels)][1:-1, 1:-1]
    # Thin walls would not outlast the blur.
    even: BoolArray = whole & np.asarray(cv2.GaussianBlur(whole.astype(np.float32), (0, 0), _SMOOTH_CELLS) > 0.5)
    return even


def clear_spurs(network: Network, space: WalkableSpace, share: float) -> None:
    """Remove branches that only lead into a corner or a niche, until there are none."""
    while spurs := [
        (number, node)
        for number, node in network.leaves()
        if network.at(network.branches[number].other(node))[1:] and _is_spur(network, number, node, space, share)
    ]:
        for number, node in spurs:
            foot = network.branches[number].other(node)
            if len(network.at(foot)) > 1:
                network.remove(number)
                network.remove_node(node)
        network.join_through()


def _is_spur(network: Network, number: int, tip: int, space: WalkableSpace, share: float) -> bool:
    """Whether a dead end reaches hardly farther than the largest disc at its foot."""
    branch = network.branches[number]
    foot_m, tip_m = space.clearance_at(np.array((network.places[branch.other(tip)], network.places[tip]))).tolist()
    reach: float = branch.length_m + tip_m - foot_m
    return bool(reach < share * foot_m if tip_m < _CORNER_M else reach < _NICHE * tip_m)
