# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is learned of a residual: maps that predict it, nothing of noise, and the law behind it."""

from dataclasses import replace
import sys

from armid_ros.diagnosis import diagnose
from armid_ros.errors import IdentificationError
from armid_ros.report.diagnosis_report import diagnosis_report
from armid_ros.report.provenance import ResultOrigin
from armid_ros.residual import learn_residual
from armid_ros.residual.gaussian_process import learn_map
from armid_ros.residual.law import suggest_law
from armid_ros.residual.learn import _learned, near_data
from armid_ros.residual.rows import BLOCKS, JointRows
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench

NOISE = 0.05


def rows(torque, seed=0, count=1500, noise=NOISE):
    """Return what is left of a joint that wanders: a torque of position and velocity, noise."""
    rng = np.random.default_rng(seed)
    t = 0.02 * np.arange(count)
    turns = rng.uniform(0.1, 0.5, 4)[:, None] * 2.0 * np.pi
    phase = rng.uniform(0.0, 2.0 * np.pi, (4, 1))
    q = 0.5 * np.sin(turns * t + phase).sum(axis=0)
    dq = (0.5 * turns * np.cos(turns * t + phase)).sum(axis=0)
    load = 2.0 * np.sin(q)
    left = torque(q, dq, load) + noise * rng.normal(size=count)
    block = np.arange(count) * BLOCKS // count
    return JointRows(np.column_stack([q, dq, load]), left, block)


def explained(known, other):
    """Return the share that a map takes of what can be explained of other data."""
    learned, _ = learn_map(known, np.random.default_rng(0))
    near = near_data(learned, other)
    assert near.mean() > 0.7
    left = other.residual[near]
    after = left - learned.torque(other.inputs[near])
    can = np.sum(left**2) - NOISE**2 * near.sum()
    return (np.sum(left**2) - np.sum(after**2)) / can


@pytest.mark.parametrize(
    'torque',
    [
        lambda q, dq, w: 0.4 * np.exp(-(((q - 0.3) / 0.4) ** 2)) * np.sign(dq),
        lambda q, dq, w: 0.1 * dq**3,
        lambda q, dq, w: 0.8 * np.maximum(q - 0.2, 0.0) * (1.0 + 0.3 * np.sign(dq)),
        lambda q, dq, w: 0.3 * np.sin(6.0 * q),
    ],
    ids=['position friction', 'cubic drag', 'cable snag', 'bumps'],
)
def test_a_map_predicts_most_of_what_has_no_name_on_another_motion(torque):
    assert explained(rows(torque), rows(torque, seed=1)) > 0.8


def test_noise_teaches_nothing():
    still = rows(lambda q, dq, w: 0.0 * q)
    learned, predicted = learn_map(still, np.random.default_rng(0))
    assert np.sum((still.residual - predicted) ** 2) > 0.99 * np.sum(still.residual**2)
    assert suggest_law(still, False) is None
    inputs = rows(lambda q, dq, w: 0.0 * q, seed=1).inputs
    assert np.sqrt(np.mean(learned.torque(inputs) ** 2)) < 0.3 * NOISE


@pytest.mark.parametrize(
    ('torque', 'text', 'value'),
    [
        (lambda q, dq, w: 0.1 * dq**3, 'dq^3', 0.1),
        (lambda q, dq, w: 0.3 * np.abs(w) * np.sign(dq), '|w| sign(dq)', 0.3),
        (lambda q, dq, w: -0.2 * dq * np.abs(dq), 'dq |dq|', -0.2),
    ],
)
def test_the_law_behind_it_is_suggested(torque, text, value):
    law = suggest_law(rows(torque), False)
    assert law.terms[0].text == text
    assert law.terms[0].coefficient == pytest.approx(value, rel=0.1)
    assert law.share > 0.8


@pytest.fixture(scope='module')
def unknown():
    """Return the diagnosis of an arm with bumps in a joint, which no catalogue has."""
    bench = Bench()

    def bumps(motion, _):
        torque = 0.8 * np.sin(9.0 * motion.q[:, 1]) * (motion.q[:, 1] > 0.0)
        return np.outer(torque, [0.0, 1.0])

    *known, held_out = bench.recordings(bumps)
    return diagnose(bench.arm, known, validate=[held_out], rng=np.random.default_rng(0))


@pytest.fixture(scope='module')
def learned(unknown):
    """Return what is learned of it."""
    return learn_residual(replace(unknown, verdict='unknown'), np.random.default_rng(0))


def test_what_has_no_name_is_learned_and_becomes_part_of_the_model(unknown, learned):
    best = learned.joints[0]
    assert best.joint == unknown.arm.robot.joints[1]
    assert best.gain > 0.5
    part = unknown.data[0]
    before, after = (part.residual(arm)[:, 1] for arm in (learned.base, learned.arm))
    assert np.std(after) < 0.7 * np.std(before)
    heads, row, *_ = learned.table()
    assert ','.join(heads) == 'joint,position,velocity,load,torque,std'
    first = [float(x or 0.0) for x in row[1:]]
    at = np.array(first[:3])
    assert learned.joints[0].learned.torque(at) == pytest.approx(first[3], abs=1e-5)


def test_a_torque_that_is_not_material_is_not_learned(unknown):
    """No held-out recording shows that the map is right."""
    small = rows(lambda q, dq, w: 0.1 * np.sin(6.0 * q), noise=0.001)
    rng, joint = np.random.default_rng(0), unknown.arm.robot.joints[0]
    kept, gone = (
        _learned(joint, small, None, material, unknown.arm, rng) for material in (0.01, 1.0)
    )
    assert kept is not None and kept.held_out is None
    assert gone is None


def test_a_map_that_harms_held_out_recordings_says_so(unknown, learned):
    harmful = replace(learned, joints=(replace(learned.joints[0], held_out=-140.0),))
    assert 'get worse' in harmful.sentences()[0]
    page = diagnosis_report(
        unknown, {}, origin=ResultOrigin('two_links'), learned=harmful.section()
    )
    assert '>worse<' in page
    assert '-14000' not in page


def test_a_name_is_never_replaced(unknown):
    for verdict in ('named', 'ambiguous', 'consistent', 'bad_data', 'not_repeatable'):
        asked = replace(unknown, verdict=verdict)
        assert learn_residual(asked, np.random.default_rng(0)) is None


def test_a_missing_library_is_said_with_what_to_install(unknown, monkeypatch):
    monkeypatch.setitem(sys.modules, 'sklearn', None)
    with pytest.raises(IdentificationError, match=r'armid_ros\[residual\]'):
        learn_residual(replace(unknown, verdict='unknown'), np.random.default_rng(0))
