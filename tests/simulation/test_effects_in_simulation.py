# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every effect, simulated: the torque that is recorded is the one predicted from the recording."""

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation import ComputedTorque, Reference, simulate, SimulatedArm, SimulatedRun
from armid_ros.simulation.warm_up import at_temperature, temperature_course
import numpy as np
import pytest

from tests.simulation.test_run import MIDDLE, swinging

#: How strong a joint is beside the shoulder; the wrist has 1e-4 kg m^2 to move.
STRENGTH = np.array([1.0, 1.0, 0.5, 0.5, 0.02, 0.02])

#: The effects that are simulated: values and shape. Friction and springs are scaled by how strong
#: their joints are; what is not listed is as small as it typically is, and scaled as well.
CASES = {
    'viscous_friction': (0.2, None),
    'coulomb_friction': (0.2, None),
    'stribeck_friction': (0.2, [0.3, 2.0]),
    'asymmetric_friction': ([0.05, 0.1], None),
    'quadratic_friction': (0.2, None),
    'load_dependent_friction': (0.1, None),
    'presliding_hysteresis': (0.2, [0.03]),
    'thermal_friction': (0.3, [1.0]),
    'coupled_joint_friction': ([1e-4, 0.01, 0.05], None),
    'torque_offset': (0.3, None),
    'torque_drift': (0.3, [1.0]),
    'torque_gain': (0.08, None),
    'torque_crosstalk': (0.02, None),
    'torque_lag': (0.02, None),
    'time_delay': (0.007, None),
    'encoder_offset': (0.03, None),
    'rotor_inertia': (0.03, None),
    'payload': ([0.3, 0.0, 0.0, 0.01, *[0.0] * 6], None),
    'link_inertia': ([0.1, 0.0, 0.0, 0.005, 1e-3, 0.0, 1e-3, 0.0, 0.0, 1e-3], None),
    'gravity_magnitude': (-1.0, None),
    'base_tilt': (0.05, None),
    'joint_elasticity': (3e-3, None),
    'backlash': (0.005, None),
    'torque_ripple': (0.1, [12.0]),
    'joint_spring': ([2.0, 0.3], None),
    'joint_coupling': (0.3, None),
    'soft_limit': (20.0, np.column_stack([MIDDLE - 0.15, MIDDLE + 0.15])),
    'actuator_saturation': ([0.6, 0.0], [1.0]),
    'human_interaction': ([100.0, 3.0, 1.0, 1.0, 1.0], None),
    'interface_slack': (200.0, None),
    'temperature_dependent_friction': ([0.004, 0.004], None),
}
SCALED = {
    'viscous_friction',
    'coulomb_friction',
    'stribeck_friction',
    'asymmetric_friction',
    'quadratic_friction',
    'presliding_hysteresis',
    'thermal_friction',
    'torque_ripple',
    'joint_spring',
    'soft_limit',
    'temperature_dependent_friction',
}
#: What may be left of an effect: with friction that falls, or follows the load of the last step,
#: and where links are where the first order of the twist puts them.
COARSE = {
    'stribeck_friction': 2e-3,
    'load_dependent_friction': 3e-3,
    'temperature_dependent_friction': 2e-3,
    'joint_elasticity': 0.03,
}


@pytest.fixture(scope='module')
def reference(humanoid) -> Reference:
    """Return two seconds of cosines, from rest."""
    return swinging(humanoid, 2.0, 101, (2.5, 5.0))


def arm_with(robot, name) -> ArmModel:
    effect = make_effect(name, robot)
    smallest = [quantity.typical[0] if quantity.typical else 0.1 for quantity in effect.quantities]
    values, shape = CASES.get(name, (smallest, None))
    if shape is not None:
        effect = effect.with_shape(shape)
    values = np.resize(values, len(effect.parameters(robot)))
    if name in SCALED or name not in CASES:
        values = values * np.repeat(STRENGTH, len(effect.quantities))
    return ArmModel(robot).with_effect(effect, values)


def recorded(run: SimulatedRun) -> Motion:
    """Return what was recorded, with the acceleration that belongs to the recorded velocity."""
    beyond = np.gradient(run.dq - run.truth.dq, run.t, axis=0)
    return Motion(run.joints, run.t, run.q, run.dq, run.truth.ddq + beyond, run.tau)


def rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2)))


#: Links that land on a flank do so between samples of the reference: tests of hidden effects have
#: them at the rate of a recording.
@pytest.mark.slow
@pytest.mark.parametrize(
    'name', [n for n, kind in CATALOGUE.items() if n != 'backlash' and not kind.learned]
)
def test_what_is_recorded_is_what_the_model_predicts(humanoid, reference, name) -> None:
    course = temperature_course('30:60:1', humanoid.n_joints, 2.0)
    arm = at_temperature(arm_with(humanoid, name), course)
    run = simulate(arm, reference, rng=np.random.default_rng(0))
    motion, dq = recorded(run), run.truth.dq
    # where no joint or shaft reverses, and the run neither begins nor ends
    chosen = np.all(np.abs(np.column_stack([dq, dq[:, 4] + dq[:, 5]])) > 0.03, axis=1)
    chosen[:30] = chosen[-30:] = False
    assert chosen.mean() > 0.75
    without = rms((ArmModel(humanoid).torque(motion) - run.tau)[chosen])
    error = rms((arm.torque(motion) - run.tau)[chosen])
    assert without > 0.002
    assert error < COARSE.get(name, 1e-4) * without


def test_friction_with_load_holds_a_joint_against_less_than_its_share(pendulum) -> None:
    """A pendulum hangs aside where friction takes what the drive does not."""
    robot = pendulum()
    arm = ArmModel(robot).with_effect(make_effect('load_dependent_friction', robot), [0.3])
    here = Reference(robot.joints, np.array([0.0, 1.0]), np.full((2, 1), 0.5))
    weak = ComputedTorque(ArmModel(robot.with_inertias(0.8 * robot.rigid_parameters)), 0.0)
    held, free = (
        simulate(one, here, controller=weak, rng=np.random.default_rng(0))
        for one in (arm, ArmModel(robot))
    )
    assert np.ptp(held.truth.q) < 1e-9
    assert np.ptp(free.truth.q) > 0.05


@pytest.mark.parametrize('name', ['time_delay', 'torque_lag', 'torque_gain', 'encoder_offset'])
def test_an_arm_that_is_read_step_by_step_reads_the_same(humanoid, reference, name) -> None:
    arm = arm_with(humanoid, name)
    whole = simulate(arm, reference, rng=np.random.default_rng(0))
    live = SimulatedArm(arm, rng=np.random.default_rng(0), start=reference.q[0])
    # the trajectory ends at rest, which an arm that stands by asks for
    t = np.append(reference.t, reference.t[-1] + 1.0)
    q = np.vstack([reference.q, MIDDLE])
    dq, ddq = (np.vstack([x, np.zeros(6)]) for x in (reference.dq, reference.ddq))
    live.set_trajectory(Reference(reference.joints, t, q, dq, ddq))
    for steps in (1, 7, 30, 200):
        sample = live.advance(steps)
    row = sample.steps
    np.testing.assert_allclose(sample.q, whole.q[row], atol=1e-9)
    np.testing.assert_allclose(sample.tau, whole.tau[row], atol=1e-4)
