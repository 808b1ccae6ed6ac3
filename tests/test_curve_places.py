"""At how many places free curves are screened."""

from types import SimpleNamespace

import pytest

from forklift.diagnosis.criteria import CURVE_NEAR, CURVES_AT, MOST_PLACES
from forklift.diagnosis.curves import credible


@pytest.mark.parametrize(
    ("near", "screened"),
    [(1, CURVES_AT), (CURVES_AT + 2, CURVES_AT + 2), (MOST_PLACES + 3, MOST_PLACES)],
    ids=["one stands out", "six are alike", "all are alike"],
)
def test_every_place_that_is_nearly_as_credible_as_the_first_is_asked(near, screened):
    evidences = [100.0 * (CURVE_NEAR + 0.01) if k else 100.0 for k in range(near)]
    evidences += [100.0 * (CURVE_NEAR - 0.01)] * 12
    inputs = [SimpleNamespace(evidence=one) for one in evidences]
    assert list(credible(inputs)) == inputs[:screened]
