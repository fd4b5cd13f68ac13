# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The residual of a diagnosis: learned as a map, and approximated by a law of few terms.

``learn_residual`` returns an arm with the maps as an effect, the maps as a table for other
programs, and the shares of the residual that maps and laws predict.

"""

from armid_ros.residual.learn import learn_residual, require_libraries, Residual

__all__ = ['Residual', 'learn_residual', 'require_libraries']
