"""A directed graph as an SVG: each node is in the layer after all its predecessors, with curved arrows downwards.

Sugiyama, Tagawa, Toda (1981): layers by longest path, long arrows separated by points in the layers that they cross, and each layer
ordered by the mean position of its neighbours.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from itertools import pairwise

WIDE, HIGH, GAP, BETWEEN, NARROW = 132, 26, 26, 34, 18  # px: a node; between nodes, between layers; width of an arrow that passes
ROUNDS = 12  # of ordering; more do not change the picture
Point = tuple[str, int]  # a node, or an arrow, in its layer


def layers(nodes: Sequence[str], edges: Sequence[tuple[str, str]]) -> dict[str, int]:
    """node -> number of arrows on the longest path to it. The graph must be acyclic."""
    found = dict.fromkeys(nodes, 0)
    for _ in nodes:
        for start, end in edges:
            found[end] = max(found[end], found[start] + 1)
    return found


def rows(nodes: Sequence[str], edges: Sequence[tuple[str, str]]) -> tuple[list[list[Point]], list[list[Point]]]:
    """(points of each layer in their order, points of each arrow from layer to layer)."""
    at = layers(nodes, edges)
    ways = [[(start, at[start]), *((f"{start} {end}", k) for k in range(at[start] + 1, at[end])), (end, at[end])] for start, end in edges]
    every = dict.fromkeys([*((node, at[node]) for node in nodes), *(point for way in ways for point in way)])
    found = [[point for point in every if point[1] == k] for k in range(max(at.values()) + 1)]
    near: dict[Point, list[Point]] = {point: [] for point in every}
    for way in ways:
        for above, below in pairwise(way):
            near[above].append(below)
            near[below].append(above)
    for turn in range(ROUNDS):
        place = {point: k / len(row) for row in found for k, point in enumerate(row)}
        for row in found if turn % 2 else found[::-1]:
            row.sort(key=lambda point: sum(map(place.__getitem__, near[point])) / len(near[point]) if near[point] else place[point])
            place |= {point: k / len(row) for k, point in enumerate(row)}
    return found, ways


def svg(groups: Mapping[str, Sequence[str]], edges: Sequence[tuple[str, str]], title: str) -> str:
    """The picture; groups: name -> nodes, each group in one shade and named below."""
    nodes = [node for names in groups.values() for node in names]
    shade = {node: k for k, names in enumerate(groups.values()) for node in names}
    found, ways = rows(nodes, edges)
    width_of = {point: WIDE if point[0] in shade else NARROW for row in found for point in row}
    total = max(sum(width_of[point] + GAP for point in row) for row in found)
    place: dict[Point, tuple[float, float]] = {}
    for k, row in enumerate(found):
        x = (total - sum(width_of[point] + GAP for point in row) + GAP) / 2
        for point in row:
            place[point] = x + width_of[point] / 2, GAP + k * (HIGH + BETWEEN)
            x += width_of[point] + GAP
    low = GAP + len(found) * (HIGH + BETWEEN)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {total:.0f} {low + 2 * HIGH:.0f}" role="img"><title>{escape(title)}</title>',
        STYLE,
    ]
    lines += [_arrow([place[point] for point in way]) for way in ways]
    for point, (x, y) in place.items():
        if point[0] in shade:
            lines.append(f'<rect class="g{shade[point[0]]}" x="{x - WIDE / 2:.0f}" y="{y:.0f}" width="{WIDE}" height="{HIGH}" rx="5"/>')
            lines.append(f'<text x="{x:.0f}" y="{y + 17.5:.0f}">{escape(point[0])}</text>')
    step = total / len(groups)
    for k, name in enumerate(groups):
        x = (k + 0.5) * step
        lines.append(f'<rect class="g{k}" x="{x - 55:.0f}" y="{low:.0f}" width="110" height="20" rx="5"/>')
        lines.append(f'<text x="{x:.0f}" y="{low + 14.5:.0f}">{escape(name)}</text>')
    return "\n".join([*lines, "</svg>", ""])


STYLE = """<defs><marker id="tip" markerWidth="7" markerHeight="7" refX="6" refY="3" orient="auto">
<path d="M0,0 L7,3 L0,6 z" fill="#7d8590"/></marker></defs>
<style>text{font:13px sans-serif;fill:#1f2328;text-anchor:middle}
path.way{fill:none;stroke:#7d8590;stroke-width:1.3}rect{stroke:#57606a;stroke-width:.7}
.g0{fill:#dbeafe}.g1{fill:#d1f0e0}.g2{fill:#fdeac2}.g3{fill:#fbd9d3}.g4{fill:#e6def7}.g5{fill:#e5e7eb}</style>"""


def _arrow(points: Sequence[tuple[float, float]]) -> str:
    (x, y), *rest = points
    drawn = f"M{x:.0f},{y + HIGH:.0f}"
    y += HIGH
    for k, (to, down) in enumerate(rest):
        half = (down - y) / 2
        drawn += f" C{x:.0f},{y + half:.0f} {to:.0f},{down - half:.0f} {to:.0f},{down:.0f}"
        x, y = to, down
        if k < len(rest) - 1:
            drawn += f" V{down + HIGH:.0f}"
            y += HIGH
    return f'<path class="way" d="{drawn}" marker-end="url(#tip)"/>'
