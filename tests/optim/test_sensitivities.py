"""Sensitivities in engineering form: Euler's theorem, differences, order, what has no per cent."""

import json
import math
from collections.abc import Callable
from functools import cache

import pytest

import optim
import solver
from optim.results.studies_result import ParameterSensitivity, SensitivityStatus
from optim.views.plots.figures import sensitivities_figure

DESIGNS = {"two-dof": {"damper.N0": 140.0}, "bladed-disk": {"shroud.N0": 150.0}}
BAND_LIMIT = {"two-dof": 1.8, "bladed-disk": 0.08e-3}


@cache
def found(name: str, limit: float | None = None) -> optim.SensitivityResult:
    return optim.sensitivities(solver.load_scene(name), DESIGNS[name], limit)


def rows(result: optim.SensitivityResult) -> dict[str, ParameterSensitivity]:
    return {row.path: row for row in result.rows}


@pytest.mark.parametrize("name", DESIGNS)
def test_the_shares_of_the_force_and_of_all_loads_add_up_to_one(name: str) -> None:
    result = found(name)
    assert result.status is SensitivityStatus.KNOWN
    # N1 is tied to N0 in both scenes, or 0: its share is in that of N0.
    loads = [row for path, row in rows(result).items() if path.endswith((".N0", "excitation.amplitude"))]
    for place in range(len(result.peaks)):
        total = sum(result.peak_elasticities(row)[place] for row in loads)
        assert total == pytest.approx(1.0, rel=1e-7)
    # At half power the limit follows the peak, and the band does not change at all.
    assert sum(result.band_elasticity(row) for row in loads) == pytest.approx(0.0, abs=1e-6)


def test_an_untied_load_has_its_own_share() -> None:
    scene = solver.load_scene("two-dof").with_values({"damper.N1": 42.0})
    result = optim.sensitivities(scene, DESIGNS["two-dof"])
    mine = rows(result)
    shares = [
        result.peak_elasticities(mine[path])[0] for path in ("damper.N0", "damper.N1", "excitation.amplitude")
    ]
    assert sum(shares) == pytest.approx(1.0, rel=1e-7)
    assert abs(shares[1]) > 1e-3


@pytest.mark.parametrize("name", DESIGNS)
def test_a_band_above_a_fixed_limit_counts_the_limit_as_a_length(name: str) -> None:
    result = found(name, BAND_LIMIT[name])
    loads = [row for path, row in rows(result).items() if path.endswith((".N0", "excitation.amplitude"))]
    by_limit = result.band_by_limit * BAND_LIMIT[name] / result.band_hz
    assert sum(result.band_elasticity(row) for row in loads) + by_limit == pytest.approx(0.0, abs=1e-6)


def difference(f: Callable[[float], float], h: float) -> float:
    """The derivative at 0 by central differences of fourth order."""
    return (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h)


@pytest.mark.parametrize(
    "path", ["damper.N0", "damper.N1", "damper.N1_phase", "damper.kt", "damper.mu", "structure.k2"]
)
def test_every_slope_is_that_of_differences(path: str) -> None:
    scene = solver.load_scene("two-dof").with_values(DESIGNS["two-dof"])
    result = found("two-dof", BAND_LIMIT["two-dof"])
    value = scene.value(path)
    row = rows(result)[path]
    step = 1e-3 * (abs(value) or 1.0)

    def response(h: float) -> solver.Branch:
        return solver.sweep(scene.with_values({path: value + h}), limit=BAND_LIMIT["two-dof"])

    peak = difference(lambda h: response(h).peaks[0].value, step)
    # A corner of the response lies close to an edge of this band: smaller steps.
    band = difference(lambda h: response(h).band.width, 0.1 * step)  # type: ignore[union-attr]
    assert row.peaks[0] == pytest.approx(peak, rel=1e-6, abs=1e-8)
    assert row.band == pytest.approx(band, rel=1e-6, abs=1e-7)
    if row.relative:
        assert result.peak_elasticities(row)[0] == pytest.approx(
            peak * value / result.peaks[0].value, rel=1e-6
        )


def test_what_matters_most_comes_first_and_zeros_and_angles_have_no_per_cent() -> None:
    result = found("bladed-disk")
    shares = [result.peak_elasticities(row)[0] for row in result.rows]
    # To six digits: equals (μ and N0 of a contact) differ by rounding and are in the order of the scene.
    with_share = [float(f"{abs(share):.6g}") for share in shares if math.isfinite(share)]
    known = solver.load_scene("bladed-disk").parameter_paths()
    ranks = [(-share, known.index(row.path)) for share, row in zip(with_share, result.rows, strict=False)]
    assert ranks == sorted(ranks)
    assert len(set(with_share)) < len(with_share)
    assert all(math.isnan(share) for share in shares[len(with_share) :])
    without = {row.path for row in result.rows if not row.relative}
    assert {"root.N1", "root.N1_ratio", "shroud.N1_phase", "excitation.phase"} <= without
    assert set(rows(result)) == set(known)


def test_the_json_is_strict() -> None:
    answer = json.loads(json.dumps(found("bladed-disk").to_json(), allow_nan=False))
    assert answer["rows"][0]["path"] == found("bladed-disk").rows[0].path
    assert answer["reached"] is True
    assert {row["path"] for row in answer["rows"] if row["peak_percent"] is None}


def test_a_mistuned_disk_leaves_out_what_differs_from_blade_to_blade() -> None:
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["structure"] |= {"sectors": 3, "mistuning": {"of": ["tip"], "values": [1.0, 1.02, 0.97]}}  # type: ignore[operator]
    raw["observe"]["band"] = [700.0, 820.0]  # type: ignore[index]
    result = optim.sensitivities(solver.Scene.from_dict(raw), harmonics=3)
    assert {path for path, _ in result.left_out} == {"shroud.N1_phase", "root.N1_phase"}
    loads = [r for r in result.rows if r.path in ("excitation.amplitude", "shroud.N0", "root.N0")]
    assert sum(result.peak_elasticities(row)[0] for row in loads) == pytest.approx(1.0, rel=1e-7)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"values": {"dumper.N0": 3.0}}, ["dumper.N0", "damper.N0"]),
        ({"values": {"damper.mu": -1.0}}, ["damper.mu", "-1.0"]),
        ({"limit": -1.0}, ["limit", "-1.0"]),
        ({"harmonics": -1}, ["harmonics", "-1"]),
    ],
)
def test_bad_input_is_named(arguments: dict[str, object], words: list[str]) -> None:
    with pytest.raises(solver.SettingError) as caught:
        optim.sensitivities(solver.load_scene("two-dof"), **arguments)  # type: ignore[arg-type]
    for word in words:
        assert word in str(caught.value)


def test_the_picture_has_a_bar_for_every_parameter_that_matters() -> None:
    result = found("bladed-disk")
    peaks, bands = sensitivities_figure(result.to_json()).axes
    names = [text.get_text() for text in peaks.get_yticklabels()]
    assert names[-1] == result.rows[0].path, "what matters most is on top"
    widths = [bar.get_width() for bar in peaks.patches]
    mine = rows(result)
    assert widths == pytest.approx([result.peak_elasticities(mine[name])[0] for name in names])
    assert len(bands.patches) == len(names)
