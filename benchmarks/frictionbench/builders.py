"""The cases, ladder by ladder: small builders whose JSON is what others read (`python -m benchmarks.frictionbench build`)."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.frictionbench.model import HERE, Case

_Dict = dict[str, Any]
BESIDE = 40  # rows from which matrices stand beside a case


def lumped(masses: dict[str, float], *springs: tuple[Any, ...], sectors: int = 1) -> _Dict:
    """Return a structure of masses and springs (a, b, k, c); `b` may be in the next sector, `a@next`."""
    dofs = list(masses)
    n = len(dofs)
    made = {key: np.zeros((n, n)) for key in ("C", "K", "K_next", "C_next")}
    for a, b, k, c in springs:
        i, j = dofs.index(a), None if b == "ground" else dofs.index(b.removesuffix("@next"))
        for key, value in (("K", k), ("C", c)):
            made[key][i, i] += value
            if j is None:
                continue
            made[key][j, j] += value
            if b.endswith("@next"):
                made[f"{key}_next"][i, j] -= value
            else:
                made[key][i, j] -= value
                made[key][j, i] -= value
    structure: _Dict = {"dofs": dofs, "M": np.diag(list(masses.values())).tolist()}
    structure |= {key: made[key].tolist() for key in "CK"}
    if sectors > 1:
        structure |= {"sectors": sectors, **{key: made[key].tolist() for key in ("K_next", "C_next")}}
    return structure


def one_mass(c: float = 0.05) -> _Dict:
    """Return a mass of 1 kg on a spring of 1 N/m."""
    return lumped({"x": 1.0}, ("x", "ground", 1.0, c))


def slider(
    kt: Any, limit: float, at: str = "x", to: str = "ground", name: str = "damper", **more: Any
) -> _Dict:
    """Return a friction contact with μ = 0.5 and the slip limit of its mean load."""
    return {
        "name": name,
        "law": "coulomb",
        "between": [at, to],
        "kt": kt,
        "mu": 0.5,
        "N0": 2.0 * limit,
        **more,
    }


def stop(k: float, gap: float, at: str = "x", to: str = "ground", name: str = "stop") -> _Dict:
    """Return a spring on one side."""
    return {"name": name, "law": "gap", "between": [at, to], "k": k, "gap": gap}


def push(dof: str = "x", amplitude: float = 1.0, **more: Any) -> list[_Dict]:
    """Return one force."""
    return [{"dof": dof, "amplitude": amplitude, **more}]


def at(beta: float, dof: str = "x", what: str = "amplitude", **more: Any) -> _Dict:
    """Ask for an amplitude at ω = β rad/s."""
    return {"what": what, "dof": dof, "frequency_hz": beta / (2.0 * math.pi), **more}


def hertz(hz: float, dof: str, what: str = "amplitude") -> _Dict:
    """Ask for an amplitude at a frequency [Hz]."""
    return {"what": what, "dof": dof, "frequency_hz": hz}


def over(low: float, high: float, dof: str, **more: Any) -> _Dict:
    """Ask for the highest peak between two frequencies [Hz]."""
    return {"what": "peak", "dof": dof, "band_hz": [low, high], **more}


def named(name: str, words: str, structure: _Dict, contacts: list[_Dict], loads: list[_Dict], asked: _Dict, source: str = "", **more: Any) -> Case:  # fmt: skip
    """Return a case without its ladder and number."""
    return {
        "schema": 1, "name": name, "words": words, "source": source, "structure": structure,
        "contacts": contacts, "loads": loads, "asked": asked, **more,
    }  # fmt: skip


def closed_forms() -> Iterator[Case]:
    """Den Hartog, Griffin, Sinha and Griffin, Goodman and Klumpp, rig loops, Iwan, Whitehead."""
    hartog = "J. P. Den Hartog, Trans. ASME APM-53-9 (1931) 107"
    for beta, limit, kind in (
        (0.8, 0.3, "without stops"),
        (1.5, 0.2, "without stops"),
        (0.5, 0.85, "with stops"),
    ):
        name = f"den-hartog-{'stops' if 'with ' in kind else f'{beta:g}'}"
        yield named(name, f"Rigid Coulomb friction on an undamped mass, {kind}.", one_mass(0.0),
                    [slider("inf", limit)], push(), at(beta), hartog)  # fmt: skip
    griffin = "J. H. Griffin, J. Eng. Power 102 (1980) 329"
    hz = math.sqrt(1.25) / (2.0 * math.pi)
    yield named("griffin-peak", "Peak of an undamped blade with an elastic slider, one harmonic.", one_mass(0.0),
                [slider(0.5, 2.0)], push(), over(0.5 * hz, 1.5 * hz, "x", harmonics=1), griffin)  # fmt: skip
    yield named("griffin-optimum", "The load that makes the peak least, one harmonic.", one_mass(0.0), [slider(0.5, 2.0)],
                push(), {"what": "least-peak", "dof": "x", "band_hz": [0.5 * hz, 1.5 * hz], "harmonics": 1,
                         "variable": "damper.N0", "range": [1.8, 12.0]}, griffin)  # fmt: skip
    sinha = "A. Sinha, J. H. Griffin, J. Aircraft 20 (1983) 372"
    for which in ("attracting", "repelling"):
        yield named(f"sinha-griffin-{which}", f"Flutter held by friction, one harmonic: the {which} limit cycle.",
                    one_mass(-0.02), [slider(0.2, 0.4)], [], {"what": "limit-cycle", "dof": "x", "which": which,
                    "harmonics": 1, "guess_hz": 0.16}, sinha)  # fmt: skip
    n, EA, q, F = 4, 1.0, 1.0, 0.7
    h = 1.0 / n
    dofs = {f"x{i}": 0.05 for i in range(n)}
    springs = [(f"x{i}", f"x{i + 1}", EA / h, 0.15 * EA / h) for i in range(n - 1)]
    yield named("goodman-klumpp-bar", "A bar in four pieces under distributed friction, slowly pulled at its end.",
                lumped(dofs, *springs), [slider(8.0, q * h, f"x{i}", name=f"f{i}") for i in range(n)],
                push("x0", F), at(0.3, "x0", "loss"),
                "L. E. Goodman, J. H. Klumpp, J. Appl. Mech. 23 (1956) 421: 2F³/(3EAq) of the continuum",
                )  # fmt: skip
    yield named("rig-loop", "Loss of a cycle of one slider in a rig.", one_mass(0.1), [slider(2.0, 0.5)], push(), at(1.1, what="loss"))  # fmt: skip
    iwan = [slider(0.3, 0.05 * (i + 1), name=f"j{i}") for i in range(5)]
    yield named("iwan-5", "Five sliders in parallel, Iwan's model of a joint.", one_mass(0.02), iwan, push(), at(1.2),
                "W. D. Iwan, J. Appl. Mech. 33 (1966) 893")  # fmt: skip
    yield named("iwan-5-loss", "Loss of a cycle of the same joint.", one_mass(0.02), iwan, push(), at(1.2, what="loss"),
                "W. D. Iwan, J. Appl. Mech. 33 (1966) 893")  # fmt: skip
    ring = lumped({"b": 1.0}, ("b", "ground", 1.0, 0.0), ("b", "b@next", 0.05, 0.0), sectors=6)
    yield named("whitehead-6", "Greatest amplification of six mistuned blades: a supremum, approached and never reached.",
                ring, [], push("b"), {"what": "amplification", "dof": "b"},
                "D. S. Whitehead, J. Mech. Eng. Sci. 8 (1966) 15", engine_order=1)  # fmt: skip


def oscillators() -> Iterator[Case]:
    """One mass: stops, separation, loads that vary."""
    yield named("one-slider", "One elastic slider.", one_mass(), [slider(1.0, 0.4)], push(), at(1.2))
    yield named(
        "one-slider-below",
        "The same at a third of its resonance.",
        one_mass(),
        [slider(1.0, 0.3)],
        push(),
        at(0.35),
    )
    yield named("two-stops", "Stops on both sides.", one_mass(0.1), [stop(2.0, 0.6), {**stop(2.0, 0.6, "ground", "x"), "name": "other"}], push(), at(1.3))  # fmt: skip
    yield named("one-stop", "A stop on one side.", one_mass(0.1), [stop(3.0, 0.5)], push(), at(0.9))
    yield named("pressed-stop", "A stop pressed at rest.", one_mass(0.1), [stop(1.0, -0.3)], push(), at(1.0))
    yield named(
        "moving-load",
        "The load varies with the motion.",
        one_mass(),
        [slider(1.0, 0.4, N1=0.5)],
        push(),
        at(1.2),
    )
    yield named(
        "moving-load-phase",
        "The load varies out of phase.",
        one_mass(),
        [slider(1.0, 0.4, N1=0.6, N1_phase=1.2)],
        push(),
        at(1.1),
    )
    yield named(
        "separation",
        "The load opens the contact once a period.",
        one_mass(),
        [slider(1.0, 0.4, N1=1.4, N1_phase=0.4)],
        push(),
        at(1.2),
    )
    yield named("three-harmonics", "Forces of orders 1, 2 and 3.", one_mass(), [slider(1.0, 0.4)],
                [*push(), *push(amplitude=0.4, harmonic=2, phase=0.5), *push(amplitude=0.3, harmonic=3, phase=2.0)], at(0.6))  # fmt: skip
    yield named(
        "rigid-and-stop",
        "Rigid friction and a stop.",
        one_mass(0.02),
        [slider("inf", 0.3), stop(2.0, 0.8)],
        push(),
        at(1.1),
    )


def the_paper() -> Iterator[Case]:
    """The two scenes of the paper (doi 10.1177/1461348419834759)."""
    doi = "doi 10.1177/1461348419834759"
    k1, k2 = 4.0 * math.pi**2, 2.0 * math.pi**2
    case_a = lumped(
        {"m1": 1.0, "m2": 1.0}, ("m1", "ground", k1, 0.5), ("m1", "m2", k2, 0.5), ("m2", "ground", k1, 0.5)
    )
    two = lumped(
        {"m1": 1.0, "m2": 1.0}, ("m1", "ground", 16 * math.pi**2, 0.5), ("m1", "m2", 4 * math.pi**2, 0.5)
    )
    damper = lambda N0, N1: {"name": "damper", "law": "coulomb", "between": ["m2", "ground"], "kt": 30.0, "mu": 0.3, "N0": N0, "N1": N1}  # noqa: E731 # fmt: skip
    force = push("m1", 100.0)
    yield named(
        "case-a",
        "Two masses, one slider, at the resonance.",
        case_a,
        [damper(100.0, 0.0)],
        force,
        hertz(1.01436, "m2"),
    )
    for N0, N1 in ((100.0, 0.0), (100.0, 80.0), (300.0, 200.0), (100.0, 150.0)):
        yield named(
            f"case-a-peak-{N0:g}-{N1:g}",
            "Its highest peak.",
            case_a,
            [damper(N0, N1)],
            force,
            over(0.8, 1.3, "m2"),
        )
    yield named(
        "two-dof", "The paper's two masses.", two, [damper(100.0, 30.0)], force, hertz(1.198, "m2"), doi
    )
    yield named("two-dof-stuck", "The contact sticks: any mean within its limit is a solution.", two, [damper(100.0, 0.0)], force,
                hertz(0.769, "m2", "half-peak-to-peak"), doi)  # fmt: skip
    K = [("tip", "middle", 5.09e5), ("middle", "root", 8.26e6), ("root", "disk", 1.71e6),
         ("disk", "disk@next", 1.03e5), ("disk", "ground", 4.33e6)]  # fmt: skip
    disk = lumped(
        {"tip": 0.02, "middle": 0.03, "root": 0.04, "disk": 0.12},
        *((a, b, k, 1e-6 * k) for a, b, k in K),
        sectors=8,
    )
    shroud = {"name": "shroud", "law": "coulomb", "between": ["tip", "tip@next"], "kt": 5.53e6, "mu": 0.3}
    root = {
        "name": "root",
        "law": "coulomb",
        "between": ["root", "disk"],
        "kt": 1.91e6,
        "mu": 0.3,
        "N0": 5000.0,
    }
    for N0, N1, hz in ((200.0, 60.0, 755.0), (200.0, 60.0, 700.0), (100.0, 30.0, 645.0)):
        yield named(f"bladed-disk-{hz:g}", "The paper's disk of eight blades with shrouds.", disk,
                    [{**shroud, "N0": N0, "N1": N1}, root], push("middle", 50.0), hertz(hz, "tip"), doi, engine_order=1)  # fmt: skip


def chain(n: int, sliders: list[int]) -> tuple[_Dict, list[_Dict]]:
    """Return masses in a row, each to the ground, with sliders on some."""
    names = [f"x{i}" for i in range(n)]
    springs = [(a, "ground", 1.0, 0.03) for a in names] + [(a, b, 0.5, 0.03) for a, b in pairwise(names)]
    contacts = [slider(0.8, 0.25 + 0.05 * i, names[i], name=f"f{i}") for i in sliders]
    return lumped(dict.fromkeys(names, 1.0), *springs), contacts


def chains() -> Iterator[Case]:
    """Chains, rings and lumped disks."""
    for n, on in ((2, [1]), (3, [0, 2]), (5, [0, 2, 4]), (8, list(range(8)))):
        structure, contacts = chain(n, on)
        yield named(
            f"chain-{n}",
            f"{n} masses in a row, {len(on)} sliders.",
            structure,
            contacts,
            push("x0"),
            at(1.15, "x0"),
        )
    ring = lumped(
        {"b": 1.0, "d": 3.0},
        ("b", "d", 1.0, 0.02),
        ("d", "d@next", 2.0, 0.0),
        ("d", "ground", 1.0, 0.05),
        sectors=6,
    )
    between = [slider(0.6, 0.3, "b", "b@next", name="shroud")]
    for order in (1, 2, 3):
        yield named(f"ring-6-order-{order}", f"Six blades, neighbours rub, engine order {order}.", ring, between, push("b"),
                    at(1.05, "b"), engine_order=order)  # fmt: skip
    laxalde = lumped({"disk": 1.2, "b1": 0.35, "b2": 0.25}, ("disk", "disk@next", 5e7, 25.0), ("disk", "ground", 6e5, 0.3),
                     ("disk", "b1", 1e6, 2.0), ("b1", "b2", 2e6, 2.0), sectors=24)  # fmt: skip
    ring_damper = slider(2e6, 2.0, "disk", name="ring")
    yield named("laxalde-24", "A split ring under the rim of a lumped disk of 24 blades.", laxalde, [ring_damper], push("b2", 10.0),
                hertz(249.0, "b2"), "D. Laxalde, F. Thouverez, J.-J. Sinou, J.-P. Lombard, Eur. J. Mech. A 26 (2007) 676",
                engine_order=4)  # fmt: skip


def floating() -> Iterator[Case]:
    """Bodies held by contacts alone, and normal loads that move."""
    blades = lumped(
        {"b1": 0.1, "b2": 0.1, "d": 0.005}, ("b1", "ground", 4e5, 0.5), ("b2", "ground", 4.1e5, 0.5)
    )
    both = lambda N0: [slider(1e6, 0.5 * N0, "d", b, name=b) for b in ("b1", "b2")]  # noqa: E731
    for N0, hz in ((50.0, 330.0),):
        yield named(f"floating-{N0:g}", "A damper that two blades hold by friction alone.", blades, both(N0), push("b1", 20.0),
                    hertz(hz, "b1", "half-peak-to-peak"))  # fmt: skip
    under = lumped({"b": 0.1, "disk": 0.6, "d": 0.005}, ("b", "disk", 6e5, 0.6), ("disk", "disk@next", 4e6, 0.0),
                   ("disk", "ground", 2e6, 1.0), sectors=6)  # fmt: skip
    yield named("underplatform-6", "A damper between each two of six blades.", under,
                [slider(2e6, 30.0, "d", "b", name="L"), slider(2e6, 30.0, "d", "b@next", name="R")], push("b", 10.0),
                hertz(340.0, "b", "half-peak-to-peak"), engine_order=1)  # fmt: skip
    wedge = lumped(
        {"t": 1.0, "n": 1.0}, ("t", "ground", 1.0, 0.05), ("n", "ground", 2.0, 0.05), ("t", "n", 0.4, 0.02)
    )
    normal = {
        "law": "elastic-normal",
        "between": ["t", "ground"],
        "normal_between": ["n", "ground"],
        "kt": 1.0,
        "kn": 0.8,
        "mu": 0.4,
    }
    for N0, load, beta in ((1.5, 1.0, 1.1), (0.5, 1.0, 1.25), (-0.2, 1.2, 1.1)):
        yield named(f"elastic-normal-{N0:g}".replace("--", "-gap-"), "The load moves with the parts, and may open.", wedge,
                    [{"name": "face", **normal, "N0": N0}], push("t", load), at(beta, "t"))  # fmt: skip
    flat = lumped({"b": 1.0, "bn": 1.0, "w": 0.1, "wn": 0.1}, ("b", "ground", 1.0, 0.04), ("bn", "ground", 1.5, 0.04),
                  ("b", "bn", 0.3, 0.0), ("w", "ground", 0.05, 0.02), ("wn", "ground", 0.05, 0.02))  # fmt: skip
    face = {
        "law": "elastic-normal",
        "between": ["b", "w"],
        "normal_between": ["bn", "wn"],
        "kt": 1.0,
        "kn": 1.0,
        "mu": 0.5,
    }
    yield named("wedge", "A light wedge against a platform and the ground, loads moving.", flat,
                [{"name": "upper", **face, "N0": 1.0},
                 {"name": "lower", **face, "between": ["w", "ground"], "normal_between": ["wn", "ground"], "N0": 1.2}],
                push("b"), at(1.15, "b"))  # fmt: skip


def patch(nodes: int, limit: str) -> Case:
    """Return a block of three motions on a face of `nodes` contacts in space, each on its own small springs."""
    side = math.ceil(math.sqrt(nodes))
    names, springs = {"x": 1.0, "y": 1.0, "z": 1.0}, [("x", "ground", 1.0, 0.04), ("y", "ground", 1.4, 0.04), ("z", "ground", 3.0, 0.1), ("x", "y", 0.1, 0.0), ("x", "z", 0.3, 0.02), ("y", "z", 0.2, 0.0)]  # fmt: skip
    contacts = []
    for i in range(nodes):
        a, b = (i % side - 0.5 * (side - 1)) / side, (i // side - 0.5 * (side - 1)) / side
        if nodes > 1:
            names |= {f"{d}{i}": 0.02 / nodes for d in "xyz"}
            springs += [(f"{d}{i}", d, 30.0 / nodes, 0.3 / nodes) for d in "xyz"]
        x, y, z = ((f"{d}{i}" if nodes > 1 else d) for d in "xyz")
        contacts.append({
            "name": f"p{i}", "law": "coulomb-3d", "limit": limit, "between": [x, "ground"], "between_second": [y, "ground"],
            "normal_between": [z, "ground"], "kt": 3.0 / nodes, "kn": 3.0 / nodes, "mu": 0.4, "prestressed": False,
            "N0": round((1.0 + 0.6 * a - 0.3 * b * b) / nodes, 6),
        })  # fmt: skip
    words = f"A face of {nodes} contacts in space, limit {limit}."
    return named(f"patch-{nodes}-{limit}", words, lumped(names, *springs), contacts,
                 [*push("x", 0.8), *push("y", 0.5, phase=1.0)], at(1.3, "x"))  # fmt: skip


def patches() -> Iterator[Case]:
    """Faces in space."""
    for nodes, limit in (
        (1, "box"),
        (1, "circle"),
        (3, "box"),
        (10, "circle"),
        (30, "circle"),
        (122, "circle"),
    ):
        yield patch(nodes, limit)


def flutter() -> Iterator[Case]:
    """Limit cycles of what gas feeds, all harmonics."""

    def cycle(dof: str, hz: float, which: str = "attracting") -> _Dict:
        return {"what": "limit-cycle", "dof": dof, "which": which, "guess_hz": hz}

    for kt, c in ((0.2, -0.02), (1.0, -0.1), (0.5, -0.06)):
        yield named(
            f"flutter-{kt:g}",
            "One mass that is fed, held by a slider.",
            one_mass(c),
            [slider(kt, 0.4)],
            [],
            cycle("x", 0.2),
        )
    yield named("flutter-repelling", "The repelling cycle beyond which friction holds no more.", one_mass(-0.1), [slider(1.0, 0.4)], [],
                cycle("x", 0.17, "repelling"))  # fmt: skip
    two = lumped(
        {"a": 1.0, "b": 0.7}, ("a", "ground", 1.0, -0.06), ("a", "b", 0.6, 0.0), ("b", "ground", 0.5, 0.02)
    )
    yield named("flutter-two", "Two masses, one fed.", two, [slider(0.4, 0.3, "b")], [], cycle("a", 0.16))
    yield named(
        "flutter-stop",
        "Held by a slider, with a spring that engages.",
        one_mass(-0.05),
        [slider(0.5, 0.4), stop(0.5, 1.0)],
        [],
        cycle("x", 0.19),
    )


def hard() -> Iterator[Case]:
    """Light damping, near grazing, stiff, many events, several solutions."""
    yield named(
        "light-1e-4",
        "Damping ratio 1e-4 at a resonance with a stuck contact's help.",
        one_mass(2e-4),
        [slider(0.5, 0.9)],
        push(amplitude=0.05),
        at(1.0),
    )
    yield named(
        "light-slip",
        "Damping ratio 5e-4, large slip.",
        one_mass(1e-3),
        [slider(0.3, 0.5)],
        push(amplitude=1.0),
        at(1.02),
    )
    for kt in (1e2, 1e4):
        yield named(
            f"stiff-{kt:g}",
            f"The contact is {kt:g} times as stiff as the spring.",
            one_mass(),
            [slider(kt, 0.4)],
            push(),
            at(0.8),
        )
    yield named(
        "near-sticking",
        "Slips by less than a thousandth of its motion.",
        one_mass(0.2),
        [slider(1.0, 1.3)],
        push(),
        at(1.2),
    )
    yield named(
        "load-touches",
        "The load falls to nearly nothing.",
        one_mass(),
        [slider(1.0, 0.4, N1=0.7996)],
        push(),
        at(1.2),
    )
    yield named("jump-upper", "A hardening stop: the upper of three solutions.", one_mass(0.05),
                [stop(1.0, 1.0), {**stop(1.0, 1.0, "ground", "x"), "name": "other"}], push(amplitude=0.3),
                at(1.17, which="largest"))  # fmt: skip
    yield named("jump-lower", "The least of the same three.", one_mass(0.05),
                [stop(1.0, 1.0), {**stop(1.0, 1.0, "ground", "x"), "name": "other"}], push(amplitude=0.3),
                at(1.17, which="smallest"))  # fmt: skip
    draw = random.Random(7)
    structure, _ = chain(6, [])
    many = [slider(round(draw.uniform(0.3, 20.0), 3), round(draw.uniform(0.05, 0.3), 3), f"x{i}", name=f"f{i}",
                   N1=round(draw.uniform(0.0, 0.3), 3), N1_phase=round(draw.uniform(0.0, 6.0), 3)) for i in range(6)]  # fmt: skip
    yield named(
        "many-events",
        "Six sliders of mixed stiffness under moving loads, at a third of the resonance.",
        structure,
        many,
        push("x0"),
        at(0.4, "x0"),
    )


def optima() -> Iterator[Case]:
    """The load that makes the highest peak least."""
    k1, k2 = 4.0 * math.pi**2, 2.0 * math.pi**2
    case_a = lumped(
        {"m1": 1.0, "m2": 1.0}, ("m1", "ground", k1, 0.5), ("m1", "m2", k2, 0.5), ("m2", "ground", k1, 0.5)
    )
    least = lambda dof, band, low, high: {"what": "least-peak", "dof": dof, "band_hz": band, "variable": "damper.N0", "range": [low, high]}  # noqa: E731 # fmt: skip
    yield named(
        "optimum-case-a",
        "The paper's two masses.",
        case_a,
        [slider(30.0, 100.0, "m2", mu=0.3)],
        push("m1", 100.0),
        least("m2", [0.2, 2.5], 20.0, 3000.0),
    )
    for kt, c in ((1.0, 0.02), (0.3, 0.05)):
        yield named(
            f"optimum-{kt:g}",
            "One mass.",
            one_mass(c),
            [slider(kt, 1.0)],
            push(),
            least("x", [0.08, 0.4], 0.4, 12.0),
        )
    structure, contacts = chain(3, [2])
    yield named(
        "optimum-chain",
        "Three masses, one damper.",
        structure,
        [{**contacts[0], "name": "damper"}],
        push("x0"),
        least("x0", [0.05, 0.5], 0.1, 20.0),
    )


LADDERS = {
    "closed forms": closed_forms, "oscillators": oscillators, "the paper": the_paper, "chains and disks": chains,
    "floating dampers": floating, "patches": patches, "flutter": flutter, "hard": hard, "optima": optima,
}  # fmt: skip


def build() -> dict[str, Case]:
    """Return every case by name."""
    cases: dict[str, Case] = {}
    for ladder, builder in LADDERS.items():
        for case in builder():
            cases[case["name"]] = {**case, "ladder": ladder, "number": len(cases) + 1}
    return cases


def write() -> int:
    """Write every case; large matrices stand beside it as MatrixMarket."""
    from scipy.io import mmwrite
    from scipy.sparse import coo_array

    folder = HERE / "cases"
    folder.mkdir(exist_ok=True)
    cases = build()
    for name, case in cases.items():
        if len(case["structure"]["dofs"]) >= BESIDE:
            for key in ("M", "C", "K"):
                beside = f"{name}-{key}.mtx"
                mmwrite(
                    folder / beside,
                    coo_array(np.array(case["structure"][key])),
                    symmetry="symmetric",
                    precision=17,
                )
                case["structure"][key] = beside
        (folder / f"{name}.json").write_text(json.dumps(case, indent=None, separators=(", ", ": ")) + "\n")
    return len(cases)
