"""Random decks of the ring of bars: places and frames of nodes written in the ways of three programs.

What a frame is, is said here anew: directions by trigonometry at each node, from the manuals.
"""

import math
from pathlib import Path

import numpy as np

Array = np.ndarray
Rng = np.random.Generator


def turned(axis: Array, angle: float) -> Array:
    """Rotation by a quaternion."""
    w, (x, y, z) = math.cos(angle / 2), math.sin(angle / 2) * np.asarray(axis) / np.linalg.norm(axis)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def some_turn(rng: Rng) -> Array:
    return turned(rng.normal(size=3), rng.uniform(-3.0, 3.0))


def at(kind: str, origin: Array, axes: Array, place: Array) -> tuple[list[float], Array]:
    """Numbers of a place in a system R, C or S of Nastran, and the directions there as columns."""
    x, y, z = axes.T @ (place - origin)
    if kind == "R":
        return [x, y, z], axes
    phi = math.atan2(y, x)
    out, about = np.array([math.cos(phi), math.sin(phi), 0.0]), np.array([-math.sin(phi), math.cos(phi), 0.0])
    if kind == "C":
        return [math.hypot(x, y), math.degrees(phi), z], axes @ np.array([out, about, [0, 0, 1]]).T
    polar = math.atan2(math.hypot(x, y), z)
    up = np.array([0.0, 0.0, 1.0])
    radius = math.sin(polar) * out + math.cos(polar) * up
    down = math.cos(polar) * out - math.sin(polar) * up
    size = math.sqrt(x * x + y * y + z * z)
    return [size, math.degrees(polar), math.degrees(phi)], axes @ np.array([radius, down, about]).T


def nastran(rng: Rng, places: dict[int, Array], folder: Path) -> tuple[Path, dict[int, Array]]:
    """GRID in CP and CD of a chain of systems, with GRDSET, in large or free fields."""
    systems = {0: ("R", np.zeros(3), np.eye(3))}
    lines = ["SOL 103", "CEND", "BEGIN BULK"] if rng.random() < 0.5 else []
    large, fortran = bool(rng.random() < 0.5), rng.choice(["E", "D", ""])

    def real(value: float) -> str:
        text = f"{value:.9E}"
        return text if fortran == "E" else text.replace("E", fortran)

    def entry(name: str, fields: list[object]) -> None:
        texts = [real(f) if isinstance(f, float) else str(f) for f in fields]
        width = 4 if large else 8
        rows = [texts[i : i + width] for i in range(0, len(texts), width)]
        for i, row in enumerate(rows):
            if large:
                lines.append((f"{name}*" if i == 0 else "*").ljust(8) + "".join(f"{t:>16}" for t in row))
            else:
                lines.append(",".join([name.lower() if i == 0 else "+", *row]))

    for number in (5, 17, 3):
        rid = int(rng.choice(list(systems)))
        kind, origin, axes = systems[rid]
        own = str(rng.choice(["R", "C", "S"]))
        there, turn = rng.uniform(-0.3, 0.3, 3), some_turn(rng)
        points = [there, there + 0.7 * turn[:, 2], there + 0.4 * turn[:, 0] + 0.2 * turn[:, 2]]
        entry(f"CORD2{own}", [number, rid, *(v for p in points for v in at(kind, origin, axes, p)[0])])
        systems[number] = own, there, turn
    if rng.random() < 0.5:  # the whole deck turned round: what comes later defines what comes before
        head = next(i for i, line in enumerate(lines) if line.upper().startswith("CORD"))
        blocks: list[list[str]] = []
        for line in lines[head:]:
            blocks = (
                [*blocks, [line]] if line.upper().startswith("CORD") else [*blocks[:-1], [*blocks[-1], line]]
            )
        lines = lines[:head] + [line for block in blocks[::-1] for line in block]
    frames, default = {}, (int(rng.choice(list(systems))), int(rng.choice(list(systems))))
    if rng.random() < 0.5:
        entry("GRDSET", ["", default[0], "", "", "", default[1]])
    else:
        default = (0, 0)
    for node, place in places.items():
        cp, cd = (int(rng.choice(list(systems))) for _ in range(2))
        named = [cp if cp != default[0] else "", cd if cd != default[1] else ""]
        entry("GRID", [node, named[0], *map(float, at(*systems[cp], place)[0]), named[1]])
        frames[node] = at(*systems[cd], place)[1]
    path = folder / "model.bdf"
    path.write_text("\n".join([*lines, "ENDDATA", "GRID,1,,9.,9.,9."]) + "\n")
    return path, frames


def ansys(rng: Rng, places: dict[int, Array], folder: Path) -> tuple[Path, dict[int, Array]]:
    """NBLOCK or N with three angles, places in the global or a local system."""
    angles = {node: rng.uniform(-170, 170, 3) * (rng.random() < 0.8) * np.array(rng.random(3) < 0.7)
              for node in places}  # fmt: skip
    axes = {"z": (0, 0, 1), "x": (1, 0, 0), "y": (0, 1, 0)}

    def turn(three: Array) -> Array:  # each about axes that the ones before have turned
        R = np.eye(3)
        for letter, angle in zip("zxy", np.radians(three), strict=True):
            R = turned(R @ np.array(axes[letter]), angle) @ R
        return R

    lines = ["/PREP7"]
    if rng.random() < 0.5:
        lines += ["NBLOCK,6,SOLID,     99,     9", "(3i9,6e21.13e3)"]
        for node, place in places.items():
            row = f"{node:9d}{0:9d}{0:9d}" + "".join(f"{v:21.13E}" for v in [*place, *angles[node]])
            lines.append((row.replace("E", "D") if node % 2 else row).rstrip())
        lines += ["N,R5.3,LOC,       -1,"]
    else:
        origin, tilt, kind = rng.uniform(-0.2, 0.2, 3), rng.uniform(-80, 80, 3), int(rng.integers(2))
        if rng.random() < 0.5:
            lines.append(f"LOCAL,11,{kind}," + ",".join(f"{v:.14g}" for v in [*origin, *tilt]))
        else:
            origin, tilt = np.zeros(3), np.zeros(3)
            lines.append(f"CSYS,{kind}")
        for node, place in places.items():
            numbers = at("RC"[kind], origin, turn(tilt), place)[0]
            lines.append(f"N,{node}," + ",".join(f"{v:.14g}" for v in [*numbers, *angles[node]]) + " ! node")
    path = folder / "model.cdb"
    path.write_text("\n".join(lines) + "\n")
    return path, {node: turn(three) for node, three in angles.items()}


def abaqus(rng: Rng, places: dict[int, Array], folder: Path) -> tuple[Path, dict[int, Array]]:
    """*TRANSFORM, *SYSTEM, SYSTEM=C, INPUT=, and a part that its instance shifts and turns."""
    shift, spin, line = np.zeros(3), np.eye(3), np.zeros(3)
    instance = rng.random() < 0.5
    lines, tail = ["*HEADING", "GRID, N, a ring"], list[str]()
    if instance:
        shift, line, axis, angle = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3), rng.normal(size=3), 75.0
        spin = turned(axis, math.radians(angle))
        lines += ['*PART, NAME="the part"']
        tail = ["*END PART", "*ASSEMBLY, NAME=A", '*INSTANCE, NAME=I, PART="the part"',
                ", ".join(f"{v:.14g}" for v in shift),
                ", ".join(f"{v:.14g}" for v in [*line, *(line + axis), angle]),
                "*END INSTANCE", "*END ASSEMBLY"]  # fmt: skip
    here = {node: spin.T @ (place - line) + line - shift for node, place in places.items()}
    origin, axes = np.zeros(3), np.eye(3)
    if rng.random() < 0.5:
        origin = rng.uniform(-1, 1, 3)
        lines += ["*SYSTEM", ", ".join(f"{v:.14g}" for v in origin)]
        if rng.random() < 0.6:
            axes = some_turn(rng)
            b, c = origin + 2.0 * axes[:, 0], origin + axes[:, 1] - 0.4 * axes[:, 0]
            lines[-1] += ", " + ", ".join(f"{v:.14g}" for v in b)
            lines += [", ".join(f"{v:.14g}" for v in c)]
    polar = bool(rng.random() < 0.5)
    kind = "RC"[polar]
    data = [f"{node}, " + ", ".join(f"{v:.14E}".replace("E", "D") for v in at(kind, origin, axes, p)[0])
            for node, p in here.items()]  # fmt: skip
    lines += ["*NODE,", f" NSET=ALL{', SYSTEM=C' if polar else ''}"]
    if rng.random() < 0.5:
        (folder / "nodes.txt").write_text("\n".join(data) + "\n")
        lines[-1] += ", INPUT=nodes.txt"
    else:
        lines += data
    frames = {node: np.eye(3) for node in here}
    nodes = list(here)
    for i, kind in enumerate("RCS"):
        name, own = f'"set, {kind}"', nodes[3 * i : 3 * i + 3]
        a, b = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3)
        lines += [f"*NSET, NSET={name}", ", ".join(map(str, own)), f"*TRANSFORM, TYPE={kind}, NSET={name}",
                  ", ".join(f"{v:.14g}" for v in [*a, *b])]  # fmt: skip
        for node in own:
            frames[node] = spin @ _own(kind, a, b, here[node])
    path = folder / "model.inp"
    path.write_text("\n".join([*lines, *tail]) + "\n")
    return path, frames


def _own(kind: str, a: Array, b: Array, place: Array) -> Array:
    """Directions of *TRANSFORM as columns."""
    if kind == "R":
        one, three = a / np.linalg.norm(a), np.cross(a, b)
        three = three / np.linalg.norm(three)
        return np.stack([one, np.cross(three, one), three], axis=1)
    pole = (b - a) / np.linalg.norm(b - a)
    out = place - a
    if kind == "C":
        out = out - (out @ pole) * pole
    one = out / np.linalg.norm(out)
    two = np.cross(pole, one)
    two = two / np.linalg.norm(two)
    return np.stack([one, two, np.cross(one, two)], axis=1)
