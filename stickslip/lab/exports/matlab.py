"""The equations of motion of a scene as a MATLAB file: a struct `model` that says what each array is."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.lab.exports import equations_of_motion
from stickslip.lab.exports.equations_of_motion import ContactRows, EquationsOfMotion, equations_of
from solver.errors import SettingError
from solver.results.files import whole
from solver.scene.parameter_paths import parameter_of
from solver.scene.scene import Scene
from solver.wording import fields_said

SUFFIX = ".mat"


def save_mat(scene: Scene, file: str | Path, *, frequency_hz: float) -> EquationsOfMotion:
    """Write the equations of motion with their contacts to a MATLAB file, whole or not at all; return them.

    A struct `model`: M, C, K, forces, `contacts`, the observed row, `parameters` of the scene with their
    units, `equations` and `words`, which say what every array is.

    Parameters
    ----------
    scene : what is written, a disk written out; file : ends in ``.mat``; frequency_hz : of the excitation.

    Raises
    ------
    SettingError
        Another suffix, or what `equations_of` has no place for.
    """
    from scipy.io import savemat

    path = Path(file)
    if path.suffix.lower() != SUFFIX:
        raise SettingError("file", str(file), f"must end in {SUFFIX}")
    found = equations_of(scene, frequency_hz)
    struct = _struct(found, "scene", "contacts") | {
        "scene": found.scene.name, "contacts": _struct(found.contacts),
        "equations": equations_of_motion.__doc__,
        "words": _words(EquationsOfMotion, "scene", "contacts") | {"contacts": _words(ContactRows)},
        "parameters": _parameters(scene),
    }  # fmt: skip
    with whole(path) as temporary:
        savemat(temporary, {"model": struct}, long_field_names=True, oned_as="column", do_compression=True)
    return found


def _struct(of: EquationsOfMotion | ContactRows, *but: str) -> dict[str, Any]:
    """Return the fields of a class, texts as cells."""
    values = {each.name: getattr(of, each.name) for each in fields(of) if each.name not in but}
    return {
        key: np.array(value, object) if isinstance(value, tuple) else value for key, value in values.items()
    }


def _words(kind: type[EquationsOfMotion | ContactRows], *but: str) -> dict[str, str]:
    return {name: words for name, (_, words) in fields_said(kind).items() if name not in but}


def _parameters(scene: Scene) -> dict[str, Any]:
    """Return the parameters that have a value in a scene, and their units."""
    found = []
    for path in scene.parameter_paths():
        parameter = parameter_of(scene, path)
        with suppress(SettingError):  # a load has an amplitude, or a ratio
            found.append((path, parameter.get(), parameter.unit or "1"))
    paths, values, units = zip(*found, strict=True) if found else ((), (), ())
    return {
        "paths": np.array(paths, object), "values": np.array(values), "units": np.array(units, object),
    }  # fmt: skip
