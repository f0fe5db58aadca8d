"""`stickslip modes`: frequency and damping ratio of a mode over its amplitude."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.options.numeric import amount, count
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.errors import InputError
from service.rendering.tables import modes as tables
from service.rendering.tables.text import show

if TYPE_CHECKING:
    from solver.scene.scene import Scene

Mode = Annotated[int, count("--mode", "N", "Which mode, 1 the slowest, contacts as they are at rest.")]
Smallest = Annotated[float, amount("--from", "A", "Smallest modal amplitude [√kg m].")]
Largest = Annotated[float, amount("--to", "B", "Largest modal amplitude [√kg m].")]
Diameter = Annotated[
    int | None,
    count(
        "--nodal-diameter", "N", "Of a disk, negative for a backward wave; the engine order's if left out."
    ),
]
Performance = Annotated[
    bool, typer.Option("--performance", help="Resonance peaks over excitation and load, from the one mode.")
]
Disturbance = Annotated[
    float | None,
    amount("--disturbance", "A", "Modal amplitude that is to die down with --aero: says the least loads."),
]
Resonance = Annotated[
    bool,
    typer.Option(
        "--phase-resonance", help="Forced responses that lag by 90°: which force an amplitude takes."
    ),
]
Aero = Annotated[
    float | None,
    amount("--aero", "ZETA", "Aerodynamic damping ratio, below 0 if it feeds: lists the limit cycles."),
]
ModeAlone = Annotated[
    bool, typer.Option("--mode-alone", help="With --aero: the gas feeds this mode alone, not every one.")
]


def modes(
    name: options.Scene,
    start: Smallest,
    stop: Largest,
    mode: Mode = 1,
    nodal_diameter: Diameter = None,
    performance: Performance = False,
    aero: Aero = None,
    mode_alone: ModeAlone = False,
    disturbance: Disturbance = None,
    phase_resonance: Resonance = False,
    values: options.Values = None,
    harmonics: options.Harmonics = 11,
    plot: options.Plot = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Follow a mode's frequency and damping over its amplitude.

    The modal amplitude a is mass-normalised: a² = Σ Q_kᴴ M Q_k over the harmonics, of one sector of a disk.
    """
    import solver

    outputs = Outputs.asked(plot, out)
    scene = inputs.scene(name, values)
    if not 0.0 < start < stop:
        raise InputError(f"`--from` and `--to` must be 0 < from < to [√kg m], got {start!r} and {stop!r}")
    if disturbance is not None and aero is None:
        raise InputError(
            "`--disturbance` needs `--aero`: without gas that feeds, every disturbance dies down"
        )
    if mode_alone and aero is None:
        raise InputError("`--mode-alone` needs `--aero`: it says what the gas feeds")
    if phase_resonance:
        if performance or aero is not None:
            raise InputError("`--phase-resonance` is a curve of its own: leave `--performance`, `--aero` out")
        _resonance(scene, mode, (start, stop), nodal_diameter, harmonics, outputs, as_json=as_json)
        return
    with bar("modes") as on_progress:
        found = solver.nonlinear_mode(
            scene, mode, amplitudes=(start, stop), nodal_diameter=nodal_diameter, harmonics=harmonics,
            on_progress=on_progress,
        )  # fmt: skip
    curve = solver.performance_curve(found) if performance else None
    drawn = found if curve is None else curve
    answer = found.to_json() | ({} if curve is None else {"performance": curve.to_json()})
    if aero is not None:
        cycles = solver.limit_cycles(found, aero, mode_alone=mode_alone)
        answer["limit_cycles"] = cycles.to_json(disturbance)
    outputs.write(drawn, drawn.plot if found.amplitude.size else None)
    show(answer, tables.report, as_json=as_json)
    end(found.completed, found.status.value)


def _resonance(
    scene: Scene, mode: int, amplitudes: tuple[float, float], nodal_diameter: int | None, harmonics: int,
    outputs: Outputs, *, as_json: bool,
) -> None:  # fmt: skip
    """Follow the phase resonances and show them."""
    import solver

    with bar("modes") as on_progress:
        found = solver.phase_resonance(
            scene, mode, amplitudes=amplitudes, nodal_diameter=nodal_diameter, harmonics=harmonics,
            on_progress=on_progress,
        )  # fmt: skip
    outputs.write(found, found.plot if found.amplitude.size else None)
    show(found.to_json(), tables.resonance, as_json=as_json)
    end(found.completed, found.status.value)
