# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Learning of the residual of a diagnosis: as a map of the state, and as a formula of few terms.

``learn_residual`` returns an arm with the maps as an effect, a table of the maps for other
programs, and the predicted shares of the residual.

"""

from armid_ros.residual.learn import learn_residual, require_libraries, Residual

__all__ = ['Residual', 'learn_residual', 'require_libraries']
