# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identification by two other tools, as their manuals show it, for the public benchmark.

figaroh (1.0.2) identifies base parameters and friction of each recording, by weighted least
squares. The values of a day are means over its recordings. mujoco.sysid (of MuJoCo 4) fits masses,
centres, friction, rotors and offsets of the description to stretches of 0.4 s, simulated under the
measured torque. The second day starts from the fit of the first. mujoco.sysid needs
`pip install absl-py tabulate`.

"""

from __future__ import annotations

from collections import defaultdict
from contextlib import redirect_stdout
from functools import partial
import io
import logging
import re
from typing import Any

from armid_ros.api.arguments import motion_of
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import mujoco
import numpy as np
from pinocchio.robot_wrapper import RobotWrapper

from benchmarks.offline_speed import figaroh_arm
from tests.hidden.descriptions import bare_urdf

#: Value and standard error of each parameter, by name and joint.
Estimates = dict[tuple[str, str], tuple[float, float]]

#: Cutoff of the filters of figaroh [Hz], rate of its samples and of its rows [Hz].
CUTOFF, SAMPLES, ROWS = 10.0, 62.5, 25.0
#: Names of the parameters of figaroh; the others are of links.
OF_FIGAROH = {'fv': 'viscous_coefficient', 'fs': 'coulomb_torque', 'off': 'torque_offset'}
#: Duration of a stretch of mujoco.sysid [s], and number of stretches of a day.
STRETCH, STRETCHES = 0.4, 16
#: Share of the largest singular value below which a direction of the parameters is not determined.
RANK = 1e-6


def figaroh_estimates(robot: Robot, recordings: list[Recording]) -> Estimates:
    """Identify recordings with figaroh, and return parameter means and standard deviations."""
    found = defaultdict(list)
    for recording in recordings:
        every = max(round(1.0 / (SAMPLES * recording.period)), 1)
        arm = figaroh_arm(robot, recording, CUTOFF, every)
        task = arm(RobotWrapper(robot.model.copy()), '')
        with redirect_stdout(io.StringIO()):
            task.initialize()
            step = max(round(1.0 / (ROWS * every * recording.period)), 2)
            task.solve(decimation_factor=step, plotting=False, wls=True)
        percent = task.result['wls_std_deviations']
        for name, value, share in zip(task.params_base, task.phi_base, percent, strict=True):
            found[name].append((value, abs(value) * share / 100.0))
    estimates = {}
    for name, pairs in found.items():
        if len(pairs) == len(recordings):
            values, std = np.array(pairs).T
            error = float(np.sqrt(np.sum(std**2)) / len(std))
            estimates[_place(robot, name)] = float(values.mean()), error
    return estimates


def _place(robot: Robot, name: str) -> tuple[str, str]:
    """Return name and joint of the first parameter in a base parameter of figaroh."""
    kind, joint = re.match(r'[^a-zA-Z]*([a-zA-Z]+)_?(.*?)(?:\s|$)', name).groups()
    places = [k for k in robot.joints if k in name.split(' ')[0]]
    joint = max(places, key=len) if places else robot.joints[int(re.findall(r'\d+', joint)[0]) - 1]
    return OF_FIGAROH.get(kind, name), joint


def sysid_days(robot: Robot, *days: list[Recording]) -> list[Estimates]:
    """Fit the URDF to each day with mujoco.sysid, starting from the fit of the day before."""
    from mujoco import sysid

    logging.getLogger('absl').setLevel(logging.ERROR)
    period = days[0][0].period
    spec = mujoco.MjSpec.from_string(bare_urdf(robot))
    spec.compiler.fusestatic = True
    spec.option.timestep, spec.option.gravity = period, robot.gravity
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    parameters, places = sysid.ParameterDict(), []
    for joint, effort in zip(robot.joints, robot.torque_limit, strict=True):
        size = min(effort, 1e3)
        motor = spec.add_actuator(name=joint, target=joint)
        motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
        motor.gaintype, motor.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        motor.gainprm[0] = 1.0
        sensor = spec.add_sensor(name=f'{joint}_q', objname=joint)
        sensor.type = mujoco.mjtSensor.mjSENS_JOINTPOS
        sensor.objtype = mujoco.mjtObj.mjOBJ_JOINT
        for name, start, least in (
            ('viscous_coefficient', 0.01, 0.0),
            ('coulomb_torque', 0.01, 0.0),
            ('rotor_inertia', 0.001, 0.0),
            ('torque_offset', 0.0, -1.0),
        ):
            parameters.add(
                sysid.Parameter(
                    f'{name} {joint}', start * size, least * size, size,
                    modifier=partial(_set, name, joint),
                )
            )  # fmt: skip
            places.append((name, joint))
    model = spec.compile()
    for joint in robot.joints:
        body = spec.joint(joint).parent.name
        parameters.add(
            sysid.body_inertia_param(spec, model, body, inertia_type=sysid.InertiaType.MassIpos)
        )
        places += [(f'{what} of the link', joint) for what in ('mass', 'x', 'y', 'z')]
    found = []
    for day in days:
        runs = sysid.ModelSequences('arm', spec, *_stretches(robot, model, day, period))
        residual = sysid.build_residual_fn(models_sequences=[runs], n_threads=1)
        with redirect_stdout(io.StringIO()):
            parameters, result = sysid.optimize(parameters, residual, verbose=False, max_iters=10)
        rest = np.concatenate(residual(parameters.as_vector(), parameters)[0])
        scale = np.linalg.norm(result.jac, axis=0) + 1e-12
        inverse = np.linalg.pinv(result.jac / scale, rcond=RANK)
        variance = rest @ rest / (len(rest) - len(scale))
        std = np.sqrt(variance * np.sum(inverse**2, axis=1)) / scale
        pairs = zip(parameters.as_vector().tolist(), std.tolist(), strict=True)
        found.append(dict(zip(places, pairs, strict=True)))
    return found


def _set(name: str, joint: str, spec: mujoco.MjSpec, parameter: Any) -> None:
    """Set a parameter of a joint in a MuJoCo model."""
    hinge, value = spec.joint(joint), parameter.value[0]
    if name == 'viscous_coefficient':
        hinge.damping = [value, 0.0, 0.0]
    elif name == 'coulomb_torque':
        hinge.frictionloss = value
    elif name == 'rotor_inertia':
        hinge.armature = value
    else:
        spec.actuator(joint).biasprm[0] = -value


def _stretches(
    robot: Robot, model: mujoco.MjModel, day: list[Recording], period: float
) -> tuple[list[Any], ...]:
    """Divide recordings into short stretches with initial state, torque and positions."""
    from mujoco import sysid

    order = [model.joint(joint).qposadr[0] for joint in robot.joints]
    columns = [model.sensor(k).name.removesuffix('_q') for k in range(model.nsensor)]
    columns = [robot.joints.index(joint) for joint in columns]
    names, states, torques, positions = [], [], [], []
    t = period * np.arange(round(STRETCH / period))
    for recording in day:
        motion = motion_of(recording)
        first = np.searchsorted(recording.t, motion.t[0] + period)
        last = np.searchsorted(recording.t, motion.t[-1] - STRETCH - period)
        for begin in np.linspace(first, last, STRETCHES // len(day)).astype(int):
            q, dq = np.empty(model.nq), np.empty(model.nv)
            for values, part in ((q, motion.q), (dq, motion.dq)):
                values[order] = [np.interp(recording.t[begin], motion.t, x) for x in part.T]
            rows = slice(begin, begin + len(t))
            names.append(str(len(names)))
            states.append(sysid.create_initial_state(model, q, dq, np.empty(0)))
            torques.append(sysid.TimeSeries(t, recording.tau[rows]))
            measured = recording.q[rows][:, columns]
            positions.append(sysid.TimeSeries.from_names(t, measured, model))
    return names, states, torques, positions
