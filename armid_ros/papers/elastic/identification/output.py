# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The document elastic.json: results of the three steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from armid_ros.arm import parameter_table
from armid_ros.papers.elastic.identification.interaction import decibel_error
from armid_ros.papers.elastic.identification.joints import SpringEstimate
from armid_ros.papers.elastic.identification.physical import BAND, frequencies, ideal_response
from armid_ros.papers.elastic.identification.response import parameter_names, unpack, velocities
from armid_ros.papers.elastic.identification.three_steps import TwoInertiaIdentification
from armid_ros.papers.elastic.identification.tuning import Tuning
from armid_ros.robots.two_link import TwoLinkParameters
import numpy as np

SCHEMA = 'armid/elastic/1'
SPRINGS_SCHEMA = 'armid/springs/1'
#: Parameters that step responses determine well; friction and spring damping are less certain.
MAIN = ('alpha', 'beta', 'gamma', 'mm', 'kg')


def elastic_document(result: TwoInertiaIdentification, robot: str) -> dict[str, Any]:
    """Return an identification of elastic joints as the document that elastic.json holds."""
    parameters, rigid = result.parameters, result.rigid.estimate
    names = parameter_names(result.joints)
    std = [None] * len(names) if result.tuning is None else list(result.tuning.estimate.std)
    frequency = np.geomspace(5.0, BAND[1], 200)
    antiresonance, resonance = frequencies(result.untuned)
    document: dict[str, Any] = {
        'schema': SCHEMA,
        'robot': robot,
        'rigid': {
            'relative_error_percent': result.rigid.relative_error,
            'parameters': parameter_table(rigid.parameters, rigid.values, list(rigid.std)),
        },
        'joints': [
            {
                'joint': joint,
                'antiresonance_hz': float(antiresonance[k]),
                'resonance_hz': float(resonance[k]),
                'interaction_gain': float(result.interaction_gain[k]),
                'subspaces_against_physical_db': decibel_error(
                    result.systems[k].response(frequency)[:, 0, 0],
                    ideal_response(parameters, k, frequency)[:, 0, 0],
                ),
                'coulomb_torque': float(parameters.joint_coulomb[k]),
            }
            for k, joint in enumerate(result.joints)
        ],
        'untuned': parameter_table(names, unpack(result.untuned), [None] * len(names)),
        'parameters': parameter_table(names, unpack(parameters), std),
    }
    if result.tuning is not None:
        before, after = result.tuning.rms
        document['tuning'] = {'rms_before': before, 'rms_after': after, 'unit': 'rad/s'}
        document['total_damping'] = total_damping(result)
    return document


def total_damping(result: TwoInertiaIdentification) -> list[dict[str, Any]]:
    """Return dl + dm gear^2 of both joints, the identifiable sum of the two."""
    assert result.tuning is not None
    estimate, gear = result.tuning.estimate, result.parameters.gear
    rows = []
    for k, joint in enumerate(result.joints):
        weights = np.zeros(len(estimate.values))
        weights[estimate.index('dl', joint)] = 1.0
        weights[estimate.index('dm', joint)] = gear[k] ** 2
        rows.append(
            {
                'name': 'dl + dm gear^2',
                'joint': joint,
                'value': float(weights @ estimate.values),
                'std': float(np.sqrt(weights @ estimate.covariance @ weights)),
                'unit': 'N m s/rad',
            }
        )
    return rows


def tuning_story(
    tuning: Tuning, start: TwoLinkParameters, truth: TwoLinkParameters
) -> dict[str, Any]:
    """
    Return the errors of a tuning against the true parameters of a simulated arm.

    Returns
    -------
    dict
        Root mean square errors of the velocities against those of the true arm, without noise,
        and largest errors of a main parameter, at the start and at the end.

    """
    clean = velocities(tuning.steps, truth)
    main = np.array([name.name in MAIN for name in parameter_names(('', ''))])
    before, after = (
        float(np.sqrt(np.mean((one - clean) ** 2))) for one in (tuning.before, tuning.after)
    )
    worst, best = (
        float(100.0 * np.abs(unpack(found) / unpack(truth) - 1.0)[main].max())
        for found in (start, tuning.parameters)
    )
    return {
        'error_before': before,
        'error_after': after,
        'unit': 'rad/s',
        'factor': before / after,
        'main_parameters_percent_before': worst,
        'main_parameters_percent_after': best,
    }


def springs_document(found: Sequence[SpringEstimate], robot: str) -> dict[str, Any]:
    """Return springs that were found joint by joint as the document that elastic.json holds."""

    def number(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    return {
        'schema': SPRINGS_SCHEMA,
        'robot': robot,
        'joints': [
            {
                'joint': one.joint,
                'told': one.informative,
                'stiffness': number(one.transmission.stiffness[0]),
                'stiffness_interval': [number(x) for x in one.transmission.stiffness[1:]],
                'stiffness_unit': 'N m/rad',
                'backlash': number(one.transmission.backlash[0]),
                'backlash_interval': [number(x) for x in one.transmission.backlash[1:]],
                'backlash_unit': 'rad',
                'backlash_seen': one.transmission.backlash_seen,
                'correlation': number(one.transmission.correlation),
                'explained': number(one.transmission.explained),
                'encoder_delay_s': number(one.transmission.delay[0]),
                'link_inertia': one.inertia,
                'rotor_inertia': None if one.motor is None else float(one.motor[0]),
                'viscous_coefficient': None if one.motor is None else float(one.motor[1]),
                'coulomb_torque': None if one.motor is None else float(one.motor[2]),
                'antiresonance_hz': number(one.antiresonance),
                'resonance_hz': number(one.resonance),
            }
            for one in found
        ],
    }
