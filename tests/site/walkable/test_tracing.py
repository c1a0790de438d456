from __future__ import annotations

import numpy as np

from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.site.walkable.skeleton import Network, traced


def network_of(*rows: str) -> Network:
    cells = np.array([[letter == "x" for letter in row] for row in rows])
    return traced(np.argwhere(cells), CellGrid((0.0, 0.0), 1.0, *cells.shape))


def test_a_line_is_one_strand() -> None:
    network = network_of(".....", ".xxx.", ".....")
    (branch,) = network.branches.values()
    assert branch.length_m == 2


def test_a_crossing_has_four_arms() -> None:
    network = network_of("..x..", "..x..", "xxxxx", "..x..", "..x..")
    assert sorted(len(network.at(node)) for node in network.places) == [1, 1, 1, 1, 4]
    assert sorted(branch.length_m for branch in network.branches.values()) == [2, 2, 2, 2]


def test_a_ring_without_a_node_gets_one() -> None:
    network = network_of(".xx.", "x..x", ".xx.")
    (branch,) = network.branches.values()
    assert branch.first == branch.last
    assert len(branch.line) == 7


def test_a_corner_is_no_triangle() -> None:
    network = network_of("xxx", "..x", "..x")
    assert len(network.branches) == 1
