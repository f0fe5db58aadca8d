"""Compiling kernels in which nobody counts references to arrays that belong to the caller.

Numba counts up for each name that an array gets, and down where the name is last used, by atomic
instructions: for an array taken from a record, at each use. What an argument leads to its caller keeps while
the kernel runs, so for names of that alone the counting says nothing. It took a sixth of a small balance's
time.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any

from numba import types
from numba.core import ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.runtime.context import NRTContext
from numba.core.typed_passes import NativeLowering

_PARTS = {
    "getattr",
    "getitem",
    "static_getitem",
    "exhaust_iter",
    "cast",
}  # of what they take
_WHOLES = types.Array, types.BaseTuple, types.StructRef


class _Uncounted(NRTContext):
    """Numba's memory without the counting."""

    def incref(self, *_: object) -> None: ...

    def decref(self, *_: object) -> None: ...


class _Lower(Lower):
    """Writes the machine code of a kernel, statement by statement."""

    context: Any

    def pre_lower(self) -> None:
        super().pre_lower()
        self._borrowed, self._uncounted = _borrowed(self), self.context.subtarget()
        self._uncounted.nrt = _Uncounted(self._uncounted, True)

    def lower_inst(self, inst: Any) -> None:
        assigned = inst.target.name if isinstance(inst, ir.Assign) else None
        counted, named = self.context, inst.value if isinstance(inst, ir.Del) else assigned
        self.context = self._uncounted if named in self._borrowed else counted
        try:
            super().lower_inst(inst)
        finally:
            self.context = counted


def _borrowed(kernel: Lower) -> set[str]:
    """Return the names that stand for nothing but what the caller keeps, and parts of it."""
    lines = [line for block in kernel.blocks.values() for line in block.body]
    meant = defaultdict(list)
    for line in lines:
        if isinstance(line, ir.Assign):
            meant[line.target.name].append(line.value)
    models = kernel.context.data_model_manager
    counted = {one for one in meant if models[kernel.typeof(one)].contains_nrt_meminfo()}
    # What is returned its new owner counts down.
    found = counted - {line.value.name for line in lines if isinstance(line, ir.Return)}
    while lost := {
        one for one in found if not all(_leads(kernel, found, counted, value) for value in meant[one])
    }:
        found -= lost
    return found


def _leads(kernel: Lower, borrowed: set[str], counted: set[str], value: Any) -> bool:
    """Whether a name is borrowed that gets this value."""
    if isinstance(value, ir.Var):
        return value.name in borrowed
    if not isinstance(value, ir.Expr):
        return isinstance(value, ir.Arg)
    if value.op == "build_tuple":
        return not {one.name for one in value.items} & (counted - borrowed)
    if value.op not in _PARTS or value.value.name not in borrowed:
        return False
    whole = kernel.typeof(value.value.name)
    if value.op == "getitem":  # by arrays it is a copy
        kind = kernel.typeof(value.index.name)
        places = kind.types if isinstance(kind, types.BaseTuple) else (kind,)
        if not all(isinstance(one, (types.Integer, types.SliceType)) for one in places):
            return False
    return isinstance(whole, _WHOLES) and not getattr(whole, "replaced", False)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):
    _name = "stickslip_lowering"

    def __init__(self) -> None:
        super().__init__()

    @property
    def lowering_class(self) -> type[Lower]:
        return _Lower


class Borrowing(CompilerBase):
    """Numba's compiler with that."""

    def define_pipelines(self) -> list[Any]:
        """Return its passes."""
        made = DefaultPassBuilder.define_nopython_pipeline(self.state)
        made.passes = [(_Lowering if one is NativeLowering else one, why) for one, why in made.passes]
        made.finalize()
        return [made]
