from __future__ import annotations

import numpy as np
import pytest

from tests.site.walkable.hand_made import rectangles
from vislam2tag.site.walkable.skeleton import Network, bend_at, join_components, mark_turns, merge_near, straighten

SPACE = rectangles(30, 10, (1, 1, 29, 9))


def network_of(*lines: list[tuple[float, float]]) -> Network:
    """Lines that share nodes where their ends are the same."""
    network = Network()
    nodes: dict[tuple[float, float], int] = {}
    for line in lines:
        ends = [nodes.setdefault(end, 0) or network.add_node(np.array(end)) for end in (line[0], line[-1])]
        nodes.update({line[0]: ends[0], line[-1]: ends[1]})
        network.add(ends[0], ends[1], np.array(line, dtype=np.float64))
    return network


def test_two_junctions_side_by_side_become_one() -> None:
    network = network_of(
        [(2, 5), (10, 5)], [(10, 5), (10, 8)], [(10, 5), (10.6, 5)], [(10.6, 5), (10.6, 2)], [(10.6, 5), (20, 5)]
    )
    merge_near(network, SPACE, set(), 1.0)
    assert sorted(len(network.at(node)) for node in network.places) == [1, 1, 1, 1, 4]
    fixed = network_of([(2, 5), (10, 5)], [(10, 5), (10, 8)], [(10, 5), (20, 5)])
    merge_near(fixed, SPACE, set(fixed.places), 1.0)
    assert len(fixed.branches) == 3


def test_rough_lines_become_straight() -> None:
    rough = [(2 + 0.1 * i, 5 + 0.1 * (i % 2)) for i in range(200)]
    network = network_of(rough)
    straighten(network, SPACE)
    (branch,) = network.branches.values()
    assert branch.length_m == pytest.approx(19.9, rel=0.01)


def test_straightening_keeps_off_walls() -> None:
    space = rectangles(20, 20, (1, 1, 3, 19), (1, 17, 19, 19))
    network = network_of([(2, 2), (2, 18), (18, 18)])
    straighten(network, space)
    (branch,) = network.branches.values()
    assert branch.length_m == pytest.approx(32)


def test_turns_become_nodes_and_bends_do_not() -> None:
    network = network_of([(2, 2), (10, 2), (10, 8)])
    assert [network.places[node].tolist() for node in mark_turns(network, list(network.branches), 0.6)] == [[10, 2]]
    bend = network_of([(2, 2), (10, 2), (18, 4)])
    assert not mark_turns(bend, list(bend.branches), 0.6)
    rounded = network_of([(2, 2), (10, 2), (10.5, 2.2), (10.8, 2.6), (11, 3), (11, 8)])
    assert len(mark_turns(rounded, list(rounded.branches), 0.6)) == 1


def test_the_bend_at_a_node() -> None:
    network = network_of([(2, 2), (10, 2)], [(10, 2), (10, 8)])
    (node,) = (node for node in network.places if len(network.at(node)) == 2)
    first, second = network.at(node)
    assert bend_at(network, node, first, second) == pytest.approx(np.pi / 2)


def test_pieces_are_joined_around_walls() -> None:
    space = rectangles(20, 20, (1, 1, 3, 19), (1, 17, 19, 19), (17, 1, 19, 19))
    network = network_of([(2, 2), (2, 10)], [(18, 3), (18, 10)])
    join_components(network, space)
    joint = max(network.branches.values(), key=lambda branch: branch.length_m)
    assert space.clear_line(joint.line[:-1], joint.line[1:]).all()
    assert joint.length_m == pytest.approx(28, abs=2.5)
