"""What the columns of the contact table mean, and which kernels have a number that is always the same."""

from __future__ import annotations

# Columns that every law has: of the elastic Coulomb law, and of the given normal load (RATIO: NaN where N1 is
# not tied to N0).
KT, MU, N0, N1, RATIO, PHASE = 0, 1, 2, 3, 4, 5
# The first column a law may use as it likes, and how many there are.
OWN, MOST_OWN = 6, 9
# Of laws that follow the history of their motion: the frequency ω [rad/s], which the balance keeps up to
# date, the nodes of a period, and what the law is to its kernel, see `solver.contacts.kernels.history`.
OMEGA, NODES = OWN + MOST_OWN, OWN + MOST_OWN + 1
HISTORY_LAW, HISTORY_STATES, HISTORY_FORM, HISTORY_WAY = NODES + 1, NODES + 2, NODES + 3, NODES + 4
COLUMNS = HISTORY_WAY + 1
# Behind them amplitude and phase of the load's harmonics from the second on, as many as the scene's loads
# have: the column `wave_column(order)` and the one after it.
# What λ is: COLUMN_KIND + j where it is the value in column j (less is in `solver.contacts.kernels.system`).
COLUMN_KIND = 4
# Elastic normal: stiffness [N/m], and 1.0 where the normal motion counts from the prestressed state.
KN, PRESTRESSED = OWN, OWN + 1
# Of a dashpot beside the tangential spring [N s/m].
C_STICK = OWN
# In space, beside these: stiffness of the second direction [N/m], NaN where it is that of the first.
KT_SECOND = OWN + 2
# Gap spring: stiffness [N/m] and gap [m].
K_GAP, GAP = OWN, OWN + 1
# Polynomial spring: a_1, a_2, … [N/m^j]
A_1, MOST_DEGREE = OWN, MOST_OWN


def wave_column(order: int) -> int:
    """Return the column of the amplitude of a harmonic of the load, of order 2 or more."""
    return COLUMNS + 2 * (order - 2)


# States beside those of `solver.contacts.kernels.stick_slip_events`.
CLOSED, TOUCHING, DEFORMING = 5, 6, 7

# The kernels whose numbers are the same in every process, in their order; those of others are given when they
# are first asked for.
KERNELS = (
    "solver.contacts.kernels.coulomb.line_law:coulomb_line",
    "solver.contacts.kernels.springs:gap_spring",
    "solver.contacts.kernels.springs:polynomial_spring",
    "solver.contacts.kernels.circle.circle_law:coulomb_circle",
    "solver.contacts.kernels.coulomb.line_law:coulomb_box",
    "solver.contacts.kernels.history.history_law:history_law",
)
# Likewise those of second derivatives.
SECOND_KERNELS = (
    "solver.contacts.kernels.coulomb.second_law:line_second",
    "solver.contacts.kernels.coulomb.second_law:box_second",
    "solver.contacts.kernels.circle.circle_hessian:circle_law_second",
    "solver.contacts.kernels.springs:gap_second",
    "solver.contacts.kernels.springs:polynomial_second",
)
