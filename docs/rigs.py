"""The picture of synthetic rigs of benchmarks/accuracy.md: `python docs/rigs.py docs/img`; some minutes."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.rigs import Held, all_held
from solver.views.plots import style

LEVELS = np.linspace(0.05, 0.98, 60)
COLOURS = (style.BLUE, style.VERMILION, style.GREEN, "#7a4fa3", "#555555")


def picture(held: Sequence[Held], file: Path) -> None:
    """Draw how often intervals hold the truth over how often they should, and where the truth lies."""
    known = [one for one in held if math.isfinite(one.share) and not one.of.startswith("populations")]
    rigs = [one.share for one in known if one.of.startswith("rigs")]
    with style.styled():
        page, (left, right) = style.figure(10.0, 3.9, columns=2)
        for name, colour in zip(dict.fromkeys(one.of for one in known), COLOURS, strict=False):
            shares = [one for one in known if one.of == name]
            inside = np.array([[one.inside(float(level)) for one in shares] for level in LEVELS]).mean(axis=1)
            left.plot(LEVELS, inside - LEVELS, color=colour, linewidth=1.3, label=f"{name} ({len(shares)})")
        spread = 2.0 * np.sqrt(LEVELS * (1.0 - LEVELS) / len(rigs))
        left.fill_between(LEVELS, -spread, spread, color="#999999", alpha=0.25, linewidth=0.0)
        left.axhline(0.0, color="#555555", linewidth=0.8)
        left.legend(fontsize=7)
        style.label(left, "probability of the interval", "share that holds the truth, less that")
        left.set_title("Intervals of all probabilities")
        right.hist(rigs, bins=np.linspace(0.0, 1.0, 11).tolist(), color=style.BLUE, alpha=0.7)
        right.axhline(len(rigs) / 10.0, color="#555555", linewidth=0.8)
        style.label(right, "share of the posterior below the truth", "intervals of rigs")
        right.set_title("Where the truth lies")
        page.savefig(file)


if __name__ == "__main__":
    picture(all_held(), Path(sys.argv[1]) / "rigs.png")
