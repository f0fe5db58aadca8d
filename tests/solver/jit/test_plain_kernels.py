"""The plain way of the kernels gives the same: for a spring, and with the long tests for friction."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent.parent.parent
PLAIN = {**os.environ, "STICKSLIP_KERNELS": "plain"}
# What asks of Numba and LLVM what they do not document.
PRIVATE = "('solver.jit.cache', 'solver.jit.slots')"
NUMBERS = f"""
import json, sys
import numpy as np
from law_cases import COULOMB_BOX, POLYNOMIAL, Element, evaluate, row_of

laws = {{"polynomial": (POLYNOMIAL, 1), "coulomb-box": (COULOMB_BOX, 3)}}
law, ports = laws[sys.argv[1]]
U = np.random.default_rng(0).normal(size=(ports, 7))
row = row_of(KT=2.0, KT_SECOND=1.0, MU=0.3, KN=1.0)
answer = evaluate(Element(law=law, U=U, load=np.array([1.0, 0.3, 0.2]), row=row))
print(json.dumps([answer.F.tolist(), answer.dF_dU.ravel().tolist(), [answer.state, answer.piece]]))
print(json.dumps([name for name in {PRIVATE} if name in sys.modules]))
"""


def numbers(law: str, environment: dict[str, str]) -> tuple[list[list[float]], list[str]]:
    """What a law called by its number gives in a process, and which private modules it loaded."""
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests" / "cases")])
    found = subprocess.run(
        [sys.executable, "-c", NUMBERS, law], env={**environment, "PYTHONPATH": path}, cwd=ROOT, check=True,
        capture_output=True, text=True,
    )  # fmt: skip
    values, private = map(json.loads, found.stdout.splitlines())
    return values, private


@pytest.mark.long
def test_the_tests_of_the_contact_force_pass() -> None:
    path = "tests/solver/contacts/test_contact_force.py"
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", path], env=PLAIN, cwd=ROOT,
        check=False, capture_output=True, text=True,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout[-2000:]
    assert "[100%]" in ran.stdout


@pytest.mark.long
@pytest.mark.parametrize("law", ["polynomial", "coulomb-box"])
def test_a_law_called_by_its_number_is_the_same_and_asks_for_nothing_private(law: str) -> None:
    plain, none = numbers(law, PLAIN)
    usual, some = numbers(law, {**os.environ, "STICKSLIP_KERNELS": "compiled"})
    assert none == []
    assert len(some) == 3
    for one, other in zip(plain, usual, strict=True):
        np.testing.assert_allclose(np.ravel(one), np.ravel(other), rtol=0.0, atol=1e-13 * np.abs(other).max())
