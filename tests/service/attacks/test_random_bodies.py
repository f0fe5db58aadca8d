"""Bodies of random shapes, depths, lengths and numbers over all routes: none is an error of the program."""

import json
import random
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any

import pytest
from attack_site import TRIES, Answer, Attack, Site

SEED = 20_261_122
MOST_BYTES = 4 * 1024 * 1024
MOST_SECONDS = 2.0
"""Of processor time, in all processes of the service, for one answer."""
WORDS = (
    "a",
    "name",
    "é",
    "",
    " ",
    "\u0000",
    "__proto__",
    "$ref",
    "a/b~c",
    "𝄞",
    "x" * 300,
    "two-dof",
    "upload:1",
    "ground",
)
NUMBERS = (
    0, -0.0, 1, -1, 2**31, 2**53 + 1, -(2**63), 10**400, 5e-324, 1e-300, 1e15, 1.7976931348623157e308, 0.1,
    1.5, 200, 41,
)  # fmt: skip


def numbers(chance: random.Random) -> object:
    return chance.choice([*NUMBERS, chance.random(), chance.gauss(0.0, 1e6), chance.randrange(-1000, 1000)])


def words(chance: random.Random) -> str:
    return chance.choice([*WORDS, "".join(chance.choices("ab.@[]{}\"'\\ \n\t0=#", k=chance.randrange(60)))])


def anything(chance: random.Random, depth: int = 0) -> object:
    """A value of any shape, rarely large or deep."""
    kind = chance.randrange(9)
    if depth > chance.choice([2, 3, 5, 80]):
        kind %= 4
    if kind < 2:
        return numbers(chance)
    if kind == 2:
        return words(chance)
    if kind == 3:
        return chance.choice([None, True, False])
    size = chance.choice([0, 1, 1, 2, 3]) if depth else chance.choice([1, 3, 10, 30])
    if kind < 6:
        return [anything(chance, depth + 1) for _ in range(size)]
    if kind == 6:
        return [numbers(chance)] * chance.choice([10, 100, 5_000])
    return {words(chance): anything(chance, depth + 1) for _ in range(size)}


def of_schema(chance: random.Random, schema: Any, parts: Any, depth: int = 0) -> object:
    """A value nearly as a schema has it: now and then something else stands in its place."""
    if depth > 6 or chance.random() < 0.04:
        return anything(chance, 2)
    if "$ref" in schema:
        return of_schema(chance, parts[schema["$ref"].rpartition("/")[2]], parts, depth)
    for key in ("anyOf", "oneOf"):
        if key in schema:
            return of_schema(chance, chance.choice(schema[key]), parts, depth)
    if "const" in schema or "enum" in schema:
        return chance.choice(schema.get("enum") or [schema["const"]])
    kind = schema.get("type")
    if kind == "object":
        return an_object(chance, schema, parts, depth)
    if kind == "array":
        items = schema.get("items") or {}
        length = chance.choice([0, 1, 1, 2, 3, 50]) if depth < 3 else chance.randrange(3)
        return [of_schema(chance, items, parts, depth + 1) for _ in range(length)]
    if kind == "integer":
        return chance.choice([1, 2, 3, 11, schema.get("minimum", 0), schema.get("maximum", 7)])
    if kind == "number":
        return chance.choice([1.0, 0.3, 1.05, 80.0, schema.get("minimum", 0.0)])
    if kind == "string":
        return chance.choice(["two-dof", "bladed-disk", "damper.N0", "m1", "frequency", words(chance)])
    return anything(chance, 2) if kind is None else chance.choice([None, True, False])


def an_object(chance: random.Random, schema: Any, parts: Any, depth: int) -> dict[str, object]:
    known, needed = schema.get("properties", {}), set(schema.get("required", ()))
    kept = [name for name in known if name in needed or chance.random() < 0.4]
    found = {
        name: of_schema(chance, known[name], parts, depth + 1) for name in kept if chance.random() < 0.97
    }
    if not known or chance.random() < 0.1:
        found |= {words(chance): anything(chance, 2) for _ in range(chance.randrange(3))}
    return found


def changed(chance: random.Random, value: Any, depth: int = 0) -> Any:
    """An example with something else in some places."""
    if chance.random() < (0.02 if depth < 2 else 0.08):
        return anything(chance, 2)
    if isinstance(value, dict):
        return {
            key: changed(chance, inner, depth + 1) for key, inner in value.items() if chance.random() < 0.97
        }
    if isinstance(value, list):
        return [changed(chance, inner, depth + 1) for inner in value] * chance.choice([1, 1, 1, 1, 2, 30])
    return value


def scenes(chance: random.Random) -> Any:
    import solver

    return solver.load_scene(chance.choice(("bladed-disk", "two-dof"))).to_dict()


Maker = Callable[[random.Random], object]


def makers(description: Any) -> dict[str, list[Maker]]:
    """What makes bodies for each route that takes one, from the description of the API."""
    parts = description["components"]["schemas"]
    found: dict[str, list[Maker]] = {}
    for path, operations in description["paths"].items():
        content = operations.get("post", {}).get("requestBody", {}).get("content", {})
        if "application/json" not in content:
            continue
        media = content["application/json"]
        examples = [one["value"] for one in media.get("examples", {}).values()]

        def example(chance: random.Random, examples: list[Any] = examples) -> object:
            return changed(chance, chance.choice(examples or [{}]))

        def own(chance: random.Random, examples: list[Any] = examples) -> object:
            scene = changed(chance, scenes(chance))
            return {**chance.choice(examples or [{}]), "scene": scene, "harmonics": 3}

        def schema(chance: random.Random, media: Any = media) -> object:
            return of_schema(chance, media["schema"], parts)

        def scene(chance: random.Random) -> object:
            return changed(chance, scenes(chance))

        found[path] = [anything, schema, schema, example, scene if path == "/v1/scenes" else own]
    return found


def bodies(description: Any, seed: int) -> Iterator[Attack]:
    """Attacks without end, the same for the same seed."""
    made = makers(description)
    assert len(made) >= 7, "the routes are those of the description"
    chance = random.Random(seed)
    while True:
        path = chance.choice(sorted(made))
        text = json.dumps(chance.choice(made[path])(chance), ensure_ascii=chance.random() < 0.5)
        data = text.encode("utf-8", "surrogatepass")
        if chance.random() < 0.1 and data:
            at = chance.randrange(len(data))
            data = (
                data[:at]
                + chance.choice([b"", b"[", b"NaN", b"\\ud800", b"9" * 5000, b"\xff", b"1e999"])
                + data[at:]
            )
        if len(data) <= MOST_BYTES:
            yield Attack(path, data)


def meets(site: Site, count: int, seed: int) -> None:
    description = json.loads(site.send(Attack("/openapi.json")).body)
    failed: list[tuple[Attack, Answer]] = []
    statuses: dict[int, int] = {}
    for attack in islice(bodies(description, seed), count):
        answer = site.send(attack)
        statuses[answer.status] = statuses.get(answer.status, 0) + 1
        for _ in range(TRIES):
            if answer.seconds <= MOST_SECONDS:
                break
            answer = site.send(attack)  # jobs that were accepted compute meanwhile
        assert answer.seconds <= MOST_SECONDS, (attack.path, attack.body[:2000], answer)
        # The queue and previews may be full; nothing else of the service's own is away.
        if answer.status >= 500 and answer.status != 503:
            failed.append((attack, answer))
    told = [(attack.path, attack.body[:2000], answer.status, answer.body[:300]) for attack, answer in failed]
    assert not failed, told[:5]
    assert statuses.get(422, 0) > 0.3 * count
    assert statuses.get(200, 0) + statuses.get(201, 0) + statuses.get(202, 0) > 0.03 * count, statuses


def test_random_bodies_over_all_routes_meet_no_error_of_the_program(site: Site) -> None:
    meets(site, 60, SEED)


@pytest.mark.long
def test_thousands_of_random_bodies_meet_no_error_of_the_program(site: Site) -> None:
    meets(site, 5000, SEED + 1)
