# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The linear problem: columns made in parts and pieces, and what dry friction hides."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification import identify
from armid_ros.identification.fitting.least_squares import NormalEquations, weighted_fit
from armid_ros.identification.rows.regression import (
    bridged,
    filtered_columns,
    held_samples,
    regressions,
)
from armid_ros.identification.rows.signals import Conditioning, decimate
from armid_ros.identification.rows.streaming import streamed
from armid_ros.motion import Motion
from armid_ros.recording import read_recording, ReadSettings, Recording, write_recording
from armid_ros.robots import load_robot
from armid_ros.simulation.run import simulate
from armid_ros.simulation.sensors import Sensors
import numpy as np
import pytest

from tests.serial_arm import serial_arm

from ..conftest import multisine, recorded


@pytest.fixture(scope='module')
def swing():
    return load_robot(serial_arm('swing revolute 0,1,0 0,0,0'))


@pytest.fixture(scope='module')
def long_motion(swing):
    """45 s at 1 kHz: three parts."""
    t = np.arange(45_000) * 1e-3
    w = 2.0 * np.pi * 0.7
    q = np.sin(w * t)[:, None]
    return Motion(swing.joints, t, q, w * np.cos(w * t)[:, None], -(w**2) * q)


@pytest.mark.parametrize(
    'values',
    [
        {'viscous_friction': 0.1, 'presliding_hysteresis': 0.3, 'time_delay': 0.0},
        {'torque_lag': 0.004, 'time_delay': 0.003, 'torque_drift': 0.2},
        {'joint_elasticity': 1e-3, 'torque_gain': 0.1},
    ],
    ids=['history', 'late', 'elastic'],
)
def test_columns_made_in_parts_are_those_made_at_once(swing, long_motion, values):
    arm = ArmModel(swing)
    for name, value in values.items():
        arm = arm.with_effect(make_effect(name, swing), [value])
    used = Conditioning(1000.0, 50.0, 20)
    chosen = np.array([9 + len(values), 3, 9, 10])
    _, unsure = held_samples(arm, long_motion)
    parts = filtered_columns(arm, chosen, long_motion, used, unsure)
    columns = arm.columns(long_motion)[:, :, chosen]
    whole = decimate(bridged(columns, unsure), used)
    np.testing.assert_allclose(parts, whole, atol=2e-5 * np.abs(whole).max())


def test_the_rigid_body_needs_no_more_samples_than_it_has_content(arm):
    """Every tenth sample of a motion below 1 Hz gives the same columns after the filter."""
    rate, used = 1000.0, Conditioning(1000.0, 20.0, 20)
    assert used.smooth_stride == 10
    motion = multisine(arm.robot.joints, 30.0, rate, seed=3)
    rigid = np.arange(len(arm.robot.rigid_parameters))
    strided = filtered_columns(arm, rigid, motion, used, held_samples(arm, motion)[1])
    whole = decimate(arm.columns(motion)[:, :, rigid], used)
    scale = np.abs(whole).max(axis=(0, 1))
    np.testing.assert_array_less(np.abs(strided - whole).max(axis=(0, 1)), 3e-3 * scale + 1e-12)


@pytest.mark.parametrize(('kind', 'inertia'), [('prismatic', 2.0), ('revolute', 0.1)])
def test_a_joint_that_stops_as_it_reverses_loses_no_inertia(kind, inertia):
    """Friction is between its limits while a joint stands, which is not its sign times a level."""
    robot = load_robot(serial_arm(f'swing {kind} 0,0,1 0,0,0'))
    structure, arm = ArmModel(robot), ArmModel(robot)
    for name, value in {'viscous_friction': 2.0, 'coulomb_friction': 2.5}.items():
        structure = structure.with_effect(make_effect(name, robot), [0.0])
        arm = arm.with_effect(make_effect(name, robot), [inertia * value])
    structure = structure.with_effect(make_effect('torque_offset', robot), [0.0])
    rng = np.random.default_rng(1)
    sensors = Sensors(torque_noise=0.025 * inertia)
    run = simulate(arm, _slow_swing(robot.joints), rng=rng, sensors=sensors)
    recording = Recording(joints=run.joints, t=run.t, q=run.q, tau=run.tau)
    result = identify(structure, [recording], rng=rng)
    truth = result.base.values(np.append(arm.theta, 0.0))
    error = (result.estimate.values - truth) / result.estimate.std
    assert np.abs(error).max() < 3.0


def _slow_swing(joints):
    """Return 20 s at 1 kHz with a reversal every two seconds."""
    t = np.arange(20_001) * 1e-3
    w, size = 2.0 * np.pi * np.array([0.25, 0.6]), np.array([0.25, 0.02])
    angle = np.outer(t, w)
    parts = np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)
    return Motion(joints, t, *((part @ size)[:, None] for part in parts))


def test_what_is_unsure_is_interpolated_the_others_stay():
    """Each joint has samples of its own; at an end the nearest sample stands in."""
    values = np.array([[7.0, 1.0], [9.0, 9.0], [2.0, 9.0], [3.0, 4.0]])
    unsure = np.array([[True, False], [True, True], [False, True], [False, False]])
    np.testing.assert_allclose(bridged(values, unsure), [[2, 1], [2, 2], [2, 3], [3, 4]])
    np.testing.assert_allclose(
        bridged(values[:, :, None], unsure)[..., 0], bridged(values, unsure)
    )


USED = Conditioning(200.0, 20.0, 8)


@pytest.fixture(scope='module')
def smooth(arm):
    """Return the arm without dry friction, whose rest is judged piece by piece."""
    return ArmModel.of(arm.robot, effects='viscous_friction,torque_offset')


def bag(folder, arm, gaps=()):
    """Write a minute in small chunks, with holes from one time to another [s]."""
    motion = multisine(arm.robot.joints, 60.0, 200.0, 3)
    measured = recorded(arm, motion, 3, torque_noise=0.02)
    keep = np.ones(len(motion), dtype=bool)
    for start, stop in gaps:
        keep &= (motion.t < start) | (motion.t > stop)
    path = folder / f'bag_{len(gaps)}'
    write_recording(path, measured.select(keep), chunk_size=40_000, start_ns=10**18)
    return path


def pieces_of(path, arm, samples):
    """Return the pieces of a bag with their rows, and the base columns."""
    columns = arm.base_parameters(np.random.default_rng(0)).independent
    pieces = streamed(path, arm, columns, lambda piece: USED, samples, settings=ReadSettings())
    return list(pieces), columns


@pytest.mark.slow
@pytest.mark.parametrize(('gaps', 'samples'), [((), 4000), (((21.3, 22.0), (40.0, 40.5)), 1700)])
def test_rows_of_pieces_are_those_of_the_whole(tmp_path, smooth, gaps, samples):
    path = bag(tmp_path, smooth, gaps)
    pieces, columns = pieces_of(path, smooth, samples)
    parts = [rows for _, some in pieces for rows in some]
    recording = read_recording(path, joints=smooth.robot.joints)
    whole = regressions(smooth, columns, [recording], USED)
    assert len(pieces) >= 12_000 // samples
    assert max(len(piece) for piece, _ in pieces) < samples + 700
    assert sum(len(part.motion) for part in parts) == sum(len(part.motion) for part in whole)
    stacked, expected = (np.concatenate([p.columns for p in some]) for some in (parts, whole))
    np.testing.assert_allclose(stacked, expected, rtol=1e-9, atol=1e-9)
    one, other = (weighted_fit(NormalEquations.of(rows)) for rows in (parts, whole))
    np.testing.assert_allclose(one.values, other.values, rtol=1e-9, atol=1e-11)


def test_pieces_of_a_shorter_reach_than_the_filters_still_end(tmp_path, smooth):
    pieces, _ = pieces_of(bag(tmp_path, smooth), smooth, 150)
    assert sum(len(part.motion) for _, some in pieces for part in some) > 1400
