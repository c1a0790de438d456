from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.site.walkable.hand_made import rectangles, space_of
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.site.walkable.skeleton import (
    Network,
    bend_at,
    join_components,
    mark_turns,
    merge_near,
    skeleton,
    straighten,
    traced,
)


def test_a_corridor_is_a_line_without_spurs_into_its_corners() -> None:
    network = skeleton(rectangles(30, 6, (1, 2, 29, 4)))
    (branch,) = network.branches.values()
    assert branch.length_m == pytest.approx(26, abs=0.4)
    assert branch.line[:, 1] == pytest.approx(3.0, abs=0.1)


def test_a_niche_is_no_dead_end_but_a_side_corridor_is_one() -> None:
    niche = rectangles(30, 9, (1, 2, 29, 4), (10, 4, 12, 4.8))
    assert len(skeleton(niche).branches) == 1
    side = rectangles(30, 9, (1, 2, 29, 4), (10, 4, 11.6, 8.5))
    assert sorted(len(skeleton(side).at(node)) for node in skeleton(side).places) == [1, 1, 1, 3]


def test_a_pillar_makes_no_ring() -> None:
    space = rectangles(20, 8, (1, 1, 19, 7))
    mask = space.area.mask.copy()
    mask[38:43, 98:103] = False
    assert len(skeleton(space_of(mask)).branches) == 1
    mask[30:50, 90:110] = False
    (ring,) = skeleton(space_of(mask)).branches.values()
    assert ring.first == ring.last


def chain(*points: tuple[float, float]) -> tuple[Network, list[int]]:
    network = Network()
    places = [np.array(point, dtype=np.float64) for point in points]
    nodes = [network.add_node(place) for place in places]
    for one, other in zip(range(len(nodes) - 1), range(1, len(nodes)), strict=True):
        network.add(nodes[one], nodes[other], np.array([places[one], places[other]]))
    return network, nodes


def length(network: Network) -> float:
    return sum(branch.length_m for branch in network.branches.values())


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), min_size=3, max_size=8, unique=True))
def test_joining_keeps_the_length(points: list[tuple[int, int]]) -> None:
    network, nodes = chain(*points)
    before = length(network)
    network.join_through()
    (branch,) = network.branches.values()
    assert length(network) == pytest.approx(before)
    assert {branch.first, branch.last} == {nodes[0], nodes[-1]}


def test_nodes_to_keep_are_not_joined_at() -> None:
    network, nodes = chain((0, 0), (1, 0), (2, 0))
    network.join_through({nodes[1]})
    assert len(network.branches) == 2


def test_splitting_keeps_the_length_and_order() -> None:
    network, nodes = chain((0, 0), (9, 0))
    (number,) = network.branches
    network.replace_line(number, np.array([(0.0, 0.0), (3.0, 0.0), (6.0, 0.0), (9.0, 0.0)]))
    made = network.split(number, [1, 2])
    assert [network.places[node][0] for node in made] == [3, 6]
    assert length(network) == 9
    assert network.neighbours(nodes[0]) == [made[0]]


def test_merging_moves_both_ends_and_drops_what_lies_between() -> None:
    network, nodes = chain((0, 0), (4, 0), (5, 0), (9, 0))
    network.merge(nodes[2], nodes[1], np.array([4.5, 1.0]))
    assert len(network.branches) == 2
    assert sorted(network.neighbours(nodes[1])) == [nodes[0], nodes[3]]
    for branch in network.branches.values():
        assert branch.away_from(nodes[1])[0].tolist() == [4.5, 1.0]


def test_a_ring_counts_twice_at_its_node() -> None:
    network, nodes = chain((0, 0), (1, 0))
    network.add(nodes[1], nodes[1], np.array([(1.0, 0.0), (2.0, 1.0), (1.0, 0.0)]))
    assert len(network.at(nodes[1])) == 3
    assert [node for _, node in network.leaves()] == [nodes[0]]
    network.remove_node(nodes[1])
    assert not network.branches


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
    merge_near(network, SPACE, set())
    assert sorted(len(network.at(node)) for node in network.places) == [1, 1, 1, 1, 4]
    fixed = network_of([(2, 5), (10, 5)], [(10, 5), (10, 8)], [(10, 5), (20, 5)])
    merge_near(fixed, SPACE, set(fixed.places))
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


def traced_network_of(*rows: str) -> Network:
    cells = np.array([[letter == "x" for letter in row] for row in rows])
    return traced(np.argwhere(cells), CellGrid((0.0, 0.0), 1.0, *cells.shape))


def test_a_line_is_one_strand() -> None:
    network = traced_network_of(".....", ".xxx.", ".....")
    (branch,) = network.branches.values()
    assert branch.length_m == 2


def test_a_crossing_has_four_arms() -> None:
    network = traced_network_of("..x..", "..x..", "xxxxx", "..x..", "..x..")
    assert sorted(len(network.at(node)) for node in network.places) == [1, 1, 1, 1, 4]
    assert sorted(branch.length_m for branch in network.branches.values()) == [2, 2, 2, 2]


def test_a_ring_without_a_node_gets_one() -> None:
    network = traced_network_of(".xx.", "x..x", ".xx.")
    (branch,) = network.branches.values()
    assert branch.first == branch.last
    assert len(branch.line) == 7


def test_a_corner_is_no_triangle() -> None:
    network = traced_network_of("xxx", "..x", "..x")
    assert len(network.branches) == 1
