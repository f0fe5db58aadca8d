"""Pictures: what is on them, their units, and that a file is whole or not there."""

import contextlib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from each import each
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import solver
from solver.results import units
from solver.results.files import whole
from solver.results.known import Measured
from solver.scene.parameter_paths import parameter
from solver.views.plots import SUFFIXES, html, style
from solver.views.plots.curves import Response, above, with_peak
from solver.views.plots.motion import Motion, motion_figure
from solver.views.plots.responses import Demands, Family, family_figure, peak_figure, response_figure


def bump(height: float, at: float = 2.0) -> Response:
    values = np.linspace(1.0, 3.0, 41)
    amplitude = height / (1.0 + (values - at) ** 2)
    return Response(
        scene="made-up",
        parameter="frequency",
        values=values,
        amplitude=amplitude,
        measured=Measured(dof="tip"),
        peak=(at, height),
        limit=0.8 * height,
        intervals=((at - 0.5, at + 0.5),),
    )


def texts(page: Figure) -> str:
    return "\n".join(text.get_text() for text in page.findobj(lambda artist: hasattr(artist, "get_text")))


def test_a_response_has_its_peak_band_limit_and_units() -> None:
    page = response_figure(bump(2e-4), asked=Demands(limit=1e-4))
    (axes,) = page.axes
    assert axes.get_xlabel() == "frequency [Hz]"
    assert axes.get_ylabel() == "amplitude, max |tip| [mm]"
    curve, dot, limit = axes.lines
    assert curve.get_ydata()[20] == pytest.approx(0.2)
    assert tuple(limit.get_ydata()) == pytest.approx((0.1, 0.1))
    assert (dot.get_xdata()[0], dot.get_ydata()[0]) == pytest.approx((2.0, 0.2))
    (band,) = axes.patches
    assert band.get_x() == pytest.approx(1.5)
    assert band.get_width() == pytest.approx(1.0)
    assert "0.2 mm at 2 Hz" in texts(page)
    assert "limit 0.1 mm" in texts(page)


def test_a_family_is_in_order_with_the_optimum_and_both_limits_marked() -> None:
    family = Family(
        variable="shroud.N0",
        members=((40.0, bump(3e-4)), (185.46, bump(1e-4)), (500.0, bump(2e-4))),
        optimum=185.46,
        free=bump(1e-2),
        stuck=bump(5e-4),
        measured=Measured(dof="tip"),
    )
    page = family_figure(family)
    (axes,) = page.axes
    names = [line.get_label() for line in axes.lines]
    assert names == ["removed (linear)", "40", "185.5 (optimum)", "500", "stuck (linear)"]
    assert axes.get_legend().get_title().get_text() == "shroud.N0 [N]"
    assert axes.get_yscale() == "log"
    assert to_rgb(axes.lines[2].get_color()) == to_rgb(style.VERMILION)
    assert len({to_rgb(line.get_color()) for line in axes.lines[1:4]}) == 3


def test_the_peak_over_a_load_has_the_optimum_marked() -> None:
    loads, peaks = np.array([20.0, 100.0, 300.0, 1000.0]), np.array([4e-3, 1.1e-4, 1.05e-4, 2e-4])
    page = peak_figure(
        "made-up", "shroud.N0", loads, peaks, optimum=(190.0, 1e-4), measured=Measured(dof="tip")
    )
    (axes,) = page.axes
    curve, dot = axes.lines
    assert axes.get_xlabel() == "shroud.N0 [N]"
    assert axes.get_ylabel() == "highest peak, max |tip| [mm]"
    assert curve.get_ydata() == pytest.approx(1e3 * peaks)
    assert (dot.get_xdata()[0], dot.get_ydata()[0]) == pytest.approx((190.0, 0.1))
    assert "optimum 190 N\npeak 0.1 mm" in texts(page)


def test_a_branch_is_drawn_as_it_is() -> None:
    branch = solver.sweep(solver.load_scene("two-dof"), start=0.8, stop=1.4, harmonics=5, limit=1.5)
    response = Response.of_branch(branch)
    assert branch.peak is not None
    assert branch.band is not None
    assert response.amplitude.max() == branch.peak.value
    assert response.values[response.amplitude.argmax()] == branch.peak.at
    assert set(branch.values) <= set(response.values)
    # The polyline's band is close to the polished one.
    polyline = above(response.values, response.amplitude, 1.5)
    assert np.ravel(polyline) == pytest.approx(np.ravel(branch.band.intervals), rel=1e-2)


@pytest.mark.parametrize(("scene", "frequency_hz"), [("two-dof", 1.2), ("bladed-disk", 755.0)])
def test_motions_of_balance_and_march_agree(scene: str, frequency_hz: float) -> None:
    given_scene = solver.load_scene(scene)
    balance = Motion.of_solution(solver.solve(given_scene, frequency_hz=frequency_hz, harmonics=41))
    marched = solver.march(given_scene, frequency_hz=frequency_hz)
    march = Motion.of_march(marched, scene, given_scene.observe.dof)
    size = np.abs(march.displacement).max()
    assert np.interp(march.time, balance.time, balance.displacement) == pytest.approx(
        march.displacement, abs=1e-3 * size
    )
    assert [loop.contact for loop in balance.loops] == [loop.contact for loop in march.loops]
    # A loop's area is the work a contact takes in a period.
    for one, other in zip(balance.loops, march.loops, strict=True):
        scale = np.ptp(other.slip) * np.ptp(other.force)
        areas = [np.sum(0.5 * (w.force[1:] + w.force[:-1]) * np.diff(w.slip)) for w in (one, other)]
        assert areas[0] == pytest.approx(areas[1], abs=1e-2 * scale)
    page = motion_figure(balance)
    assert [axes.get_xlabel()[:4] for axes in page.axes] == ["time", *["slip"] * len(balance.loops), "harm"]


def test_a_picture_has_at_most_three_loops() -> None:
    tau = np.linspace(0.0, 2.0 * np.pi, 50)
    scene = solver.load_scene("two-dof")
    motion = Motion.of_solution(solver.solve(scene, frequency_hz=1.2, harmonics=3))
    many = Motion(title="many", dof="x", time=tau, displacement=np.sin(tau), loops=motion.loops * 5)
    assert sum(axes.has_data() for axes in motion_figure(many).axes) == 4


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_suffix_chooses_the_format_and_the_bytes_repeat(tmp_path: Path, suffix: str) -> None:
    for name in ("one", "two"):
        html.save(response_figure(bump(1e-4)), tmp_path / f"{name}{suffix}")
    one, two = ((tmp_path / f"{name}{suffix}").read_bytes() for name in ("one", "two"))
    assert one == two
    begins = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF", ".html": b"<!DOC"}
    assert one.startswith(begins[suffix])


def test_a_picture_that_fails_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "picture.png"
    path.write_bytes(b"old")
    page = response_figure(bump(1e-4))
    page.axes[0].set_title(r"$\nosuchcommand$")
    with pytest.raises(ValueError, match="nosuchcommand"):
        html.save(page, path)
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["picture.png"]


def test_a_file_is_whole_or_not_there(tmp_path: Path) -> None:
    path = tmp_path / "file.txt"
    with contextlib.suppress(KeyboardInterrupt), whole(path) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())
    with whole(path) as temporary:
        assert temporary.suffix == ".txt"
        temporary.write_text("all")
        assert not path.exists()
    assert path.read_text() == "all"


@each(
    ("metres", "shown"),
    [
        (13.4758, "13.48 m"), (0.61031, "0.6103 m"), (0.0923, "92.3 mm"), (1.00331e-4, "0.1003 mm"),
        (7.161e-5, "71.61 µm"), (1.4e-8, "14 nm"), (0.0, "0 m"), (-2e-3, "-2 mm"),
    ],
)  # fmt: skip
def test_lengths_have_the_unit_that_fits(metres: float, shown: str) -> None:
    assert units.length(metres) == shown


@each(
    ("path", "shown"),
    [("frequency", "1.5 Hz"), ("shroud.N0", "1.5 N"), ("shroud.N1_ratio", "1.5"), ("structure.k1", "1.5"),
     ("shroud.kt", "1.5 N/m"), ("shroud.N1_phase", "1.5 rad"),
     ("seal.gap", "1.5 m"), ("seal.a3", "1.5 N/m^3"), ("excitation.amplitude", "1.5 N")],
)  # fmt: skip
def test_parameters_have_their_unit(path: str, shown: str) -> None:
    assert parameter(path, 1.5) == shown


heights = st.lists(st.floats(0.0, 10.0), min_size=2, max_size=30)


@given(heights, st.floats(0.5, 9.5), st.booleans())
def test_above_measures_the_polyline(amplitude: list[float], limit: float, backwards: bool) -> None:
    """Against a fine sampling of the polyline; the direction it was walked in does not matter."""
    values, heights_ = np.arange(float(len(amplitude))), np.array(amplitude)
    found = above(values[::-1], heights_[::-1], limit) if backwards else above(values, heights_, limit)
    fine = np.linspace(0.0, values[-1], 200 * len(amplitude))
    share = np.mean(np.interp(fine, values, heights_) > limit)
    width = sum(high - low for low, high in found)
    assert width == pytest.approx(share * values[-1], abs=0.02 * len(amplitude))
    assert all(one[1] < two[0] for one, two in pairwise(found))


def test_a_fold_counts_once() -> None:
    values, amplitude = np.array([0.0, 2.0, 1.0, 3.0]), np.array([2.0, 2.0, 2.0, 2.0])
    assert above(values, amplitude, 1.0) == ((0.0, 3.0),)


def test_a_peak_is_put_where_the_branch_is_highest() -> None:
    values, amplitude = np.array([0.0, 2.0, 1.0, 3.0]), np.array([0.0, 5.0, 4.0, 1.0])
    more, height, _ = with_peak(values, amplitude, (1.5, 6.0))
    assert more.tolist() == [0.0, 1.5, 2.0, 1.0, 3.0]
    assert height.tolist() == [0.0, 6.0, 5.0, 4.0, 1.0]
    assert with_peak(values, amplitude, None)[0] is values
    assert with_peak(values, amplitude, (9.0, 6.0))[0] is values
