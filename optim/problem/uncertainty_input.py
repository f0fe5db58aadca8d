"""Reading what is uncertain: intervals, ellipsoids, samples and mistuned disks, checked against a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import gammaincinv

from optim.problem.cases import LoadCase, displaced
from optim.problem.checks import DesignError, is_number, positive, share
from optim.problem.uncertainty_set import Coordinate, Disk, How, Scenario, UncertainSet, UncertaintyShape
from optim.problem.variables import BoundedVariable, Real
from solver.balance.balance import Kind, resolve
from solver.errors import Place, at
from solver.scene.parameter_paths import STRUCTURE
from solver.scene.scene import Scene

ELLIPSOID = ("centre", "relative", "paths", "half_axes", "shape", "covariance", "confidence", "mistuning")
MISTUNING = ("of", "spread", "seeds", "values", "within")
CONFIDENCE = 0.95
LARGEST = 0.9  # deviation of a factor
_DEVIATIONS = {"deviation": How.RELATIVE, "absolute_deviation": How.OFFSET}
_INTERVAL = 'must be [low, high], {"deviation": 0.1} or {"absolute_deviation": 5.0}'
_WHERE: Place = ("uncertain",)
_FORM = "must be a table of intervals, a table of an ellipsoid, or a list of samples"


def read_uncertain(
    scene: Scene, variables: Sequence[BoundedVariable], uncertain: object, cases: Sequence[LoadCase] = ()
) -> UncertainSet:
    """Return the set of scenarios of a description.

    Parameters
    ----------
    scene : what is designed.
    variables : what may be chosen; of these only deviations can be uncertain.
    uncertain : one of

        - intervals ``{path: [low, high]}``, ``{path: {"deviation": 0.1}}`` (±10 % of the nominal value, or
          [low, high]), ``{path: {"absolute_deviation": 5.0}}``; paths that share a value separated by commas;
        - an ellipsoid ``{"centre": {path: value}, "half_axes": {path: length}}``, or with a matrix ``shape``
          P, (x − c)ᵀ P⁻¹ (x − c) ≤ 1, or a ``covariance`` with the ``confidence`` its ellipsoid has. Without
          a centre the numbers are deviations from the nominal values, with ``relative`` relative ones (a
          matrix then needs ``paths``);
        - samples, a list of ``{path: value}`` or ``{path: {"deviation": …}}``;
        - what an identification found: the result, of which ``uncertain`` counts.

        Intervals and ellipsoids may have ``mistuning`` on top: ``{"of": …, "spread": 0.01, "seeds": [1, 2]}``
        or ``{"of": …, "values": [[factor of each sector], …]}``. ``{"of": …, "within": 0.03}``, with
        intervals or alone, leaves every blade a factor from 0.97 to 1.03.
    cases : the load cases: of what one sets only deviations can be uncertain.

    Raises
    ------
    DesignError, SettingError, SceneError
        What is wrong: the key, the value, and what would be right.
    """
    uncertain = getattr(uncertain, "uncertain", uncertain)
    chosen = {path for variable in variables for path in variable.paths}
    if isinstance(uncertain, Mapping) and uncertain:
        mistuning = uncertain.get("mistuning")
        if isinstance(mistuning, Mapping) and "within" in mistuning:
            found = _free_blades(scene, chosen, uncertain, mistuning)
            _check_extent(scene, variables, cases, found)
            return found
        disks = _disks(scene, mistuning, _WHERE)
        ellipsoid = any(key in uncertain for key in ("half_axes", "shape", "covariance", "centre"))
        found = (_ellipsoid if ellipsoid else _intervals)(scene, chosen, uncertain, disks)
    elif isinstance(uncertain, Sequence) and not isinstance(uncertain, str) and uncertain:
        listed = tuple(_sample(scene, chosen, i, table) for i, table in enumerate(uncertain))
        found = UncertainSet(shape=UncertaintyShape.LIST, listed=listed)
    else:
        raise DesignError("uncertain", uncertain, _FORM)
    _check_extent(scene, variables, cases, found)
    return found


def _coordinate(scene: Scene, chosen: set[str], name: object, how: How, where: Place = _WHERE) -> Coordinate:
    """Return a coordinate whose paths exist and may be given in this way."""
    paths = tuple(part.strip() for part in str(name).split(","))
    tied = {
        f"{owner}.N1"
        for contact in scene.contacts
        if contact.load is not None and contact.load.ratio is not None
        for owner in (contact.name, contact.group)
    }
    for path in paths:
        with at(*where, str(name)):
            kind = resolve(scene, path).kind
        if kind is Kind.FREQUENCY:
            wanted = "cannot be the frequency: the band of the scene is searched"
            raise DesignError("uncertain", path, wanted, place=(*where, str(name)))
        if how is How.VALUE and path in chosen:
            wanted = 'is a variable: give a deviation from the design, {"deviation": 0.1}'
            raise DesignError((*_WHERE, str(name)), path, wanted, place=(*where, str(name)))
        if how is not How.VALUE and path in tied:
            wanted = f"is tied to N0: give the deviation of {path}_ratio instead"
            raise DesignError((*_WHERE, str(name)), path, wanted, place=(*where, str(name)))
    return Coordinate(name=str(name), paths=paths, how=how)


def _intervals(
    scene: Scene, chosen: set[str], table: Mapping[str, object], disks: tuple[Disk, ...]
) -> UncertainSet:
    coordinates, ends = [], []
    for name, given in table.items():
        if name == "mistuning":
            continue
        how, both = _interval((*_WHERE, str(name)), given)
        coordinates.append(_coordinate(scene, chosen, name, how))
        ends.append(both)
    _no_path_twice(coordinates)
    return UncertainSet(
        shape=UncertaintyShape.BOX, coordinates=tuple(coordinates),
        centre=tuple(0.5 * (low + high) for low, high in ends),
        axes=_nested(np.diag([0.5 * (high - low) for low, high in ends])), ends=tuple(ends), disks=disks,
    )  # fmt: skip


def _free_blades(
    scene: Scene, chosen: set[str], table: Mapping[str, object], mistuning: Mapping[str, object]
) -> UncertainSet:
    """Return intervals, and the factor of every blade within bounds as one more each."""
    where, within = (*_WHERE, "mistuning"), mistuning["within"]
    if set(mistuning) != {"of", "within"} or any(key in ELLIPSOID[:-1] for key in table):
        raise DesignError(where, dict(mistuning), "must be `of` and `within` alone, beside intervals if any")
    if not is_number(within) or not 0.0 < within <= LARGEST:
        raise DesignError((*where, "within"), within, f"must be a number > 0 and <= {LARGEST}")
    count = scene.structure.sector_count
    (ones,) = _disks(scene, {"of": mistuning["of"], "values": [1.0] * count}, _WHERE)
    disk = replace(ones, free=True)
    rows = disk.paths(scene)
    if not rows:
        raise DesignError(where, dict(mistuning), "needs a structure of named parts: matrices have none")
    plain = _intervals(scene, chosen, table, ())
    for path in dict.fromkeys(path.partition("@")[0] for row in rows for path in row):
        if path in chosen or path in plain.paths:
            wanted = "is what every blade has a factor of: it cannot be a variable or uncertain besides"
            raise DesignError((*where, "of"), path.removeprefix(STRUCTURE), wanted)
    blades = tuple(Coordinate(name=f"blade {j}", paths=(), how=How.FACTOR) for j in range(count))
    reach = [*np.diag(np.array(plain.axes).reshape(2 * (len(plain.ends),))), *([within] * count)]
    return replace(
        plain, coordinates=(*plain.coordinates, *blades), centre=(*plain.centre, *([0.0] * count)),
        axes=_nested(np.diag(reach)), ends=(*plain.ends, *([(-within, within)] * count)), blades=disk.of,
    )  # fmt: skip


def _interval(where: Place, given: object) -> tuple[How, tuple[float, float]]:
    """Return what an interval means and its ends."""
    if not isinstance(given, Mapping):
        return How.VALUE, _ends(where, given)
    if len(given) != 1 or next(iter(given)) not in _DEVIATIONS:
        raise DesignError(where, given, _INTERVAL)
    (key, wide), *_ = given.items()
    if is_number(wide):
        if wide <= 0.0:
            raise DesignError((*where, key), wide, "must be > 0, or [low, high]")
        return _DEVIATIONS[key], (-float(wide), float(wide))
    return _DEVIATIONS[key], _ends((*where, key), wide)


def _ends(where: Place, given: object) -> tuple[float, float]:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
        raise DesignError(where, given, _INTERVAL)
    if not all(is_number(value) for value in given) or not given[0] < given[1]:
        raise DesignError(where, given, "must be two finite numbers, low < high")
    return float(given[0]), float(given[1])


def _ellipsoid(
    scene: Scene, chosen: set[str], table: Mapping[str, object], disks: tuple[Disk, ...]
) -> UncertainSet:
    for key in table:
        if key not in ELLIPSOID:
            raise DesignError((*_WHERE, key), table[key], f"is not known of an ellipsoid: {ELLIPSOID}")
    form = [key for key in ("half_axes", "shape", "covariance") if key in table]
    if len(form) != 1:
        raise DesignError("uncertain", dict(table), "must have one of half_axes, shape, covariance")
    relative = table.get("relative", False)
    if not isinstance(relative, bool) or (relative and "centre" in table):
        raise DesignError((*_WHERE, "relative"), relative, "must be true or false, and has no centre")
    how = How.RELATIVE if relative else How.VALUE if "centre" in table else How.OFFSET
    names = _names(table)
    coordinates = tuple(_coordinate(scene, chosen, name, how) for name in names)
    _no_path_twice(coordinates)
    centre = (
        _numbers((*_WHERE, "centre"), table["centre"]) if "centre" in table else dict.fromkeys(names, 0.0)
    )
    if form == ["half_axes"]:
        lengths = _numbers((*_WHERE, "half_axes"), table["half_axes"])
        if set(lengths) != set(names) or min(lengths.values()) <= 0.0:
            raise DesignError((*_WHERE, "half_axes"), lengths, f"must be numbers > 0 for {', '.join(names)}")
        axes, reach = np.diag([lengths[name] for name in names]), 1.0
    else:
        reach = _confidence(table, len(names))
        axes = reach * _root((*_WHERE, form[0]), table[form[0]], len(names))
    return UncertainSet(
        shape=UncertaintyShape.NORMAL if form == ["covariance"] else UncertaintyShape.BALL,
        coordinates=coordinates, centre=tuple(centre[name] for name in names), axes=_nested(axes),
        deviations=reach, disks=disks,
    )  # fmt: skip


def _names(table: Mapping[str, object]) -> list[str]:
    """Return the order of the coordinates of an ellipsoid."""
    for key in ("centre", "half_axes"):
        if key in table:
            return list(_numbers((*_WHERE, key), table[key]))
    names = table.get("paths")
    if not isinstance(names, Sequence) or isinstance(names, str) or not names:
        raise DesignError((*_WHERE, "paths"), names, "must list the paths in the order of the matrix")
    return [str(name) for name in names]


def _numbers(where: Place, table: object) -> dict[str, float]:
    if not isinstance(table, Mapping) or not table:
        raise DesignError(where, table, "must be a table of parameter paths and numbers")
    for name, value in table.items():
        if not is_number(value):
            raise DesignError((*where, name), value, "must be a finite number")
    return {str(name): float(value) for name, value in table.items()}


def _confidence(table: Mapping[str, object], n: int) -> float:
    """Return the radius of the ellipsoid in standard deviations; 1 for a shape matrix."""
    if "covariance" not in table:
        if "confidence" in table:
            raise DesignError((*_WHERE, "confidence"), table["confidence"], "needs a covariance")
        return 1.0
    confidence = share((*_WHERE, "confidence"), table.get("confidence", CONFIDENCE))
    return math.sqrt(2.0 * float(gammaincinv(0.5 * n, confidence)))


def _root(where: Place, given: object, n: int) -> Real:
    """Return A with A Aᵀ = the matrix."""
    try:
        matrix = np.array(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise DesignError(where, given, f"must be a matrix of {n} rows of {n} numbers") from error
    if matrix.shape != (n, n) or not np.all(np.isfinite(matrix)) or not np.allclose(matrix, matrix.T):
        raise DesignError(where, given, f"must be a symmetric matrix of {n} rows of {n} numbers")
    # The units of the coordinates differ by many decades: judged in units in which the diagonal is 1.
    units = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    if np.any(units == 0.0):
        raise DesignError(where, given, "must be positive definite")
    values, vectors = np.linalg.eigh(matrix / np.outer(units, units))
    if values.min() <= 1e-12:
        raise DesignError(where, given, "must be positive definite")
    return np.asarray(units[:, None] * vectors * np.sqrt(values))


def _sample(scene: Scene, chosen: set[str], index: int, table: object) -> Scenario:
    where: Place = (*_WHERE, index)
    if not isinstance(table, Mapping):
        raise DesignError(where, table, "must be a table of parameter paths and values")
    disks = _disks(scene, table.get("mistuning"), where)
    if len(disks) > 1:
        raise DesignError((*where, "mistuning"), table["mistuning"], "must be one disk in a sample")
    settings = []
    for name, given in table.items():
        if name == "mistuning":
            continue
        how, value = How.VALUE, given
        if isinstance(given, Mapping):
            key = next(iter(given), None)
            if len(given) != 1 or key not in _DEVIATIONS:
                raise DesignError((*where, name), given, 'must be a number or {"deviation": 0.1}')
            how, value = _DEVIATIONS[key], given[key]
        if not is_number(value):
            raise DesignError((*where, name), given, "must be a finite number")
        settings.append((_coordinate(scene, chosen, name, how, where), float(value)))
    _no_path_twice([coordinate for coordinate, _ in settings])
    return Scenario(settings=tuple(settings), disk=disks[0] if disks else None)


def _disks(scene: Scene, table: object, where: Place) -> tuple[Disk, ...]:
    """Return the mistuned disks of a table, each tried on the scene."""
    if table is None:
        return ()
    where = (*where, "mistuning")
    if not isinstance(table, Mapping) or "of" not in table:
        raise DesignError(
            where, table, 'must be a table such as {"of": "tip", "spread": 0.01, "seeds": [1, 2]}'
        )
    for key in table:
        if key not in MISTUNING:
            raise DesignError((*where, key), table[key], f"is not known; there are {', '.join(MISTUNING)}")
    of = (table["of"],) if isinstance(table["of"], str) else tuple(table["of"])
    if "values" in table:
        rows = table["values"]
        if not isinstance(rows, Sequence) or isinstance(rows, str) or not rows or "spread" in table:
            raise DesignError(
                (*where, "values"), rows, "must be a list of factors, and goes without a spread"
            )
        lists = rows if isinstance(rows[0], Sequence) else [rows]
        disks = tuple(Disk(of=of, values=tuple(float(x) for x in row)) for row in lists)
    else:
        spread, seeds = positive((*where, "spread"), table.get("spread")), table.get("seeds", [1])
        if not isinstance(seeds, Sequence) or isinstance(seeds, str) or not seeds:
            raise DesignError((*where, "seeds"), seeds, "must be a list of whole numbers")
        disks = tuple(Disk(of=of, spread=spread, seed=seed) for seed in seeds)
    for disk in disks:
        with at(*where):
            disk.on(scene)
    return disks


def _no_path_twice(coordinates: Sequence[Coordinate]) -> None:
    seen: dict[str, str] = {}
    for coordinate in coordinates:
        for path in coordinate.paths:
            if path in seen:
                wanted = "must stand in one place, it is there twice"
                raise DesignError("uncertain", path, wanted, place=(*_WHERE, seen[path]))
            seen[path] = coordinate.name


def _nested(matrix: Real) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())


def _check_extent(
    scene: Scene, variables: Sequence[BoundedVariable], cases: Sequence[LoadCase], found: UncertainSet
) -> None:
    """Raise unless every value that may occur is one its path may have, and leaves cases what is theirs."""
    reach = found.reach() if found.coordinates else np.zeros(0)
    ends = [
        (coordinate, middle + sign * wide)
        for coordinate, middle, wide in zip(found.coordinates, found.centre, reach.tolist(), strict=True)
        for sign in (-1.0, 1.0)
    ]
    every = [*ends, *(setting for scenario in found.listed for setting in scenario.settings)]
    check_settings(scene, variables, every)
    for case in (case for case in cases if case.own):
        for coordinate, value in (one for one in every if one[0].how is How.VALUE):
            path = displaced(case.scene, case.own, coordinate.paths, (value,))
            if path is not None:
                wanted = f"sets {path}, as the case {case.name} does: give a deviation from what that has"
                raise DesignError(
                    (*_WHERE, coordinate.name), coordinate.name, f'{wanted}, {{"deviation": 0.1}}'
                )


def check_settings(
    scene: Scene, variables: Sequence[BoundedVariable], settings: Sequence[tuple[Coordinate, float]]
) -> None:
    """Raise unless uncertain values are such as their paths may have, at every design within the bounds.

    Raises
    ------
    SettingError
        Names the path and the value.
    """
    bounds = {path: (variable.low, variable.high) for variable in variables for path in variable.paths}
    for coordinate, delta in settings:
        for path in coordinate.paths:
            nominal = scene.value(path)
            for base in bounds.get(path, (nominal, nominal)):
                value = coordinate.value(base, delta)
                with at("uncertain", coordinate.name):
                    resolve(scene, path).check(f"uncertain.{coordinate.name}", value)
                    scene.with_values({path: value})
