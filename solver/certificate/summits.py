"""Peaks and least peaks proved: where parabolas turn in long numbers, orbits beside and over that place."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from solver.certificate.boxes import boxed, claimed, digits, orbit_at, set_out, settled

if TYPE_CHECKING:
    from solver.response.exact.orbit import Orbit as ExactOrbit
    from solver.response.exact.piecewise import Piecewise

_PEAK_BITS, _LEAST_BITS = 256, 512
_PART = 0.27  # of the bits: half the relative width of the range a peak is proved in
_BESIDE = 1e-16  # likewise of the loads for a least peak, which rises by the square of it
_STEP, _TRIES = 1e-4, 60  # of the parabolas, relative
_FAR = 4.0  # steps gone at once at most


def peak_proved(
    raw: dict[str, Any], piecewise: Piecewise, found: ExactOrbit
) -> dict[str, tuple[float, float]]:
    """Complete a certificate of a peak; return what it claims as floats.

    Raises
    ------
    RejectedError
        It cannot be proved.
    """
    return _in_long_numbers(raw, piecewise, found, "peak", _PEAK_BITS)


def least_proved(
    raw: dict[str, Any], piecewise: Piecewise, found: ExactOrbit
) -> dict[str, tuple[float, float]]:
    """Complete a certificate of the least peak over the loads that vary; as `peak_proved`."""
    return _in_long_numbers(raw, piecewise, found, "least peak", _LEAST_BITS)


def _in_long_numbers(
    raw: dict[str, Any], piecewise: Piecewise, found: ExactOrbit, what: str, bits: int
) -> dict[str, tuple[float, float]]:
    from flint import arb, ctx

    from solver.certificate.checker import prove
    from solver.certificate.proof_work import Counted

    kept = ctx.prec
    try:
        raw["certifies"], raw["bits"], ctx.prec = what, bits, bits
        summits = _Summits(raw, set_out(raw, piecewise, found.pieces))
        if what == "peak":
            raw["proof"] = summits.beside(arb(1))
        else:
            at = _turning(lambda factor: -summits.height(factor), arb(1))
            loads = [at + at * k * arb(_BESIDE) for k in (-1, 0, 1)]
            raw["proof"] = {"three": [summits.beside(load) for load in loads], "over": summits.over_loads(at)}
        bounds = prove(raw, raw["proof"], Counted)
        told = ("peak", "frequency_hz") if what == "peak" else ("least_peak", "load_factor", "frequency_hz")
        return claimed(raw, {name: bounds[name] for name in told})
    finally:
        ctx.prec = kept


def _turning(value: Callable[[Any], Any], at: Any) -> Any:
    """Return where a function is largest, by parabolas through three values ever nearer to each other."""
    from solver.certificate.checker import RejectedError

    step = _STEP
    for _ in range(_TRIES):
        try:
            left, top, right = (value((at + at * k * step).mid()) for k in (-1, 0, 1))
        except RejectedError:  # other events happen there
            if step < _least_step():
                raise
            step /= 8.0
            continue
        bends = left - 2 * top + right
        if not bends < 0:
            raise RejectedError(f"there is no extreme near {float(at):.9g}: it bends by {float(bends):.1e}")
        shift = step * (left - right) / (2 * bends)
        at = (at + at * max(-_FAR * step, min(_FAR * step, shift))).mid()
        if abs(shift) < _half_width() / 100:
            return at
        if abs(shift) < step:
            step = max(step**1.5, _least_step())
    raise RejectedError(f"no extreme was found near {float(at):.9g}")


def _half_width() -> Any:
    """Return half the relative width of the range a peak is proved in."""
    from flint import arb, ctx

    return arb(2) ** int(-_PART * ctx.prec)


def _least_step() -> float:
    """Return the step at which a parabola is off by less than that, and its values still differ enough."""
    return float(float(_half_width()) ** 0.65)


class _Summits:
    """Peaks by frequency for factors of the loads; each begins at the unknowns of the one before."""

    def __init__(self, raw: dict[str, Any], y: list[Any]) -> None:
        from flint import arb

        self.raw, self.y, self.at = raw, y, arb(raw["system"]["frequency_hz"])

    def height(self, factor: Any) -> Any:
        """Return the peak for a factor of the loads."""
        from solver.certificate.checker import least

        def reached(frequency: Any) -> Any:
            orbit = orbit_at(self.raw, frequency_hz=digits(frequency), load_factor=digits(factor))
            self.y, _ = settled(orbit, self.y)
            none = np.zeros(orbit.system.d)
            motion = [each for piece, (_, _, length, *found) in enumerate(orbit.shoot(self.y)[2])
                      for each in orbit.kept(piece, none, length, length, *found)]  # fmt: skip
            high, low = (-least([(sign * p, rest, h) for p, rest, h in motion]) for sign in (-1, 1))
            return high.max(low).mid()

        self.at = _turning(reached, self.at)
        return reached(self.at)

    def beside(self, factor: Any) -> dict[str, Any]:
        """Return orbits over a range about a peak, and below, at and above it."""
        self.height(factor)
        width, three = self.at * _half_width(), []
        over = self._over(digits(factor), f"{digits(self.at)} +/- {(width * 1.01).str(5, radius=False)}")
        for k in (-1, 0, 1):
            where = {"load_factor": digits(factor), "frequency_hz": digits(self.at + k * width)}
            orbit = orbit_at(self.raw, **where)
            self.y, now = settled(orbit, self.y)
            three.append(where | {"unknowns": boxed(orbit, self.y, now)[0]})
        return {"over": over, "three": three}

    def over_loads(self, factor: Any) -> dict[str, Any]:
        """Return an orbit at the peak for a factor, over the loads about it."""
        self.height(factor)
        width = (factor * _BESIDE * 1.01).str(5, radius=False)
        return self._over(f"{digits(factor)} +/- {width}", digits(self.at), _BESIDE)

    def _over(self, factor: str, frequency_hz: str, width: Any = None) -> dict[str, Any]:
        where = {"load_factor": factor, "frequency_hz": frequency_hz}
        box = boxed(orbit_at(self.raw, **where), self.y, _half_width() if width is None else width)[0]
        return where | {"unknowns": box}
