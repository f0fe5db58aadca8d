"""Mistakes that people make, and what each message has to say: the field, the value, what would be right.

A mistake is made on one face (a file given to the command, the command, Python, REST): keys, units,
encodings, commas, paths, bounds and names in turn. `named`, `given` and `remedy` are what it must hold.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

SHIPPED = Path(__file__).parents[2] / "solver" / "scene" / "shipped"
TWO, WEDGE = ((SHIPPED / f"{name}.toml").read_text("utf-8") for name in ("two-dof", "platform-wedge"))
CSV = b"frequency [Hz],amplitude [m]\n1.0,1.5\n1.1,1.9\n1.2,1.7\n"
MTX = b"%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1.0\n2 2 1.0\n"
_DESIGN = {"kind": "design", "scene": "two-dof", "variables": {"damper.N0": [20, 1000]}}
_SOLVE = {"kind": "solve", "scene": "two-dof", "frequency_hz": 1.2}
_SWEEP = {"kind": "sweep", "scene": "two-dof"}
_BESIDE = {"data.csv": CSV, "K.mtx": MTX, "M.mtx": MTX, "two.toml": TWO.encode(), "blade/x.txt": b""}


class Mistake(NamedTuple):
    """What somebody does, and the words of the answer."""

    what: str
    named: str
    given: str
    remedy: str
    words: tuple[str, ...] = ()
    files: Mapping[str, bytes] = {}
    python: str = ""
    rest: tuple[str, str, Any] | None = None


def _file(change: str, by: str, named: str, given: str, remedy: str, of: str = TWO) -> Mistake:
    """A scene file with one thing changed."""
    assert change in of, change
    text = of.replace(change, by, 1)
    return Mistake(
        f"{change} -> {by}", named, given, remedy, ("sweep", "my.toml"), {"my.toml": text.encode()}
    )


def _wedge(change: str, by: str, named: str, given: str, remedy: str) -> Mistake:
    return _file(change, by, named, given, remedy, WEDGE)


def _raw(name: str, data: bytes, named: str, given: str, remedy: str) -> Mistake:
    """A file of some bytes in place of a scene."""
    return Mistake(f"{name} {data[:20]!r}", named, given, remedy, ("sweep", name), {name: data})


def _said(line: str, named: str, given: str, remedy: str, files: Mapping[str, bytes] = {}) -> Mistake:
    """A line of the command; a word with spaces has ~ for them."""
    words = tuple(word.replace("~", " ") for word in line.split())
    return Mistake(line, named, given, remedy, words, {**_BESIDE, **files})


def _python(code: str, named: str, given: str, remedy: str) -> Mistake:
    return Mistake(code, named, given, remedy, python=code)


def _post(body: Any, named: str, given: str, remedy: str) -> Mistake:
    return Mistake(f"POST {str(body)[:60]}", named, given, remedy, rest=("POST", "/v1/jobs", body))


def _get(path: str, named: str, given: str, remedy: str) -> Mistake:
    return Mistake(f"GET {path}", named, given, remedy, rest=("GET", path, None))


def _keys() -> Iterator[Mistake]:
    yield _file("masses =", "mases =", "/structure/mases", "m1", "did you mean `masses`?")
    yield _file("mu =", "Mu =", "/contacts/0/Mu", "0.3", "did you mean `mu`?")
    yield _file("N0 =", "n0 =", "/contacts/0/n0", "100.0", "did you mean `N0`?")
    yield _file("kt =", "k_t =", "/contacts/0/k_t", "30.0", "did you mean `kt`?")
    yield _file(
        'between = ["m2"', 'betwen = ["m2"', "/contacts/0/betwen", "ground", "did you mean `between`?"
    )
    yield _file("[observe]", "[observed]", "/observed", "m2", "did you mean `observe`?")
    yield _file("[excitation]", "[exitation]", "/exitation", "m1", "did you mean `excitation`?")
    yield _file("[[contacts]]", "[[contact]]", "/contact", "damper", "did you mean `contacts`?")
    yield _file("amplitude", "amplitud", "/excitation/amplitud", "100.0", "did you mean `amplitude`?")
    yield _file("band", "bands", "/observe/bands", "[0.2, 2.6]", "did you mean `band`?")
    yield _file("N1_ratio", "N1ratio", "/contacts/0/N1ratio", "0.3", "did you mean `N1_ratio`?")
    yield _file("k = 157.9", "stiffness = 157.9", "/structure/springs/0/stiffness", "157.9", "known keys: ")
    yield _file('"lumped"', '"lumpd"', "/structure/kind", "'lumpd'", "did you mean `lumped`?")
    yield _file(
        "mu = 0.3", 'law = "coloumb"\nmu = 0.3', "/contacts/0/law", "'coloumb'", "did you mean `coulomb`?"
    )
    yield _file("mu = 0.3", "", "/contacts/0/mu", "is missing", "a contact needs it")
    yield _file("[observe]", "[observe.x]", "/observe/dof", "is missing", "needs it")
    yield _file(
        '["m2", "ground"]', '["m3", "ground"]', "/contacts/0/between", "'m3'", "known: m1, m2, ground"
    )
    yield _file('dof = "m1"', 'dof = "M1"', "/excitation/dof", "'M1'", "did you mean `m1`?")
    yield _file('dof = "m2"', 'dof = "m22"', "/observe/dof", "'m22'", "did you mean `m2`?")
    yield _file(
        "[excitation]",
        '[[contacts]]\nname = "damper"\nbetween = ["m1", "ground"]\nkt = 1.0\nmu = 0.1\n'
        "N0 = 1.0\n[excitation]",
        "/contacts/1/name",
        "'damper'",
        "must differ",
    )
    yield _wedge('shape = "wedge"', 'shape = "wegde"', "/dampers/0/shape", "'wegde'", "did you mean `wedge`?")
    yield _wedge("angle = 0.35", "", "/dampers/0/angle", "is missing", "needs it")
    yield _wedge("length = 0.004", "lenght = 0.004", "/dampers/0/lenght", "0.004", "did you mean `length`?")
    yield _post({**_SOLVE, "harmonic": 5}, "/harmonic", "`harmonic`", "did you mean `harmonics`?")
    yield _post({**_SOLVE, "kind": "desing"}, "/kind", "'desing'", "did you mean `design`?")
    yield _post({"kind": "solve", "frequency_hz": 1.2}, "/scene", "`scene`", "is missing")


def _units() -> Iterator[Mistake]:
    yield _wedge(
        "angle = 0.35",
        "angle = 35",
        "/dampers/0/angle",
        "got 35",
        'below 1.5 rad (86°), got 35: in rad, or "35 deg"',
    )
    yield _wedge("angle = 0.35", 'angle = "20 mm"', "/dampers/0/angle", "'20 mm'", "rad or deg")
    yield _wedge("width = 0.012", 'width = "12 kg"', "/dampers/0/width", "'12 kg'", "mm")
    yield _file("[0.2, 2.6]", '[0.2, "2.6 s"]', "/observe/band", "'2.6 s'", "Hz")
    yield _file("mu = 0.3", 'mu = "0.3 N"', "/contacts/0/mu", "'0.3 N'", "without a unit")
    yield _file("kt = 30.0", 'kt = "30 N/ell"', "/contacts/0/kt", "'30 N/ell'", "N/mm")
    yield _file("amplitude = 100.0", 'amplitude = "100 kp"', "/excitation/amplitude", "'100 kp'", "kN")
    yield _file("m1 = 1.0", 'm1 = "1 N"', "/structure/masses/m1", "'1 N'", "kg")
    yield _wedge("speed = 4000.0", 'speed = "4000 m"', "/speed", "'4000 m'", "1/min")
    yield _said(
        "solve platform-wedge --frequency 320 --set wedge.angle=35",
        "wedge.angle",
        "35",
        'in rad, or "35 deg"',
    )
    yield _said(
        "solve platform-wedge --frequency 320 --set wedge.angle=20~mm", "wedge.angle", "20 mm", "rad or deg"
    )
    yield _said("solve two-dof --frequency 1.2N", "--frequency", "1.2N", "Hz")
    yield _said("design two-dof --variable damper.N0 20m 3000", "damper.N0", "20m", "kN")
    yield _said("sweep two-dof --limit 3kg", "--limit", "3kg", "mm")
    yield _said(
        "identify two-dof bad.csv --unknown damper.mu 0.1 1",
        "amplitude",
        "ell",
        "µm",
        {"bad.csv": CSV.replace(b"[m]", b"[ell]")},
    )
    yield _said(
        "identify two-dof data.csv --column amplitude=amplitude:ell --unknown damper.mu 0.1 1",
        "amplitude",
        "ell",
        "mm",
    )
    yield _said("import M.mtx K.mtx --out new.toml --dof a=0 --units mmm", "--units", "mmm", "mm")
    yield _said("db prune --older-than 30days", "--older-than", "30days", "30d")
    yield _python(
        'stickslip.load_scene("platform-wedge").with_values({"wedge.angle": 35})',
        "wedge.angle",
        "35",
        'in rad, or "35 deg"',
    )
    yield _python('stickslip.new_scene("platform-damper", angle=35.0)', "angle", "35", 'or "35 deg"')
    yield _post({**_SOLVE, "set": {"damper.N0": "3 mm"}}, "/set/damper.N0", "3 mm", "must be a number")
    yield _post({**_SOLVE, "frequency_hz": "1 N"}, "/frequency_hz", "1 N", "number")


def _encodings() -> Iterator[Mistake]:
    yield _raw("my.toml", TWO.encode("utf-16"), "my.toml", "UTF-16", "save it as UTF-8")
    yield _raw(
        "my.toml", TWO.replace("chain", "Kette für").encode("latin-1"), "my.toml", "byte", "save it as UTF-8"
    )
    yield _raw("my.toml", b"\x1f\x8b\x08\x00\x00", "my.toml", "gzip", "unpack it")
    yield _file('name = "two-dof"', "name = “two-dof”", "my.toml", "line 3", 'plain quotes, "')
    yield _file(
        'kind = "lumped"', 'kind = "matrices"\nM = "C:\\new\\M.mtx"', "my.toml", "line 7", "paths with /"
    )
    yield _raw("my.json", b'{"name": "two-dof",}', "my.json", "line 1", "comma")
    yield _raw("my.json", b"{'name': 'two-dof'}", "my.json", "line 1", "double quotes")
    yield _said(
        "identify two-dof bad.csv --unknown damper.mu 0.1 1",
        "bad.csv",
        "zip",
        "CSV",
        {"bad.csv": b"PK\x03\x04\x14\x00\x00\xff\xfe"},
    )
    yield _post(b'{"kind": "solve"', "body", "line 1", "JSON")
    yield _post(b'{"kind": "\xff"}', "body", "byte", "UTF-8")


def _commas() -> Iterator[Mistake]:
    yield _file("mu = 0.3", "mu = 0,3", "my.toml", "0,3", "a decimal point, as in 0.3")
    yield _file("[0.2, 2.6]", "[0,2, 2,6]", "/observe/band", "[0, 2, 2, 6]", "2 entries")
    yield _file(
        "amplitude = 100.0", 'amplitude = "1,5"', "/excitation/amplitude", "'1,5'", "decimal point, as in 1.5"
    )
    yield _file("kt = 30.0", 'kt = "30,5 N/m"', "/contacts/0/kt", "'30,5 N/m'", "decimal point, as in 30.5")
    yield _said("solve two-dof --frequency 1,2", "--frequency", "1,2", "1.2")
    yield _said("solve two-dof --frequency 1.2 --set damper.mu=0,3", "--set", "0,3", "0.3")
    yield _said("design two-dof --variable damper.N0 20,5 3000", "--variable", "20,5", "20.5")
    yield _said("design two-dof --max-peak 0,01", "--max-peak", "0,01", "0.01")
    yield _said("solve two-dof --frequency 1.2 --harmonics 5,5", "--harmonics", "5,5", "whole number")
    yield _said("identify two-dof data.csv --unknown damper.mu 0,1 1", "--variable", "0,1", "0.1")
    yield _raw("my.json", b'{"speed": 0,3}', "my.json", "line 1", "decimal point")
    yield _post({**_SOLVE, "frequency_hz": "1,2"}, "/frequency_hz", "1,2", "1.2")
    yield _python(
        'stickslip.load_scene("two-dof").with_values({"damper.mu": "0,3"})', "damper.mu", "0,3", "0.3"
    )


def _paths() -> Iterator[Mistake]:
    yield _said("sweep two-doff", "no scene", "'two-doff'", "did you mean 'two-dof'?")
    yield _said("sweep tow.toml", "no scene", "'tow.toml'", "did you mean 'two.toml'?")
    yield _said("sweep K.mtx", "no scene", "'K.mtx'", "stickslip import")
    yield _said("sweep data.csv", "no scene", "'data.csv'", "stickslip identify")
    yield _said("sweep mesh.inp", "no scene", "'mesh.inp'", "stickslip import", {"mesh.inp": b"*NODE\n"})
    yield _said("sweep modes.uff", "no scene", "'modes.uff'", "stickslip identify", {"modes.uff": b""})
    yield _said("sweep blade", "no scene", "'blade'", "folder")
    yield _said(
        "design result.json",
        "no scene",
        "'result.json'",
        "stickslip check-proof",
        {"result.json": b'{"kind": "design", "values": {}, "status": "x"}'},
    )
    yield _said(
        "design problem.toml",
        "no scene",
        "'problem.toml'",
        "--problem problem.toml",
        {"problem.toml": b'scene = "two-dof"\n[variables]\n"damper.N0" = [1, 2]\n'},
    )
    yield _said(
        "sweep two-dof --parameter damper.N9", "--parameter", "'damper.N9'", "did you mean `damper.N0`?"
    )
    yield _said(
        "sweep two-dof --parameter dampr.kt", "--parameter", "'dampr.kt'", "did you mean `damper.kt`?"
    )
    yield _said(
        "solve two-dof --frequency 1 --set damperN0=5", "--set", "'damperN0'", "did you mean `damper.N0`?"
    )
    yield _said("solve two-dof --frequency 1 --set damper.N0", "--set", "'damper.N0'", "PATH=VALUE")
    yield _said(
        "design two-dof --variable damper.k 1 2", "--variable", "damper.k", "did you mean `damper.kt`?"
    )
    yield _said("sweep two-dof --out result.xyz", "--out", "'result.xyz'", ".csv")
    yield _said("sweep two-dof --out nowhere/result.csv", "--out", "'nowhere/result.csv'", "no folder")
    yield _said("sweep two-dof --plot pic.bmp", "--plot", "'pic.bmp'", ".png")
    yield _said("design --problem missing.toml", "--problem", "'missing.toml'", "No such file")
    yield _said("design --problem data.csv", "--problem", "'data.csv'", ".toml, .json")
    yield _said("design two-dof --report r.docx", "--report", "'r.docx'", ".html, .pdf")
    yield _said(
        "identify two-dof missing.csv --unknown damper.mu 0.1 1",
        "missing.csv",
        "missing.csv",
        "a file that is there",
    )
    yield _said("import M.mtx nothing.mtx --out new.toml --dof a=0", "FILES", "nothing.mtx", "no file")
    yield _said("import M.mtx K.mtx --out two.toml --dof a=0", "--out", "'two.toml'", "another name")
    yield _said("sweep two-dof --without bumper", "--without", "'bumper'", "damper")
    yield _python('stickslip.load_scene("two dof")', "scene", "'two dof'", "did you mean 'two-dof'?")
    yield _python(
        'stickslip.load_scene("two-dof").with_values({"damper.n0": 1.0})',
        "path",
        "'damper.n0'",
        "did you mean `damper.N0`?",
    )
    yield _python('stickslip.load_scene("two-dof").value("damper")', "path", "'damper'", "damper.N0")
    yield _post({**_SOLVE, "scene": "twodof"}, "/scene", "'twodof'", "two-dof")
    yield _get("/v1/jobs/xyz", "job", "'xyz'", "there is no job")
    yield _get("/v1/jobz", "/v1/jobz", "/v1/jobz", "/v1/jobs")


def _bounds() -> Iterator[Mistake]:
    yield _file("mu = 0.3", "mu = -0.3", "/contacts/0/mu", "-0.3", "must be >= 0")
    yield _file("kt = 30.0", "kt = 0", "/contacts/0/kt", "got 0", "must be > 0 N/m")
    yield _file("m1 = 1.0", "m1 = 0.0", "/structure/masses/m1", "got 0", "must be > 0 kg")
    yield _file("[0.2, 2.6]", "[2.6, 0.2]", "/observe/band", "[2.6, 0.2]", "low < high")
    yield _file("[0.2, 2.6]", "[0.0, 2.6]", "/observe/band", "0.0", "must be > 0 Hz")
    yield _file("N0 = 100.0", "N0 = nan", "/contacts/0/N0", "nan", "finite number")
    yield _file("kt = 30.0", "kt = 1e99", "/contacts/0/kt", "1e+99", "<= 1e15 N/m")
    yield _said("solve two-dof --frequency 1.2 --harmonics -1", "--harmonics", "got -1", "from 0")
    yield _said("sweep two-dof --from 5 --to 5", "--to", "5.0", "must differ from `--from`")
    yield _said("design two-dof --variable damper.N0 3000 20", "damper.N0", "[3000.0, 20.0]", "low < high")
    yield _said("solve two-dof --frequency -1", "--frequency", "-1", "> 0")
    yield _said("solve two-dof --frequency 1.2 --set damper.mu=-1", "damper.mu", "-1", ">= 0")
    yield _said("serve --port 99999", "port", "99999", "65535")
    yield _post({**_SOLVE, "harmonics": 100000}, "/harmonics", "100000", "less than or equal to 200")
    yield _post({**_SWEEP, "from": 2, "to": 2}, "/to", "2", "must differ from")
    yield _python('stickslip.solve("two-dof", frequency_hz=-1.0)', "frequency_hz", "-1", "> 0 Hz")
    yield _python('stickslip.solve("two-dof", frequency_hz=float("nan"))', "frequency_hz", "nan", "> 0 Hz")
    yield _python(
        'stickslip.solve("two-dof", frequency_hz=1.2, harmonics=2.5)', "harmonics", "2.5", "whole number"
    )
    yield _python(
        'stickslip.design("two-dof", variables={"damper.N0": (5.0,)})', "damper.N0", "5.0", "two numbers"
    )


def _names() -> Iterator[Mistake]:
    yield _said("swep two-dof", "command", "'swep'", "Did you mean 'sweep'?")
    yield _said("sweep two-dof --freqency 1", "--freqency", "--freqency", "--frequency")
    yield _said("sweep two-dof --from", "--from", "requires an argument", "--from")
    yield _said("solve two-dof", "--frequency", "issing", "frequency")
    yield _said("design two-dof --method minmax", "--method", "'minmax'", "did you mean `minimax`?")
    yield _said(
        "sweep two-dof --effects even-harmonic",
        "--effects",
        "even-harmonic",
        "did you mean `even-harmonics`?",
    )
    yield _said("schema scen", "schema", "'scen'", "did you mean `scene`?")
    yield _said(
        "new my.toml --like platform-wegde", "--like", "'platform-wegde'", "did you mean `platform-wedge`?"
    )
    yield _said("new two.toml", "two.toml", "exists", "--force")
    yield _said("design two-dof --limt 3", "--limt", "--limt", "--limit")
    yield _python("stickslip.desgin", "stickslip", "desgin", "Did you mean: 'design'?")
    yield _python(
        'stickslip.sweep("two-dof", paramter="damper.N0")', "sweep", "paramter", "did you mean `parameter`?"
    )
    yield _python('stickslip.load_scene("two-dof").observ', "Scene", "observ", "Did you mean: 'observe'?")
    yield _python(
        'stickslip.solve("two-dof", frequency=1.2)', "solve", "frequency", "did you mean `frequency_hz`?"
    )


MISTAKES = [*_keys(), *_units(), *_encodings(), *_commas(), *_paths(), *_bounds(), *_names()]


def body_of(sent: Any) -> bytes:
    """What is sent of a body."""
    return sent if isinstance(sent, bytes) else json.dumps(sent).encode()
