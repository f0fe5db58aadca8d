"""Numbers of the contact laws, and what the columns of the contact table mean to each of them."""

from __future__ import annotations

# Laws; the numbers are those of `solver.contacts.kernels.system.System.laws`.
COULOMB, ELASTIC_NORMAL, GAP_SPRING, POLYNOMIAL, COULOMB_BOX, COULOMB_PLANE = 0, 1, 2, 3, 4, 5
PORTS = (1, 2, 1, 1, 2, 2)

# Columns of the elastic Coulomb law.
KT, MU = 0, 1
# The first column a law may use as it likes, and how many there are.
OWN, MOST_OWN = 6, 9
COLUMNS = OWN + MOST_OWN
# What λ is: OWN_KIND + j where it is the value in column OWN + j (less is in
# `solver.contacts.kernels.system`).
OWN_KIND = 10
# Elastic normal: stiffness [N/m], and 1.0 where the normal motion counts from the prestressed state.
KN, PRESTRESSED = OWN, OWN + 1
# Gap spring: stiffness [N/m] and gap [m].
K_GAP, GAP = OWN, OWN + 1
# Polynomial spring: a_1, a_2, … [N/m^j]
A_1, MOST_DEGREE = OWN, MOST_OWN
# Circular limit: samples a period.
SAMPLES = OWN

# States beside those of `solver.contacts.kernels.stick_slip_events`.
CLOSED, TOUCHING, DEFORMING = 5, 6, 7
