# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An inspection as a file for programs to read."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from armid_ros.inspection.inspect import Inspection
import numpy as np

SCHEMA = 'armid/inspection/1'


def inspection_document(found: Inspection) -> dict[str, Any]:
    """Return an inspection for programs to read."""
    trial = None
    if found.trial is not None:
        trial = asdict(found.trial)
        scale = found.trial.scale
        trial['scale'] = (
            None if scale is None else [s if np.isfinite(s) else None for s in scale.tolist()]
        )
    return {
        'schema': SCHEMA,
        'source': found.recording.source,
        'topic': found.recording.topic,
        'topics': [
            {'name': t.name, 'type_name': t.type_name, 'count': t.count, 'joints': list(t.joints)}
            for t in found.topics
        ],
        'samples': len(found.recording),
        'sampling': asdict(found.sampling),
        'joints': [asdict(joint) for joint in found.joints],
        'remarks': [asdict(remark) for remark in found.remarks],
        'trial': trial,
        'verdict': found.verdict,
    }
