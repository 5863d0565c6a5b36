"""Calibration: measures of how well stated likelihoods agree with what was true, and recalibration by other houses.

A stated likelihood has one of 21 values, so two counts for each value suffice: how often the value was stated, and how
often the belief was then true. The functions take `counts`, (..., 21, 2), and work on any number of resamples at once.

Recalibration maps stated to true likelihoods. The map repairs the beliefs of a miscalibrated agent; it cannot make the
beliefs of an uninformative agent better than the base rate. It is monotone (isotonic regression), because a surer
belief should be at least as likely to be true.

Sources: Murphy, "A new vector partition of the probability score", 1973 (parts of the Brier score); Kumar, Liang and
Ma, "Verified uncertainty calibration", 2019 (debiased calibration error); Geifman, Uziel and El-Yaniv, "Bias-reduced
uncertainty estimation for deep neural classifiers", 2019 (excess area under risk and coverage).
"""

import numpy as np

from vigil.records.probe import SCALE

VALUES = SCALE + 1
P = np.arange(VALUES) / SCALE
"""(21,) likelihood, from 0 to 1, of each value of the scale."""
STATED, TRUE = 0, 1
"""Columns of the counts: how often a value was stated, and how often the belief was then true."""
FOLDS = 5
"""Number of parts into which the houses are split. Beliefs in one part are recalibrated by a map fitted on the other
parts."""


def counts_of(sure: np.ndarray, is_true: np.ndarray) -> np.ndarray:
    """Return the counts (n, 21, 2) of n beliefs, one row each; the sum of rows has the counts of several beliefs.

    `sure` has the stated values of the scale, (n,), and `is_true` says whether each belief was true, (n,).
    """
    rows = np.zeros((len(sure), VALUES, 2))
    at = np.arange(len(sure))
    rows[at, sure.astype(int), STATED] = 1.0
    rows[at, sure.astype(int), TRUE] = is_true
    return rows


def base_rate(counts: np.ndarray) -> np.ndarray:
    """Return the share of beliefs whose fact was true; NaN without beliefs."""
    return _ratio(counts[..., TRUE].sum(axis=-1), counts[..., STATED].sum(axis=-1))


def overconfidence(counts: np.ndarray) -> np.ndarray:
    """Return the mean stated likelihood minus the share of beliefs whose fact was true."""
    return _ratio((P * counts[..., STATED] - counts[..., TRUE]).sum(axis=-1), counts[..., STATED].sum(axis=-1))


def brier(counts: np.ndarray) -> np.ndarray:
    """Return the Brier score: the mean squared difference between the stated likelihood and the truth; 0 is best."""
    stated, true = counts[..., STATED], counts[..., TRUE]
    return _ratio((stated * P**2 - 2 * P * true + true).sum(axis=-1), stated.sum(axis=-1))


def skill(counts: np.ndarray) -> np.ndarray:
    """Return the Brier skill: 1 for perfect beliefs, 0 for always stating the base rate."""
    return 1 - _ratio(brier(counts), uncertainty(counts))


def reliability_term(counts: np.ndarray) -> np.ndarray:
    """Return Murphy's reliability: the mean squared difference between a stated likelihood and the share of beliefs
    with it that were true; 0 is best."""
    share = _ratio(counts[..., TRUE], counts[..., STATED])
    return _weighted((share - P) ** 2, counts)


def resolution(counts: np.ndarray) -> np.ndarray:
    """Return Murphy's resolution: how much the share of true beliefs differs between stated likelihoods; more is
    better."""
    share = _ratio(counts[..., TRUE], counts[..., STATED])
    return _weighted((share - base_rate(counts)[..., None]) ** 2, counts)


def uncertainty(counts: np.ndarray) -> np.ndarray:
    """Return Murphy's uncertainty, the Brier score of always stating the base rate."""
    rate = base_rate(counts)
    return rate * (1 - rate)


def debiased_calibration_error(counts: np.ndarray, squares: np.ndarray) -> np.ndarray:
    """Return the squared calibration error, corrected for the part that chance alone causes; it may be below 0.

    `squares`, (..., 21, 3), are sums over houses of true^2, true * stated and stated^2 (`square_sums`), because the
    beliefs of one house are not independent. If each house has one belief, this is Kumar's formula. Values of the scale
    that were stated in fewer than two houses are left out.
    """
    stated, true = counts[..., STATED], counts[..., TRUE]
    share = _ratio(true, stated)
    spread = squares[..., 0] - 2 * share * squares[..., 1] + share**2 * squares[..., 2]
    effective = _ratio(stated**2, squares[..., 2])  # number of houses, if they are equally large
    variance = _ratio(spread, stated**2) * _ratio(effective, effective - 1)
    is_known = effective > 1 + 1e-9
    terms = np.where(is_known, (share - P) ** 2 - variance, 0.0)
    weights = np.where(is_known, stated, 0.0)
    return _ratio((weights * terms).sum(axis=-1), weights.sum(axis=-1))


def square_sums(counts: np.ndarray) -> np.ndarray:
    """Return, for each house and value of the scale, true^2, true * stated and stated^2 (..., 21, 3) from its two
    counts."""
    stated, true = counts[..., STATED], counts[..., TRUE]
    return np.stack([true**2, true * stated, stated**2], axis=-1)


def auroc(counts: np.ndarray) -> np.ndarray:
    """Return the chance that a true belief has a higher stated likelihood than a false one.

    Ties count half; NaN unless there are both true and false beliefs.
    """
    true = counts[..., TRUE]
    false = counts[..., STATED] - true
    below = np.cumsum(false, axis=-1) - false
    return _ratio((true * (below + false / 2)).sum(axis=-1), true.sum(axis=-1) * false.sum(axis=-1))


def risk_coverage(counts: np.ndarray) -> np.ndarray:
    """Return how well sureness separates right from wrong beliefs: 1 at best, 0 for a random order; NaN if no belief is
    wrong.

    The beliefs are sorted by their sureness |p - 1/2|; beliefs of equal sureness are in random order. The area under
    the share of wrong beliefs is compared with the areas of the best order and of a random order. A belief of 1/2
    counts as half wrong.
    """
    stated, true = counts[..., STATED], counts[..., TRUE]
    wrong = np.where(P > 0.5, stated - true, np.where(P < 0.5, true, stated / 2))
    half = SCALE // 2
    n = np.stack([_mirrored(stated, half, step) for step in range(half, -1, -1)], axis=-1)
    e = np.stack([_mirrored(wrong, half, step) for step in range(half, -1, -1)], axis=-1)
    total = n.sum(axis=-1)
    n, e = _ratio(n, total[..., None]), _ratio(e, total[..., None])
    covered, errors = np.cumsum(n, axis=-1) - n, np.cumsum(e, axis=-1) - e
    rate = _ratio(e, n)
    growth = np.log1p(_ratio(n, covered, 0.0))
    area = np.where(n > 0, np.nan_to_num(rate) * n + (errors - np.nan_to_num(rate) * covered) * growth, 0.0)
    risk = e.sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        best = risk + (1 - risk) * np.log1p(-risk)
    best = np.where(risk >= 1, 1.0, best)
    return 1 - _ratio(area.sum(axis=-1) - best, risk - best)


def _mirrored(values: np.ndarray, half: int, step: int) -> np.ndarray:
    return values[..., half] if step == 0 else values[..., half - step] + values[..., half + step]


def _weighted(terms: np.ndarray, counts: np.ndarray) -> np.ndarray:
    stated = counts[..., STATED]
    return _ratio((stated * np.nan_to_num(terms)).sum(axis=-1), stated.sum(axis=-1))


def _ratio(top: np.ndarray, bottom: np.ndarray, otherwise: float = np.nan) -> np.ndarray:
    """Return top / bottom; `otherwise` where bottom is 0."""
    top, bottom = np.broadcast_arrays(np.asarray(top, dtype=float), np.asarray(bottom, dtype=float))
    return np.divide(top, bottom, out=np.full(top.shape, otherwise), where=bottom != 0)


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
