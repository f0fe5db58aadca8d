"""Scenes that are hard: limits of every parameter, kinks, ill-conditioned and badly scaled structures."""

import math
from dataclasses import dataclass

from other_units import in_other_units
from scene_cases import bladed_disk, loose_mass, oscillator, two_dof

from solver import Scene, annulus

MARCHED = 2e-3  # relative agreement of half peak-to-peak with time marching, by the harmonics left out


@dataclass(frozen=True, kw_only=True)
class Hard:
    """A scene and what is asked of it.

    Attributes
    ----------
    scene, frequency_hz, harmonics : what to solve.
    band : Hz, swept both ways; None: a solve only.
    march : largest relative difference of half peak-to-peak from time marching; None: too slow to march.
    """

    scene: Scene
    frequency_hz: float
    harmonics: int = 11
    band: tuple[float, float] | None = (0.3, 2.6)
    march: float | None = MARCHED


def weakly_damped(c: float, **contact: float) -> Scene:
    """An oscillator of 1 kg and 1 N/m with hardly any damping of its own."""
    values = {"kt": 0.5, "mu": 0.3, "N0": 1.0, **contact}
    return oscillator(values, k=1.0, c=c)


def kink_chain() -> Scene:
    """Both limits touch at once near 1.610 Hz."""
    k1, k2 = 4.0 * math.pi**2, 2.0 * math.pi**2
    return two_dof(N1=30.0).with_values({"structure.k1": k1, "structure.k2": k2})


def at_the_edge(factor: float) -> Scene:
    """The load at which the stuck oscillator touches both limits at once, times a factor."""
    omega = 2.0 * math.pi * 0.17
    limit = 0.5 / abs(1.0 + 0.5 - omega**2 + 0.05j * omega)
    return oscillator({"kt": 0.5, "mu": 0.3, "N0": factor * limit / 0.3}, k=1.0, c=0.05)


def together(load: float) -> Scene:
    """An annulus whose sectors all do the same: every root contact changes its state at one instant."""
    raw = bladed_disk().with_values({"root.N0": load}).to_dict()
    raw["structure"] |= {"sectors": 4}  # type: ignore[operator]
    raw["excitation"] |= {"engine_order": 0}  # type: ignore[operator]
    return annulus(Scene.from_dict(raw))


def with_static_load(newtons: float) -> Scene:
    """The two masses pulled to one side besides."""
    raw = two_dof().to_dict()
    pull = {"dof": "m2", "amplitude": newtons, "harmonic": 0}
    return Scene.from_dict({**raw, "excitation": [raw["excitation"], pull]})


def pressed_and_driven(scale: float) -> Scene:
    """Force and load scaled alike: the response scales with them."""
    return two_dof(N0=100.0 * scale).with_values({"excitation.amplitude": 100.0 * scale})


def driven(newtons: float) -> Scene:
    """Another force under the same load: all stuck, or the contact hardly there."""
    return two_dof().with_values({"excitation.amplitude": newtons})


def touching(N0: float, ratio: float, phase: float) -> Scene:
    return two_dof(N0=N0, N1_ratio=ratio, N1_phase=phase)


K = (4.0 * math.pi) ** 2  # N/m, the stiffer spring of the two masses
GRAZING = [(N0, 1.0, phase) for N0 in (10.0, 100.0) for phase in (0.0, 1.0, math.pi)]
OPEN = [(N0, 10.0, phase) for N0 in (1.0, 30.0) for phase in (0.0, 2.0)]
DISK_BAND = (500.0, 900.0)

HARD: dict[str, Hard] = {
    **{f"N0 = {N0:g}": Hard(scene=two_dof(N0=N0), frequency_hz=1.198)
       for N0 in (0.0, 1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e9)},
    "N0 = 0, N1 = 50": Hard(scene=two_dof(N0=0.0, N1=50.0), frequency_hz=1.198),
    **{f"N1 = N0 = {N0:g}, phase {phase:.2f}": Hard(scene=touching(N0, ratio, phase), frequency_hz=1.05)
       for N0, ratio, phase in GRAZING},
    **{f"N1 = 10 N0 = {10.0 * N0:g}, phase {phase:g}":
       Hard(scene=touching(N0, ratio, phase), frequency_hz=1.05) for N0, ratio, phase in OPEN},
    **{f"kt = {share:g} k": Hard(scene=two_dof(kt=share * K), frequency_hz=1.198)
       for share in (1e-6, 1e-3, 1.0, 1e3)},
    **{f"kt = {share:g} k": Hard(scene=two_dof(kt=share * K), frequency_hz=1.198, march=None)
       for share in (1e6, 1e9)},
    "mu = 0": Hard(scene=two_dof(mu=0.0), frequency_hz=1.198),
    "mu = 5": Hard(scene=two_dof(mu=5.0), frequency_hz=1.198),
    "damping 1e-6": Hard(scene=weakly_damped(1e-6), frequency_hz=0.17, band=(0.05, 0.3)),
    "damping 1e-6, at the free resonance":
        Hard(scene=weakly_damped(1e-6, N0=3.0), frequency_hz=1.0 / (2.0 * math.pi), band=None, march=None),
    "damping 1e-6, separation":
        Hard(scene=weakly_damped(1e-6, N1=2.0), frequency_hz=0.1, band=(0.05, 0.145), march=None),
    **{f"H = {H}": Hard(scene=two_dof(N1=130.0), frequency_hz=1.198, harmonics=H,
                        march=MARCHED if H > 10 else None, band=(0.8, 1.6) if H < 60 else None)
       for H in (0, 1, 2, 3, 5, 21, 51, 101, 201)},
    **{f"kink, {f:g} Hz": Hard(scene=kink_chain(), frequency_hz=f, band=(1.55, 1.65))
       for f in (1.605, 1.608, 1.609, 1.610, 1.611, 1.612, 1.615)},
    **{f"edge of stick, load x {factor!r}":
       Hard(scene=at_the_edge(factor), frequency_hz=0.17, band=(0.1, 0.3))
       for factor in (0.999, 1.0 - 1e-6, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 1.0 + 1e-6)},
    **{f"all roots together, N0 = {load:g}":
       Hard(scene=together(load), frequency_hz=700.0, harmonics=3, band=(600.0, 900.0))
       for load in (5.0, 30.0, 100.0)},
    **{f"super-harmonics at {f:g} Hz, N1 = {N1:g}":
       Hard(scene=two_dof(N1=N1), frequency_hz=f, harmonics=101, band=None)
       for f, N1 in ((0.05, 30.0), (0.05, 200.0), (0.02, 150.0))},
    "super-harmonics from 0.05 Hz":
        Hard(scene=two_dof(N1=150.0), frequency_hz=0.1, harmonics=41, band=(0.05, 0.5)),
    **{f"static load {force:g} N": Hard(scene=with_static_load(force), frequency_hz=1.198)
       for force in (1.0, 300.0, 1e5)},
    **{f"force and load x {scale:g}": Hard(scene=pressed_and_driven(scale), frequency_hz=1.198)
       for scale in (1e-11, 1e7)},
    **{f"force {force:g} N": Hard(scene=driven(force), frequency_hz=1.198) for force in (1e-9, 1e9)},
    "micrometres": Hard(scene=in_other_units(two_dof(N1=130.0), length=1e-6, time=1.0), frequency_hz=1.198),
    "kilometres and hours":
        Hard(scene=in_other_units(two_dof(N1=130.0), length=1e3, time=3600.0), frequency_hz=3600.0 * 1.198,
             band=(3600.0 * 0.3, 3600.0 * 2.6)),
    **{f"disk, shroud kt = {kt:g}":
       Hard(scene=bladed_disk(kt=kt), frequency_hz=755.0, harmonics=7, band=DISK_BAND, march=None)
       for kt in (1.0, 1e4, 1e9, 1e12)},
    **{f"disk, both loads {load:g} N":
       Hard(scene=bladed_disk(N0=load).with_values({"root.N0": 2.0 * load}), frequency_hz=755.0, harmonics=7,
            band=DISK_BAND, march=None)
       for load in (0.0, 1.0, 30.0)},
    "loose mass": Hard(scene=loose_mass(), frequency_hz=1.7, band=(0.5, 4.0)),
    "loose mass, floor slips": Hard(scene=loose_mass(30.0), frequency_hz=1.7, band=(0.5, 4.0), march=None),
}  # fmt: skip
