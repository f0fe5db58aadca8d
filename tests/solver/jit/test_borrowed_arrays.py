"""Kernels count references to what they own alone: what is made is given back, what is given out stays."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba")

from numba.core.runtime import _nrt_python, rtsys

from solver.jit.decorators import compiled
from solver.jit.kernel_records import referenced
from solver.jit.way import WAY, Way

pytestmark = pytest.mark.skipif(WAY is not Way.COMPILED, reason="counting is that of compiled kernels")

_holder: Callable[..., Any] = referenced("BorrowedHolder", __name__, ("rows", "other"))
_changed: Callable[..., Any] = referenced("BorrowedChanged", __name__, ("rows",), replaced=True)


@compiled
def holder(rows, other):
    return _holder(rows, other)


@compiled
def changed(rows):
    return _changed(rows)


@compiled
def summed(rows):
    total = 0.0
    for i in range(rows.shape[0]):
        row = rows[i]
        total += row[0] + rows[i, 1:][0]
    return total


@compiled
def part(rows, first):
    return rows[first:]


@compiled
def either(rows, own):
    here = rows
    if own:
        here = np.ones_like(rows)
    return here[0, 0] + here[-1, -1]


@compiled
def chosen(rows, which):
    some = rows[which]
    return some[0, 0] + some[-1, 1]


@compiled
def pair(one, other):
    first, second = (one[0], other[1])
    return first[0] + second[1]


@compiled
def of_record(rows, other):
    record = holder(rows, other)
    total = 0.0
    for i in range(record.rows.shape[0]):
        total += record.rows[i, 0] * record.other[i, 1]
    return total


@compiled
def put(record, rows):
    record.rows = rows.copy()


@compiled
def read_around_a_change(record, rows):
    before = record.rows
    put(record, rows)
    for i in range(50):
        rows = rows + i
    return before[0, 0] + record.rows[0, 0]


@compiled
def kept(rows):
    record = changed(rows)
    return read_around_a_change(record, np.full((3, 2), 7.0))


ROWS = np.arange(6.0).reshape(3, 2)
ANSWERS = {
    "a view of an argument": (lambda: summed(ROWS), 3 * 0 + 15.0),
    "a part given out": (lambda: part(ROWS, 1).sum(), 14.0),
    "borrowed on one way": (lambda: either(ROWS, False), 5.0),
    "owned on the other": (lambda: either(ROWS, True), 2.0),
    "a copy by places": (lambda: chosen(ROWS, np.array([2, 0])), 5.0),
    "a pair of views": (lambda: pair(ROWS, ROWS), 3.0),
    "a record made inside": (lambda: of_record(ROWS, ROWS), 0 * 1.0 + 2 * 3 + 4 * 5),
    "a field replaced while it is read": (lambda: kept(ROWS), 7.0),
}


@pytest.fixture
def balanced() -> Iterator[None]:
    """Have every piece of memory given back, and none twice."""
    gc.collect()
    _nrt_python.memsys_enable_stats()
    before = rtsys.get_allocation_stats()
    yield
    gc.collect()
    after = rtsys.get_allocation_stats()
    _nrt_python.memsys_disable_stats()
    assert after.alloc - before.alloc == after.free - before.free
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free


@pytest.mark.usefixtures("balanced")
@pytest.mark.parametrize("case", list(ANSWERS))
def test_what_a_kernel_owns_is_given_back_once(case: str) -> None:
    call, answer = ANSWERS[case]
    call()
    for _ in range(100):
        assert call() == pytest.approx(answer)
    assert ROWS.tolist() == [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]
