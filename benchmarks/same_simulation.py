# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether simulated arms still do what they did: proof for changes that may not change a number.

``python -m benchmarks.same_simulation --write before.npz``, change the code, then the same with
``--against before.npz``: by how much each array of each case differs at most, as a share of its
largest entry. The cases are rigid and elastic joints with every kind of force, stick and slip,
stops, sensors with noise, and trajectories that take the place of each other.

"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from importlib.metadata import files
import sys

from armid_ros.arm import ArmModel
from armid_ros.effects import parse_effect
from armid_ros.papers.elastic.plant.run import ElasticSensors, run_all
from armid_ros.papers.elastic.plant.signals import (
    EXCITATION_RMS,
    resonance_experiments,
    step_experiments,
    STEP_POSES,
    STEPS,
    WEAK,
)
from armid_ros.robots import load_robot, Robot
from armid_ros.robots.two_link import two_link_set
from armid_ros.simulation import (
    GravityPD,
    Plant,
    Reference,
    Sensors,
    simulate,
    SimulatedArm,
    step,
)
from armid_ros.simulation.elastic.record import record
from armid_ros.simulation.elastic.setup import make_elastic_arm, shipped_arm
from armid_ros.simulation.elastic.two_link import two_link_loop, two_link_plant
import numpy as np

from benchmarks.simulation import swinging, with_friction

Case = tuple[str, dict[str, np.ndarray]]

TOLERANCE = 1e-9
#: Samples before flanks that hit each other have made 1e-15 of the start more than that.
BEFORE = 60
SENSORS = Sensors(
    torque_noise=0.05, position_noise=1e-5, velocity_noise=1e-3, resolution=1e-5,
    velocity_from_encoder=True, torque_delay=2, acceleration_noise=0.1,
)  # fmt: skip
DRY = ('coulomb_friction:coulomb_torque=0.05', 'viscous_friction:viscous_coefficient=0.05')
MOTORS = ('rotor_inertia:rotor_inertia=0.02', 'joint_elasticity:compliance=0.0005', *DRY)
#: Effects that act in ways of their own, on an arm with dry friction.
EFFECTS: dict[str, tuple[str, ...]] = {
    'load': ('load_dependent_friction:load_coefficient=0.1',),
    'presliding': ('presliding_hysteresis:presliding_torque=0.05',),
    'shaft': (
        'coupled_joint_friction:coupled_inertia=0.0001,coupled_viscous_coefficient=0.02,'
        'coupled_coulomb_torque=0.05',
    ),
    'smooth': (
        'torque_ripple:ripple_sine=0.05',
        'quadratic_friction:quadratic_coefficient=0.02',
        'asymmetric_friction:coulomb_asymmetry=0.01,viscous_asymmetry=0.01',
        'torque_offset:torque_offset=0.1',
    ),
    'links': (
        'joint_coupling:coupling_stiffness=0.3',
        'payload:payload_m=0.3,payload_Ixx=0.001,payload_Iyy=0.001,payload_Izz=0.001',
        'base_tilt:tilt_x=0.1',
    ),
    'readings': (
        'torque_lag:lag=0.02',
        'encoder_offset:encoder_offset=0.03',
        'torque_gain:gain_error=0.05',
    ),
    'saturation': (
        'actuator_saturation:lost_share=0.6,saturation_torque=1.0',
        'time_delay:delay=0.007',
    ),
}


def arm_with(robot: Robot, texts: Sequence[str]) -> ArmModel:
    """Return a robot with effects."""
    arm = ArmModel(robot)
    for text in texts:
        arm = arm.with_effect(*parse_effect(text, robot))
    return arm


def rigid_cases(robot: Robot) -> Iterator[Case]:
    """Let arms with rigid joints follow, stop, stand and become another."""
    panda = next(
        str(entry.locate()) for entry in files('example-robot-data') if entry.name == 'panda.urdf'
    )
    for name, other in (('humanoid', robot), ('panda', load_robot(panda))):
        yield f'rigid {name}', recorded(with_friction(other), swinging(other))
    for name, texts in EFFECTS.items():
        yield f'rigid {name}', recorded(arm_with(robot, (*DRY, *texts)), swinging(robot))
    plant = Plant(arm_with(robot, DRY))
    state, rows = plant.state(np.full(6, 0.3)), []
    for k in range(1500):
        state = step(plant, state, 8.0 * np.cos(0.004 * k + np.arange(6.0)))
        rows.append([state.q, state.dq, state.ddq])
    passed = zip(('q', 'dq', 'ddq'), np.array(rows).transpose(1, 0, 2), strict=True)
    yield 'rigid stops', dict(passed)
    arm = SimulatedArm(
        arm_with(robot, DRY), rng=np.random.default_rng(1), sensors=SENSORS,
        controller=GravityPD(ArmModel(robot)),
    )  # fmt: skip
    yield 'rigid live', live(arm, arm_with(robot, (*DRY, *EFFECTS['smooth'])))


def recorded(arm: ArmModel, reference: Reference) -> dict[str, np.ndarray]:
    """Simulate a run with noise."""
    rng = np.random.default_rng(0)
    run = simulate(arm, reference, rng=rng, sensors=SENSORS, rate=500.0, duration=0.7)
    return {
        'q': run.q, 'dq': run.dq, 'tau': run.tau, 'saturated': run.saturated,
        **{f'true {name}': getattr(run.truth, name) for name in ('q', 'dq', 'ddq', 'tau')},
    }  # fmt: skip


def live(arm: SimulatedArm, other: ArmModel | None = None) -> dict[str, np.ndarray]:
    """Give an arm trajectories, one in place of another, and read it now and then."""
    samples, home = [], arm.state.q.copy()
    for goal, after, steps in ((0.2, 1.0, 30), (-0.2, 1.5, 250), (0.0, 1.0, 40)):
        arm.set_trajectory(Reference(arm.joints, np.array([after]), home[np.newaxis] + goal))
        samples += [arm.advance(7) for _ in range(steps)]
        if other is not None:
            arm.become(other)
    arm.reset(arm.state.steps)
    samples += [arm.advance() for _ in range(20)]
    return {
        name: np.array([getattr(s, name) for s in samples]) for name in ('t', 'q', 'dq', 'tau')
    }


def elastic_cases(robot: Robot) -> Iterator[Case]:
    """Let arms with springs in their joints follow, stop and stand."""
    shipped, rng = two_link_set('after'), np.random.default_rng(0)
    plant = two_link_plant(shipped.parameters)
    noise = ElasticSensors(motor_velocity=0.006, link_velocity=0.003, link_acceleration=0.2)
    experiments = resonance_experiments(2, rms=EXCITATION_RMS, rng=rng, duration=1.0)
    steps = step_experiments(STEP_POSES, STEPS)
    for name, loop, all_of_them in (
        ('resonances', two_link_loop(shipped, WEAK), experiments),
        ('steps', two_link_loop(shipped), steps),
    ):
        runs = [noise.measure(run, rng) for run in run_all(plant, loop, all_of_them)]
        for number, run in enumerate(runs):
            yield f'elastic {name} {number}', both_sides(run)
    two = plant.robot
    model, drives = shipped_arm(two)
    arm = make_elastic_arm(model, rng=rng, drives=drives, sensors=SENSORS)
    q = np.array([[0.0, 0.3], [0.2, 0.0], [0.2, 0.0]])
    pushed = Reference(two.joints, np.array([0.0, 0.5, 1.2]), q, tau=np.full((3, 2), 30.0))
    yield 'elastic two links', both_sides(record(arm, pushed, rate=500.0))
    near = two.upper - 0.02
    against = Reference(
        two.joints, np.array([0.0, 0.3]), np.stack([near, near]), tau=np.full((2, 2), 150.0)
    )
    arm = make_elastic_arm(model, rng=rng, drives=drives, gain=0.05)
    yield 'elastic stops', both_sides(record(arm, against))
    gap = ('backlash:backlash=0.002',)
    for name, texts in {'plain': (), 'backlash': gap, **EFFECTS}.items():
        arm = make_elastic_arm(arm_with(robot, (*MOTORS, *texts)), rng=rng, sensors=SENSORS)
        sides = both_sides(record(arm, swinging(robot), rate=500.0))
        if name == 'backlash':
            sides = {part: values[:BEFORE] for part, values in sides.items() if part != 'felt'}
        yield f'elastic {name}', sides
    two_of_them = f'elasticity@{robot.joints[1]}+{robot.joints[3]}'
    some = [text.replace('elasticity', two_of_them) for text in MOTORS]
    arm = make_elastic_arm(arm_with(robot, some), rng=rng, sensors=SENSORS)
    yield 'elastic some', both_sides(record(arm, swinging(robot), rate=500.0))
    yield 'elastic live', live(arm)


def both_sides(run) -> dict[str, np.ndarray]:
    """Return what was recorded of motors and links."""
    arrays = {
        'motor q': run.motor.q, 'motor dq': run.motor.dq, 'tau': run.motor.tau,
        'link q': run.link.q, 'link dq': run.link.dq, 'link ddq': run.link.ddq,
        'reference': run.reference,
    }  # fmt: skip
    return arrays if run.felt is None else {**arrays, 'felt': run.felt}


def main() -> int:
    """Write the numbers, or compare them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--write', help='file to keep the numbers in')
    parser.add_argument('--against', help='file to compare them with')
    options = parser.parse_args()
    robot = load_robot('humanoid_arm')
    found, worst = {}, 0.0
    before = np.load(options.against) if options.against else None
    for cases in (rigid_cases(robot), elastic_cases(robot)):
        for case, arrays in cases:
            found |= {f'{case}: {name}': values for name, values in arrays.items()}
    for name, values in found.items():
        if before is None:
            print(f'{name:40s} {np.sum(np.abs(values)):.9e}')
            continue
        size = np.abs(before[name]).max() or 1.0
        off = float(np.abs(values - before[name]).max() / size)
        worst = max(worst, off)
        print(f'{name:40s} {off:.1e}{"" if off <= TOLERANCE else "  CHANGED"}')
    if options.write:
        np.savez_compressed(options.write, **found)
    return int(worst > TOLERANCE)


if __name__ == '__main__':
    sys.exit(main())
