"""Contacts in space marched in time: the reference values, the box, one direction."""

import copy
import math

import numpy as np
import pytest
from space_elements import balanced
from space_march import CASES, march_case, matrices

from solver.jit import fourier


@pytest.mark.parametrize("name", CASES)
def test_march_reaches_the_reference(name: str):
    case = CASES[name]
    marched = march_case(case["scene"], case["frequency_hz"])
    np.testing.assert_allclose(marched.half_pp, case["half_pp"], rtol=3e-7)
    np.testing.assert_allclose(marched.mean, case["mean"], atol=1e-10)
    assert marched.work == pytest.approx(case["work"], rel=3e-6)


@pytest.mark.parametrize("name", CASES)
def test_box_and_two_stiffnesses_agree_with_the_balance(name: str):
    case = CASES[name]
    for limit, second in (("circle", 18.0), ("box", 18.0)):
        scene = copy.deepcopy(case["scene"])
        scene["contacts"][0] |= {"limit": limit, "kt_second": second}
        marched = march_case(scene, case["frequency_hz"], tolerance=1e-10)
        omega = 2.0 * math.pi * case["frequency_hz"]
        U = balanced(matrices(scene), omega, scene, harmonics=41)
        x = fourier.basis(np.linspace(0.0, 2.0 * math.pi, 20001), 41) @ U.T
        np.testing.assert_allclose(0.5 * (x.max(axis=0) - x.min(axis=0)), marched.half_pp, rtol=2e-5)
