"""Peaks and least peaks proved: where parabolas turn in long numbers, orbits beside and over that place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.lab.proofs.boxes import boxed, claimed, digits, orbit_at, set_out, settled

if TYPE_CHECKING:
    from stickslip.lab.proofs.exact.orbit import Orbit as ExactOrbit
    from stickslip.lab.proofs.exact.piecewise import Piecewise

_PEAK_BITS, _LEAST_BITS = 256, 512
_PART = 0.27  # of the bits: half the relative width of the range a peak is proved in
_BESIDE = 1e-17  # likewise of the loads for a least peak, which rises by the square of it
_STEP, _TRIES = 1e-4, 60  # of the parabolas, relative
_FAR = 4.0  # steps gone at once at most
_FASTER = 1.7  # power of a step that the next one is: a parabola is off by the square, times some number
_OFF = 1e-3  # of the cube of a step: how well what is reached must be known for that
_CLOSE = 1e-5  # a step below which events are in the order they had
_GRID, _NEWTON = 33, 8  # places looked at for the largest of a polynomial; steps from there


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
    from flint import ctx

    from stickslip.lab.proofs.checker import prove
    from stickslip.lab.proofs.proof_work import allowance

    kept = ctx.prec
    try:
        raw["certifies"], raw["bits"], ctx.prec = what, bits, bits
        summits = _Summits(raw, set_out(raw, piecewise, found.pieces))
        told = ("peak", "frequency_hz") if what == "peak" else ("least_peak", "load_factor", "frequency_hz")
        raw["proof"] = summits.peak(_STEP) if what == "peak" else summits.least_peak()
        bounds = prove(raw, raw["proof"], allowance(), summits.extremes)
        return claimed(raw, {name: bounds[name] for name in told})
    finally:
        ctx.prec = kept


def _half_width() -> Any:
    """Return half the relative width of the range a peak is proved in."""
    from flint import arb, ctx

    return arb(2) ** int(-_PART * ctx.prec)


class _Summits:
    """What is reached over the frequency and a factor of the loads, and where it is largest and least."""

    def __init__(self, raw: dict[str, Any], y: list[Any]) -> None:
        from flint import arb, arb_mat

        self.raw, self.bits, self.proved = raw, raw["bits"], dict[tuple[str, ...], Any]()
        self.at, self.y = [arb(raw["system"]["frequency_hz"]), arb(1)], arb_mat([y]).transpose()
        self.rates = [0 * self.y] * 2  # of the unknowns, by frequency and factor
        self.near: Any = None  # the inverse of a derivative that served last
        self.top: tuple[int, int] | None = None  # the piece and the span where most is reached

    def reached(self, at: list[Any], step: float) -> tuple[Any, Any]:
        """Return the largest |x|, as well known as parabolas of this step need it, and the unknowns."""
        from flint import arb_mat, ctx

        enough = _OFF * step**3
        with ctx.workprec(min(self.bits, max(128, math.ceil(-math.log2(enough) * 5 / 3)))):
            orbit, y = self.orbit(at), self.guess(at)
            found, _, self.near = settled(orbit, y.entries(), enough, self.near)
            return self.height(orbit, found, checked=step > _CLOSE), arb_mat([found]).transpose()

    def orbit(self, at: list[Any]) -> Any:
        """Return the orbit at a frequency and a factor."""
        return orbit_at(self.raw, frequency_hz=digits(at[0]), load_factor=digits(at[1]))

    def guess(self, at: list[Any]) -> Any:
        """Return about what the unknowns are."""
        return sum(
            (rate * (new - old) for rate, new, old in zip(self.rates, at, self.at, strict=True)), self.y
        )

    def height(self, orbit: Any, y: list[Any], *, checked: bool) -> Any:
        """Return the largest |x| of an orbit, its inequalities required if it is to be `checked`."""
        from flint import arb, arb_poly

        starts, none = orbit.shoot(y)[2], np.zeros(orbit.system.d)
        if checked or self.top is None:
            motion = [
                (piece, span, each)
                for piece, (_, _, length, *found) in enumerate(starts)
                for span, each in enumerate(orbit.kept(piece, none, length, length, *found, near=True))
            ]
            sizes = [
                np.abs(np.polyval([float(c) for c in p.coeffs()[::-1]], np.linspace(0.0, float(h), _GRID)))
                for _, _, (p, _, h) in motion
            ]
            self.top = motion[max(range(len(motion)), key=lambda k: float(sizes[k].max()))][:2]
        piece, span = self.top
        _, _, length, points, _ = starts[piece]
        terms, _ = orbit.system.series(orbit.during[piece], points[span], length / (len(points) - 1))
        p = arb_poly([(orbit.system.observe * term)[0, 0].mid() for term in terms])
        places = np.linspace(0.0, 1.0, _GRID)
        at = arb(float(places[np.abs(np.polyval([float(c) for c in p.coeffs()[::-1]], places)).argmax()]))
        speed, bend = p.derivative(), p.derivative().derivative()
        for _ in range(_NEWTON):
            at = (at - speed(at) / bend(at)).mid()
        return abs(p(at)).mid()

    def turned(self, count: int, step: float) -> list[Any]:
        """Return where most is reached over the frequency, of which the load makes the least if it varies.

        `count` of both vary. Parabolas through what is reached at ever smaller steps, all of them relative.
        """
        from flint import ctx

        from stickslip.lab.proofs.checker import RejectedError

        least, at = _OFF * float(_half_width()) ** 0.5, list(self.at)
        for _ in range(_TRIES):
            try:
                slope, bends = self.parabola(at, count, step)
            except RejectedError:  # other events happen there
                if step <= least:
                    raise
                step /= 8.0
                continue
            if not (bends[0, 0] < 0 and (count == 1 or bends.det() < 0)):
                told = f"it bends by {', '.join(f'{float(bends[i, i]):.1e}' for i in range(count))}"
                raise RejectedError(f"there is no extreme near {float(at[0]):.9g}: {told}")
            shift = [-each for each in bends.solve(slope).entries()]
            far = max(abs(float(each)) for each in shift) / step
            for i, each in enumerate(shift):
                at[i] = (at[i] + at[i] * each * min(1.0, _FAR / far if far else 1.0)).mid()
            if far <= 1.0:
                if step <= least:
                    with ctx.workprec(self.bits):
                        self.y, self.at = self.guess(at), list(at)
                        return at
                step = max(step**_FASTER, least)
        raise RejectedError(f"no extreme was found near {float(at[0]):.9g}")

    def parabola(self, at: list[Any], count: int, step: float) -> tuple[Any, Any]:
        """Return the slope of what is reached by relative changes of the first `count` places, its bends."""
        from flint import arb_mat

        def beside(*shift: int) -> tuple[Any, Any]:
            return self.reached([(x + x * k * step).mid() for x, k in zip(at, shift, strict=True)], step)

        middle, self.y = beside(0, 0)
        self.at, slope, bends, highs = list(at), arb_mat(count, 1), arb_mat(count, count), list[Any]()
        for i in range(count):
            (low, before), (high, after) = (beside(*(way * (i == k) for k in range(2))) for way in (-1, 1))
            slope[i, 0], bends[i, i] = (high - low) / (2 * step), (low - 2 * middle + high) / step**2
            self.rates[i] = (after - before) * (1 / (2 * step * at[i]))
            highs.append(high)
        if count == 2:
            bends[0, 1] = bends[1, 0] = (beside(1, 1)[0] - sum(highs) + middle) / step**2
        return slope, bends

    def peak(self, step: float) -> dict[str, Any]:
        """Return orbits over a range about a peak for the factor there is, and below, at and above it."""
        at, factor = self.turned(1, step)
        half = _half_width()
        over = self.enclosed([at, factor], [at * half, 0])
        return {"over": over, "three": [self.enclosed([at + k * at * half, factor]) for k in (-1, 0, 1)]}

    def least_peak(self) -> dict[str, Any]:
        """Return three peaks whose middle one is the least, and an orbit at its frequency over all loads."""
        at, factor = self.turned(2, _STEP)
        three, over = list[Any](), self.enclosed([at, factor], [0, factor * _BESIDE])
        for beside in (factor - factor * _BESIDE, factor, factor + factor * _BESIDE):
            self.y, self.at = self.guess([at, beside]), [at, beside.mid()]
            three.append(self.peak(_BESIDE))
        return {"over": over, "three": three}

    def enclosed(self, at: list[Any], widths: Any = (0, 0)) -> dict[str, Any]:
        """Return an orbit at a frequency and a factor, or over a range of one of them."""
        where = {
            name: digits(place) + (f" +/- {(width * 1.01).str(5, radius=False)}" if width else "")
            for name, place, width in zip(("frequency_hz", "load_factor"), at, widths, strict=True)
        }
        orbit, y, now = orbit_at(self.raw, **where), self.guess(at).entries(), 0.0
        if not any(widths):
            y, now, self.near = settled(orbit, y, near=self.near)
        box, self.proved[tuple(where.values())] = boxed(orbit, y, now)
        return where | {"unknowns": box}

    def extremes(self, _work: Any, _raw: Any, at: dict[str, str]) -> Any:
        """Return the extremes and the period of an orbit that is proved."""
        return self.proved[at["frequency_hz"], at["load_factor"]]
