"""The drawing of a scene: what hangs on what by springs and contacts, the force, what is observed.

It is a drawing of connections, not of places: a column is as far from the ground as there are springs on the
way. Of a disk one sector is drawn with its neighbour; what moves as one node or body is one circle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solver.scene.scene import Scene
from solver.views.picture import GROUND, NEXT, Pair, Parts, Place, parts_of, places_of
from solver.views.plots import style
from solver.views.plots.style import Into

MOST_PARTS = 40
"""Circles that can be told apart."""
_RADIUS, _BOW = 0.16, 0.34
_WHITE = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 0.6}


def scene_figure(scene: Scene, *, ax: Into = None) -> Figure | None:
    """Draw masses, springs and contacts, the force and what is observed.

    Parameters
    ----------
    scene : Scene
        Of any kind.
    ax : axes to draw into, as `solver.views.plots.style.figure`.

    Returns
    -------
    The drawing; None of a scene with more than `MOST_PARTS` masses, nodes and bodies, of which nothing could
    be told.
    """
    parts = parts_of(scene)
    if len(parts.names) > MOST_PARTS:
        return None
    places = places_of(parts)
    rows = 1 + max(y for _, y in places.values())
    with style.styled():
        page, (axes,) = style.figure(7.2, 1.0 + 0.7 * rows, into=ax)
        axes.set_axis_off()
        axes.set_aspect("equal")
        _ground(axes, places)
        drawn: dict[Pair, int] = {}
        first = min(x for x, _ in places.values())
        hung: dict[str, int] = {}
        for pair in parts.springs:
            _spring(axes, *_ends(pair, places, first, hung), _beside(pair, drawn))
        for pair, names in parts.contacts.items():
            _contact(axes, *_ends(pair, places, first, hung), _beside(pair, drawn), names)
        for name, place in places.items():
            _circle(axes, name, place, parts)
        x = [place[0] for place in places.values()]
        y = [place[1] for place in places.values()]
        axes.set_xlim(-0.5, max(x) + 0.8)
        axes.set_ylim(min(y) - (1.35 if hung else 0.6), max(y) + 0.75)
    return page


def _ends(pair: Pair, places: Mapping[str, Place], first: float, hung: dict[str, int]) -> tuple[Place, Place]:
    """Where a spring or a contact begins and ends.

    The ground is straight beside a circle of the first column, below one that others stand before.
    """
    free = next((name for name in pair if name != GROUND), None)
    if free is None or GROUND not in pair:
        a, b = (places.get(name, (0.0, 0.0)) for name in pair)
        return a, b
    x, y = places[free]
    if x == first:
        return (x, y), (-_RADIUS, y)
    hung[free] = hung.get(free, -1) + 1
    at = x + 0.5 * hung[free]
    return (at, y), (at, y - 1.0 - _RADIUS)


def _beside(pair: Pair, drawn: dict[Pair, int]) -> int:
    """How many are drawn between the same two already."""
    key = (min(pair), max(pair))
    drawn[key] = drawn.get(key, -1) + 1
    return drawn[key]


def _way(a: Place, b: Place, beside: int) -> tuple[Place, Place, Place, Place]:
    """From the rim of one circle to that of the other, shifted; its direction and the one across it."""
    length = math.dist(a, b) or 1.0
    along = ((b[0] - a[0]) / length, (b[1] - a[1]) / length)
    across = (-along[1], along[0])
    shift = -_BOW * beside
    begin = tuple(p + _RADIUS * d + shift * n for p, d, n in zip(a, along, across, strict=True))
    end = tuple(p - _RADIUS * d + shift * n for p, d, n in zip(b, along, across, strict=True))
    return begin, end, along, across  # type: ignore[return-value]


def _between(a: Place, b: Place, share: float, across: Place, side: float = 0.0) -> Place:
    x, y = (p + share * (q - p) + side * n for p, q, n in zip(a, b, across, strict=True))
    return x, y


def _line(axes: Axes, points: Sequence[Place], color: str, width: float = 1.1) -> None:
    axes.plot([x for x, _ in points], [y for _, y in points], color=color, linewidth=width, zorder=1)


def _spring(axes: Axes, a: Place, b: Place, beside: int) -> None:
    begin, end, _, across = _way(a, b, beside)
    turns = [_between(begin, end, 0.2 + 0.6 * (i + 0.5) / 6, across, 0.09 * (-1) ** i) for i in range(6)]
    straight = [_between(begin, end, share, across) for share in (0.2, 0.8)]
    _line(axes, [begin, straight[0], *turns, straight[1], end], style.GREY)
    if beside:
        _leads(axes, a, b, begin, end)
    _foot(axes, end, a, b)


def _foot(axes: Axes, end: Place, a: Place, b: Place) -> None:
    """The ground below a circle, where a spring or a contact hangs down to it."""
    if not math.isclose(b[1], a[1] - 1.0 - _RADIUS) or not math.isclose(a[0], b[0]):
        return
    _line(axes, [(end[0] - 0.25, end[1]), (end[0] + 0.25, end[1])], style.INK, 1.4)
    for i in range(4):
        x = end[0] - 0.2 + 0.14 * i
        _line(axes, [(x + 0.04, end[1]), (x - 0.05, end[1] - 0.1)], style.GREY, 0.7)


def _contact(axes: Axes, a: Place, b: Place, beside: int, names: Sequence[str]) -> None:
    """Two plates that rub, with the names of the contacts."""
    begin, end, along, across = _way(a, b, beside)
    middle = _between(begin, end, 0.5, across)
    for side in (-0.05, 0.05):
        plate = [
            (middle[0] + along[0] * s + across[0] * side, middle[1] + along[1] * s + across[1] * side)
            for s in (-0.2, 0.2)
        ]
        _line(axes, plate, style.VERMILION, 3.2)
    for tip, share in ((begin, -0.2), (end, 0.2)):
        _line(axes, [tip, (middle[0] + along[0] * share, middle[1] + along[1] * share)], style.VERMILION)
    if beside:
        _leads(axes, a, b, begin, end)
    _foot(axes, end, a, b)
    words = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
    upright = abs(along[1]) > abs(along[0])
    axes.annotate(
        words, middle, xytext=(9, 0) if upright else (0, -13), textcoords="offset points",
        ha="left" if upright else "center", va="center", color=style.VERMILION, fontsize=8.0,
        bbox=_WHITE, zorder=5,
    )  # fmt: skip


def _leads(axes: Axes, a: Place, b: Place, begin: Place, end: Place) -> None:
    """From the circles to what stands beside their straight connection."""
    for circle, tip in ((a, begin), (b, end)):
        _line(axes, [circle, tip], style.GREY, 0.8)


def _ground(axes: Axes, places: Mapping[str, Place]) -> None:
    low, high = min(y for _, y in places.values()) - 0.4, max(y for _, y in places.values()) + 0.4
    _line(axes, [(0.0, low), (0.0, high)], style.INK, 1.4)
    count = max(int((high - low) / 0.16), 1)
    for i in range(count):
        y = low + (i + 0.5) * (high - low) / count
        _line(axes, [(0.0, y + 0.06), (-0.14, y - 0.06)], style.GREY, 0.7)


def _circle(axes: Axes, name: str, place: Place, parts: Parts) -> None:
    """A mass, node or body; of the next sector pale, without a name."""
    from matplotlib.patches import Circle

    pale = name.endswith(NEXT)
    color = style.GREY if pale else style.BLUE
    axes.add_patch(Circle(place, _RADIUS, facecolor="white", edgecolor=color, linewidth=1.3, zorder=2))
    if pale:
        if name == f"{parts.names[0]}{NEXT}":
            axes.annotate(
                "next sector", place, xytext=(0, 11), textcoords="offset points", ha="center", fontsize=7.0,
                color=style.GREY,
            )  # fmt: skip
        return
    if name == parts.observed:
        axes.add_patch(Circle(place, 0.62 * _RADIUS, fill=False, edgecolor=color, linewidth=1.1, zorder=3))
    axes.annotate(
        name, place, xytext=(-11, -10), textcoords="offset points", ha="right", va="center", fontsize=8.5,
        bbox=_WHITE, zorder=5,
    )  # fmt: skip
    if name in parts.forced:
        arrow = {"arrowstyle": "-|>", "color": style.GREEN, "linewidth": 1.4}
        # From the upper left: springs lie flat, contacts stand upright.
        tip = (place[0] - 0.7 * _RADIUS, place[1] + 0.7 * _RADIUS)
        tail = (tip[0] - 0.3, tip[1] + 0.3)
        axes.annotate("", tip, xytext=tail, arrowprops=arrow)
        axes.annotate(
            parts.forced[name], tail, xytext=(0, 5), textcoords="offset points", ha="center", va="center",
            fontsize=8.0, color=style.GREEN, bbox=_WHITE, zorder=5,
        )  # fmt: skip
