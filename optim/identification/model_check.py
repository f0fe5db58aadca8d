"""Whether the model describes the data: what a fit leaves over must be noise, and nothing else.

Four tests of the residuals, each at a level of `_LEVEL` shared among all it tries:

- runs: residuals of one sign that follow each other along a curve (Wald, Wolfowitz, Ann. Math. Stat. 11
  (1940) 147), of all curves together;
- one-sided: the mean of the residuals of a curve, by Student's t;
- outliers: residuals too large for a normal distribution (Grubbs, Ann. Math. Stat. 21 (1950) 27), unless
  the fit was to bear them;
- score: whether something the fit holds fixed would lower the residuals (Rao, Proc. Camb. Phil. Soc. 44
  (1948) 50): every other parameter of the scene, parts without a name as well, the scale of what was
  measured (rms for peak values), harmonics left out, an unknown beyond its bound. Linearised at the
  optimum, by an F of one and N − p − 1 degrees of freedom. It names what would explain the data best.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from optim.identification.fit import HUBER, LocalFit, Runs
from optim.problem.variables import Real
from solver.balance.balance import build
from solver.balance.parameter_derivatives import reason_without
from solver.balance.simplifications import Effects
from solver.scene.matrices_structure import MatricesStructure
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import even_harmonics_reason
from solver.scene.scene_records import Damper, Mass, Spring

_LEVEL = 2.5e-3  # probability by which each test doubts a model that is right
_FEWEST = 8  # residuals of a curve from which their order says something
_UNSEEN = 1.0  # standard error of a relative change from which the data do not see it
_EXACT = 1e-3  # relative residuals below which they are the harmonics left out of data that were computed
_BOUND = 1e-6  # scaled distance from a bound within which an unknown lies on it
_TINY = 1e-9  # of the largest singular value, below which a direction is none


@dataclass(frozen=True, slots=True, kw_only=True)
class _Direction:
    """Something the fit holds fixed: how the predictions move with a relative change of it."""

    words: str
    rows: Real


def doubts(runs: Runs, best: LocalFit, *, robust: bool) -> str:
    """Return the likeliest reason why the model does not describe the data; empty if it does.

    Parameters
    ----------
    runs : the data and their models.
    best : the fit.
    robust : whether outliers were to weigh less: they then count no more here.
    """
    if best.level <= _EXACT:
        return ""
    rest = np.full(runs.observations.size, np.nan)
    rest[best.active] = best.residuals(runs.observations)
    if robust:
        rest = np.clip(rest, -HUBER, HUBER)
    every = [
        curve[np.isfinite(curve)]
        for run, part in zip(runs.runs, runs.slices, strict=True)
        for curve in run.curves(rest[part])
    ]
    curves = [curve for curve in every if curve.size >= _FEWEST]
    explained = _explanation(runs, best, rest)
    far = "" if robust else _outliers(rest[best.active], len(runs.unknowns))
    # What would explain the data says most; the others are signs of what is not named.
    found = next((told for told in (explained, far, _one_side(curves), _one_sign(curves)) if told), "")
    return f"{found} Intervals would say nothing." if found else ""


def _one_sign(curves: list[Real]) -> str:
    """Return that residuals hang together, if there are too few runs of one sign."""
    runs = wanted = spread = 0.0
    for curve in curves:
        above = curve > 0.0
        n, up = above.size, int(above.sum())
        mixed = 2.0 * up * (n - up)
        runs += 1 + np.count_nonzero(above[1:] != above[:-1])
        wanted += 1.0 + mixed / n
        spread += mixed * (mixed - n) / (n * n * (n - 1))
    if spread <= 0.0:
        return ""
    from scipy.stats import norm

    if norm.cdf((runs + 0.5 - wanted) / math.sqrt(spread)) > _LEVEL:
        return ""
    return (
        f"The residuals hang together: {runs:.0f} runs of one sign along the curves, where noise would "
        f"have {wanted:.0f}."
    )


def _one_side(curves: list[Real]) -> str:
    """Return that a curve lies to one side of the fit."""
    from scipy.stats import t

    for curve in curves:
        n, spread = curve.size, float(curve.std(ddof=1))
        mean = float(curve.mean())
        # The spread of a curve that is followed closely says little; the noise of all is 1.
        if t.sf(abs(mean) * math.sqrt(n) / max(spread, 1.0), n - 1) < 0.5 * _LEVEL / len(curves):
            side = "above" if mean > 0.0 else "below"
            return f"The fit lies {side} the data along a whole curve of {n} points."
    return ""


def _outliers(rest: Real, fitted: int) -> str:
    """Return that some residuals are too large for noise."""
    from scipy.stats import t

    degrees = rest.size - fitted
    if degrees < _FEWEST:
        return ""
    squares = rest**2 * degrees / float(np.sum(rest**2))
    # A residual over the root of the mean square of all: one that is all of them would be √degrees.
    student = np.sqrt(squares * (degrees - 1) / np.maximum(degrees - squares, 1e-300))
    far = int(np.sum(2.0 * rest.size * t.sf(student, degrees - 1) < _LEVEL))
    if not far:
        return ""
    return (
        f"{far} of {rest.size} numbers measured lie too far off for noise: outliers (`robust`), or the model."
    )


def _explanation(runs: Runs, best: LocalFit, rest: Real) -> str:
    """Return what would lower the residuals by more than chance, the best of it."""
    from scipy.stats import f

    z = best.fitted.z
    free = (z > _BOUND) & (z < 1.0 - _BOUND)
    jacobian, names = best.fitted.jacobian, runs.unknowns.names
    beyond = [
        _Direction(words=f"{names[i]} were beyond its bound ({{}} of their range)", rows=jacobian[:, i])
        for i in np.flatnonzero(~free)
    ]
    scale = _Direction(
        words="all that was measured were scaled, {}: rms in place of peak values, a sensor, or the "
        "excitation",
        rows=best.fitted.values,
    )
    directions = [*beyond, *_others(runs, best), scale, *_harmonics(runs, best)]
    used = best.active & np.isfinite(np.array([each.rows for each in directions])).all(axis=0)
    sd, rest = best.sd[used], rest[used]
    basis, sizes, _ = np.linalg.svd(jacobian[used][:, free] / sd[:, None], full_matrices=False)
    basis = basis[:, sizes > _TINY * max(sizes.max(initial=0.0), 1e-300)]
    rest = rest - basis @ (basis.T @ rest)
    degrees = rest.size - basis.shape[1] - 1
    tried: list[tuple[float, str]] = []
    for each in directions:
        rows = each.rows[used] / sd
        rows = rows - basis @ (basis.T @ rows)
        size = float(rows @ rows)
        if degrees < 1 or size * _UNSEEN**2 < 1.0:
            continue
        change = -float(rows @ rest) / size
        gain, left = change * change * size, float(rest @ rest)
        ratio = gain * degrees / max(left - gain, 1e-300)
        told = f"{abs(100.0 * change):.2g} % {'larger' if change > 0.0 else 'smaller'}"
        tried.append((float(f.sf(ratio, 1, degrees)), each.words.format(told)))
    tried.sort()
    if not tried or tried[0][0] * len(tried) > _LEVEL:
        return ""
    return f"The residuals look as if {tried[0][1]}."


def _others(runs: Runs, best: LocalFit) -> list[_Direction]:
    """Return every parameter with a derivative that was not looked for, with relative changes of each."""
    here = _all_named(runs.scene.with_values(runs.unknowns.by_path(best.fitted.z)))
    effects = Effects(even_harmonics=even_harmonics_reason(here, here.parameter_paths()) is not None)
    balance = build(here, harmonics=runs.harmonics, effects=effects)
    others = (path for path in here.parameter_paths() if path not in runs.unknowns.paths)
    paths = tuple(path for path in others if not reason_without(here, balance, path))
    blocks = []
    for run, part in zip(runs.runs, runs.slices, strict=True):
        under = here.with_values(dict(run.conditions))
        found = run.model(under, paths, runs.harmonics).evaluate({})
        slopes = found.slopes * np.array([under.value(path) or 1.0 for path in paths])
        # The solution of another branch says nothing of this one.
        same = np.abs(found.values - best.fitted.values[part]) <= 0.1 * best.sd[part]
        blocks.append(np.where((same & found.reached)[:, None] | ~best.active[part, None], slopes, np.nan))
    rows = np.concatenate(blocks)
    seen = np.isfinite(rows[best.active]).any(axis=0)
    return [_Direction(words=f"{path} were {{}}", rows=rows[:, i]) for i, path in enumerate(paths) if seen[i]]


def _all_named(scene: Scene) -> Scene:
    """Return a scene whose masses, springs and dampers all have names, so that each is a parameter."""
    structure = scene.structure
    if isinstance(structure, MatricesStructure):
        return scene

    def named(part: Mass | Spring | Damper) -> Mass | Spring | Damper:
        place = part.dof if isinstance(part, Mass) else "-".join(part.between)
        return (
            part if part.name else part.model_copy(update={"name": f"{type(part).__name__.lower()} {place}"})
        )

    parts = {kind: tuple(map(named, getattr(structure, kind))) for kind in ("masses", "springs", "dampers")}
    return scene.model_copy(update={"structure": structure.model_copy(update=parts)})


def _harmonics(runs: Runs, best: LocalFit) -> list[_Direction]:
    """Return what twice the harmonics would change."""
    more = Runs(runs.scene, runs.runs, runs.unknowns, 2 * runs.harmonics + 1)
    found = more.at(best.fitted.z)
    rows = np.where(found.reached, found.values - best.fitted.values, np.nan)
    if not np.isfinite(rows[best.active]).all() or not rows[best.active].any():
        return []
    return [_Direction(words="harmonics were left out: take more ({} of what twice as many add)", rows=rows)]
