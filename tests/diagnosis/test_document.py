# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""diagnosis.json says what was found, how much it explains, and beside what."""

from dataclasses import replace
import json

from armid_ros.arm import Misfit
from armid_ros.diagnosis import diagnose, diagnosis_document
import numpy as np
import pytest

from .conftest import Bench, UPRIGHT_URDF, URDF


def strict(found):
    """Return the document as a strict reader of JSON has it."""
    return json.loads(json.dumps(diagnosis_document(found), allow_nan=False))


def hidden_drag(motion, tau):
    """Return drag of the elbow."""
    return np.outer(motion.dq[:, 1] * np.abs(motion.dq[:, 1]), [0.0, 0.08])


@pytest.fixture(scope='module')
def document():
    bench = Bench()
    return strict(diagnose(bench.arm, bench.recordings(hidden_drag), rng=np.random.default_rng(0)))


def test_the_headline_has_its_share_with_an_interval(document):
    (effect,) = document['effects']
    assert (effect['name'], effect['joints']) == ('quadratic_friction', ['elbow'])
    low, high = effect['share_interval']
    assert 0.9 < low <= effect['share'] <= high <= 1.0
    assert 0.0 <= effect['p'] <= 0.01
    (parameter,) = effect['parameters']
    assert set(parameter) == {'name', 'joint', 'value', 'std', 'unit'}
    assert parameter['value'] == pytest.approx(0.08, rel=0.02)


def test_every_field_of_the_schema_is_there(document):
    assert document['schema'] == 'armid/diagnosis/1'
    assert document['verdict'] == 'named'
    assert set(document) == {
        *('schema', 'verdict', 'summary', 'effects', 'minor', 'baseline', 'where'),
        *('gap', 'filters', 'candidates', 'not_visible', 'detectable', 'model', 'spans'),
    }
    assert document['baseline'] == 'noise'
    assert set(document['gap']['before']) == {'shoulder', 'elbow'}
    assert document['where'][0]['joint'] == 'elbow'
    assert document['candidates'][0]['visible_fraction'] <= 1.0
    for one in document['minor']:
        assert set(one) >= {'name', 'joints', 'parameters', 'share', 'share_interval', 'p'}
    gap = document['gap']
    assert gap['before']['elbow'] > 3.0 * gap['after']['elbow']
    assert all(0.0 <= row['adjusted_p'] <= 1.0 for row in document['candidates'])


def test_torque_has_the_unit_of_its_joint(document):
    assert document['gap']['unit'] == 'N m'
    assert document['gap']['units'] == {'shoulder': 'N m', 'elbow': 'N m'}
    sliding = URDF.replace('name="shoulder" type="revolute"', 'name="shoulder" type="prismatic"')
    bench = Bench(sliding)
    still = replace(bench.recordings()[0], tau=np.zeros_like(bench.recordings()[0].tau))
    gap = strict(diagnose(bench.arm, [still], rng=np.random.default_rng(0)))['gap']
    assert (gap['unit'], gap['units']) == ('N m', {'shoulder': 'N', 'elbow': 'N m'})


@pytest.mark.long
def test_nothing_named_is_nothing_changed():
    """A body that is fitted anew is no name: before and after are the same model."""
    bench = Bench(UPRIGHT_URDF, (0.3, 0.2, 0.2), (0.5, 0.3, 0.3))
    theta = bench.arm.theta.copy()
    theta[:30] *= np.repeat([1.2, 0.8, 1.2], 10)
    off = bench.arm.with_theta(theta)
    found = diagnose(off, bench.recordings(), rng=np.random.default_rng(0))
    assert found.refitted and not found.findings
    gap = strict(found)['gap']
    assert gap['before'] == gap['after']


def test_a_diagnosis_of_bad_data_is_a_document_as_well():
    bench = Bench()
    turned = [replace(r, tau=-r.tau) for r in bench.recordings()]
    document = strict(diagnose(bench.arm, turned, rng=np.random.default_rng(0)))
    assert document['verdict'] == 'bad_data'
    assert document['gap']['before'] == {}
    assert document['baseline'] == ''


def test_a_misfit_that_was_written_down_is_the_floor_that_is_said():
    bench = Bench()
    misfit = Misfit('held-out', {'shoulder': 0.5, 'elbow': 0.5}, 5.0)
    small = bench.recordings(lambda m, tau: 0.2 * hidden_drag(m, tau))
    rng = np.random.default_rng(0)
    assert diagnose(bench.arm, small, rng=rng).verdict == 'named'
    found = diagnose(bench.arm, small, misfit=misfit, rng=rng)
    assert found.verdict == 'consistent'
    assert 'when it was identified' in found.baseline
    assert 'when it was identified' in found.summary
    large = diagnose(bench.arm, bench.recordings(hidden_drag), misfit=misfit, rng=rng)
    assert [one.name for one in large.findings] == ['quadratic_friction']
