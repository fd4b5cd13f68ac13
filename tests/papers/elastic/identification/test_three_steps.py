# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The three steps on data of another engine, and what is said of them."""

from __future__ import annotations

import json

from armid_ros.papers.elastic.identification.output import elastic_document
from armid_ros.papers.elastic.identification.three_steps import identify_two_inertia
from armid_ros.papers.elastic.plant.run import ElasticSensors
from armid_ros.robots.two_link import two_link_set
from armid_ros.simulation.elastic.two_link import two_link_loop
import numpy as np
import pytest

from benchmarks.elastic import errors

pytestmark = pytest.mark.long


@pytest.fixture(scope='module')
def result(runs, clean_steps, truth):
    """Identify the arm; only gears and torque constants are known before."""
    rng = np.random.default_rng(2)
    sensors = ElasticSensors(motor_velocity=0.002, link_velocity=0.002)
    steps = [sensors.measure(run, rng) for run in clean_steps]
    loop = two_link_loop(two_link_set('after'))
    drives = two_link_set('before').parameters
    return identify_two_inertia(runs, drives, steps=steps, loop=loop)


def test_parameters_are_found_without_a_start(result, truth) -> None:
    found = errors(result.parameters, truth)
    assert found['main'] < 1.0
    assert found['dg'] < 6.0
    assert found['sum'] < 4.0


def test_tuning_reaches_the_noise(result) -> None:
    assert result.tuning.rms[1] == pytest.approx(0.002, rel=0.05)


def test_document_holds_parameters_with_deviations(result, truth) -> None:
    document = json.loads(json.dumps(elastic_document(result, 'two_link_elastic')))
    rows = {(row['name'], row['joint']): row for row in document['parameters']}
    stiffness = rows['kg', 'joint1']
    assert abs(stiffness['value'] - truth.stiffness[0]) < 4.0 * stiffness['std']
    assert stiffness['unit'] == 'N m/rad'
    total = document['total_damping'][0]
    assert total['std'] < rows['dl', 'joint1']['std'] / 3.0
