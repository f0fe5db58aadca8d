"""Which effects a run pays for: what may be left out without changing the answer, and the override.

Every saving but one is exact. A scene whose loads are constant and whose forces have odd harmonics only
responds with x(τ + π) = −x(τ) if no stiffness changes with the motion: even harmonics and mean are zero. A
contact that sticks all the time is its spring, and one that never touches is nothing: both are eliminated
from the Newton step. A tuned disk under a travelling wave repeats itself from sector to sector; where the
laws of its contacts allow other motions too that is an assumption, and said. Modes carry the linear part at
the cost of modes instead of matrices.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from solver.errors import SettingError
from solver.wording import nearest


@dataclass(frozen=True, slots=True, kw_only=True)
class Effects:
    """Effects to pay for whether the scene calls for them or not; the rest is decided by the plan.

    Attributes
    ----------
    even_harmonics : bool
        Even harmonics and the mean, even where the response is half-wave symmetric.
    every_contact : bool
        Every contact stays in the Newton step, even one that cannot slip or never touches.
    every_port : bool
        Newton steps are solved for the motions of every contact, even where fewer lead them all.
    every_sector : bool
        The whole annulus, even of a tuned disk under a travelling wave.
    whole_matrices : bool
        The matrices of the linear part at every frequency, even where modes carry it.
    """

    even_harmonics: bool = False
    every_contact: bool = False
    every_port: bool = False
    every_sector: bool = False
    whole_matrices: bool = False

    @classmethod
    def everything(cls) -> Effects:
        """Return the settings that leave nothing out."""
        return cls(**dict.fromkeys((field.name for field in fields(cls)), True))

    @classmethod
    def read(cls, text: str) -> Effects:
        """Read ``auto``, ``all``, or names such as ``even-harmonics,every-sector``.

        Raises
        ------
        SettingError
            A name that is none of these.
        """
        if text == "auto":
            return cls()
        if text == "all":
            return cls.everything()
        known = [field.name.replace("_", "-") for field in fields(cls)]
        chosen = [name.strip() for name in text.split(",")]
        for name in chosen:
            if name not in known:
                words = f"must be `auto`, `all`, or of {', '.join(known)}"
                raise SettingError("effects", name, words, nearest(name, known))
        return cls(**{name.replace("-", "_"): True for name in chosen})
