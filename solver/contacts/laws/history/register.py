"""A law of one's own from a function of the motion and its history: `register_law`."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Annotated, Any, Literal, ParamSpec, TypeVar

from pydantic import Field, create_model

from solver.contacts.laws import law_registry as registry
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.history.contact import HistoryContact
from solver.contacts.laws.history.definition import HistoryLaw, LawParameter

_P = ParamSpec("_P")
_T = TypeVar("_T")
_FORMULA = "a function of the motion and its history"


def law_class(law: HistoryLaw, base: type[HistoryContact] = HistoryContact) -> type[HistoryContact]:
    """Return the class of the contacts of a law; `base` may answer more than functions do."""
    fields: dict[str, Any] = {"law": (Literal[law.name], ...)}
    fields |= {
        key: (_type(parameter), ... if parameter.default is None else parameter.default)
        for key, parameter in law.parameters.items()
    }
    made = create_model(
        "".join(part.capitalize() for part in law.name.split("-")) + "Contact",
        __base__=base, __module__=base.__module__, __doc__=law.words or f"A contact of the law {law.name}.",
        **fields,
    )  # fmt: skip
    made.DEFINITION, made.LAW = law, law.name
    made.FORCE = law.formula or _FORMULA
    made.PARAMETERS = {key: one.quantity(law.columns[key]) for key, one in law.parameters.items()}
    made.WORDS = {key: _described(one) for key, one in law.parameters.items()}
    made.RUBBING = (0,) if law.rubs else ()
    return made


def _type(parameter: LawParameter) -> Any:
    bounds: dict[str, Any] = {
        "gt" if parameter.above else "ge": parameter.least, "lt" if parameter.below else "le": parameter.most
    }  # fmt: skip
    return Annotated[float, Field(strict=True, allow_inf_nan=False, **bounds)]


def _described(parameter: LawParameter) -> str:
    words = parameter.words.rstrip(".") or "A parameter of the law"
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    default = "" if parameter.default is None else f"; {parameter.default:g} if left out"
    return f"{words}{unit}{default}."


def _takes(definition: Callable[_P, HistoryLaw]) -> Callable[[Callable[..., _T]], Callable[_P, _T]]:
    """Give a function the arguments of a definition, for those who ask and those who check."""

    def with_arguments(function: Callable[..., _T]) -> Callable[_P, _T]:
        given, own = inspect.signature(definition), inspect.signature(function)
        function.__signature__ = given.replace(return_annotation=own.return_annotation)  # type: ignore[attr-defined]
        return function

    return with_arguments


@_takes(HistoryLaw)
def register_law(*name: str, **given: Any) -> type[AnyContact]:
    """Add a law in this process, given by functions of the motion and its history.

    The law is either in rate form, `force(u, v, state, p) → float` and, with states, `rate(u, v, state, p,
    out)`, which fills d(state)/dt, or in samples, `step(u, v, du, dt, last, state, p) → float`, which fills
    the state after a change du of the motion in the time dt and returns the force. u is the relative motion
    [m] of `between`, v its velocity [m/s], p the parameters in their order. A positive force pulls the first
    end towards the second. At the beginning the states are 0 and nothing has moved.

    A period is followed, from that beginning, until the state repeats: two turns or more, then by Newton's
    method on the map of a period. Where it does not repeat, or a force is not finite, the point has not
    converged.

    The functions may be plain Python, which is compiled, or compiled by `numba.njit`; what Numba cannot
    compile is called as Python. They may not call back into a scene.

    Parameters
    ----------
    name : str
        The word of `law` in a scene: lower-case letters, digits and -.
    parameters : mapping
        The numbers of the law in the order of `p`, at most 9.
    force, rate, step : functions
        See above.
    states : int
        How many states there are.
    slopes : function, optional
        The derivatives by hand: `slopes(u, v, state, p, out)` of a law in rate form fills the rows (rates,
        force) by the columns (u, v, states, parameters), `slopes(u, v, du, dt, last, state, p, out)` of one
        in samples the rows (states, force) by (u, v, du, dt, states before, parameters). An entry that is
        never set is 0. Without it derivatives are found by a complex step if the functions are found to allow
        it, else by central differences; the plan says which.
    derivatives : solver.contacts.laws.history.definition.Derivatives, optional
        How they are found, in place of trying.
    samples : int, optional
        Nodes of a period; 32 a harmonic if left out, 16 with `reversals`. A contact may set its own
        `samples`.
    reversals : bool
        Whether nodes begin anew where the motion reverses: right for friction, whose force has corners there
        and is smooth between. Without, the nodes are even: right for a smooth force, and for one that has
        corners elsewhere.
    independent : bool
        Whether each state follows by itself, as those of sliders side by side.
    odd : bool
        Whether the negative motion has the negative force.
    monotone : bool
        Whether the law never lets two motions under the same forces move apart, as springs and dry friction.
    rubs : bool
        Whether it is friction, whose work counts as wear.
    formula, words : str
        The force in a line for the table of laws, and a sentence for the schema of scenes.

    Returns
    -------
    The class of its contacts, which `STICKSLIP_EXTENSIONS` may name.

    Raises
    ------
    SettingError
        An argument is wrong.
    ValueError
        There is a law of this name.
    """
    return registry.register(law_class(HistoryLaw(*name, **given)))
