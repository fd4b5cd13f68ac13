# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Effects of one's own: registered, named like those that are shipped, and checked."""

from dataclasses import replace
from pathlib import Path
import re

import armid_ros as ar
from armid_ros.arm import testing
from armid_ros.arm.testing import check_effect
from armid_ros.effects import Action, CATALOGUE, joint_columns, scatter
import numpy as np
import pytest


class Hose(ar.Effect):
    """A hose along a joint that stiffens as it bends, tau = k q^3."""

    name = 'hose'
    summary = 'hose that stiffens as it bends'
    quantities = (ar.Quantity('hose_stiffness', 'N m/rad^3', typical=(0.1, 10.0)),)

    def columns(self, motion, arm):
        """Return dtau/dk = q^3."""
        return joint_columns(self, motion, motion.q**3)


class Twice(Hose):
    """A hose that pulls half as much in a simulation as an identification takes it to."""

    def action(self, values, arm):
        """Return too little."""
        return super().action(0.5 * values, arm)


class Bent(Hose):
    """A hose that says that it is linear, and bends."""

    def action(self, values, arm):
        """Return the torque, and a little more."""
        (stiffness,) = scatter(self, values, arm.robot)
        return Action(link_torque=lambda t, q, dq: (stiffness + stiffness**3) * q**3)


class Biased(Hose):
    """A hose that pulls before it is there."""

    def action(self, values, arm):
        """Return the torque."""
        (stiffness,) = scatter(self, values, arm.robot)
        return Action(link_torque=lambda t, q, dq: 0.1 + stiffness * q**3)


class Remembering(Hose):
    """A hose whose columns depend on how long a recording is."""

    def columns(self, motion, arm):
        """Return columns without their mean."""
        columns = super().columns(motion, arm)
        return columns - columns.mean(axis=0)


class Wide(Hose):
    """A hose with a column too many."""

    def columns(self, motion, arm):
        """Return columns twice."""
        return np.concatenate([super().columns(motion, arm)] * 2, axis=2)


def local_hose(typical=(0.1, 10.0)):
    """Return a class that cannot be pickled, with a range of typical sizes."""

    class Local(Hose):
        """A hose of a function."""

        quantities = (replace(Hose.quantities[0], typical=typical),)

    return Local


@pytest.fixture
def hose():
    ar.register(Hose)
    yield Hose
    CATALOGUE.remove('hose')


def test_a_registered_effect_is_named_like_those_that_are_shipped(hose, tmp_path):
    arm = ar.ArmModel.of('two_link_elastic', effects='hose@joint1')
    assert arm.effects[0] == Hose(('joint1',))
    arm = arm.with_theta(np.r_[arm.theta[:-1], 2.5])
    ar.save_model(tmp_path / 'model.yaml', arm, 'two_link_elastic')
    read = ar.load_model(tmp_path / 'model.yaml')
    assert read.effects == arm.effects
    np.testing.assert_array_equal(read.values[0], [2.5])


def test_a_class_that_is_defined_anew_takes_the_place_of_the_old(hose):
    again = type('Hose', (Hose,), {'__module__': Hose.__module__, 'summary': 'longer'})
    assert ar.register(again) is again
    assert CATALOGUE['hose'].summary == 'longer'


def test_the_guide_lists_at_most_twelve_members_of_an_effect():
    guide = Path(__file__).parents[2] / 'docs/howto/own_effect.md'
    rows = re.findall(r'^\| (`.*?`) \|', guide.read_text('utf-8'), flags=re.MULTILINE)
    members = set(re.findall(r'`(?:Hose\.)?(\w+)', ' '.join(rows)))
    assert len(members) <= 12 and {'name', 'columns', 'on'} <= members
    assert members <= {*ar.Effect.__annotations__, *dir(ar.Effect)}


def test_the_contract_holds_for_what_is_right():
    check_effect(Hose)
    check_effect(Hose, ar.load_robot('two_link_elastic'))


@pytest.mark.parametrize(
    ('kind', 'breach'),
    [
        (Twice, testing.columns_are_the_derivative_at_zero),
        (Bent, testing.columns_are_the_derivative_at_any_size),
        (Bent, testing.linear_means_exact),
        (Biased, testing.size_zero_changes_nothing),
        (Remembering, testing.instantaneous_means_sample_by_sample),
        (Wide, testing.columns_are_finite_and_one_per_parameter),
        (local_hose(), testing.effect_can_be_pickled),
        (local_hose(typical=(2.0, 1.0)), testing.docstring_bounds_and_names_are_valid),
    ],
)
def test_breaches_of_the_contract_are_named(kind, breach):
    with pytest.raises(AssertionError, match=breach.__name__.replace('_', ' ')):
        check_effect(kind)


def test_columns_of_another_shape_are_refused_with_both_shapes():
    robot = ar.load_robot('two_link_elastic')
    arm = ar.ArmModel(robot).with_effect(Wide.on(robot), [1.0, 1.0])
    with pytest.raises(ar.ArmidError, match=r"'hose'.*\(\d+, 2, 4\).*\(\d+, 2, 2\)"):
        ar.simulate(arm)


@pytest.mark.parametrize(
    ('facts', 'message'),
    [
        ({'name': 'Hose 2'}, "'name'"),
        ({'name': 'payload'}, "'payload'"),
        ({'summary': ''}, "'summary'"),
        ({'quantities': ()}, "'quantities'"),
        ({'quantities': Hose.quantities * 2}, 'two quantities'),
        ({'quantities': (ar.Quantity('coulomb_torque', 'N m'),)}, 'coulomb'),
        ({'shapes': ('q',)}, "'shapes'"),
        ({'columns': ar.Effect.columns}, 'columns'),
    ],
)
def test_classes_that_lack_something_are_refused(facts, message):
    kind = type('Odd', (Hose,), facts)
    with pytest.raises(ar.ArmidError, match=message):
        ar.register(kind)
    assert kind not in CATALOGUE.values()
    with pytest.raises(ar.ArmidError, match='class'):
        ar.register(Hose(('joint1',)))
