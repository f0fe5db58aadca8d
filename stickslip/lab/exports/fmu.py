"""A scene as a functional mock-up unit (FMI 2.0, co-simulation): a library that needs neither Python nor us.

`fmu.c` beside this is the text of every unit: a Taylor series between the events of the contacts, as the time
march goes. Numbers are put before it, a C compiler makes the library; the sources go with it.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import tempfile
import uuid
import zipfile
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from stickslip.lab.exports.equations_of_motion import EquationsOfMotion, equations_of
from solver.contacts.laws.contact_parts import Follows
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.results.files import whole
from solver.scene.scene import Scene

SUFFIX = ".fmu"
MOST = 300  # coordinates: the matrices are in the source
NAME = "model"
_STEP = 0.375  # rad that the fastest motion turns in a step, as in the march
_SECONDS = 300.0  # of the compiler
_LIBRARIES = {
    "Linux": ("linux64", ".so"),
    "Darwin": ("darwin64", ".dylib"),
    "Windows": ("win64", ".dll"),
}
_UNITS = {
    "m": {"m": "1"}, "m/s": {"m": "1", "s": "-1"}, "N": {"kg": "1", "m": "1", "s": "-2"}, "Hz": {"s": "-1"},
}  # fmt: skip


class ModelVariable(NamedTuple):
    """A variable of the unit; its value reference is its place."""

    name: str
    causality: str
    words: str
    unit: str
    start: float | None = None


def save_fmu(
    scene: Scene, file: str | Path, *, frequency_hz: float, sources_only: bool = False
) -> EquationsOfMotion:
    """Write a scene as a functional mock-up unit for co-simulation, whole or not at all; return its numbers.

    Inputs are further forces on the degrees of freedom ``NAME.force`` [N], outputs their displacements and
    velocities, forces and loads of the contacts and what the scene observes, parameters ``frequency_hz``, a
    factor of the excitation, friction coefficients, normal loads and their first amplitudes. It begins at
    rest, contacts without force.

    Parameters
    ----------
    scene : what is written, a disk written out; file : ends in ``.fmu``.
    frequency_hz : of the excitation, which may be set anew in the unit.
    sources_only : leave it to the program that imports the unit to compile it.

    Raises
    ------
    SettingError
        Another suffix, too many coordinates, no C compiler, or what `equations_of` has no place for.
    """
    path = Path(file)
    if path.suffix.lower() != SUFFIX:
        raise SettingError("file", str(file), f"must end in {SUFFIX}")
    found = equations_of(scene, frequency_hz)
    if len(found.M) > MOST:
        raise SettingError(
            "scene", f"{len(found.M)} coordinates", f"must have at most {MOST}: reduce it first"
        )
    source = source_of(found)
    with tempfile.TemporaryDirectory() as folder, whole(path) as temporary:
        library = None if sources_only else compiled(source, Path(folder))
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", description_of(found, source))
            archive.writestr(f"sources/{NAME}.c", source)
            if library is not None:
                place = _LIBRARIES[platform.system()][0]
                archive.write(library, f"binaries/{place}/{library.name}")
    return found


def compiled(source: str, folder: Path) -> Path:
    """Return the library of a source, made in a folder by the system's C compiler.

    Raises
    ------
    SettingError
        There is none, or it refuses.
    """
    known = [os.environ.get("CC", ""), "cc", "gcc", "clang"]
    compiler = next((found for each in known if each and (found := shutil.which(each))), None)
    if compiler is None or platform.system() not in _LIBRARIES:
        wanted = "must be a C compiler, or the unit be written as sources alone (`sources_only`)"
        raise SettingError("CC", ", ".join(filter(None, known)), wanted)
    library = folder / f"{NAME}{_LIBRARIES[platform.system()][1]}"
    text = folder / f"{NAME}.c"
    text.write_text(source, encoding="utf-8")
    flags = ["-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-fvisibility=hidden"]
    ended = subprocess.run(
        [compiler, *flags, "-o", str(library), str(text), "-lm"],
        capture_output=True, text=True, timeout=_SECONDS, check=False,
    )  # fmt: skip
    if ended.returncode != 0:
        raise SettingError("CC", compiler, f"must compile the unit: {ended.stderr.strip()[-500:]}")
    return library


def variables_of(found: EquationsOfMotion) -> Iterator[ModelVariable]:
    """Yield the variables of a unit in the order of their value references."""
    rows = found.contacts
    yield ModelVariable("frequency_hz", "parameter", "Frequency of the excitation.", "Hz", found.frequency_hz)
    yield ModelVariable("excitation.factor", "parameter", "Times the forces of the scene that vary.", "", 1.0)
    for c, name in enumerate(rows.names):
        friction = rows.follows[c] != Follows.GAP.value
        kind, tied = "parameter" if friction else "", rows.ratio[c] != 0.0
        first, unit = float(rows.ratio[c] if tied else rows.wave[c, 0]), "" if tied else "N"
        yield ModelVariable(f"{name}.mu", kind, "Friction coefficient.", "", float(rows.mu[c]))
        yield ModelVariable(f"{name}.N0", kind, "Mean normal load.", "N", float(rows.N0[c]))
        words = "First amplitude of the load over N0." if tied else "First amplitude of the load."
        yield ModelVariable(f"{name}.{'N1_ratio' if tied else 'N1'}", kind, words, unit, first)
    for name in found.dofs:
        yield ModelVariable(f"{name}.force", "input", "Force beside the excitation.", "N", 0.0)
    for key, words, unit in (("displacement", "Displacement.", "m"), ("velocity", "Velocity.", "m/s")):
        for name in found.dofs:
            yield ModelVariable(f"{name}.{key}", "output", words, unit)
    for key, words in (("contact_force", "Friction force, or that of a gap."), ("normal_load", "Load.")):
        for name in rows.names:
            yield ModelVariable(f"{name}.{key}", "output", words, "N")
    yield ModelVariable("observed", "output", f"What the scene observes: {found.scene.observe.dof}.", "m")


def description_of(found: EquationsOfMotion, source: str) -> str:
    """Return `modelDescription.xml`."""
    root = ElementTree.Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=found.scene.name, guid=_guid(source),
        generationTool="stickslip", variableNamingConvention="flat", numberOfEventIndicators="0",
    )  # fmt: skip
    unit = ElementTree.SubElement(
        root, "CoSimulation", modelIdentifier=NAME, canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="true", canGetAndSetFMUstate="true", canSerializeFMUstate="true",
    )  # fmt: skip
    ElementTree.SubElement(ElementTree.SubElement(unit, "SourceFiles"), "File", name=f"{NAME}.c")
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for name, powers in _UNITS.items():
        ElementTree.SubElement(ElementTree.SubElement(units, "Unit", name=name), "BaseUnit", powers)
    listed, outputs = ElementTree.SubElement(root, "ModelVariables"), []
    for reference, each in enumerate(variables_of(found)):
        if not each.causality:
            continue
        kind = "fixed" if each.causality == "parameter" else "continuous"
        scalar = ElementTree.SubElement(
            listed, "ScalarVariable", name=each.name, valueReference=str(reference),
            causality=each.causality, variability=kind, description=each.words,
        )  # fmt: skip
        given = {"unit": each.unit} if each.unit else {}
        if each.start is not None:
            given["start"] = repr(each.start)
        ElementTree.SubElement(scalar, "Real", given)
        if each.causality == "output":
            outputs.append(len(listed))
    structure = ElementTree.SubElement(root, "ModelStructure")
    for key in ("Outputs", "InitialUnknowns"):
        part = ElementTree.SubElement(structure, key)
        for index in outputs:
            ElementTree.SubElement(part, "Unknown", index=str(index))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True)


def source_of(found: EquationsOfMotion) -> str:
    """Return the source of a unit: dimensions and numbers, then the text that is the same of all."""
    rows, n = found.contacts, len(found.M)
    inverse = np.asarray(np.linalg.inv(found.M), np.float64)
    A, B = inverse @ found.K, inverse @ found.C
    m, f, d, k = len(rows.names), len(found.amplitude), len(found.dofs), rows.wave.shape[1]
    tied = np.where(rows.ratio != 0.0, rows.ratio, rows.wave[:, 0]) if m else np.zeros(0)
    numbers = np.column_stack([rows.mu, rows.N0, tied]).ravel()
    sizes = {
        "NX": n, "DOFS": d, "CONTACTS": m, "FORCES": f, "ND": max(d, 1), "NC": max(m, 1), "NF": max(f, 1),
        "NW": k, "PARAMETERS": 2 + 3 * m, "NP": 2 + 3 * m,
    }  # fmt: skip
    real = {
        "A[NX][NX]": A, "B[NX][NX]": B, "W_FORCE[NF][NX]": found.force @ inverse.T,
        "W_INPUT[ND][NX]": found.shapes @ inverse.T, "W_ALONG[NC][NX]": rows.along @ inverse.T,
        "W_NORMAL[NC][NX]": rows.normal @ inverse.T, "ALONG[NC][NX]": rows.along,
        "NORMAL[NC][NX]": rows.normal, "SHAPES[ND][NX]": found.shapes, "OBSERVE[NX]": found.observe,
        "KT[NC]": rows.kt, "KN[NC]": rows.kn, "GAPS[NC]": rows.gap, "WAVE[NC][NW]": rows.wave,
        "WAVE_PHASE[NC][NW]": rows.wave_phase, "AMPLITUDE[NF]": found.amplitude, "PHASE[NF]": found.phase,
        "PARAMETER[NP]": np.concatenate([[found.frequency_hz, 1.0], numbers]),
    }  # fmt: skip
    whole_numbers = {
        "LAW[NC]": rows.follows, "TIED[NC]": rows.ratio != 0.0, "PRESTRESSED[NC]": rows.prestressed,
        "PRESSES[NC]": rows.presses, "HARMONIC[NF]": found.harmonic,
    }  # fmt: skip
    orders = [*found.harmonic.tolist(), *(np.flatnonzero(np.any(rows.wave, axis=0)) + 1).tolist(), 1]
    lines = [
        f"enum {{ {', '.join(f'{name} = {size}' for name, size in sizes.items())} }};",
        f"#define RATE {_fastest(found, A, B, inverse)!r} /* rad/s */",
        f"#define HIGHEST {max(orders)}", f"#define STEP {_STEP}",
        *(f"static const double {name} = {_numbers(each)};" for name, each in real.items()),
        *(f"static const int {name} = {_numbers(each.astype(int))};" for name, each in whole_numbers.items()),
    ]  # fmt: skip
    text = "\n".join([*lines, files(__package__).joinpath("fmu.c").read_text(encoding="utf-8")])
    return f'#define GUID "{_guid(text)}"\n{text}'


def _fastest(found: EquationsOfMotion, A: Real, B: Real, inverse: Real) -> float:
    """Return the largest rate of the motion, contacts stuck and pressed [rad/s]."""
    rows, n = found.contacts, len(A)
    stuck = rows.along.T @ (rows.kt[:, None] * rows.along)
    stuck += rows.normal.T @ ((rows.kn * rows.presses)[:, None] * rows.normal)
    first = np.block([[np.zeros((n, n)), np.eye(n)], [-A - inverse @ stuck, -B]])
    return float(np.abs(np.linalg.eigvals(first)).max())


def _numbers(values: Any) -> str:
    """Return an array as C writes it; an empty one as one with a 0."""
    if values.ndim == 0:
        return repr(values.item())
    return "{" + (", ".join(map(_numbers, values)) or ("0" if values.ndim == 1 else "{0}")) + "}"


def _guid(source: str) -> str:
    return str(uuid.uuid5(uuid.NAMESPACE_URL, source.partition("enum {")[2]))
