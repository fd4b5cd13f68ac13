# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of lived arms counts what was said against the truth."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.motion import Motion
import numpy as np
import pytest

from benchmarks.hidden_effects import with_true_effect
from benchmarks.lived import judge
from benchmarks.lived_scoring import exact, gravity_of, LivedJudged, pairs, score
from benchmarks.metrics import table
from benchmarks.two_days import Answer, answer_of, Named
from tests.hidden.lived.arms import load_arm
from tests.hidden.lived.causes import CAUSES
from tests.hidden.lived.causes.base import Scene
from tests.hidden.lived.causes.drive import Coulomb
from tests.hidden.lived.causes.rigid import Mounting, Payload
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import draw_path, tracked
from tests.hidden.lived.plant import LivedArm
from tests.hidden.lived.specification import specify
from tests.hidden.lived.wear import Wear

EARTH = np.array([0.0, 0.0, -9.81])


COULOMB = Coulomb('elbow', 2, 2.0)


def judged(answer, cause=COULOMB, kind='development', index=1, **changes):
    """Return an answer about 2 N m of dry friction in the elbow, or about something else."""
    word = next((w for w, one in CAUSES.items() if type(cause) is one), 'none')
    spec = replace(specify(kind, index), cause=word)
    facts = {'gap': 5.0, 'gravity': EARTH, 'described': EARTH, 'felt': np.eye(3)}
    return LivedJudged(spec, cause, answer=answer, **(facts | changes))


def said(*headline, verdict='named'):
    """Return an answer."""
    return Answer(verdict, tuple(headline), seconds=1.0)


def metric(outcomes, name):
    """Return the value of one row."""
    return next(m.value for m in score(outcomes) if m.name.strip() == name)


@pytest.mark.parametrize(
    'word', sorted(word for word, cause in CAUSES.items() if cause.in_catalogue)
)
def test_true_parameters_of_a_cause_make_its_torque_in_the_package(word):
    """Two codes of one definition; where the package goes by derivatives, of a small cause."""
    robot = load_arm('ur5')
    chain = Chain.of(robot)
    wanted = draw_path('sines', robot, chain, 8.0, np.random.default_rng(5))
    path = tracked(wanted, chain, np.zeros(6))
    arm = LivedArm(chain, replace(Wear.none(6), presliding=np.full(6, 1e-7)))
    ends = np.array([robot.lower, robot.upper])
    ones = np.ones(6)
    middle = np.where(np.isfinite(ends).all(axis=0), ends, 0.0).mean(axis=0)
    scene = Scene(chain, 5.0 * ones, ones, -ones, ones, middle, 10.0)
    cause = CAUSES[word].draw(scene, np.random.default_rng(1))
    cause = cause.scaled({'delay': 0.2, 'encoder': 0.1}.get(word, 1.0))
    rows = slice(400, -400, 10)
    said = Motion(chain.joints, path.t, path.q, path.dq, path.ddq, None)
    bare, shape = ArmModel(robot), getattr(cause, 'attachment', None)
    more = with_true_effect(bare, cause, shape).torque(said) - bare.torque(said)
    true = arm.contribution(path, cause)
    moving = np.all(np.abs(path.dq) > 0.02, axis=1)[rows]
    error = np.linalg.norm((more - true)[rows][moving]) / np.linalg.norm(true[rows][moving])
    assert error < 0.02


def test_first_and_tied_are_told_apart():
    right = Named('coulomb_friction', ('elbow',))
    wrong = Named('torque_ripple', ('elbow',))
    tie = Named('stribeck_friction', ('elbow',), rivals=(('coulomb_friction', ('elbow',)),))
    crowd = replace(tie, rivals=(*tie.rivals, ('a', ()), ('b', ())))
    for headline, first, tied, too_many in (
        ((right,), True, True, 0),
        ((right, wrong), True, True, 1),
        ((wrong, right), False, False, 1),
        ((tie,), False, True, 0),
        ((crowd,), False, False, 0),
        ((wrong,), False, False, 1),
        ((), False, False, 0),
    ):
        one = judged(said(*headline))
        assert (one.first, one.tied, one.too_many) == (first, tied, too_many)


def test_joint_share_and_parameters_are_compared_with_the_truth():
    values = (('coulomb_torque', 'elbow', 2.2, 0.2),)
    good = Named('coulomb_friction', ('elbow',), (), values, share=0.77)
    bad = replace(good, joints=('wrist',), parameters=(('coulomb_torque', 'elbow', 3.0, 0.1),))
    pair = [judged(replace(said(one), true_share=0.75)) for one in (good, replace(bad, share=0.2))]
    assert [one.share_error for one in pair] == pytest.approx([0.02, -0.55])
    assert [one.placed for one in pair] == [True, False]
    assert pair[0].parameter_errors() == [(pytest.approx(0.1), True)]
    assert pair[1].parameter_errors() == [(pytest.approx(0.5), False)]
    assert metric(pair, 'share within 5 points') == 0.5
    assert 'NOT reached' in table(score(pair))


def test_gravity_is_read_from_any_of_its_names():
    wall = Named('base_tilt', (), (), (('tilt_x', '', 0.0, 0.0), ('tilt_y', '', np.pi / 2, 0.0)))
    moon = Named('gravity_magnitude', (), (), (('gravity_difference', '', 1.62 - 9.81, 0.0),))
    np.testing.assert_allclose(gravity_of([wall], EARTH), [9.81, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(gravity_of([wall, moon], EARTH), [1.62, 0.0, 0.0], atol=1e-9)
    vector = (9.81, 0.0, 0.1)
    mounted = judged(said(wall), Mounting(vector), gravity=np.array(vector))
    angle, size = mounted.gravity_error()
    assert angle == pytest.approx(np.degrees(np.arctan(0.1 / 9.81)))
    assert abs(size) < 1e-3


def test_an_answer_is_read_from_the_document():
    document = {
        'verdict': 'ambiguous',
        'effects': [
            {
                'name': 'payload',
                'joints': ['wrist'],
                'share': 0.91,
                'share_interval': [0.88, 0.93],
                'ambiguous_with': ['human_interaction'],
                'rivals': [{'name': 'human_interaction', 'joints': ['elbow']}],
                'parameters': [{'name': 'payload_m', 'joint': 'wrist', 'value': 3.0, 'std': 0.1}],
            }
        ],
    }
    answer = answer_of(document, 2.0)
    (found,) = answer.headline
    assert found.names == {'payload', 'human_interaction'}
    assert found.joints_of('human_interaction') == ('elbow',)
    assert found.share_interval == (0.88, 0.93)
    assert found.parameters == (('payload_m', 'wrist', 3.0, 0.1),)


def test_a_question_that_fails_is_counted_as_one(monkeypatch):
    def fails(*args, **options):
        raise ValueError('no')

    monkeypatch.setattr('benchmarks.lived.ask', fails)
    one = judge('development/exact', 2)
    assert one.answer.verdict == 'failed'
    assert 'ValueError' in one.line
    assert metric([one], 'failures') == 1.0


LOAD = Payload('wrist', 5, 2.0, (0.0, 0.0, 0.1), 0.03)


def payload(mass):
    """Return an answer that names a payload."""
    values = (('payload_m', 'wrist', mass, 0.01),)
    return Answer('named', (Named('payload', ('wrist',), (), values),))


NOTHING = Answer('consistent')


def test_point_to_point_is_held_against_what_periodic_data_give():
    answers = (payload(2.0), payload(2.0), payload(2.0), NOTHING, NOTHING, payload(2.0))
    asked = [judged(one, LOAD, 'development/pairs', k) for k, one in enumerate(answers)]
    periodic, dwells, ratio = pairs(asked)
    assert (periodic.value, dwells.value) == (pytest.approx(2 / 3), pytest.approx(2 / 3))
    assert ratio.value == 1.0
    assert ratio.good
    assert pairs(asked[:4])[2].value == 0.5
    assert not pairs(asked[:4])[2].good


def test_exact_arms_are_counted_by_what_is_known_of_friction():
    outcomes = [
        judged(answer, cause, 'development/exact', index)
        for index, cause, answer in (
            (0, LOAD, payload(2.0)),  # friction by values
            (1, LOAD, payload(3.0)),  # friction by names
            (2, None, NOTHING),
            (4, None, Answer('unknown')),
        )
    ]
    assert [metric.value for metric in exact(outcomes)] == [1.0, 1.0, 1.0, 1.0, 0.0, 0.0]
