# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A bag larger than the memory: its rows come piece by piece, and are those of the whole."""

from armid_ros.arm import ArmModel
from armid_ros.identification.fitting.least_squares import NormalEquations, weighted_fit
from armid_ros.identification.rows.regression import regressions
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.identification.rows.streaming import streamed
from armid_ros.recording import read_recording, ReadSettings, write_recording
import numpy as np
import pytest

from ..conftest import multisine, recorded

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
