"""The front of peak against resonance band."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from matplotlib.figure import Figure

from service import units
from service.plots import style
from service.plots.curves import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Front:
    """What is drawn of a front.

    Attributes
    ----------
    scene, dof : str
        Name of the scene and the observed DOF.
    band_hz, peak, slope : (n,) arrays
        Width of the band [Hz], highest peak [m], d peak / d band [m/Hz] (NaN where there is none).
    dominated : (m, 2) array
        Band and peak of designs that another one beats in both.
    knee : int or None
        Which point lies farthest below the line between the ends.
    words : tuple of str
        The design of every point.
    """

    scene: str
    dof: str
    band_hz: FloatArray
    peak: FloatArray
    slope: FloatArray
    dominated: FloatArray
    knee: int | None
    words: tuple[str, ...]

    @classmethod
    def of_json(cls, found: Mapping[str, Any]) -> Self:
        """The front of a result with at least one point."""
        points = found["points"]
        slopes = [np.nan if point["slope"] is None else point["slope"] for point in points]
        beaten = [(point["band_hz"], point["peak"]) for point in found["dominated"]]
        return cls(
            scene=found["scene"],
            dof=found["dof"],
            band_hz=np.array([point["band_hz"] for point in points]),
            peak=np.array([point["peak"] for point in points]),
            slope=np.array(slopes),
            dominated=np.array(beaten).reshape(len(beaten), 2),
            knee=found["knee"],
            words=tuple(
                ", ".join(f"{name} {style.quantity(name, value, 4)}" for name, value in p["values"].items())
                for p in points
            ),
        )


def front_figure(front: Front) -> Figure:
    """The points with the tangents that their multipliers give, ends and knee named."""
    unit = units.length_unit(float(front.peak.max()))
    height = front.peak * unit.per_metre
    with style.styled():
        page, (axes,) = style.figure(6.0, 3.8)
        axes.plot(front.band_hz, height, color=style.BLUE, marker="o", markersize=4.5)
        # Of the same length on paper, however steep.
        wide, tall = (max(float(np.ptp(values)), 1e-12) for values in (front.band_hz, height))
        for x, y, slope in zip(front.band_hz, height, front.slope * unit.per_metre, strict=True):
            if np.isfinite(slope):
                ends = np.array([-0.05, 0.05]) * wide / np.hypot(1.0, slope * wide / tall)
                axes.plot(x + ends, y + slope * ends, color=style.GREY, linewidth=0.9, zorder=1)
        if len(front.dominated):
            bands, peaks = front.dominated.T
            axes.plot(bands, peaks * unit.per_metre, color=style.GREY, marker="x", linestyle="none")
        last = len(height) - 1
        for index in {0, last} | ({front.knee} if front.knee is not None else set()):
            # Beside the curve: to the right of what lies high, above what lies low.
            side = "right" if index == 0 and last else "left"
            axes.annotate(
                front.words[index], (front.band_hz[index], height[index]), ha=side, va="bottom",
                xytext=(-4 if side == "right" else 5, 5), textcoords="offset points",
                color=style.VERMILION if index == front.knee else style.INK,
            )  # fmt: skip
        if front.knee is not None:
            at = (front.band_hz[front.knee], height[front.knee])
            axes.plot(*at, color=style.VERMILION, marker="o", markersize=7.0, zorder=5)
        axes.margins(x=0.08, y=0.14)
        style.label(axes, "resonance band [Hz]", f"highest peak, max |{front.dof}| [{unit.name}]")
        axes.set_title(front.scene)
    return page
