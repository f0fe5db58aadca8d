"""The law `elastic-normal`: rubbing, where the normal load moves with the parts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from solver.contacts.fields import Between, Signed, Stiffness
from solver.contacts.kernels import columns
from solver.contacts.laws.contact_parts import LawQuantity, RestStiffness
from solver.contacts.laws.coulomb import SlidesOnALine
from solver.contacts.laws.friction import FrictionContact
from solver.results import units

_CLOSED = (columns.N0, 1)


class ElasticNormalContact(SlidesOnALine):
    """A rubbing contact: the load moves with the parts, N = N0 + N1 cos(omega t + N1_phase) + kn v.

    The friction is that of `Contact`, without force while N <= 0; max(N, 0) acts on the normal pair.
    """

    LAW: ClassVar[str] = "elastic-normal"
    FORCE: ClassVar[str] = (
        "the same with `N = N0 + N1 cos(ωt + N1_phase) + kn v`, and `max(N, 0)` on the normal pair"
    )
    KERNEL: ClassVar[str] = "solver.contacts.kernels.coulomb.line_law:coulomb_line"
    SECOND: ClassVar[str | None] = "solver.contacts.kernels.coulomb.second_law:line_second"
    PARAMETERS: ClassVar[Mapping[str, LawQuantity]] = {
        **FrictionContact.PARAMETERS,
        # It may stand apart at rest.
        "N0": LawQuantity(
            column=columns.N0, unit="N",
            wanted="must be a number >= 0 (from -1e15 with the law elastic-normal) and <= 1e15 [N]",
        ),
        "kn": LawQuantity(
            column=columns.KN, unit="N/m", least=0.0, wanted="must be a number > 0 and <= 1e15 [N/m], or inf"
        ),
    }  # fmt: skip
    END_KEYS: ClassVar[tuple[str, ...]] = ("between", "normal_between")
    NEEDED_ENDS: ClassVar[tuple[str, ...]] = ("normal_between",)
    HELD: ClassVar[tuple[RestStiffness, ...]] = (
        RestStiffness(columns.KT, *_CLOSED),
        RestStiffness(columns.KN, *_CLOSED),
    )
    OPENS: ClassVar[bool] = True

    law: Literal["elastic-normal"]
    normal_between: Annotated[
        Between | None,
        "The ends of the normal motion v = x(first) - x(second); v > 0 presses. Left out where `normal` is "
        "given.",
    ] = None
    N0: Annotated[Signed, "Load [N] at v = 0; -kn times the gap for an initial gap."]
    kt: Stiffness
    kn: Annotated[Stiffness, "Normal contact stiffness [N/m]."]
    prestressed: Annotated[
        bool,
        "Whether v counts from the state in which a positive N0 is in equilibrium already: the force on "
        "the normal pair is then max(N, 0) - max(N0, 0). Else it is the whole max(N, 0).",
    ] = False

    @property
    def moving(self) -> tuple[float, bool]:
        """By which stiffness its load moves with the parts [N/m], and whether v counts from equilibrium."""
        return self.kn, self.prestressed

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        moves = units.quantity(self.kn, "N/m")
        return f"the normal load moves with the parts by {moves}: friction and load in closed form"


LAW = ElasticNormalContact
