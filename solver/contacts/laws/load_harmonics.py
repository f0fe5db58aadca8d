"""The normal load as a Fourier list, `load = [N0, {order, amplitude, phase}, …]`: harmonics and their paths.

N0, N1 and N1_phase are fields of their own; the list keeps the harmonics from the second on.

The coefficients of a load are N0, N_k cos(phase_k), −N_k sin(phase_k); N1 = N1_ratio·N0 where it is tied.
Their derivatives by parameters follow from those of the rows of the contact table.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from numbers import Real as Number
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from solver.contacts.fields import Angle, Part, Real, Signed
from solver.contacts.kernels.columns import COLUMNS, N0, N1, PHASE, RATIO, wave_column
from solver.contacts.laws.contact_parts import LawQuantity

MOST_ORDER = 1000
_PATH = re.compile(r"N([1-9]\d{0,3})(_phase)?")

Order = Annotated[int, Field(strict=True, ge=1, le=MOST_ORDER)]


class LoadHarmonic(Part):
    """A harmonic of a normal load: amplitude * cos(order * omega t + phase)."""

    order: Annotated[Order, "Its multiple of the frequency."]
    amplitude: Annotated[Signed, "Amplitude [N]."]
    phase: Annotated[Angle, "Phase [rad]."] = 0.0

    def in_sector(self, turn: float, *, standing: bool) -> LoadHarmonic:
        """Return it in a sector that the wave's first harmonic reaches an angle later [rad]."""
        angle = self.order * turn
        changed = (
            {"amplitude": self.amplitude * math.cos(angle)} if standing else {"phase": self.phase + angle}
        )
        return self.model_copy(update=changed)

    def times(self, factor: float) -> LoadHarmonic:
        """Return it with its amplitude times a factor."""
        return self.model_copy(update={"amplitude": factor * self.amplitude})


def order_of(key: str) -> int | None:
    """Return the harmonic from the second on that a parameter such as ``N3`` or ``N3_phase`` is of."""
    found = _PATH.fullmatch(key)
    order = int(found[1]) if found else 0
    return order if 2 <= order <= MOST_ORDER else None


def is_phase(key: str) -> bool:
    """Return whether a parameter is the phase of a harmonic of the load."""
    return key.endswith("_phase") and (key == "N1_phase" or order_of(key) is not None)


def is_of_variation(key: str) -> bool:
    """Return whether a parameter is of the part of the load that varies."""
    return key in ("N1", "N1_ratio") or is_phase(key) or order_of(key) is not None


def higher_quantity(key: str) -> LawQuantity:
    """Return what amplitude or phase of a harmonic from the second on is."""
    order = order_of(key) or 0
    if key.endswith("_phase"):
        return LawQuantity(
            column=wave_column(order) + 1, unit="rad", wanted="must be a number from -1e4 to 1e4 [rad]",
            by_hand=False,
        )  # fmt: skip
    odd = bool(order % 2)
    return LawQuantity(
        column=wave_column(order), unit="N", wanted="must be a number from -1e15 to 1e15 [N]",
        unlike_half_waves="changes the variation of a normal load" if odd else "", breaks_symmetry=odd,
        varies_load=True, load_order=order, by_hand=False,
    )  # fmt: skip


def named_apart(data: Any) -> Any:
    """Return the keys of a contact with N0, N1 and N1_phase taken from the list of its load."""
    given = data.get("load") if isinstance(data, Mapping) else None
    if not isinstance(given, Sequence) or isinstance(given, str):
        return data
    found: dict[str, Any] = {}
    if given and _is_number(given[0]):
        found["N0"] = given[0]
    for each in given:
        if isinstance(each, Mapping) and each.get("order") == 1 and "N1" not in found:
            found |= {"N1": each.get("amplitude", 0.0), "N1_phase": each.get("phase", 0.0)}
    beside = ("N0", *(("N1", "N1_ratio", "N1_phase") if "N1" in found else ()))
    twice = [key for key in beside if data.get(key) is not None and (key != "N0" or "N0" in found)]
    if twice:
        raise ValueError(
            f"`load` of contact `{data.get('name')}` has what `{twice[0]}` says: leave out the key or the "
            f"entry, got {twice[0]} = {data[twice[0]]!r} and load = {list(given)!r}"
        )
    return {**data, **found}


def as_harmonics(given: Any) -> Any:
    """Return the list of a load with a harmonic of order 1 in the place of its mean: each keeps its place."""
    if not isinstance(given, Sequence) or isinstance(given, str):
        return given
    orders: set[object] = set()
    for i, each in enumerate(given):
        if _is_number(each) and i > 0:
            raise ValueError(
                f"`load` must have its mean first and then tables, got {each!r} in place {i + 1}"
            )
        order = each.get("order") if isinstance(each, Mapping) else getattr(each, "order", None)
        if order is not None and order in orders:
            raise ValueError(f"`load` must have one entry of each order, got order {order!r} twice")
        orders.add(order)
    return [{"order": 1, "amplitude": 0.0} if _is_number(each) else each for each in given]


def _is_number(value: object) -> bool:
    return isinstance(value, Number) and not isinstance(value, bool)


def load_slopes(rows: Real, slope: Real, column: int) -> Real:
    """Return the derivatives of the loads, (nc, 1 + 2 K), by a parameter that changes a column of the table.

    A path of N1 unties it from N0, one of N1_ratio ties it: what N1 follows by is filled into `slope`.

    Parameters
    ----------
    rows, slope : (nc, ·) the contact table and its derivative by the parameter.
    """
    if column == N0:
        slope[:, N1] = np.nan_to_num(rows[:, RATIO]) * slope[:, N0]
    elif column == RATIO:
        slope[:, N1] = rows[:, N0] * slope[:, RATIO]
    found = [slope[:, N0]]
    for size, phase in _waves(rows):
        cosine, sine = np.cos(rows[:, phase]), np.sin(rows[:, phase])
        found.append(slope[:, size] * cosine - rows[:, size] * sine * slope[:, phase])
        found.append(-slope[:, size] * sine - rows[:, size] * cosine * slope[:, phase])
    return np.stack(found, axis=1)


def _waves(rows: Real) -> list[tuple[int, int]]:
    """Return the columns of amplitude and phase of every harmonic of the loads."""
    return [(N1, PHASE), *((column, column + 1) for column in range(COLUMNS, rows.shape[1], 2))]


def contradicting(rows: Real, slopes: Real) -> NDArray[np.bool_]:
    """Return, (nc,), where parameters of one load contradict each other.

    N1_ratio ties N1 to N0 and N1 unties it: what both, or N0 beside one that changes this, mean together is
    not one function of the parameters.
    """
    tied = ~np.isnan(rows[:, RATIO])
    by_mean, by_ratio = (np.any(slopes[:, :, column] != 0.0, axis=0) for column in (N0, RATIO))
    by_amplitude = np.any((slopes[:, :, N1] != 0.0) & (slopes[:, :, [N0, RATIO]] == 0.0).all(axis=2), axis=0)
    clash = (by_ratio & by_amplitude) | (by_mean & by_amplitude & tied) | (by_mean & by_ratio & ~tied)
    return np.asarray(clash)


def second_loads(rows: Real, slopes: Real) -> Real:
    """Return ∂²N/∂p_i∂p_j, (n_paths, n_paths, nc, 1 + 2 K), from the slopes (n_paths, nc, ·) of the rows."""

    def pair(one: int, other: int) -> Real:
        product = np.einsum("ic,jc->ijc", slopes[..., one], slopes[..., other])
        return np.asarray(product + product.transpose(1, 0, 2))

    tied = pair(N0, RATIO)
    found = [np.zeros(tied.shape)]
    for size, phase in _waves(rows):
        cosine, sine = np.cos(rows[:, phase]), np.sin(rows[:, phase])
        turned = pair(size, phase)
        along = (tied if size == N1 else 0.0) - rows[:, size] * 0.5 * pair(phase, phase)
        found += [along * cosine - turned * sine, -along * sine - turned * cosine]
    return np.stack(found, axis=-1)
