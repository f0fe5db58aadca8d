"""The law `coulomb-3d`: contact in space, friction in two directions under a load that may move."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from solver.contacts.fields import Between, Positive, Real, Signed
from solver.contacts.kernels import columns
from solver.contacts.laws.contact_parts import LawQuantity, RestStiffness
from solver.contacts.laws.coulomb_2d import SlidesInAPlane
from solver.contacts.laws.friction import FrictionContact
from solver.results import units

_CLOSED = (columns.N0, 1)


class SpaceContact(SlidesInAPlane):
    """A contact in space: two directions it slides in and, if given, a normal motion v that changes the load.

    N = N0 + N1 cos(omega t + N1_phase) + kn v; the friction force is 0 and the normal force too while N <= 0.
    """

    LAW: ClassVar[str] = "coulomb-3d"
    FORCE: ClassVar[str] = (
        "friction in two directions with one limit, under `N = N0 + N1 cos(ωt + N1_phase) + kn v`; "
        "`max(N, 0)` on the normal pair, if there is one"
    )
    PARAMETERS: ClassVar[Mapping[str, LawQuantity]] = {
        **FrictionContact.PARAMETERS,
        "kt_second": LawQuantity(
            column=columns.KT_SECOND, unit="N/m", least=0.0, wanted="must be a number > 0 and <= 1e15 [N/m]",
            otherwise=("kt",),
        ),
        "kn": LawQuantity(
            column=columns.KN, unit="N/m", least=0.0, wanted="must be a number > 0 and <= 1e15 [N/m]"
        ),
    }  # fmt: skip
    END_KEYS: ClassVar[tuple[str, ...]] = ("between", "between_second", "normal_between")
    NEEDED_ENDS: ClassVar[tuple[str, ...]] = ("between_second",)
    HELD: ClassVar[tuple[RestStiffness, ...]] = (
        RestStiffness(columns.KT, *_CLOSED), RestStiffness(columns.KT_SECOND, *_CLOSED),
        RestStiffness(columns.KN, *_CLOSED),
    )  # fmt: skip

    law: Literal["coulomb-3d"]
    normal_between: Annotated[
        Between | None,
        "The ends of the normal motion v = x(first) - x(second), v > 0 presses; None: the load is given. "
        "Left out where `normal` is given: the load then moves if there is a `kn`.",
    ] = None
    N0: Annotated[Signed, "Mean load, or load at v = 0 [N]; -kn times the gap for an initial gap."]
    kt_second: Annotated[
        Positive | None,
        "Tangential stiffness of the first and of the second direction [N/m]; the second is the first's if "
        "left out.",
    ] = None
    kn: Annotated[
        Positive | None, "Normal contact stiffness [N/m]; given together with `normal_between` or `normal`."
    ] = None
    prestressed: Annotated[
        bool,
        "Whether v counts from the state in which a positive N0 is in equilibrium already: the force on "
        "the normal pair is then max(N, 0) - max(N0, 0). Else it is the whole max(N, 0).",
    ] = False

    @model_validator(mode="after")
    def _load_moves_or_is_given(self) -> SpaceContact:
        in_space = self.normal is not None or self.motions is not None
        if not in_space and (self.normal_between is None) != (self.kn is None):
            missing, given = ("kn", "normal_between") if self.kn is None else ("normal_between", "kn")
            raise ValueError(
                f"`{missing}` of contact `{self.name}` is missing beside `{given}`: give both for a load "
                "that moves with the parts, or neither for one that is given"
            )
        if self.kn is None and self.N0 < 0.0:
            raise ValueError(
                f"`N0` of contact `{self.name}` must be >= 0 where the load is given, got {self.N0!r}"
            )
        if self.kn is None and self.prestressed:
            raise ValueError(f"`prestressed` of contact `{self.name}` needs `normal_between` and `kn`")
        return self

    # Ports

    @property
    def end_keys(self) -> tuple[str, ...]:
        """The keys of the ends of its relative motions."""
        return self.END_KEYS if self.kn is not None else self.END_KEYS[:2]

    @property
    def moving(self) -> tuple[float, bool] | None:
        """By which stiffness its load moves with the parts [N/m], and whether v counts from equilibrium."""
        return None if self.kn is None else (self.kn, self.prestressed)

    @property
    def held(self) -> tuple[RestStiffness, ...]:
        """What each of its ports begins with at rest."""
        second = columns.KT if self.kt_second is None else columns.KT_SECOND
        if self.kn is None:
            return RestStiffness(columns.KT), RestStiffness(second)
        return self.HELD[0], RestStiffness(second, *_CLOSED), self.HELD[2]

    @property
    def tangential(self) -> tuple[float, float]:
        """The stiffness of each direction [N/m]."""
        return self.kt, self.kt if self.kt_second is None else self.kt_second

    # Contact table

    def value_of(self, key: str) -> float:
        """Value of a parameter; a second stiffness that is left out is the first."""
        if key == "kt_second":
            return self.tangential[1]
        if key == "kn":
            return self.kn or 0.0
        return super().value_of(key)

    def followers(self, key: str) -> frozenset[str]:
        """The parameters that change while one of its own does."""
        tied = {"kt_second"} if key == "kt" and self.kt_second is None else set()
        return super().followers(key) | tied

    def fill(self, row: Real, highest: int) -> None:
        """Put its numbers into its row of the contact table."""
        super().fill(row, highest)
        if self.kt_second is not None:
            row[columns.KT_SECOND] = self.kt_second

    def with_numbers(self, row: Real) -> SpaceContact:
        """The contact with the numbers of a row of the contact table."""
        moved = super().with_numbers(row)
        left_out = {key: None for key in ("kt_second", "kn") if getattr(self, key) is None}
        return moved.model_copy(update=left_out)

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        load = (
            "under a given load"
            if self.kn is None
            else f"the load moves with {units.quantity(self.kn, 'N/m')}"
        )
        if self.limits_apart:
            return f"contact in space, {load}: a limit for each direction, in closed form"
        return f"contact in space, {load}: circular limit, closed form in stick, collocation in slip"


LAW = SpaceContact
