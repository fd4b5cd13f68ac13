# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plots of a joint quantity over time, one axes per joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt


def draw_joints(
    joints: Sequence[str], curves: Mapping[str, tuple[FloatArray, FloatArray]], quantity: str
) -> npt.NDArray[np.object_]:
    """
    Plot curves over time in one subplot per joint; return the axes of the subplots.

    Parameters
    ----------
    joints : sequence of str
        The joints.
    curves : mapping of str to (ndarray, ndarray)
        Label of each curve, with its times (N,) [s] and values (N, n).
    quantity : str
        Name and unit of the quantity, the label of the vertical axis.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n,)

    """
    from matplotlib import pyplot as plt

    count = len(joints)
    size = (8.0, 1.0 + 1.3 * count)
    figure, axes = plt.subplots(
        count, sharex=True, squeeze=False, figsize=size, layout='constrained'
    )
    for joint, (name, axis) in enumerate(zip(joints, axes[:, 0], strict=True)):
        for number, (label, (t, values)) in enumerate(curves.items(), start=1):
            # broad under fine, so that equal curves are visible
            width = 1.0 + 2.0 * (len(curves) - number)
            axis.plot(t, values[:, joint], label=label, linewidth=width)
        axis.set_title(name, loc='left', fontsize='medium')
        axis.grid(True, alpha=0.3)
    axes[-1, 0].set_xlabel('time [s]')
    figure.supylabel(quantity)
    if len(curves) > 1:
        labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(*labels, loc='outside upper right', ncols=len(curves))
    return np.asarray(axes[:, 0])
