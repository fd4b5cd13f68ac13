# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Figures for documents: matplotlib, without a display and without global state.

Each function returns a ``matplotlib.figure.Figure``; ``save_figure`` writes it.

"""

from armid_ros.report.figures.convergence import convergence_figure
from armid_ros.report.figures.parameters import parameter_figure
from armid_ros.report.figures.style import save_figure
from armid_ros.report.figures.torque import torque_figure

__all__ = [
    'convergence_figure',
    'parameter_figure',
    'save_figure',
    'torque_figure',
]
