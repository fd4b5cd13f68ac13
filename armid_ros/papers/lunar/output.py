# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The document lunar.json: results of the reproduction of the lunar paper."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from armid_ros.motion import FloatArray
from armid_ros.papers.lunar.reproduction import Repeated, Reproduction

SCHEMA = 'armid/lunar/1'


def lunar_document(found: Reproduction) -> dict[str, Any]:
    """
    Return the reproduction as the document of lunar.json.

    Parameters
    ----------
    found : Reproduction
        Tables, gravity parameters, load.

    """
    return {
        'schema': SCHEMA,
        'tables': [_table(one) for one in found.repeated],
        'composites': [{**asdict(one), 'unit': 'N mm'} for one in found.composites],
        'load': {'value': found.load, 'std': found.load_std, 'unit': 'kg'},
    }


def _table(one: Repeated) -> dict[str, Any]:
    scale = 1.0 if one.table.uniform else 100.0
    slow, whole = one.methods

    def by_joint(values: FloatArray) -> dict[str, float]:
        return dict(zip(one.joints, values.tolist(), strict=True))

    return {
        'number': one.table.number,
        'title': one.table.title,
        'measure': 'mae_over_noise' if one.table.uniform else 'rmse_percent_of_peak',
        'paper': by_joint(scale * one.table.ratio),
        'against_noise': by_joint(scale * one.ratio(slow.noisy)),
        'weight_alone': by_joint(scale * one.ratio(slow.held_out)),
        'whole_dynamics': by_joint(scale * one.ratio(whole.held_out)),
        'paper_peak': by_joint(one.table.peak),
        'largest_torque': by_joint(one.peak),
        'torque_unit': 'N m',
    }
