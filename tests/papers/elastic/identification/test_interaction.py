# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Rigid parameters, what one link does to the other, and what is left of each joint."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.model import inverse_dynamics
from armid_ros.motion import Motion
from armid_ros.papers.elastic.identification.interaction import (
    decibel_error,
    fit_joints,
    frequencies,
    HOLD,
    ideal_response,
    interaction_torques,
    joint_signals,
    measured_response,
    ORDER,
)
from armid_ros.papers.elastic.identification.rigid import fit_rigid
from armid_ros.papers.elastic.identification.subspace import identify_subspace, Signals
from armid_ros.robots import load_robot
import control
import numpy as np
import pytest
import scipy.signal

FREQUENCY = np.geomspace(5.0, 60.0, 200)


def test_interaction_is_what_inverse_dynamics_has_beside_the_own_inertia(truth) -> None:
    """The equations against Pinocchio on the shipped description."""
    rng = np.random.default_rng(0)
    robot = load_robot('two_link_elastic')
    q, dq, ddq = rng.standard_normal((3, 50, 2))
    link = Motion(robot.joints, np.arange(50.0), q, dq, ddq)
    tau = inverse_dynamics(robot, link) - ddq * truth.inertia
    np.testing.assert_allclose(interaction_torques(link, truth), tau, atol=1e-10)


@pytest.mark.parametrize('joint', [0, 1])
def test_ideal_response_is_that_of_python_control(truth, joint) -> None:
    s = control.tf('s')
    spring = truth.stiffness[joint] / s + truth.spring_damping[joint]
    motor = truth.rotor[joint] * s + truth.joint_motor_damping[joint]
    link = truth.inertia[joint] * s + truth.link_damping[joint]
    plant = (link + spring) / ((motor + spring) * (link + spring) - spring * spring)
    theirs = control.frequency_response(plant, 2 * np.pi * FREQUENCY).complex
    np.testing.assert_allclose(ideal_response(truth, joint, FREQUENCY)[:, 0, 0], theirs, rtol=1e-9)


def test_motor_torque_alone_shows_another_system_and_more_so_at_link_2(truth, runs) -> None:
    wrong = []
    for joint in range(2):
        frequency, found = measured_response(
            joint_signals(runs, truth, joint, decoupled=False), 1e-3
        )
        band = (frequency >= 5.0) & (frequency <= 60.0)
        ideal = ideal_response(truth, joint, frequency[band])
        wrong.append(decibel_error(found[band, 0, 0], ideal[:, 0, 0]))
    assert 3.0 < wrong[0] < wrong[1]


def test_physical_parameters_follow_from_the_responses(truth, runs) -> None:
    systems = [
        identify_subspace(joint_signals(runs, truth, k, decoupled=True), 1e-3, ORDER, HOLD)
        for k in range(2)
    ]
    fit, gain = fit_joints(systems, ('joint1', 'joint2'), truth)
    for name, tolerance in (
        ('rotor', 0.02),
        ('inertia', 0.02),
        ('stiffness', 0.02),
        ('spring_damping', 0.05),
        ('total_damping', 0.05),
    ):
        np.testing.assert_allclose(getattr(fit, name), getattr(truth, name), rtol=tolerance)
    np.testing.assert_allclose(gain, 1.0, atol=0.01)
    antiresonance, resonance = frequencies(fit)
    np.testing.assert_allclose(antiresonance, (22.7, 29.4), atol=0.25)
    np.testing.assert_allclose(resonance, (35.5, 42.2), atol=0.35)


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


DT = 1e-3
A = np.array([[-3.0, 200.0, 0.0], [-200.0, -20.0, 5.0], [0.0, 1.0, -8.0]])
B = np.array([[1.0, 0.0], [0.5, 2.0], [3.0, -1.0]])
C = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, -1.0]])


def experiment(rng, count=3000, noise=0.0):
    """Simulate with one held and one smooth input, from a random state."""
    t = DT * np.arange(count)
    held = rng.standard_normal(count)
    smooth = np.sum(
        [np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in np.arange(1.0, 90.0, 2.0)], axis=0
    )
    start = 3.0 * rng.standard_normal(3)
    a, b, *_ = scipy.signal.cont2discrete((A, B, C, np.zeros((2, 2))), DT, 'zoh')
    first = scipy.signal.cont2discrete((A, B, C, np.zeros((2, 2))), DT, 'foh')
    x, table = start, np.empty((count, 2))
    states = scipy.signal.dlsim(first, np.column_stack([0 * smooth, smooth]))[1]
    for k in range(count):
        table[k] = C @ x
        x = a @ x + b[:, 0] * held[k]
    y = table + states
    return Signals(np.column_stack([held, smooth]), y + noise * rng.standard_normal(y.shape))


@pytest.fixture(scope='module')
def clean():
    """Return four experiments without noise."""
    rng = np.random.default_rng(0)
    return [experiment(rng) for _ in range(4)]


def test_bode_plot_is_that_of_python_control(clean) -> None:
    """A tenth of a line's width: 0.01 dB and 0.1 degrees on all four responses."""
    frequency = np.geomspace(1.0, 100.0, 60)
    system = identify_subspace(clean, DT, 3, ('zero', 'first'))
    found = system.response(frequency)
    theirs = control.frequency_response(
        control.ss(A, B, C, np.zeros((2, 2))), 2 * np.pi * frequency
    )
    wanted = np.moveaxis(np.asarray(theirs.complex), 2, 0)
    ratio = found / wanted
    assert np.abs(20.0 * np.log10(np.abs(ratio))).max() < 0.01
    assert np.abs(np.degrees(np.angle(ratio))).max() < 0.1


def test_spectra_agree_without_a_model(clean) -> None:
    frequency, found = measured_response(clean, DT, window=1.5)
    band = (frequency >= 10.0) & (frequency <= 80.0)
    s = 2j * np.pi * frequency[band]
    wanted = C @ np.linalg.solve(s[:, np.newaxis, np.newaxis] * np.eye(3) - A, B)
    error = np.abs(found[band, 0, 0] / wanted[:, 0, 0] - 1.0)
    assert np.median(error) < 0.05


def test_too_little_data_is_refused(clean) -> None:
    short = [Signals(e.u[:60], e.y[:60]) for e in clean]
    with pytest.raises(IdentificationError, match='too short'):
        identify_subspace(short, DT, 3, ('zero', 'first'))


def test_an_input_that_does_nothing_is_refused(clean) -> None:
    dead = [Signals(e.u * [1.0, 0.0], e.y) for e in clean]
    with pytest.raises(IdentificationError, match='zero in all samples'):
        identify_subspace(dead, DT, 3, ('zero', 'first'))
