"""Parts that contacts alone hold: the mean of such a part is a gauge as long as no contact holds it.

The force of a contact under a given load that slips both ways in a period does not depend on the mean of its
motion. Whether the contacts hold a part is a matter of rank: with l_i the rigid-body motions at the ports,
scaled to Σ l_i kt l_j = δ_ij, the part is loose along the null space of S_ij = l_i (dF₀/du₀) l_j, which is 1
where every contact sticks. There the Newton step takes the contacts' stiffness for the slope that is missing,
along the gauge alone, which leaves the mean where it is when the mean forces balance, as they do by symmetry;
the determinant keeps its sign, and tangents have no part along the gauge.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.coordinates import is_reduced, responses
from solver.contacts.kernels.stick_slip_events import SEPARATED, STUCK
from solver.contacts.kernels.system import UNHELD, Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Real, coefficient_count
from solver.jit.separate import apart

# Singular value of S below which nothing holds the part: slopes are of the size of kt, or rounding of events.
FREE = 1e-6


@apart
def find_gauge(system: System, point: Evaluation) -> None:
    """Find the directions in which nothing holds a part, and what stands in for the slope that is missing.

    Fills `gauge` with these motions of the ports, `unheld` with the forces that would act along them, and
    `elastic` with the stiffness of contacts that stick with all the mean force they can carry: a Newton step
    takes them for sticking at rest (`rebase`), unless a constant force holds the part.
    """
    rigid, nc = system.loose.shape[0], system.owner.size
    S = np.zeros((rigid, rigid))
    for c in range(nc):
        point.elastic[c] = 0.0
    for e in range(system.laws.size):
        first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
        for a in range(m):
            for b in range(m):
                slope = point.dF_dU[system.first_block[e] + a * m + b, 0, 0]
                for i in range(rigid):
                    for j in range(rigid):
                        S[i, j] += system.loose[i, first + a] * slope * system.loose[j, first + b]
    point.counts[UNHELD] = 0
    if not math.isfinite(S.sum()):
        return
    left, sizes, right = np.linalg.svd(S)
    if system.hold == 0 and sizes[rigid - 1] <= FREE:
        for c in range(nc):
            if point.states[system.owner[c]] != STUCK:
                continue
            along = 0.0
            for k in range(rigid):
                if sizes[k] <= FREE:
                    part = 0.0
                    for i in range(rigid):
                        part += right[k, i] * system.loose[i, c]
                    along += part * part * system.shift[c]
            if along > FREE:
                point.elastic[c] = system.shift[c]
                for i in range(rigid):
                    for j in range(rigid):
                        S[i, j] += system.loose[i, c] * system.shift[c] * system.loose[j, c]
        left, sizes, right = np.linalg.svd(S)
    count = 0
    for k in range(rigid):
        if sizes[k] > FREE:
            continue
        for i in range(rigid):
            point.unheld[count, i] = left[i, k]
        for c in range(nc):
            point.gauge[count, c] = 0.0
            for i in range(rigid):
                point.gauge[count, c] += right[k, i] * system.loose[i, c]
        count += 1
    point.counts[UNHELD] = count


@apart
def let_hold(system: System, r: Real, point: Evaluation) -> None:
    """Take the mean forces in the directions that nothing holds out of the mean residual.

    That is what a constant force on the part would do which holds it where nothing else does.
    """
    n, rigid = coefficient_count(system.ks), system.loose.shape[0]
    for k in range(point.counts[UNHELD]):
        force = 0.0
        for i in range(rigid):
            for c in range(system.owner.size):
                force += point.unheld[k, i] * system.loose[i, c] * system.shift[c] * r[c * n]
        for i in range(rigid):
            for c in range(system.owner.size):
                r[c * n] -= force * point.unheld[k, i] * system.loose[i, c]


@compiled
def keep_means(system: System, point: Evaluation, J: Real, n: int) -> None:
    """Add Σ l (kt l)ᵀ over the motions l of `gauge` to dr/du of the means: a Newton step leaves them.

    Since A₀ kt l = l, that is a stiffness against l and nothing else. All ports have to be in J.
    """
    for k in range(point.counts[UNHELD]):
        for c in range(system.owner.size):
            for d in range(system.owner.size):
                J[c * n, d * n] += point.gauge[k, c] * system.shift[d] * point.gauge[k, d]


@apart
def _pin_means(system: System, u: Real, point: Evaluation, rhs: Real) -> None:
    """Let a Newton step move the means along `gauge` to where the mean forces are those of first loading.

    Any mean along a gauge is as good, until a contact that slipped sticks: it begins unloaded, with kt u as
    its first force. Means that Newton's steps left anywhere would then be pulls that nothing balances, and
    the response that goes on there could not be reached. Σ l (kt u₀ − F₀) = 0 over what slips leaves none.
    The step has J l = l, see `keep_means`. A motion that takes contacts along that are open is left alone:
    they may close; and so is all where a constant force holds the part, which may stand on either side.
    """
    if system.hold == 1:
        return
    n = coefficient_count(system.ks)
    for k in range(point.counts[UNHELD]):
        beside, off = 0.0, 0.0
        for c in range(system.owner.size):
            along, stiffness = point.gauge[k, c], system.shift[c]
            if system.rubs[c] == 0 or point.states[system.owner[c]] == SEPARATED:
                beside += along * stiffness * along
            else:
                off += along * (stiffness * u[c * n] - point.F[c, 0])
        if beside <= FREE:
            for c in range(system.owner.size):
                rhs[c * n] += off * point.gauge[k, c]


@compiled
def rebase(system: System, linear: Receptance, u: Real, point: Evaluation, rhs: Real) -> None:
    """Make the right-hand side of a Newton step that of contacts which stick at rest about their mean.

    A contact that sticks beyond what it slipped when first loaded has a constant mean force, whatever its
    mean: the motion with that force on its first loading line is as good, and from there the line leads on.
    So are the means that nothing holds, of contacts that slip.
    """
    if system.loose.shape[0] == 0:
        return
    n, nc = coefficient_count(system.ks), system.owner.size
    _pin_means(system, u, point, rhs)
    off, motions = np.zeros(nc, np.complex128), np.zeros(nc, np.complex128)
    for d in range(nc):
        if point.elastic[d] > 0.0:
            off[d] = point.elastic[d] * u[d * n] - point.F[d, 0]
    if is_reduced(system, linear):
        responses(system, linear.A[0, 0], off, motions)
    else:
        for d in range(nc):
            for c in range(nc):
                motions[c] += linear.A[0, 0, c, d] * off[d]
    for c in range(nc):
        rhs[c * n] += motions[c].real
