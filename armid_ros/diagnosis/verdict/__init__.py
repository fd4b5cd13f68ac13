# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Verdict of a diagnosis: shares of the residual, findings, sentences and diagnosis.json."""
