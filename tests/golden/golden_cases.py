"""What the golden files are made of: scenes, and a command line for each study."""

from collections.abc import Iterator
from typing import Any, NamedTuple

from law_scene_cases import CUBIC, GAP, RUB, cyclic, scene

from solver.scene.scene import Scene

SHIPPED = ("two-dof", "bladed-disk")
CYCLIC = ("bladed-disk", "ring")
_DAHL: dict[str, Any] = {"law": "dahl", "sigma": 2.0, "limit": 0.4}
_RUB: dict[str, Any] = {"law": "coulomb", "kt": 2.0, "mu": 0.4, "N0": 1.0}
_LOAD = {
    "two-dof": "damper.N0 50 200", "bladed-disk": "shroud.N0 100 300", "rub": "c0.N0 0.1 0.4",
    "gap": "c0.k 2 4", "cubic": "c1.N0 0.5 2", "ring": "shroud.limit 0.2 0.8",
}  # fmt: skip
SCENES = tuple(_LOAD)
_BAND = {"two-dof": (0.8, 1.4), "bladed-disk": (740, 780), "ring": (0.1, 0.3)}
_MODE = {"two-dof": (0.1, 3), "bladed-disk": (1e-5, 1e-4)}
_HEIGHT = {"bladed-disk": 2e-5}
_OWN_HARMONICS = ("accuracy", "interference", "march", "solve-accuracy")
_LONG = {
    "accuracy": SCENES, "mistuning": CYCLIC, "pareto": SCENES, "controlled": SCENES[1:],
    "worst_mistuning": CYCLIC, "worst_mistuning-open": CYCLIC,
    "sweep-load": ("rub", "gap", "cubic"), "march": CYCLIC, "campbell": ("ring",), "solve-all": ("ring",),
    "modes-resonance": ("ring", "two-dof"), "sweep": ("ring",),
    "peaks": ("bladed-disk", "gap", "cubic"), "identify": SCENES,
}  # fmt: skip
MEASURED = """# excitation.amplitude = 100
# damper.N0 = 100
frequency [Hz],amplitude [m]
1.0,1.93
1.1,2.12
1.2,1.77
1.3,1.48
1.4,1.25
"""


class Case(NamedTuple):
    """A command line with `SCENE` in place of its scene."""

    study: str
    scene: str
    words: str

    @property
    def name(self) -> str:
        return f"{self.study} {self.scene}"

    @property
    def long(self) -> bool:
        """Whether it takes more than half a second."""
        return self.scene in _LONG.get(self.study, ())


def own_scenes() -> dict[str, Scene]:
    """Four beside those that are shipped: a load that moves, a gap, two laws, a law with a history."""
    return {
        "rub": scene(RUB), "gap": scene(GAP, amplitude=0.3), "cubic": scene(CUBIC, _RUB),
        "ring": cyclic(_DAHL),
    }  # fmt: skip


def cases() -> Iterator[Case]:
    """Every study on every scene that it is for."""
    for scene_name in SCENES:
        for study, options in _options(scene_name):
            fewer = "" if study in _OWN_HARMONICS else " --harmonics 3"
            yield Case(
                study, scene_name, f"{study.partition('-')[0].replace('_', '-')} SCENE {options}{fewer}"
            )


def _options(name: str) -> Iterator[tuple[str, str]]:
    low, high = _BAND.get(name, (0.1, 0.4))
    path, least, most = _LOAD[name].split()
    middle, ends = 0.5 * (low + high), f"--from {low} --to {high}"
    over = f"--parameter {path} --from {least} --to {most}"
    small, large = _MODE.get(name, (0.05, 2.0))
    modes = f"--from {small} --to {large}"
    yield "plan", "--effects every-port"
    yield "solve", f"--frequency {middle} --set {path}={most}"
    yield "solve-all", f"--frequency {middle} --all --starts 2"
    yield "solve-accuracy", f"--frequency {middle} --accuracy 1e-3"
    yield "sweep", ends
    yield "sweep-load", f"{over} --frequency {middle} --stability --branches"
    yield "accuracy", f"--frequency {middle}"
    yield "march", f"--frequency {middle}"
    yield "peaks", f"{over} --checks 1"
    yield "map", f"{over} --steps 3 --frequencies 5 --no-ridge"
    yield "campbell", f"--speeds {30 * low} {60 * high} --order 1 --order 2 --band {low} {high}"
    yield "modes", modes
    yield "modes-all", f"{modes} --performance --aero -0.01 --disturbance {small}"
    yield "modes-resonance", f"{modes} --phase-resonance"
    yield "controlled", f"--amplitude {_HEIGHT.get(name, 0.5)} {ends}"
    if name != "ring":  # a minute of differences of a law without second derivatives
        yield "sensitivities", ""
        yield "design", f"--variable {path} {least} {most}"
        limit = 1e-4 if name == "bladed-disk" else 1.0
        yield "margin", f"--from 0.5 --to 2 --points 3 --limit {1e-6 if name == 'bladed-disk' else 0.1}"
        yield "pareto", f"--variable {path} {least} {most} --limit {limit} --points 3"
    if name == "two-dof":
        yield "identify", "DATA --unknown damper.mu 0.1 0.6 --starts 2"
    if name in CYCLIC:
        yield "interference", "--speed 11000" if name == "bladed-disk" else "--speed 8"
        yield "mistuning", f"--of {'tip' if name == 'bladed-disk' else 'u'} --samples 2 {ends}"
        of = f"--of {'tip' if name == 'bladed-disk' else 'u'} --starts 2 --patterns AB"
        yield "worst_mistuning", f"{of} --climbs 2 --climb 2 {ends}"
        yield "worst_mistuning-open", f"{of} --contacts open --rms 0.01 --worst-of-patterns {ends}"
