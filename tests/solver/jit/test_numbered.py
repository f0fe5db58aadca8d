"""Kernels called by number: a call announces those its contract knows, others load when asked for."""

import pickle
from typing import Any

import numba
import pytest
from numba import types

from solver.contacts.kernels.columns import KERNELS
from solver.contacts.kernels.laws import call_law, law_number
from solver.contacts.kernels.stick_slip_events import SEGMENT
from solver.jit.slots import watched


class Noted:
    def __init__(self) -> None:
        self.called_ones: list[str] = []
        self.names: list[str] = []

    def called(self, name: bytes) -> None:
        self.called_ones.append(place(name))

    def listed(self, name: bytes) -> None:
        self.names.append(place(name))

    def needed(self, name: bytes) -> None:
        pass


def place(name: bytes) -> str:
    module, kernel, *_ = pickle.loads(name)
    return f"{module}:{kernel}"


def test_compiling_a_call_announces_every_law_of_the_package() -> None:
    one, two, three = (types.Array(types.float64, dimensions, "C") for dimensions in (1, 2, 3))
    ks, segments = types.Array(types.int64, 1, "C"), types.Array(numba.from_dtype(SEGMENT), 1, "C")

    @numba.njit
    def caller(e: int, *rest: Any) -> tuple[int, int]:
        return call_law(e, *rest)

    noted = Noted()
    with watched(noted):
        rest = types.Tuple([two, ks, one, ks, one, one, one, two, two, segments, two, three, two])
        caller.compile((types.int64, rest))
    assert set(KERNELS) <= set(noted.names)
    assert not set(KERNELS) & set(noted.called_ones), "which of them are called nobody knows yet"


def test_what_is_no_kernel_of_the_contract_gets_no_number() -> None:
    with pytest.raises(TypeError, match="returns"):
        law_number("not_a_law:returns_a_float")
    with pytest.raises(ModuleNotFoundError):
        law_number("no_such_module:law")
