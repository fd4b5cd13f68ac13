# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Step 1: slow motion, rigid joints."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.papers.elastic.identification.rigid import fit_rigid
import numpy as np
import pytest


def test_rigid_parameters(runs, truth) -> None:
    fit = fit_rigid(runs)
    wanted = [truth.alpha + truth.rotor[0], truth.beta, truth.gamma, truth.rotor[1]]
    np.testing.assert_allclose(fit.estimate.values[:4], wanted, rtol=0.02)
    np.testing.assert_allclose(fit.coulomb, truth.joint_coulomb, rtol=0.03)
    np.testing.assert_allclose(fit.estimate.values[4:6], truth.total_damping, rtol=0.02)
    assert fit.relative_error < 3.0


def test_deviations_hold_for_short_data(runs, truth) -> None:
    """24 s: rows are closer than the filter lets errors change, which deviations have to know."""
    true = [truth.alpha + truth.rotor[0], truth.beta, truth.gamma, truth.rotor[1]]
    true = np.array([*true, *truth.total_damping, *truth.joint_coulomb])
    off = [
        (fit.values - true) / fit.std
        for fit in (fit_rigid(part).estimate for part in (runs[:6], runs[6:]))
    ]
    assert np.sqrt(np.mean(np.square(off))) < 1.6
    assert np.abs(off).max() < 3.0


def test_short_experiments_are_refused(clean_steps) -> None:
    with pytest.raises(IdentificationError, match=r'0\.8 s'):
        fit_rigid(clean_steps)


def test_a_joint_that_stands_is_refused(runs) -> None:
    still = []
    for run in runs:
        stop = np.array([1.0, 0.0])
        motor = replace(run.motor, dq=run.motor.dq * stop)
        link = replace(run.link, dq=run.link.dq * stop, ddq=run.link.ddq * stop)
        still.append(replace(run, motor=motor, link=link))
    with pytest.raises(IdentificationError, match='rests'):
        fit_rigid(still)
