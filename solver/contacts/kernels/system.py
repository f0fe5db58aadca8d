"""The condensed multi-harmonic balance r(u, λ) = u − ū + A F(u): its data and its evaluation.

With Z_k = K − (kω)²M + ikωC of every kept harmonic k, the linear degrees of freedom are eliminated,
A_k = L Z_k⁻¹ Lᴴ, ū_k = L Z_k⁻¹ f̂_k, so the unknowns are the slip motions of the contacts alone. Z⁻¹ is kept
in one of three forms: undamped modes (classical damping), poles and residues (any damping whose eigenvectors
span the state space), both at the cost of modes × contacts² a frequency, and dense (the rest, and whenever λ
is a parameter of the structure itself).

A stiffness `shift` of each port may be moved into the structure and taken out of the force again,
r = u − ū + A (F − shift u): the same equation, but Z_0 stays regular when only contacts hold a part in place.

Where fewer modes, coordinates or rigid bodies move the ports than there are ports, all motions follow from
those of `leading` ones, L = P L_leading with P = `span`: A_k = P Â_k Pᵀ, of which Â_k is kept, see
`solver.balance.kernels.coordinates`.

An element (a contact, of whatever law) has one or more ports: relative motions with n coefficients each, the
force of each depending on all of them. The unknowns are the motions of all ports, port after port.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np

from solver.contacts.kernels.stick_slip_events import new_segments
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Index, Integer, Real, coefficient_count
from solver.jit.kernel_records import Records, referenced

# What λ is, where it is no column of the contact table.
FREQUENCY, LEVEL, FORCE_PHASE, STRUCTURE = 0, 1, 2, 3
# How Z⁻¹ is kept.
MODES, POLES, DENSE = 0, 1, 2
# What is measured: max|x|; counted from the middle of its range; a stress over what is allowed at its mean.
FROM_REST, CENTRED, UTILISED = 0, 1, 2
# Numbers in `Evaluation.counts`.
FREE, HELD, SIZE, AT_BRANCH_POINT, UNHELD, PINNED, MIXED, BANDED = range(8)
COUNTS = 8
# Numbers that say where and of what a receptance's A was filled.
PLACE = 5


class System(NamedTuple):
    """Everything the compiled loops need; arrays only.

    nk harmonics, ne elements with nc ports in all, ns distinct structures (nodal diameters), nm modes or n
    DOFs of each.
    """

    ks: Integer  # (nk,) harmonics kept, ascending
    load_ks: Integer  # (K + 1,) harmonics of the normal loads, 0 … K; K ≥ 1 is the highest in the scene
    which: Integer  # (nk,) structure of each harmonic
    cos_table: Real
    sin_table: Real
    laws: Integer  # (ne,) numbers of the kernels, see `solver.contacts.kernels.laws`
    jenkins: Integer  # (ne,) 1: the force is that of one spring and slider under the given load, else 0
    alone: Integer  # (ne,) 1: the kernel finds the force alone for less, given no blocks of dF_dU, else 0
    normal_port: Integer  # (ne,) the port whose motion changes the normal load, −1: the load is given
    first_port: Integer  # (ne + 1,) where the ports of each element begin
    first_block: Integer  # (ne + 1,) where its blocks of dF_dU begin: ports² of them, row after row
    owner: Integer  # (nc,) element of each port
    rubs: Integer  # (nc,) 1: friction, which a larger normal load would hold, else 0
    held: Integer  # (nc, 3) of the stiffness at rest: its column, and the column and sign of what must be > 0
    contacts: Real  # (ne, ·) the numbers of each law, see `solver.contacts.kernels.columns`
    active: Real  # (ne,) share of λ in the number it changes, 0.0 where it does not act
    load_rise: Real  # (2, ne) N0 gains these times ω and ω² where λ is the frequency [N s, N s²]
    level: (
        Real  # (2, 3) factor of the excitation, and of constant forces, by 1, ω, ω² where λ is the frequency
    )
    shift: Real  # (nc,) stiffness moved into the structure [N/m]
    leading: Integer  # (r,) ports whose motions all others follow from; all of them where `span` is empty
    span: Real  # (nc, r) the motion of every port as a sum of theirs, (nc, 0) where none follows from others
    loose: Real  # (nr, nc) ports' part in the rigid-body motions of what contacts alone hold, see `loose`
    hold: int  # 1: where no contact holds such a part, a constant force does
    samples: int  # in a period, for contact forces by samples in time; 0: in closed form
    condense: int  # 1: contacts that are linear where they are leave the Newton step, 0: none does
    kind: int  # what λ is
    omega: float  # rad/s, when λ is not the frequency
    level_reference: float  # N, the excitation amplitude at level 1
    constant_mean: int  # 1: constant forces are loads, which the level of the excitation leaves alone
    phase_reference: float  # rad
    centred: int  # what is measured of the observed motion: FROM_REST, CENTRED or UTILISED
    only: int  # the one harmonic of the observed motion that is measured, −1: the whole motion
    haigh: Real  # (4,) of a utilisation, see `solver.balance.kernels.haigh`
    parameter_reference: float  # the value of a structural parameter at which K, M, C stand
    least_size: float  # m, motions of the contacts far below it are rounding of what cancels in ū
    form: int
    eigenvalues: Complex  # (ns, nm) undamped ω² [rad²/s²], or poles [rad/s]
    dampings: Real  # (ns, nm) modal damping [1/s] of undamped modes
    contact_modes: Complex  # (ns, nc, nm) L x_m
    contact_duals: Complex  # (ns, nc, nm) y_mᴴ Lᴴ, normalised
    observe_modes: Complex  # (ns, nm)
    modal_forces: Complex  # (nk, nm) y_mᴴ f̂_k at level 1, normalised
    K: Complex  # (ns, n, n), likewise below; empty unless dense
    C: Complex
    M: Complex
    dK: Complex  # derivative by the structural parameter
    dC: Complex
    dM: Complex
    ddK: Complex  # second derivative of K; none at all where it is affine
    L: Complex  # (ns, nc, n)
    observe: Complex  # (n,)
    forces: Complex  # (nk, n) f̂_k at level 1
    dforces: Complex  # (2, nk, n) first and second derivatives by the structural parameter


class Receptance(NamedTuple):
    """Condensed linear part at one λ, and its derivative by λ (first index 0: value, 1: derivative).

    By reference it has one array more, `filled` (PLACE,): where A was filled, see
    `solver.linear.kernels.receptance`; NaN where it is to be filled anew.
    """

    A: Complex  # (2, nk, nc, nc), or Â (2, nk, r, r) of the leading ports alone where r < nc
    u_linear: Complex  # (2, nk, nc)
    B: Complex  # (2, nk, nc) from the contact forces to the observed DOF
    x_linear: Complex  # (2, nk)


class Evaluation(NamedTuple):
    """The balance at one (u, λ): residual, derivative by λ, and the contact forces behind them.

    From `jacobian` on, filled by `solver.balance.kernels.jacobian`: what belongs to the last Jacobian looked
    at.
    """

    residual: Real  # (nt,)
    dr_dp: Real  # (nt,) dr/dλ
    F: Real  # (nc, n)
    dF_dU: Real  # (blocks, n, n)
    dF_dp: Real  # (nc, n) partial derivative of the force by λ
    dF_dkt: Real  # (n,) scratch, as the two below
    dF_dmu: Real  # (n,)
    dF_dN: Real  # (n, 3)
    states: Integer  # (ne,)
    pieces: Integer  # (ne,) which smooth piece of its law a contact is on, see `events.piece_of`
    slopes: Real  # (nc,) ∂F/∂U of a port whose force is a spring's (stuck, pressed, separated), else NaN
    segments: Records  # scratch
    jacobian: Real  # (nt, nt) dr/du
    lu: Real  # (nt + 1, nt + 1) factors of the condensed, perhaps bordered, Jacobian in their leading block
    pivots: Index  # (nt + 1,)
    free: Integer  # (nc,) ports kept in it
    held: Integer  # (nc,) ports eliminated
    counts: Integer  # (COUNTS,) numbers of both, size of the factors, whether they belong to a branch point,
    # the number of directions in which nothing holds a part, and that at the factors' point; whether an
    # element has both ports kept and eliminated; 1: the factors are those of
    # `solver.balance.kernels.banded`, −1: they cannot be
    G: Real  # (blocks, n, n) dF_dU less the shift, at the factors' point
    responses: Complex  # (nk, nc, nc) R in the columns of ports kept, V and D⁻¹ in those of ports eliminated,
    # likewise below; see `solver.balance.kernels.jacobian`. Of leading ports (nk, r, r), Â
    border: Real  # (nt,) the weighted tangent
    settled: Real  # (nt + 1,) T dr/dλ, and what the border is scaled with
    work: Real  # (3, nt + 1) scratch
    gauge: Real  # (nr, nc) motions of the ports that nothing holds, see `solver.balance.kernels.gauge`
    unheld: Real  # (nr, nr) forces along them, over the rigid-body motions
    elastic: Real  # (nc,) stiffness of contacts that carry all the mean force they can [N/m], else 0
    pinned: Real  # (nr, nc) kt l along these motions at the factors' point
    pushed: Real  # (nc, r·n) G P of one coefficient, scratch as the two below; see
    # `solver.balance.kernels.coordinates`
    springs: Real  # (n, r, r·n) Pᵀ G P, coefficient by coefficient of the force
    rows: Real  # (4·r, r·n)


# Inside the compiled loops each record is one pointer: forty arrays passed by value at every call cost more
# than the work itself, and minutes of compilation.


class _ReceptanceProxy:
    """A `Receptance` by reference."""

    @cached_property
    def arrays(self) -> Receptance:
        """Its arrays; no kernel puts others in their place."""
        return receptance_arrays(cast(Receptance, self))


class _EvaluationProxy:
    """An `Evaluation` by reference."""

    @cached_property
    def arrays(self) -> Evaluation:
        """Its arrays; no kernel puts others in their place."""
        return evaluation_arrays(cast(Evaluation, self))


_new_system: Callable[..., System] = referenced("System", __name__, System._fields)
_receptance_of: Callable[..., Receptance] = referenced(
    "Receptance", __name__, [*Receptance._fields, "filled"], _ReceptanceProxy
)
_evaluation_of: Callable[..., Evaluation] = referenced(
    "Evaluation", __name__, Evaluation._fields, _EvaluationProxy
)


@compiled
def by_reference(system: System) -> System:
    """Return the same system as the compiled loops take it: one pointer."""
    return _new_system(*system)


def evaluation_by_value(point: Evaluation) -> Evaluation:
    """Return the arrays of an evaluation as a tuple that Python can read (views, not copies)."""
    return cast(_EvaluationProxy, point).arrays


@compiled
def evaluation_arrays(point: Evaluation) -> Evaluation:
    """Return the same, made anew: it takes longer than to evaluate a point of few contacts."""
    return Evaluation(
        point.residual, point.dr_dp, point.F, point.dF_dU, point.dF_dp, point.dF_dkt, point.dF_dmu,
        point.dF_dN, point.states, point.pieces, point.slopes, point.segments, point.jacobian, point.lu,
        point.pivots, point.free, point.held, point.counts, point.G, point.responses, point.border,
        point.settled, point.work, point.gauge, point.unheld, point.elastic, point.pinned, point.pushed,
        point.springs, point.rows,
    )  # fmt: skip


@compiled
def receptance_over(A: Complex, u_linear: Complex, B: Complex, x_linear: Complex) -> Receptance:
    """Return a receptance that reads arrays of others, whose first index begins with value, derivative."""
    return _receptance_of(A, u_linear, B, x_linear, np.full(PLACE, np.nan))


def receptance_by_value(linear: Receptance) -> Receptance:
    """Return the arrays of a receptance as a tuple that Python can read (views, not copies)."""
    return cast(_ReceptanceProxy, linear).arrays


def of_all_ports(system: System, linear: Receptance) -> Receptance:
    """Return a receptance by value with A (2, nk, nc, nc) of all ports."""
    if system.span.shape[1] == 0 or linear.A.shape[2] == system.span.shape[0]:
        return linear
    return linear._replace(A=np.ascontiguousarray(system.span @ linear.A @ system.span.T))


@compiled
def receptance_arrays(linear: Receptance) -> Receptance:
    """Return the same, made anew."""
    return Receptance(linear.A, linear.u_linear, linear.B, linear.x_linear)


@compiled
def is_spanned(system: System) -> bool:
    """Return whether the motions of all ports follow from those of fewer."""
    return bool(system.span.shape[1] > 0)


@compiled
def new_receptance(system: System) -> Receptance:
    """Return an empty receptance for `system`."""
    nk, nc, r = system.ks.size, system.owner.size, system.leading.size
    return _receptance_of(
        np.zeros((2, nk, r, r), np.complex128),
        np.zeros((2, nk, nc), np.complex128),
        np.zeros((2, nk, nc), np.complex128),
        np.zeros((2, nk), np.complex128),
        np.full(PLACE, np.nan),
    )


@compiled
def new_evaluation(system: System) -> Evaluation:
    """Return empty arrays for `evaluate`, for factors in the leading ports alone where they span all.

    The large ones are not set to zero: of many contacts that stick most of their memory is never touched.
    """
    spanned = is_spanned(system)
    ne, nc, n, nk = system.laws.size, system.owner.size, coefficient_count(system.ks), system.ks.size
    blocks, nt, rigid = system.first_block[ne], nc * n, system.loose.shape[0]
    r = system.leading.size if spanned else 0
    size, whole = (r * n, 0) if spanned else (nt, nt)
    kept = r if spanned else nc
    return _evaluation_of(
        np.zeros(nt), np.zeros(nt), np.zeros((nc, n)), np.zeros((blocks, n, n)), np.zeros((nc, n)),
        np.zeros(n), np.zeros(n), np.zeros((n, coefficient_count(system.load_ks))), np.zeros(ne, np.int64),
        np.zeros(ne, np.int64), np.zeros(nc),
        new_segments(max(system.ks[-1], system.load_ks[-1])),
        np.empty((whole, whole)),
        np.empty((size + 1, size + 1)), np.zeros(nt + 1, np.int32), np.zeros(nc, np.int64),
        np.zeros(nc, np.int64), np.zeros(COUNTS, np.int64), np.zeros((blocks, n, n)),
        np.empty((nk, kept, kept), np.complex128), np.zeros(nt), np.zeros(nt + 1), np.zeros((3, nt + 1)),
        np.zeros((rigid, nc)), np.zeros((rigid, rigid)), np.zeros(nc), np.zeros((rigid, nc)),
        np.empty((nc, r * n)), np.empty((n, r, r * n)), np.empty((4 * r, r * n)),
    )  # fmt: skip
