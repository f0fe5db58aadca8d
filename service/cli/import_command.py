"""`stickslip import`: matrices or modes from a finite-element program become a scene file."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.failures import InputError
from service.cli.inputs import number, output_path, whole_number
from service.cli.output import print_json, print_pairs
from service.files import whole

if TYPE_CHECKING:
    from solver.scene import Scene

MOST_UNNAMED = 200
_ROLES = ("M", "K", "C")
_CONTACT = """
# A contact joins two DOFs, or one and "ground"; take away the # and give your values.
# [[contacts]]
# name = "damper"
# between = ["{dof}", "ground"]
# kt = 1e6     # N/m
# mu = 0.3
# N0 = 100.0   # N
"""

Files = Annotated[
    list[str],
    typer.Argument(
        metavar="FILES", help="M K [C], in this order or named so; or one .npz or .mat with M, K, C or modes."
    ),
]
Out = Annotated[str, typer.Option("--out", metavar="SCENE.toml", help="The scene to write.")]
Dofs = Annotated[
    list[str] | None,
    typer.Option("--dof", metavar="NAME=ROW", help="A DOF in use and its row, zero-based; repeatable."),
]
Excite = Annotated[
    str | None,
    typer.Option("--excite", metavar="NAME", help="DOF of the force; the first --dof if left out."),
]
Observed = Annotated[
    str | None,
    typer.Option("--observe", metavar="NAME", help="DOF to observe; that of the force if left out."),
]
From = Annotated[
    float | None, typer.Option("--from", metavar="HZ", parser=number, help="Start of the band of interest.")
]
To = Annotated[
    float | None, typer.Option("--to", metavar="HZ", parser=number, help="End of the band of interest.")
]
Keep = Annotated[
    int | None,
    typer.Option(
        "--keep-modes", metavar="N", parser=whole_number,
        help="Reduce a large model onto the DOFs in use and N modes of the rest.",
    ),
]  # fmt: skip


def import_scene(
    files: Files,
    out: Out,
    dofs: Dofs = None,
    excite: Excite = None,
    observe: Observed = None,
    start: From = None,
    stop: To = None,
    keep_modes: Keep = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Make a scene of matrices or modes in files.

    The scene refers to the files, which are read and checked first. Contacts are then added by hand: a
    template stands in the scene.
    """
    target = output_path("--out", out, (".toml",))
    if target is None or target.exists():
        raise InputError(f"`--out`: {out!r} exists already; give another name or remove it")
    structure = _structure(files, target, keep_modes)
    table = _dofs(dofs, structure, target.parent)
    force = excite or next(iter(table))
    name = re.sub(r"[^A-Za-z0-9_-]", "-", target.stem)[:100]

    def raw(band: list[float]) -> dict[str, Any]:
        return {
            "name": name,
            "structure": {**structure, "dofs": table},
            "excitation": {"dof": force, "amplitude": 1.0},
            "observe": {"dof": observe or force, "band": band},
        }

    frequencies = _frequencies(_load(raw([1.0, 2.0]), target.parent))
    with whole(target) as temporary:
        temporary.write_text(_toml(raw(_band(start, stop, frequencies))), encoding="utf-8")
        import solver

        scene = solver.load_scene(temporary)
    _report(scene, target, frequencies, as_json)


def _structure(files: Sequence[str], target: Path, keep_modes: int | None) -> dict[str, object]:
    """The [structure] table, with names of files relative to the scene."""
    for name in files:
        if not Path(name).is_file():
            raise InputError(f"`FILES`: there is no file {name!r}")
    if len(files) > len(_ROLES):
        raise InputError(f"`FILES` takes M, K and maybe C, got {len(files)} files")
    table: dict[str, object] = {"kind": "matrices"}
    if len(files) == 1:
        roles = _roles_of_one(Path(files[0]))
        table |= dict.fromkeys(roles, _relative(files[0], target))
    else:
        table |= {role: _relative(name, target) for role, name in _assigned(files).items()}
    if keep_modes is not None:
        table["keep_modes"] = keep_modes
    return table


def _relative(name: str, target: Path) -> str:
    return Path(os.path.relpath(Path(name).absolute(), target.absolute().parent)).as_posix()


def _assigned(files: Sequence[str]) -> dict[str, str]:
    """Files by their role: the last letter or word of their names if all tell, else in the order M, K, C."""
    told = [re.split(r"[^A-Za-z]", Path(name).stem)[-1].upper() for name in files]
    if set(told) <= set(_ROLES) and len(set(told)) == len(told) and {"M", "K"} <= set(told):
        return dict(zip(told, files, strict=True))
    return dict(zip(_ROLES, files, strict=False))


def _roles_of_one(path: Path) -> tuple[str, ...]:
    """What a single file holds: matrices under their names, or modes."""
    from solver.matrices.files import MatrixFileError, array_names

    try:
        names = array_names(path)
    except MatrixFileError as error:
        raise InputError(f"`FILES`: {error}") from error
    if {"M", "K"} <= set(names):
        return tuple(role for role in _ROLES if role in names)
    if "modes" in names:
        return ("modes",)
    held = ", ".join(f"`{name}`" for name in names[:20]) or "nothing with a name"
    raise InputError(f"`FILES`: {str(path)!r} alone must hold M and K, or modes; it holds {held}")


def _dofs(texts: Sequence[str] | None, structure: Mapping[str, object], folder: Path) -> dict[str, int]:
    if not texts:
        return _all_rows(structure, folder)
    table: dict[str, int] = {}
    for text in texts:
        name, equals, row = text.rpartition("=")
        if not equals or not name or not re.fullmatch(r"[0-9]{1,12}", row):
            raise InputError(f"`--dof` takes NAME=ROW with a row from 0, for example tip=399, got {text!r}")
        if name in table:
            raise InputError(f"`--dof` names {name!r} twice; keep one")
        table[name] = int(row)
    return table


def _all_rows(structure: Mapping[str, object], folder: Path) -> dict[str, int]:
    """Names x0, x1, … for the rows of a small model."""
    from solver.matrices.files import MatrixFileError, read_matrix, read_modes

    try:
        if "modes" in structure:
            size = read_modes(folder / str(structure["modes"])).size
        else:
            size = read_matrix(folder / str(structure["M"]), "M").shape[0]
    except MatrixFileError as error:
        raise InputError(f"`FILES`: {error}") from error
    if size > MOST_UNNAMED:
        raise InputError(f"`--dof` is needed: the model has {size} rows, name those that you use (tip=399)")
    return {f"x{row}": row for row in range(size)}


def _load(raw: dict[str, object], folder: Path) -> Scene:
    from solver.matrices.loading import with_files
    from solver.scene import Scene

    return Scene.from_dict(with_files(raw, folder))


def _frequencies(scene: Scene) -> list[float]:
    """Natural frequencies without contacts [Hz], ascending."""
    from solver.parametric import linear_model
    from solver.undamped import undamped_modes

    model = linear_model(scene)
    omega2 = undamped_modes(model.K0, model.M).omega2
    return [math.sqrt(max(float(value), 0.0)) / (2.0 * math.pi) for value in sorted(omega2)]


def _band(start: float | None, stop: float | None, frequencies: Sequence[float]) -> list[float]:
    """The band asked for; around the first elastic mode if left out."""
    elastic = [f for f in frequencies if f > 1e-5 * frequencies[-1]] or [1.0]
    low = 0.5 * elastic[0] if start is None else start
    high = 2.0 * max(elastic[0], low) if stop is None else stop
    if not 0.0 < low < high < math.inf:
        raise InputError(
            f"`--from` and `--to` must be frequencies with 0 < from < to, got {low:g} and {high:g}"
        )
    return [float(f"{low:.6g}"), float(f"{high:.6g}")]


def _toml(raw: Mapping[str, Any]) -> str:
    """The scene as a file; JSON texts are TOML texts."""
    structure, observe, force = raw["structure"], raw["observe"], raw["excitation"]
    lines = [f"name = {json.dumps(raw['name'])}", "", "[structure]"]
    for key, value in structure.items():
        if key != "dofs":
            lines.append(f"{key} = {json.dumps(value, ensure_ascii=False)}")
    lines += [
        "# stiffness_proportional_damping = 1e-6   # s; see also mass_proportional_damping, damping_ratio"
    ]
    lines += ["", "[structure.dofs] # rows of the matrices, zero-based"]
    lines += [f"{json.dumps(name)} = {row}" for name, row in structure["dofs"].items()]
    lines += [_CONTACT.format(dof=force["dof"]).rstrip("\n"), "", "[excitation]"]
    lines += [f"dof = {json.dumps(force['dof'])}", "amplitude = 1.0 # N", "", "[observe]"]
    lines += [f"dof = {json.dumps(observe['dof'])}", f"band = {json.dumps(observe['band'])} # Hz", ""]
    return "\n".join(lines)


def _report(scene: Scene, target: Path, frequencies: Sequence[float], as_json: bool) -> None:
    from solver.scene_parts import MatricesStructure

    structure = scene.structure
    reduction = structure.reduction if isinstance(structure, MatricesStructure) else None
    if as_json:
        reduced = None if reduction is None else reduction.model_dump()
        print_json(
            {
                "scene": scene.name, "file": str(target), "dofs": list(structure.dofs),
                "frequencies_hz": list(frequencies[:10]), "reduction": reduced,
            }
        )  # fmt: skip
        return
    pairs = [
        ("DOFs in use", ", ".join(structure.dofs[:10]) + (", …" if len(structure.dofs) > 10 else "")),
        ("first frequencies", ", ".join(f"{f:.5g} Hz" for f in frequencies[:6])),
    ]
    if reduction is not None:
        kept = f"{reduction.dofs} DOFs to {len(structure.dofs)} and {reduction.modes} modes"
        pairs.append(("reduced", f"{kept} up to {reduction.highest_hz:.5g} Hz"))
    pairs.append(("next", "add [[contacts]] in the file, then `stickslip plan`"))
    print_pairs(f"Scene {scene.name} in {target}", pairs)
