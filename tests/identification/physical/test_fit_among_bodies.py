# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import IdentificationError, RobotError
from armid_ros.identification import IdentificationSettings, identify, Score
from armid_ros.identification.physical.fit_among_bodies import consistent_prior, PhysicalSettings
from armid_ros.identification.physical.physical_program import box_conditions, nearest_body
from armid_ros.model.pseudo_inertia import link_parameters, pseudo_inertia
import numpy as np
import pytest

from ..conftest import multisine, recorded


@pytest.fixture(scope='module')
def drawing(arm):
    """Return the structure with inertias as wrong as those of a drawing."""
    rng = np.random.default_rng(0)
    matrices = pseudo_inertia(arm.robot.rigid_parameters.reshape(-1, 10))
    stretch = np.exp(0.25 * rng.normal(size=(len(matrices), 4)))
    matrices = stretch[:, :, np.newaxis] * matrices * stretch[:, np.newaxis, :]
    return ArmModel(arm.robot.with_inertias(link_parameters(matrices).ravel()), arm.effects)


@pytest.fixture(scope='module')
def recording(arm):
    return recorded(arm, multisine(arm.robot.joints, 20.0, 250.0, seed=1), 0, 0.02, 1e-5)


def run(structure, recording, physical):
    settings = IdentificationSettings(physical=physical)
    return identify(structure, [recording], settings, rng=np.random.default_rng(0))


@pytest.fixture(scope='module')
def free(drawing, recording):
    return run(drawing, recording, None)


@pytest.fixture(scope='module')
def bodies(drawing, recording):
    return run(drawing, recording, PhysicalSettings())


def test_every_link_is_a_body_at_the_torque_error_of_the_free_fit(arm, free, bodies):
    without, found = (
        np.linalg.eigvalsh(pseudo_inertia(result.arm.robot.rigid_parameters.reshape(-1, 10)))
        for result in (free, bodies)
    )
    assert without.min() < 0.0 < found.min()
    assert bodies.physical.consistent
    eigenvalues = [link.eigenvalues for link in bodies.physical.links]
    np.testing.assert_allclose(eigenvalues, found, rtol=1e-6)
    values = bodies.base.values(bodies.arm.theta)
    np.testing.assert_allclose(bodies.estimate.values, values, rtol=1e-12)
    other = recorded(arm, multisine(arm.robot.joints, 10.0, 250.0, seed=7), 3, 0.02, 1e-5)
    errors = [Score.of(r.predict([other])).relative_error_percent for r in (free, bodies)]
    assert errors[1] < 1.03 * errors[0]
    assert bodies.physical.held_out_ratio < 1.03


def test_without_noise_and_with_a_true_description_nothing_changes(arm):
    exact = recorded(arm, multisine(arm.robot.joints, 20.0, 250.0, seed=1))
    result = run(arm, exact, PhysicalSettings())
    truth = result.base.values(arm.theta)
    np.testing.assert_allclose(result.estimate.values, truth, atol=2e-4 * np.abs(truth).max())


def test_friction_is_not_negative(arm, structure):
    """Data of an arm that friction drives on: the nearest that can be has none."""
    values = list(arm.values)
    values[0] = np.full(6, -0.05)
    smooth = ArmModel(arm.robot, arm.effects, tuple(values))
    motion = multisine(arm.robot.joints, 20.0, 250.0, seed=1)
    result = run(structure, recorded(smooth, motion, 5, 0.5), PhysicalSettings())
    assert result.arm.values[0].min() >= 0.0
    assert any(name.name == 'viscous_coefficient' for name in result.physical.at_bound)
    assert any('bounds' in note for note in result.notes)


@pytest.mark.parametrize('share', [1.0, 0.1])
def test_total_mass_is_kept_and_a_wrong_one_costs(arm, drawing, recording, bodies, share):
    """A right one improves what torques do not show."""
    true = arm.robot.rigid_parameters
    total = share * float(true[::10].sum())
    weighed = run(drawing, recording, PhysicalSettings(total_mass=total))
    found = weighed.arm.robot.rigid_parameters
    assert abs(found[::10].sum() - total) < 1e-6 * total
    off = [np.linalg.norm(one.arm.robot.rigid_parameters - true) for one in (weighed, bodies)]
    assert (off[0] < off[1]) == (share == 1.0)
    assert (weighed.physical.held_out_ratio > 1.03) == (share < 1.0)
    notes = (one.physical.constraint_notes for one in (weighed, bodies))
    assert [any('held-out' in note for note in own) for own in notes] == [share < 1.0, False]


def test_no_mass_is_beyond_its_range_and_held_out_torques_hardly_suffer(
    drawing, recording, bodies
):
    described = drawing.robot.rigid_parameters[::10]
    free = bodies.arm.robot.rigid_parameters[::10] / described
    factor = 1.0 + 0.5 * float(np.max(np.maximum(free, 1.0 / free)) - 1.0)
    held = run(drawing, recording, PhysicalSettings(mass_range=factor))
    ratio = held.arm.robot.rigid_parameters[::10] / described
    assert np.all(ratio > (1.0 - 1e-6) / factor)
    assert np.all(ratio < (1.0 + 1e-6) * factor)
    assert held.physical.at_mass
    assert held.physical.consistent
    assert not bodies.physical.at_mass
    assert held.physical.held_out_ratio < 1.03


@pytest.mark.parametrize(
    ('lower', 'upper', 'narrow'),
    [
        ([-0.05, -0.05, -0.02], [0.05, 0.05, 0.12], False),
        ([-0.02, -0.02, -0.02], [0.02, 0.02, 0.03], True),  # half of the body that torques show
    ],
)
def test_a_link_stays_in_its_box_which_is_named_where_it_is_too_small(
    drawing, recording, lower, upper, narrow
):
    settings = PhysicalSettings(boxes={'wrist_pitch': (lower, upper)})
    result = run(drawing, recording, settings)
    pi = result.arm.robot.rigid_parameters[50:]
    assert np.min(box_conditions((np.array(lower), np.array(upper))) @ pi) > -1e-6
    center = pi[1:4] / pi[0]
    assert np.all(center > np.array(lower) - 1e-6)
    assert np.all(center < np.array(upper) + 1e-6)
    walls = result.physical.at_wall
    assert all('wrist_pitch' in wall for wall in walls)
    if narrow:
        assert walls
        assert any('box' in line for line in result.physical.constraint_notes)


def test_a_description_without_masses_or_with_a_thin_inertia_gets_a_wide_prior(arm, recording):
    """A vendor's file may have nearly singular principal moments."""
    thin = arm.robot.rigid_parameters.copy()
    thin[50:] = 0.63, 0.0, 0.0, 0.0, 5.6e-7, 0.0, 2.2e-4, 0.0, 0.0, 2.2e-4
    bare, narrow = (
        ArmModel(arm.robot.with_inertias(body), arm.effects) for body in (0.0 * thin, thin)
    )
    theta, notes = consistent_prior(narrow)
    second = np.linalg.eigvalsh(pseudo_inertia(theta[50:60])[:3, :3])
    assert second.min() == pytest.approx(0.63 * 0.03**2)
    assert len(notes) == 1
    theta, notes = consistent_prior(bare)
    assert np.linalg.eigvalsh(pseudo_inertia(theta[:60].reshape(-1, 10))).min() > 0.0
    assert len(notes) == 6
    result = run(bare, recording, PhysicalSettings())
    assert result.physical.consistent
    assert Score.of(result.training).relative_error_percent < 1.0


@pytest.mark.parametrize(
    ('settings', 'fact'),
    [
        ({'total_mass': -1.0}, r'total mass .*-1'),
        ({'boxes': {'elbow': ((0, 0, 0), (1, -1, 1))}}, "joint 'elbow'"),
        ({'boxes': {'elbow': ((0, 0, 0), (1, 1, 1))}}, 'elbow_pitch'),  # an unknown joint
        *(({'mass_range': factor}, 'factor above 1') for factor in (1.0, 0.5, np.inf, np.nan)),
    ],
)
def test_what_cannot_be_is_refused(drawing, recording, settings, fact):
    with pytest.raises((IdentificationError, RobotError), match=fact):
        run(drawing, recording, PhysicalSettings(**settings))


def test_an_inertia_that_is_not_of_the_links_takes_no_mass_along(arm, structure):
    """Of rotors that are most of the inertia; torques do not show the mass of the first link."""
    rotors = np.array([0.3, 0.3, 0.1, 0.1, 0.003, 0.003])
    truth = arm.with_effect(make_effect('rotor_inertia', arm.robot), rotors)
    recording = recorded(truth, multisine(arm.robot.joints, 20.0, 100.0, seed=1), 0, 0.02)
    geared = run(structure, recording, PhysicalSettings())
    masses, described = (r.rigid_parameters[::10] for r in (geared.arm.robot, arm.robot))
    assert masses[0] == pytest.approx(described[0], rel=0.3)
    assert np.max(masses / described) < 5.0


def test_the_nearest_body_is_possible_and_as_near_as_the_true_one():
    """Estimates of small loads, with errors that make nearly every inertia impossible."""
    rng, impossible = np.random.default_rng(0), 0
    for _ in range(20):
        root = rng.normal(size=(4, 4)) * [[0.02], [0.02], [0.02], [0.5]]
        true = link_parameters(root @ root.T)
        errors = rng.normal(size=(10, 10)) * np.r_[1e-3, [3e-4] * 3, [6e-4] * 6][:, np.newaxis]
        covariance = errors @ errors.T
        estimate = true + errors @ rng.normal(size=10)
        impossible += np.linalg.eigvalsh(pseudo_inertia(estimate))[0] < 0.0
        found = nearest_body(estimate, covariance)
        assert np.linalg.eigvalsh(pseudo_inertia(found))[0] > 0.0
        distances = [
            (other - estimate) @ np.linalg.solve(covariance, other - estimate)
            for other in (found, true)
        ]
        assert distances[0] < distances[1] + 1.0  # the divergence moves it off the limit
    assert impossible > 15
