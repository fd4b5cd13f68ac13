# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The nuisance parameters that are fitted with each cause: rigid body, friction, model discrepancy.

The residual of recording k, in weighted rows of each joint, is

    y_k = X_k b + B_k (d0 + d_m + d_k) + Z_k (g0 + [k is diagnosed] g + u_k) + e_k

where b are base parameters (prior: the description), d0 is the model discrepancy of all
recordings, d_m that of a motion in several recordings, and d_k that of one recording (Kennedy and
O'Hagan, Bayesian calibration of computer models, 2001), g are the values of a cause, g0 its values
in the baseline, u_k their differences between recordings, and e_k is noise. For given standard
deviations of d0, d_m, d_k and e_k, all of these are Gaussian. Each d_k is therefore integrated out
of the normal equations of its recording.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import described_precision, excited_parameters
from armid_ros.diagnosis.data.discrepancy import discrepancy_columns
from armid_ros.diagnosis.data.rows import REPEATED, Rows
from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.hyperparameters import (
    Hyperparameters,
    MotionDiscrepancies,
    NuisancePosterior,
)
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import linalg

#: Least prior precision over the squared norm of a column, so that the equations can be solved.
_MIN_PRECISION = 1e-12
#: Relative prior error of a described value of an effect, or of a torque in unvisited states.
#: Errors of values in the laboratory reach 0.1, and friction of an arm changes by 0.2 in a day.
_RELATIVE_PRIOR_STD = 0.25


@dataclass(frozen=True)
class Nuisance:
    """
    Linear regression of the nuisance parameters: rigid body, friction, model discrepancy.

    Attributes
    ----------
    rows : Rows
        The recordings.
    arm : ArmModel
        The model, with friction in all joints, given or not.
    base : BaseParameters
        The r base parameters b of its rigid body and friction.
    prior_precision : ndarray, shape (r, r)
        Prior precision of b.
    unset : ndarray of bool, shape (r,)
        Whether each of b is a friction or offset value that the given model lacks.
    columns : tuple of ndarray, each (n, M, q)
        Weighted columns of each recording: b, then the model discrepancy of each joint.
    residual : tuple of ndarray, each (n, M)
        Weighted residual of the model in each recording.
    column_products : (ndarray, shape (K, q, q), ndarray, shape (K, q))
        Inner products of the columns with each other and with the residual, in each recording.
    accepted : tuple of Cause
        Accepted causes, which are fitted as well.

    """

    rows: Rows
    arm: ArmModel
    base: BaseParameters
    prior_precision: FloatArray
    unset: npt.NDArray[np.bool_]
    columns: tuple[FloatArray, ...]
    residual: tuple[FloatArray, ...]
    column_products: tuple[FloatArray, FloatArray]
    accepted: tuple[Cause, ...] = ()

    @classmethod
    def of(
        cls,
        rows: Rows,
        arm: ArmModel,
        rng: np.random.Generator,
        information: FloatArray | None = None,
        constant: Sequence[int] = (),
        gravity: FloatArray | None = None,
    ) -> Nuisance:
        """
        Set up the regression: compute weighted regressor and residual of each recording.

        Parameters
        ----------
        rows : Rows
            The recordings.
        arm : ArmModel
            The model.
        rng : numpy.random.Generator
            Draws the random states from which base parameters are found.
        information : ndarray, shape (P, P), optional
            Fisher information on the first P parameters of the arm from its identification.
        constant : sequence of int
            Indices of parameters of the arm that are not fitted: an accepted cause changes them.
        gravity : ndarray, shape (3,), optional
            Gravity for the columns of the rigid body, if not that of the model [m/s^2].

        """
        free = np.setdiff1d(np.arange(len(arm.parameters)), constant)
        felt = arm if gravity is None else replace(arm, robot=arm.robot.with_gravity(gravity))
        base, columns = excited_parameters(felt, felt.base_parameters(rng, free), rows.data)
        prior_precision = described_precision(base, arm, information)
        rigid = len(arm.robot.rigid_parameters)
        values = arm.theta[base.independent]
        unset = (base.independent >= rigid) & (values == 0.0)  # noqa: RUF069 - no given value
        given = (base.independent >= rigid) & ~unset
        prior_precision[given, given] += (_RELATIVE_PRIOR_STD * values[given]) ** -2.0
        joints = range(arm.robot.n_joints)
        functions = discrepancy_columns(rows.data, arm)
        both = [
            np.concatenate([x, f, *(f * (part.fold in group) for group in rows.repeated)], axis=2)
            for x, f, part in zip(columns, functions, rows.data, strict=True)
        ]
        rest = [part.residual(arm)[:, :, np.newaxis] for part in rows.data]
        weighted = rows.weighted(both, joints)
        residual = [x[:, :, 0] for x in rows.weighted(rest, joints)]
        size = weighted[0].shape[2]
        pairs = [(x.reshape(-1, size), y.ravel()) for x, y in zip(weighted, residual, strict=True)]
        return cls(
            rows,
            arm,
            base,
            prior_precision,
            unset,
            tuple(weighted),
            tuple(residual),
            (np.array([x.T @ x for x, _ in pairs]), np.array([x.T @ y for x, y in pairs])),
        )

    @cached_property
    def discrepancy(self) -> npt.NDArray[np.intp]:
        """Indices (n, f) of the f columns for the discrepancy of each joint in all recordings."""
        return np.asarray(self._discrepancies[0])

    @cached_property
    def _discrepancies(self) -> npt.NDArray[np.intp]:
        """Indices (1 + g, n, f): of all recordings, and of each of g repeated motions."""
        columns = np.arange(self.base.rank, self.columns[0].shape[2])
        return columns.reshape(1 + len(self.rows.repeated), len(self.columns[0]), -1)

    def _own_std(self, hyperparameters: Hyperparameters) -> FloatArray:
        """Return prior standard deviations (K, n) of d_k, the discrepancy of one recording."""
        share = np.ones((len(self.columns), 1))
        for group in self.rows.repeated:
            share[group] = REPEATED
        return hyperparameters.own * share * np.array(self.rows.amplitude)

    @cached_property
    def acting(self) -> list[list[tuple[npt.NDArray[np.intp], FloatArray]]]:
        """Nonzero columns of each joint in each recording: indices and values (M, c)."""
        body, found = np.arange(self.base.rank), []
        for k, columns in enumerate(self.columns):
            used = [0, *(1 + n for n, group in enumerate(self.rows.repeated) if k in group)]
            functions = self._discrepancies[used].swapaxes(0, 1)
            places = [np.concatenate([body, *own]) for own in functions]
            found.append([(place, x[:, place]) for place, x in zip(places, columns, strict=True)])
        return found

    @cached_property
    def count(self) -> npt.NDArray[np.intp]:
        """Number of rows in which a joint moves, in each recording, summed over joints, (K,)."""
        folds = [part.fold for part in self.rows.data]
        return np.bincount(folds, [np.count_nonzero(w) for w in self.rows.weight]).astype(int)

    @cached_property
    def square(self) -> FloatArray:
        """Gram matrix of nuisance columns and accepted causes, shape (K, q + a, q + a)."""
        if not self.accepted:
            return self.column_products[0]
        border = np.concatenate([self._acting(x) * x.products for x in self.accepted], axis=2)
        pairs = [self._acting(x) * self._among_accepted(x) for x in self.accepted]
        within = np.concatenate(pairs, axis=2)
        return np.block([[self.column_products[0], border], [border.swapaxes(1, 2), within]])

    @cached_property
    def cross(self) -> FloatArray:
        """Inner products of nuisance columns and accepted causes with the residual, (K, q + a)."""
        aims = [one.aim * self._acting(one)[:, :, 0] for one in self.accepted]
        return np.concatenate([self.column_products[1], *aims], axis=1)

    @cached_property
    def power(self) -> FloatArray:
        """Sum of squares of the weighted residual of each recording, shape (K,)."""
        return np.array([np.sum(own**2) for own in self.residual])

    def _among_accepted(self, cause: Cause) -> FloatArray:
        """Return inner products of the accepted causes with another cause, (K, a, p)."""
        parts = [self._acting(one) * one.products_with(cause) for one in self.accepted]
        return np.concatenate(parts, axis=1)

    def _acting(self, cause: Cause) -> FloatArray:
        """Return a mask (K, 1, 1) of the recordings in which an accepted cause acts."""
        return cause.acts(self.rows.diagnosed).astype(float)[:, np.newaxis, np.newaxis]

    def products(self, cause: Cause) -> FloatArray:
        """Return the inner products of all columns with the columns of a cause, (K, q + a, p)."""
        if not self.accepted:
            return cause.products
        return np.concatenate([cause.products, self._among_accepted(cause)], axis=1)

    def and_cause(self, cause: Cause, size: float = 1.0) -> Nuisance:
        """Add a cause whose values have the prior standard deviation `size` times their `unit`."""
        return replace(self, accepted=(*self.accepted, replace(cause, size=size)))

    def without_cause(self, index: int) -> Nuisance:
        """Return the regression problem without the accepted cause at this index."""
        return replace(self, accepted=(*self.accepted[:index], *self.accepted[index + 1 :]))

    def with_residual(self, residual: Sequence[FloatArray]) -> Nuisance:
        """Return the regression problem for another weighted residual, (n, M) per recording."""
        pairs = zip(self.columns, residual, strict=True)
        aims = np.array([x.reshape(-1, x.shape[2]).T @ y.ravel() for x, y in pairs])
        accepted = []
        for one in self.accepted:
            own = zip(one.columns, residual, strict=True)
            aim = [np.einsum('tmp,tm->p', x, y[list(one.joints)]) for x, y in own]
            accepted.append(replace(one, aim=np.array(aim)))
        return replace(
            self,
            residual=tuple(residual),
            column_products=(self.column_products[0], aims),
            accepted=tuple(accepted),
        )

    @property
    def value_slices(self) -> list[slice]:
        """Return for each accepted cause the slice of its values among all parameters."""
        size = self.columns[0].shape[2]
        counts = [len(one.unit) for one in self.accepted]
        stops = size + np.cumsum(counts, dtype=int)
        return [slice(s - count, s) for count, s in zip(counts, stops.tolist(), strict=True)]

    @cached_property
    def unvisited_factor(self) -> FloatArray:
        """
        Return factors (n, f) that widen the discrepancy prior in states without baseline data.

        The misfit of the baseline limits the discrepancy in visited states only. In other states,
        the discrepancy may be a share of the torque.

        """
        before = self.rows.n_baseline
        if not before:
            return np.ones(self.discrepancy.shape)
        then, now = (
            np.mean([np.diag(x)[self.discrepancy] for x in part], axis=0)
            for part in (self.square[:before], self.square[before:])
        )
        most = np.maximum(_RELATIVE_PRIOR_STD * self.rows.torque / self.rows.amplitude[0], 1.0)
        with np.errstate(divide='ignore', invalid='ignore'):
            more = np.sqrt(np.where(now > 0.0, now / then, 1.0))
        return np.asarray(np.clip(more, 1.0, most[:, np.newaxis]))

    def prior(self, hyperparameters: Hyperparameters) -> tuple[npt.NDArray[np.intp], FloatArray]:
        """Return the indices of the fitted parameters and their prior precision matrix."""
        unit = self.rows.amplitude[0]
        rigid = self.base.independent < len(self.arm.robot.rigid_parameters)
        scale = np.where(rigid, hyperparameters.body or 1.0, 1.0)
        rank = self.base.rank
        squares = np.diagonal(self.column_products[0], axis1=1, axis2=2).sum(axis=0)[:rank]
        body = self.prior_precision / np.outer(scale, scale)
        body += _MIN_PRECISION * np.diag(np.where(squares > 0.0, squares, 1.0))
        shared = max(hyperparameters.shared, _MIN_PRECISION)
        size = shared * unit[:, np.newaxis] * self.unvisited_factor
        own = max(hyperparameters.own, _MIN_PRECISION) * np.sqrt(1.0 - REPEATED**2)
        firsts = [self.rows.amplitude[group[0]] for group in self.rows.repeated]
        of_motions = [np.repeat(own * unit, size.shape[1]) for unit in firsts]
        of_causes = [one.size * one.unit for one in self.accepted]
        others = np.concatenate([size.ravel(), *of_motions, *of_causes]) ** -2.0
        whole = linalg.block_diag(body, np.diag(others))
        fitted = np.ones(len(whole), dtype=bool)
        fitted[:rank] = (hyperparameters.body > 0.0) | self.unset
        fitted[self.discrepancy.ravel()] = hyperparameters.shared > 0.0
        fitted[self._discrepancies[1:].ravel()] = hyperparameters.own > 0.0
        used = np.flatnonzero(fitted)
        return used, whole[np.ix_(used, used)]

    def rows_of(self, k: int) -> FloatArray:
        """Return the weighted columns of recording k, shape (M, n, q + a)."""
        joints, rows, _ = self.columns[k].shape
        blocks = [self.columns[k]]
        for one in self.accepted:
            own = np.zeros((joints, rows, len(one.unit)))
            if one.acts(self.rows.diagnosed)[k]:
                own[list(one.joints)] = one.columns[k]
            blocks.append(own)
        return np.concatenate(blocks, axis=2).swapaxes(0, 1)

    def posterior(
        self,
        hyperparameters: Hyperparameters,
        among: Sequence[int] | None = None,
        less: tuple[int, FloatArray, FloatArray] | None = None,
    ) -> NuisancePosterior:
        """Return the posterior of all parameters at given hyperparameters."""
        return self.posteriors([hyperparameters], among, less)[0]

    def posteriors(
        self,
        settings: Sequence[Hyperparameters],
        among: Sequence[int] | None = None,
        less: tuple[int, FloatArray, FloatArray] | None = None,
    ) -> list[NuisancePosterior]:
        """
        Return posteriors for several hyperparameters, which differ neither in `own` nor `noise`.

        The discrepancies d_k of single recordings are integrated out once, by their Schur
        complement.

        Parameters
        ----------
        settings : sequence of Hyperparameters
            The sets of hyperparameters.
        among : sequence of int, optional
            Indices of the recordings that are fitted; all by default.
        less : (int, ndarray, shape (S, q + a), ndarray, shape (S,)), optional
            Held-out rows: the index of their recording, their columns, and their residual.

        """
        fitted = list(range(len(self.columns)) if among is None else among)
        square, cross, count = self.square[fitted], self.cross[fitted], self.count[fitted].sum()
        scale, power = settings[0].precision, float(self.power[fitted].sum())
        if less is not None:
            k, x, y = less
            square[fitted.index(k)] -= x.T @ x
            cross[fitted.index(k)] -= x.T @ y
            count, power = count - len(y), power - float(y @ y)
        priors = [self.prior(one) for one in settings]
        used = priors[0][0]
        information = square.sum(axis=0)[np.ix_(used, used)] * scale
        vector = cross.sum(axis=0)[used] * scale
        loss, motion = 0.5 * power * scale, None
        normaliser = -float(count) / settings[0].correlated_rows * np.log(settings[0].noise)
        if settings[0].own:
            place, functions = self.discrepancy, self.discrepancy.shape[1]
            size = self._own_std(settings[0])[fitted]
            precision = square[:, place[:, :, np.newaxis], place[:, np.newaxis, :]] * scale
            precision += np.eye(functions) * size[:, :, np.newaxis, np.newaxis] ** -2.0
            covariance = np.asarray(np.linalg.inv(precision))
            border = square[:, place.ravel()][:, :, used] * scale
            regressed = covariance @ border.reshape(*precision.shape[:3], -1)
            regressed = regressed.reshape(border.shape)
            aim = cross[:, place] * scale
            information -= border.reshape(-1, len(used)).T @ regressed.reshape(-1, len(used))
            vector -= aim.ravel() @ regressed.reshape(-1, len(used))
            loss -= 0.5 * float(np.einsum('kjf,kjfg,kjg->', aim, covariance, aim))
            normaliser -= 0.5 * float(np.linalg.slogdet(precision)[1].sum())
            normaliser -= functions * float(np.log(size).sum())
            motion = MotionDiscrepancies(covariance, aim, regressed)
        found = []
        for hyperparameters, (_, prior) in zip(settings, priors, strict=True):
            lower = np.asarray(np.linalg.cholesky(prior + information))
            values = linalg.cho_solve((lower, True), vector)
            left = loss - 0.5 * float(vector @ values)
            evidence = (
                0.5 * float(np.linalg.slogdet(prior)[1])
                + hyperparameters.prior
                + normaliser
                - left
            )
            evidence -= float(np.sum(np.log(np.diag(lower))))
            found.append(
                NuisancePosterior(hyperparameters, used, lower, values, evidence, left, motion)
            )
        return found

    def moments(self, posterior: NuisancePosterior) -> tuple[FloatArray, FloatArray]:
        """Return mean and covariance of all parameters; zero for parameters not fitted."""
        size = self.cross.shape[1]
        covariance = np.zeros((size, size))
        covariance[np.ix_(posterior.used, posterior.used)] = posterior.root.T @ posterior.root
        return self.means(posterior), covariance

    def means(self, posterior: NuisancePosterior) -> FloatArray:
        """Return posterior means of all parameters; zero for parameters that are not fitted."""
        values = np.zeros(self.cross.shape[1])
        values[posterior.used] = posterior.values
        return values

    def residual_at(self, values: FloatArray, k: int) -> FloatArray:
        """Return the weighted residual (n, M) of recording k, without its own discrepancy d_k."""
        columns = self.columns[k]
        residual = self.residual[k] - columns @ values[: columns.shape[2]]
        for one, span in zip(self.accepted, self.value_slices, strict=True):
            if one.acts(self.rows.diagnosed)[k]:
                residual[list(one.joints)] -= one.columns[k] @ values[span]
        return residual

    def squares_of_diagnosed(self, posterior: NuisancePosterior) -> float:
        """Return the sum of squared weighted residuals of the diagnosed recordings."""
        values, diagnosed = self.means(posterior), np.flatnonzero(self.rows.diagnosed).tolist()
        return float(sum(np.sum(self.residual_at(values, k) ** 2) for k in diagnosed))

    def noise_at(self, values: FloatArray, hyperparameters: Hyperparameters, k: int) -> FloatArray:
        """Return the weighted residual (n, M) of recording k, less its fitted discrepancy d_k."""
        residual = self.residual_at(values, k)
        if not hyperparameters.own:
            return residual
        size = self._own_std(hyperparameters)[k]
        for joint, place in enumerate(self.discrepancy):
            functions = self.columns[k][joint][:, place]
            precision = hyperparameters.precision * functions.T @ functions
            precision += np.eye(len(place)) * size[joint] ** -2.0
            aim = hyperparameters.precision * functions.T @ residual[joint]
            residual[joint] -= functions @ np.linalg.solve(precision, aim)
        return residual

    def correlation_length(
        self, posterior: NuisancePosterior, recordings: Sequence[int], least: float
    ) -> float:
        """
        Return how many correlated residual rows equal one independent row, at least 1.

        It is one plus twice the sum of the autocorrelations up to the first one below 0.05, as the
        median over joints and recordings.

        """
        lengths = []
        values = self.means(posterior)
        for k in recordings:
            for x in self.noise_at(values, posterior.hyperparameters, k):
                x = x[np.abs(x) > 0.0]
                if len(x) >= 60:  # three times the largest lag
                    correlation = np.array([x[lag:] @ x[:-lag] for lag in range(1, 20)]) / (x @ x)
                    below = correlation < 0.05
                    count = int(np.argmax(below)) if below.any() else len(correlation)
                    lengths.append(1.0 + 2.0 * float(correlation[:count].sum()))
        return max(float(np.median(lengths)) if lengths else least, 1.0)
