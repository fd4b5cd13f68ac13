# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0

from dataclasses import replace
import json

from armid_ros.arm import Misfit
from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.identification.assess.compare import compare, residual_changes
from armid_ros.identification.assess.grade_limits import FREEDOM
from armid_ros.identification.parameters_file import KnownFit, ParameterFile, read_parameters
import numpy as np
import pytest


def given(source, table):
    """Return a file with independent values."""
    covariance = np.diag([std**2 for _, std in table.values()])
    return ParameterFile(source, 'arm', table, 5.0, covariance)


def parameters(values, std, source='a'):
    names = [ParameterName(f'Izz{k + 1}', f'joint_{k + 1}', 'kg m^2') for k in range(len(values))]
    return given(source, dict(zip(names, zip(values, std, strict=True), strict=True)))


def correlated(rng, size):
    """Return a covariance whose parameters are hard to tell apart."""
    factors = rng.normal(size=(size, size)) * np.logspace(0, -2, size)
    return factors @ factors.T


def drawn(rng, names, covariance):
    """Return an estimate of parameters that are zero, with its covariance."""
    values = rng.multivariate_normal(np.zeros(len(names)), covariance)
    std = np.sqrt(np.diag(covariance))
    table = {n: (float(v), float(s)) for n, v, s in zip(names, values, std, strict=True)}
    return ParameterFile('a', 'arm', table, 5.0, covariance)


FRICTION = [ParameterName(f'coefficient_{k}', 'elbow', 'N m') for k in range(4)]
LINKS = [ParameterName(f'p{k}', f'joint_{k % 2}', 'kg') for k in range(20)]


def test_19_of_20_lists_are_free_of_chance_finds():
    rng = np.random.default_rng(0)
    names = [*FRICTION, *LINKS]
    covariance = correlated(rng, len(names))
    alarms = 0
    for _ in range(400):
        alarms += compare(*(drawn(rng, names, covariance) for _ in range(2))).anything
    assert 0.02 < alarms / 400 < 0.085


def test_what_no_parameter_shows_alone_all_of_a_joint_do():
    """Two coefficients that only their sum is known of, which changes."""
    covariance = np.array([[1.0, -0.9999], [-0.9999, 1.0]])
    before, after = (
        ParameterFile(source, 'arm', dict.fromkeys(FRICTION[:2], (value, 1.0)), 5.0, covariance)
        for source, value in (('a', 0.0), ('b', 0.1))
    )
    comparison = compare(before, after)
    assert not comparison.changed
    (group,) = comparison.changed_together
    assert group.joint == 'elbow'
    assert group.p_value < 1e-6


def test_a_motion_that_shows_less_is_compared_with_one_that_shows_more():
    """Two moments, and a sum of them; a sum varies between recordings as its parameters do."""
    mx, my = (ParameterName(name, 'elbow', 'kg m') for name in ('mx1', 'my1'))
    terms, scatter = {mx: {'mx1': 1.0}, my: {'my1': 1.0}}, np.array([[0.1, -0.2], [0.3, 0.4]])
    rich = given('a', {mx: (1.0, 0.1), my: (2.0, 0.1)})
    rich = replace(rich, terms=terms, scatter=scatter)
    together = ParameterName('mx1 + 2 my1', 'elbow', 'kg m')
    poor = given('b', {together: (7.0, 0.3)})
    poor = replace(poor, terms={together: {'mx1': 1, 'my1': 2}})
    for pair, sign in (((rich, poor), 1.0), ((poor, rich), -1.0)):
        (change,) = compare(*(replace(one, scatter=np.zeros((0, 0))) for one in pair)).changes
        assert change.parameter == together
        assert change.difference == pytest.approx(sign * 2.0)
        assert change.std == pytest.approx(np.sqrt(0.09 + 0.05))
    np.testing.assert_allclose(rich.regrouped_as(poor).scatter_of([together]), [[-0.3], [1.1]])


def recorded(rng, truth, size, noise, source='a'):
    """Return means of values of three recordings, which differ by more than noise does."""
    own = truth + size * rng.normal(size=(3, len(truth)))
    names = [ParameterName(f'p{k}', f'joint_{k % 5}', 'kg m') for k in range(len(truth))]
    values, others = own.mean(axis=0), (own.sum(axis=0) - own) / 2.0
    table = {name: (float(v), noise) for name, v in zip(names, values, strict=True)}
    scatter = np.sqrt(2.0 / 3.0) * (others - values)
    covariance = noise**2 * np.eye(len(truth))
    return ParameterFile(source, 'arm', table, 5.0, covariance, scatter=scatter)


def test_what_differs_from_recording_to_recording_is_no_change():
    """A model gets something else wrong of every motion; noise alone makes a tenth of it."""
    rng = np.random.default_rng(3)
    found, without = 0, 0
    for _ in range(200):
        sides = [recorded(rng, np.zeros(40), 1.0, 0.1) for _ in range(2)]
        found += compare(*sides).anything
        without += compare(*(replace(one, scatter=np.zeros((0, 0))) for one in sides)).anything
    assert without == 200
    assert found < 0.085 * 200


def test_a_change_beyond_what_recordings_differ_by_is_found():
    rng = np.random.default_rng(4)
    after = np.arange(40) == 7
    for _ in range(20):
        rough, exact = (recorded(rng, np.zeros(40), size, 0.2 * size) for size in (1.0, 0.05))
        changed = recorded(rng, after, 0.05, 0.01)
        assert 'p7' not in [one.parameter.name for one in compare(rough, changed).changed]
        first = compare(exact, changed).changed[0]
        assert first.parameter.name == 'p7'
        assert 0.02 < first.std < 0.08


def test_each_reason_why_a_parameter_is_not_compared():
    shared = {ParameterName('Izz1', 'a', 'kg m^2'): (1.0, 0.1)}
    alone = {
        ParameterName('viscous_coefficient', 'resting', 'N m s/rad'): 'motion',
        ParameterName('spring_stiffness', 'elbow', 'N m/rad'): 'effect',
        ParameterName('my2 + m3', 'elbow', 'kg m'): 'grouping',
    }
    more = dict.fromkeys(alone, (1.0, 0.1))
    before = ParameterFile('a', 'arm', shared | more, 5.0, 0.01 * np.eye(4))
    changed = {k: (1.1, s) for k, (_, s) in shared.items()}
    lost = frozenset({('viscous_coefficient', 'resting')})
    after = ParameterFile('b', 'arm', changed, 5.0, 0.01 * np.eye(1), not_shown=lost)
    found = compare(before, after)
    assert {one.parameter: one.why for one in found.only_before} == alone
    assert len(found.not_compared) == found.document()['not_compared'] == 3


@pytest.mark.parametrize('equal', [0.3, 0.1 + 0.2])
def test_known_exactly_and_equal_is_no_change(equal):
    before, after = parameters([0.3, 2.0], [0.0, 0.1]), parameters([equal, 2.1], [0.0, 0.1])
    found = compare(before, after)
    assert found.changed == () and found.changes[0].deviations == 0.0


BARE = replace(parameters([], []), covariance=None, source='bare')
OTHER = ParameterFile('other', 'arm', {ParameterName('x', '', 'm'): (0.0, 1.0)}, None, np.eye(1))


@pytest.mark.parametrize(
    ('other', 'message'),
    [
        (parameters([1.0], [0.1]), 'equal parameters'),
        (parameters([1.0], [0.1], source='copy'), 'copy have equal'),
        (BARE, 'bare .*covariance'),
        (OTHER, 'other .*common'),
    ],
    ids=['itself', 'a copy', 'no covariance', 'nothing in common'],
)
def test_results_that_cannot_be_compared_are_refused_by_name(other, message):
    with pytest.raises(ModelError, match=message):
        compare(parameters([1.0], [0.1]), other)


def written(tmp_path, lost=(), **changes):
    """Write an identification of one parameter, changed, or with lost keys of the parameter."""
    row = {'name': 'Izz1', 'joint': 'a', 'value': 1.0, 'std': 0.1, 'unit': 'kg m^2'}
    row = {key: changes.get(key, value) for key, value in row.items() if key not in lost}
    document = {
        'schema': changes.get('schema', 'armid/identification/1'),
        'robot': 'arm',
        'parameters': [row],
        'covariance': changes.get('covariance', [[0.01]]),
        'scatter': changes.get('scatter', [[0.1], [0.2]]),
        'training': {'relative_error_percent': changes.get('error', 5.0)},
    }
    (tmp_path / 'identification.json').write_text(json.dumps(document))
    return tmp_path / 'identification.json'


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'value': 10**400}, 'Izz1 .*joint a .*finite'),
        ({'std': float('inf')}, 'std of Izz1 .*finite'),
        ({'std': -0.1}, 'std of Izz1 .*negative'),
        ({'covariance': [[-0.01]]}, 'negative variance'),
        ({'covariance': [[float('nan')]]}, 'not finite'),
        ({'covariance': [[1.0], [0.0, 1.0]]}, 'triangle'),
        ({'error': 'x'}, 'relative_error_percent'),
        ({'scatter': [[0.1, 0.2]]}, "'scatter' has to have"),
        ({'scatter': [[float('inf')]]}, 'scatter .*finite'),
        ({'schema': 'other'}, 'schema'),
        ({'lost': ['name']}, 'name'),
    ],
)
def test_documents_that_no_identification_writes_are_refused(tmp_path, changes, message):
    assert [*read_parameters(written(tmp_path)).values.values()] == [(1.0, 0.1)]
    with pytest.raises(ModelError, match=rf'identification.json: .*{message}'):
        read_parameters(written(tmp_path, **changes))


def test_a_folder_without_results_and_a_broken_document_are_refused(tmp_path):
    with pytest.raises(ModelError, match=r'identification\.json.*model\.yaml'):
        read_parameters(tmp_path)
    (tmp_path / 'identification.json').write_text('{"schema":')
    with pytest.raises(ModelError, match='JSON'):
        read_parameters(tmp_path)


@pytest.mark.parametrize('inverse', [False, True])
def test_currents_beside_newton_metres_are_a_unit_and_no_change_of_the_arm(inverse):
    rng = np.random.default_rng(0)
    gains = {'hip': 13.3, 'knee': 11.1, 'foot': 10.6}
    kinds = ('viscous_coefficient', 'coulomb_torque', 'offset')
    names = [ParameterName(kind, joint, 'N m') for joint in gains for kind in kinds]
    values = rng.uniform(0.5, 2.0, len(names))
    torque = {name: (v, 0.01 * v) for name, v in zip(names, values, strict=True)}
    current = {n: (v / gains[n.joint], s / gains[n.joint]) for n, (v, s) in torque.items()}
    files = [given(*one) for one in (('a', torque), ('b', current))]
    comparison = compare(*(files[::-1] if inverse else files))
    expected = {j: gain if inverse else 1.0 / gain for j, gain in gains.items()}
    assert comparison.factors == pytest.approx(expected)
    payload = dict(torque) | {names[0]: (3.0 * values[0], 0.01)}
    assert compare(files[0], given('c', payload)).factors == {}


def fit(rms, torque=1.0, recordings=1):
    """Return a model that leaves so much of a torque of 1 N m."""
    rms = dict(zip('abcdef', rms, strict=False))
    misfit = Misfit('training', rms, 1.0, dict.fromkeys(rms, torque))
    return KnownFit('good', '', misfit, recordings)


def p_values(before, after):
    return [one.p_value for one in residual_changes(before, after)]


def test_chances_are_uniform_where_motions_alone_make_a_difference():
    rng = np.random.default_rng(0)
    left = np.sqrt(rng.chisquare(FREEDOM, size=(2, 2000)) / FREEDOM)
    found = [p_values(fit([a]), fit([b]))[0] for a, b in left.T]
    assert 0.04 < np.mean(np.array(found) < 0.05) < 0.06


def test_a_residual_changes_by_more_than_chance_motions_and_torque_explain():
    same, more = residual_changes(fit([0.01, 0.01]), fit([0.011, 0.1]))
    assert same.p_value > 0.5 and more.p_value < 1e-4
    assert more.ratio == pytest.approx(10.0)
    assert p_values(fit([0.1]), fit([0.01])) == pytest.approx(p_values(fit([0.01]), fit([0.1])))
    few, many = (p_values(fit([0.1], recordings=n), fit([0.2], recordings=n))[0] for n in (1, 4))
    assert few > 0.05 > 0.005 > many
    louder = fit([0.1], torque=10.0)
    assert p_values(fit([0.01]), louder) == pytest.approx([1.0])
    assert p_values(louder, fit([0.01])) == pytest.approx([1.0])
    assert p_values(fit([1e-9]), fit([1e-6])) == [1.0]  # remains of filters
    assert residual_changes(fit([0.1]), None) == ()
