"""Posteriors drawn: samples of each unknown with its 90 % interval, and the probabilities of models."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from solver.views.plots import style
from solver.views.plots.style import Into


def drawn(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw that of the three which it is."""
    return (_model_choice_figure if "models" in found else _posterior_figure)(found, ax=ax)


def _posterior_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw a histogram of the samples of each unknown; of a population, of assemblies that may come.

    Parameters
    ----------
    found : the JSON of a posterior or a population that has samples.
    """
    of_each = found["middles"] if "middles" in found else found["marginals"]
    samples = np.array(found["samples"], dtype=np.float64)
    with style.styled():
        page, axes = style.figure(3.6 * len(of_each), 3.0, columns=len(of_each), into=ax)
        for one, draws, place in zip(of_each, samples.T, axes, strict=True):
            place.hist(draws, bins=25, color=style.SKY, density=True)
            if one["interval"][0] is not None:
                words = "90 % of the median" if "middles" in found else "90 % interval"
                place.axvspan(*one["interval"], color=style.BLUE, alpha=0.2, linewidth=0.0, label=words)
                place.axvline(one["mean"], color=style.BLUE, linewidth=1.2, label="mean")
            style.label(place, f"{one['name']} [{one['unit'] or '1'}]", "density")
        axes[0].set_title(found["scene"])
        axes[0].legend(fontsize=7.5)
    return page


def _model_choice_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw the probability of each model, on a logarithmic scale.

    Parameters
    ----------
    found : the JSON of a model choice with probabilities.
    """
    names = [one["name"] for one in found["models"]]
    chances = [one["probability"] for one in found["models"]]
    errors = np.minimum([one["probability_error"] for one in found["models"]], 0.9 * np.array(chances))
    with style.styled():
        page, (axes,) = style.figure(5.2, 0.9 + 0.45 * len(names), columns=1, into=ax)
        axes.barh(names, chances, xerr=errors, color=style.SKY, ecolor=style.INK, height=0.6)
        axes.set_xscale("log")
        axes.invert_yaxis()
        style.label(axes, "probability of the model", "")
    return page
