"""Recalibration: a map from stated to true likelihoods, fitted on other houses.

The map repairs the beliefs of a miscalibrated agent. It cannot make the beliefs of an uninformative agent better than
the base rate. It is monotone (isotonic regression), because a surer belief should be at least as likely to be true.
"""

import numpy as np

from vigil.analysis.measures.beliefs.scores import STATED, TRUE, P

FOLDS = 5
"""Number of parts into which the houses are split. Beliefs in one part are recalibrated by a map fitted on the other
parts."""


def recalibrated(counts: np.ndarray, houses: np.ndarray) -> np.ndarray | None:
    """Return the likelihood (n,) of each of n beliefs after recalibration; None with fewer than two houses.

    `counts`, (n, 21, 2), has one row for each belief; `houses`, (n,), has the house of each belief.
    """
    names, index = np.unique(houses.astype(str), return_inverse=True)
    folds = min(FOLDS, len(names))
    if folds < 2:
        return None
    after = np.empty(len(counts))
    for part in range(folds):
        is_own = index % folds == part
        after[is_own] = counts[is_own, :, STATED] @ monotone_map(counts[~is_own].sum(axis=0))
    return after


def monotone_map(counts: np.ndarray) -> np.ndarray:
    """Return, for each of the 21 values that can be stated, the likelihood (21,) that a belief with this value is true.

    `counts` is (21, 2). A higher value never gets a lower likelihood. Values that were never stated are interpolated.
    """
    from scipy.optimize import isotonic_regression  # noqa: PLC0415 - loads many modules

    is_known = counts[:, STATED] > 0
    stated, true = counts[is_known].T
    return np.interp(P, P[is_known], isotonic_regression(true / stated, weights=stated).x)


def calibration_error(likelihood: np.ndarray, counts: np.ndarray) -> float:
    """Return the expected calibration error: the mean difference between a belief's likelihood and the share of beliefs
    with the same stated value that were true.

    `likelihood` is (n,), `counts` is (n, 21, 2).
    """
    claimed = (counts[..., STATED] * likelihood[:, None]).sum(axis=0)
    return float(np.abs(claimed - counts[..., TRUE].sum(axis=0)).sum() / len(likelihood))
