# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace
import json
from typing import get_args

from armid_ros.identification import identification_document, identify, write_document
from armid_ros.identification.assess.compare import compare
from armid_ros.identification.fitting.identifiability import Reason
from armid_ros.identification.parameters_file import read_parameters
from armid_ros.motion import Motion
import numpy as np
import pytest

from .conftest import multisine, recorded

NEVER, NOT_SHOWN, _, WEAK = get_args(Reason)


@pytest.fixture(scope='module')
def result(arm, structure):
    motion = multisine(arm.robot.joints, 15.0, 200.0, seed=1)
    recording = recorded(arm, motion, 0, 0.02, 1e-5)
    return identify(structure, [recording], rng=np.random.default_rng(0))


@pytest.fixture(scope='module')
def elbow_only(arm, structure):
    """Identify from a recording in which nothing but the elbow moves."""
    full = multisine(arm.robot.joints, 15.0, 200.0, seed=1)
    elbow = np.arange(6) == 3
    pose = np.array([0.1, 0.2, 0.3, 0.0, 0.2, 0.1])
    motion = Motion(full.joints, full.t, pose + elbow * full.q, elbow * full.dq, elbow * full.ddq)
    return identify(structure, [recorded(arm, motion, 0, 0.02)], rng=np.random.default_rng(0))


def test_covariance_survives_the_file(result, tmp_path):
    path = tmp_path / 'identification.json'
    write_document(path, identification_document(result, 'arm', {}))
    read = read_parameters(path)
    size = np.outer(result.estimate.std, result.estimate.std)
    correlation = result.estimate.covariance / size
    np.testing.assert_allclose(read.covariance / size, correlation, rtol=1e-8, atol=1e-10)
    assert read.terms[result.base.parameters[0]] == result.base.terms[0]
    later = {name: (value + 1e-3 * std, std) for name, (value, std) in read.values.items()}
    assert not compare(read, replace(read, values=later)).anything


def test_a_row_of_numbers_is_a_line(result, tmp_path):
    path = tmp_path / 'identification.json'
    document = identification_document(result, 'arm', {})
    write_document(path, document)
    text = path.read_text()
    assert json.loads(text) == json.loads(json.dumps(document))
    assert len(text.splitlines()) < 20 * result.base.rank


def test_factors_of_a_group_are_those_of_its_name(result):
    names = [name.name for name in result.base.parameters]
    terms = result.base.terms[names.index('my2 + 0.35 (m3 + m4 + m5 + m6) - mz3')]
    assert terms == pytest.approx(
        {'my2': 1.0, 'm3': 0.35, 'm4': 0.35, 'm5': 0.35, 'm6': 0.35, 'mz3': -1.0}
    )


def test_what_a_motion_does_not_show_is_listed_with_the_reason(elbow_only):
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


def test_what_is_listed_as_not_told_has_zero_in_its_interval(elbow_only):
    estimate = elbow_only.estimate
    weak = [u.parameter for u in elbow_only.unidentified if u.reason == WEAK]
    for name, value, std in zip(estimate.parameters, estimate.values, estimate.std, strict=True):
        assert (name in weak) == (abs(value) <= 1.96 * std)
