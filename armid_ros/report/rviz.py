# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A configuration of RViz for one robot: the arm, and what its model does not explain."""

from __future__ import annotations

from armid_ros.report.layouts import SCHEMA, topic_prefix
from armid_ros.report.page import render


def rviz_config(base: str, namespace: str = '') -> str:
    """
    Return a configuration of RViz, with the model of the arm and the residual on its joints.

    The model moves with the transforms of robot_state_publisher; the markers need none.

    Parameters
    ----------
    base : str
        Base link, which is the fixed frame.
    namespace : str
        Of the nodes; empty for none.

    """
    at = topic_prefix(namespace)
    return f'{render("arm.rviz", {"schema": SCHEMA, "base": base, "at": at})}\n'
