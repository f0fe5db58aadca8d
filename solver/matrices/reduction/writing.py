"""A reduced model in a file that `read_matrix` reads again: .npz or MATLAB's .mat."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.io import savemat

from solver.matrices.reduction.craig_bampton import Reduced

WRITTEN = (".npz", ".mat")


def write_reduced(path: Path, reduced: Reduced, dofs: Sequence[str]) -> None:
    """Write M, K and maybe C, with the names of the rows and the frequencies of the modes kept.

    The arrays are ``M`` [kg], ``K`` [N/m], ``C`` [N s/m], ``names`` (DOFs in use, then ``mode1`` …),
    ``held_hz``, ``system_hz`` [Hz] and ``good_to_hz``.

    Raises
    ------
    ValueError
        A suffix that is not one of `WRITTEN`.
    OSError
        The file cannot be written.
    """
    names = [*dofs, *(f"mode{i}" for i in range(1, reduced.modes + 1))]
    quality = reduced.quality
    arrays = {
        **reduced.matrices,
        "held_hz": quality.held_hz,
        "system_hz": quality.system_hz,
        "good_to_hz": np.array(quality.good_to_hz),
    }
    suffix = path.suffix.lower()
    if suffix == ".npz":
        np.savez_compressed(path, allow_pickle=False, **arrays, names=np.array(names))
    elif suffix == ".mat":
        savemat(path, {**arrays, "names": np.array(names, dtype=object)}, do_compression=True)
    else:
        raise ValueError(f"a reduced model is written to {' or '.join(WRITTEN)}, got {path.suffix!r}")
