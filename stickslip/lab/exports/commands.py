"""`stickslip export`: the equations of a scene for other programs."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli.options import inputs
from service.cli.options import parameters as options
from service.errors import InputError
from service.rendering.text import print_json, print_pairs
from solver.errors import SettingError


def export(
    name: options.Scene,
    out: Annotated[str, typer.Option("--out", metavar="F", help="What is written: .mat or .fmu.")],
    frequency: Annotated[float, inputs.amount("--frequency", "HZ", "Frequency of the excitation [Hz].")],
    sources_only: Annotated[
        bool, typer.Option("--sources-only", help="Leave it to who imports the .fmu to compile it.")
    ] = False,
    values: options.Values = None,
    as_json: options.Json = False,
) -> None:
    """Write a scene for other programs: equations for MATLAB, a unit for co-simulation (FMI 2.0).

    Mass, damping and stiffness, contacts and forces (.mat), or a functional mock-up unit that computes them
    without Python (.fmu).
    """
    from stickslip.lab.exports.fmu import SUFFIX as UNIT
    from stickslip.lab.exports.fmu import save_fmu
    from stickslip.lab.exports.matlab import SUFFIX as MATLAB
    from stickslip.lab.exports.matlab import save_mat

    path = inputs.output_path("--out", out, (MATLAB, UNIT))
    if path is None or (sources_only and path.suffix.lower() != UNIT):
        raise InputError(f"`--sources-only` is of a file that ends in {UNIT}, got {out!r}")
    scene = inputs.scene(name, values)
    try:
        if path.suffix.lower() == UNIT:
            found = save_fmu(scene, path, frequency_hz=frequency, sources_only=sources_only)
        else:
            found = save_mat(scene, path, frequency_hz=frequency)
    except SettingError as error:
        raise InputError(
            error.issue.said("--frequency" if error.name == "frequency_hz" else error.name)
        ) from error
    told = {"coordinates": len(found.M), "dofs": len(found.dofs), "contacts": len(found.contacts.names)}
    if as_json:
        print_json({"file": str(path), "scene": found.scene.name, **told})
    else:
        print_pairs(f"{path} of {found.scene.name}", [(key, str(value)) for key, value in told.items()])
