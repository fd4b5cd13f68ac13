# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""diagnosis.json says what was found, how much it explains, and beside what."""

from dataclasses import replace
import json

from armid_ros.arm import Misfit
from armid_ros.diagnosis import diagnosis_document
import numpy as np
import pytest

from .conftest import Bench, diagnosed, drag, UPRIGHT_URDF, URDF


def strict(found):
    """Return the document as a strict reader of JSON has it."""
    return json.loads(json.dumps(diagnosis_document(found), allow_nan=False))


@pytest.fixture(scope='module')
def document():
    bench = Bench()
    return strict(diagnosed(bench.arm, bench.recordings(drag(0.08))))


def test_the_headline_has_its_share_with_an_interval(document):
    assert (document['schema'], document['verdict']) == ('armid/diagnosis/1', 'named')
    (effect,) = document['effects']
    assert (effect['name'], effect['joints']) == ('quadratic_friction', ['elbow'])
    low, high = effect['share_interval']
    assert 0.9 < low <= effect['share'] <= high <= 1.0
    assert 0.0 <= effect['p'] <= 0.01
    (parameter,) = effect['parameters']
    assert set(parameter) == {'name', 'joint', 'value', 'std', 'unit'}
    assert parameter['value'] == pytest.approx(0.08, rel=0.02)


def test_the_gap_is_that_of_the_joint_with_the_cause(document):
    gap = document['gap']
    assert (document['baseline'], document['where'][0]['joint']) == ('noise', 'elbow')
    assert set(gap['before']) == {'shoulder', 'elbow'}
    assert gap['before']['elbow'] > 3.0 * gap['after']['elbow']
    for one in document['candidates']:
        assert 0.0 <= one['adjusted_p'] <= 1.0 and one['visible_fraction'] <= 1.0


def test_torque_has_the_unit_of_its_joint(document):
    assert document['gap']['unit'] == 'N m'
    assert document['gap']['units'] == {'shoulder': 'N m', 'elbow': 'N m'}
    sliding = URDF.replace('name="shoulder" type="revolute"', 'name="shoulder" type="prismatic"')
    bench = Bench(sliding)
    still = replace(bench.recordings()[0], tau=np.zeros_like(bench.recordings()[0].tau))
    gap = strict(diagnosed(bench.arm, [still]))['gap']
    assert (gap['unit'], gap['units']) == ('N m', {'shoulder': 'N', 'elbow': 'N m'})


@pytest.mark.long
def test_nothing_named_is_nothing_changed():
    """A body that is fitted anew is no name: before and after are the same model."""
    bench = Bench(UPRIGHT_URDF, (0.3, 0.2, 0.2), (0.5, 0.3, 0.3))
    theta = bench.arm.theta.copy()
    theta[:30] *= np.repeat([1.2, 0.8, 1.2], 10)
    off = bench.arm.with_theta(theta)
    found = diagnosed(off, bench.recordings())
    assert found.refitted and not found.findings
    gap = strict(found)['gap']
    assert gap['before'] == gap['after']


def test_a_misfit_that_was_written_down_is_the_floor_that_is_said():
    bench = Bench()
    misfit = Misfit('held-out', {'shoulder': 0.5, 'elbow': 0.5}, 5.0)
    small = bench.recordings(drag(0.016))
    assert diagnosed(bench.arm, small).verdict == 'named'
    found = diagnosed(bench.arm, small, misfit=misfit)
    assert found.verdict == 'consistent'
    assert 'when it was identified' in found.baseline
    assert 'when it was identified' in found.summary
    large = diagnosed(bench.arm, bench.recordings(drag(0.08)), misfit=misfit)
    assert [one.name for one in large.findings] == ['quadratic_friction']
