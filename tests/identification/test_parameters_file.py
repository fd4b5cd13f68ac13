# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a file of an identification contains, and says of the parameters that a model has."""

from dataclasses import replace
from typing import get_args

from armid_ros.effects import CATALOGUE
from armid_ros.errors import ModelError
from armid_ros.identification import identification_document, identify, write_document
from armid_ros.identification.assess.compare import compare
from armid_ros.identification.fitting.identifiability import Reason
from armid_ros.identification.parameters_file import known_fit, parameters_of, read_parameters
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench

from .conftest import multisine, recorded


def test_information_of_standard_parameters_is_the_inverse_covariance():
    """On parameters that were not identified there is none."""
    bench = Bench()
    found = identify(bench.arm, bench.recordings(), rng=np.random.default_rng(0))
    read = parameters_of('identification.json', identification_document(found, 'bench', {}))
    told = read.information(bench.arm.parameters)
    lift = np.linalg.pinv(found.base.grouping)
    product = lift.T @ told @ lift @ found.estimate.covariance
    np.testing.assert_allclose(product, np.eye(found.base.rank), atol=1e-3)
    hidden = np.eye(len(told)) - lift @ found.base.grouping
    np.testing.assert_allclose(hidden @ told @ hidden, 0.0, atol=1e-9 * np.abs(told).max())
    assert replace(read, covariance=None).information(bench.arm.parameters) is None
    arm = bench.arm.with_effect(CATALOGUE['joint_spring'].on(bench.robot, ('elbow',)))
    more, known = read.information(arm.parameters), len(told)
    assert not np.any(more[known:]) and not np.any(more[:, known:])
    np.testing.assert_allclose(more[:known, :known], told)


def score(rms, errors, **others):
    joints = 'ab'
    return {
        'relative_error_percent': max(errors),
        'joint_relative_error_percent': dict(zip(joints, errors, strict=True)),
        'rms': dict(zip(joints, rms, strict=True)),
    } | others


def test_what_was_fitted_counts_as_what_was_held_out_may_be_of_a_changed_arm():
    training = score([0.1, 0.2], [1.0, 2.0], bags=['x', 'y', 'z'])
    held_out = [score([0.3, 0.4], [30.0, 40.0], bag='v')]
    found = known_fit({'training': training, 'validation': held_out})
    assert (found.recordings, found.grade) == (3, 'good')
    assert found.misfit.rms == {'a': 0.1, 'b': 0.2}
    assert found.misfit.torque_rms == pytest.approx({'a': 10.0, 'b': 10.0})
    written = {'grade': 'unusable', 'reasons': ['Because.', 'So.'], 'training': training}
    assert known_fit(written).unusable and known_fit(written).reason == 'Because.'
    assert known_fit({}) is None


@pytest.mark.parametrize('rms', [float('nan'), -0.1, 'much'])
def test_numbers_that_no_residual_has_are_refused(rms):
    with pytest.raises((ValueError, ModelError), match=r"of a|joint 'a'"):
        known_fit({'training': score([rms, 0.1], [1.0, 1.0])})


NEVER, NOT_SHOWN, _, WEAK = get_args(Reason)


@pytest.fixture(scope='module')
def elbow_only(arm, structure):
    """Identify from a recording in which nothing but the elbow moves."""
    full = multisine(arm.robot.joints, 15.0, 200.0, seed=1)
    elbow = np.arange(6) == 3
    motion = replace(full, q=0.2 + elbow * full.q, dq=elbow * full.dq, ddq=elbow * full.ddq)
    return identify(structure, [recorded(arm, motion, 0, 0.02)], rng=np.random.default_rng(0))


def test_covariance_and_grouping_survive_the_file(identified, tmp_path):
    path = tmp_path / 'identification.json'
    write_document(path, identification_document(identified, 'arm', {}))
    assert len(path.read_text().splitlines()) < 20 * identified.base.rank  # a row is a line
    read = read_parameters(path)
    size = np.outer(identified.estimate.std, identified.estimate.std)
    correlation = identified.estimate.covariance / size
    np.testing.assert_allclose(read.covariance / size, correlation, rtol=1e-8, atol=1e-10)
    (group,) = (key for key in read.terms if key.name.startswith('my2 + '))
    assert group.name == 'my2 + 0.35 (m3 + m4 + m5 + m6) - mz3'
    links = dict.fromkeys(('m3', 'm4', 'm5', 'm6'), 0.35)
    assert read.terms[group] == pytest.approx({'my2': 1.0, **links, 'mz3': -1.0})
    later = {name: (value + 1e-3 * std, std) for name, (value, std) in read.values.items()}
    assert not compare(read, replace(read, values=later)).anything


def test_what_a_motion_does_not_show_is_listed_with_the_reason(elbow_only):
    assert any('rest' in note and 'wrist_pitch' in note for note in elbow_only.notes)
    document = identification_document(elbow_only, 'arm', {})
    shown = {(row['name'], row['joint']) for row in document['parameters']}
    lost = {(row['name'], row['joint']): row['reason'] for row in document['not_identified']}
    assert ('viscous_coefficient', 'elbow_pitch') in shown
    for joint in elbow_only.arm.robot.joints:
        if joint != 'elbow_pitch':
            assert lost['viscous_coefficient', joint] == NOT_SHOWN
    assert lost['m1', 'shoulder_pitch'] == NEVER
    weak = {key for key, reason in lost.items() if reason == WEAK}
    assert weak
    assert weak == shown & set(lost)
    estimate = elbow_only.estimate
    for name, value, std in zip(estimate.parameters, estimate.values, estimate.std, strict=True):
        assert ((name.name, name.joint) in weak) == (abs(value) <= 1.96 * std)
