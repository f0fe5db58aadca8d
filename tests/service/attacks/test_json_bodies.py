"""JSON that is made to be costly is read in linear time and little memory, or refused."""

import pytest
from attack_site import Attack, Site

PLAN = "/v1/plan"
MIB = 1024 * 1024


BODIES: dict[str, bytes] = {
    "a long key before many zeros": b'{"' + b"k" * 40_000 + b'": [' + b"0," * 90_000 + b"0]}",
    "4 MB of zeros": b'{"a": [' + b"0," * (2 * MIB - 10) + b"0]}",
    "4 MB of empty objects": b'{"a": [' + b"{}," * (4 * MIB // 3 - 10) + b"{}]}",
    "4 MB of fractions": b'{"a": [' + b"0.25," * (4 * MIB // 5 - 10) + b"1]}",
    "as many fractions as are read": b'{"scene": {"a": [' + b"0.1234," * 490_000 + b"1]}}",
    "4 MB of unknown keys": b"{" + b",".join(b'"%06d":0' % n for n in range(4 * MIB // 11 - 10)) + b"}",
    "as many unknown keys as are read": b"{" + b",".join(b'"%06d":0' % n for n in range(19_000)) + b"}",
    "4 MB of settings": b'{"scene": "two-dof", "set": {'
    + b",".join(b'"a.b%06d":{}' % n for n in range(19_000))
    + b"}}",
    "4 MB of quotes": b'{"a": [' + b'"",' * (4 * MIB // 3 - 10) + b'""]}',
    "4 MB of backslashes": b'{"a": "' + b"\\\\" * (2 * MIB - 10) + b'"}',
    "4 MB of brackets": b"[" * (4 * MIB - 10),
    "not a number among many": b'{"a": [' + b"0," * 400_000 + b"1e999]}",
    "many that are no numbers": b'{"a": [' + b"NaN," * 400_000 + b"NaN]}",
    "an integer of 4 MB": b'{"a": ' + b"9" * (4 * MIB - 10) + b"}",
    "integers of 4000 digits": b'{"a": [' + (b"9" * 4000 + b",") * 1000 + b"1]}",
}


LONG = {
    "4 MB of empty objects", "4 MB of fractions", "4 MB of unknown keys", "4 MB of quotes",
    "4 MB of backslashes", "many that are no numbers", "integers of 4000 digits",
}  # fmt: skip


@pytest.mark.few(6)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long if name in LONG else ()) for name in BODIES]
)
def test_a_costly_body_hurts_nobody_else(site: Site, name: str) -> None:
    figures = site.bears([Attack(PLAN, BODIES[name])])
    assert figures.answers[0].status in (400, 413, 422)
    assert len(figures.answers[0].body) < 100_000
    assert figures.answers[0].seconds < 2.0


@pytest.mark.long
def test_many_large_bodies_at_once_hurt_nobody_else(site: Site) -> None:
    """As many values as are read at all, from several connections."""
    body = b'{"scene": {"a": [' + b"0.1234," * 490_000 + b"1]}}"
    figures = site.bears([Attack("/v1/scenes", body)] * 4, at_once=4)
    assert {answer.status for answer in figures.answers} <= {413, 422, 429, 503}
