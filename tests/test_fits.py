"""Fits (3.39), (3.40) and the filter through which velocities are told."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.signal import savgol_filter

from forklift import ForkliftError
from forklift.base.derivative import derivative
from forklift.fitting.metrics import nmse, nrmse, rmse

SIGNALS = arrays(np.float64, 20, elements=st.floats(-1e3, 1e3, width=32))


def test_a_perfect_simulation_fits_to_100_percent():
    y = np.array([0.0, -0.2, -0.5, -0.1])
    assert nmse(y, y) == 100.0
    assert nrmse(y, y) == 100.0
    assert rmse(y, y) == 0.0


def test_the_mean_fits_to_0_percent_and_worse_than_it_is_negative():
    y = np.array([0.0, -0.2, -0.5, -0.1])
    assert nmse(y, np.full(4, y.mean())) == pytest.approx(0.0, abs=1e-12)
    assert nrmse(y, -y) < 0


def test_the_fits_are_those_of_the_thesis_written_out():
    y, y_hat = np.array([1.0, 2.0, 4.0]), np.array([1.5, 2.0, 3.0])
    error, spread = 1.25, 14 / 3
    assert nmse(y, y_hat) == pytest.approx(100 * (1 - error / spread))
    assert nrmse(y, y_hat) == pytest.approx(100 * (1 - np.sqrt(error / spread)))
    assert rmse(y, y_hat) == pytest.approx(np.sqrt(error / 3))


def test_tables_5_4_and_5_5_hold_one_fit_each_way():
    """NMSE 98.0 % and NRMSE 85.8 % say the same error twice (first row of Table 5.4)."""
    rng = np.random.default_rng(1)
    y = rng.standard_normal(1000)
    noise = rng.standard_normal(1000)
    y_hat = y + noise * np.sqrt(0.02 * np.sum((y - y.mean()) ** 2) / np.sum(noise**2))
    assert nmse(y, y_hat) == pytest.approx(98.0)
    assert nrmse(y, y_hat) == pytest.approx(85.8, abs=0.1)


@given(SIGNALS, SIGNALS)
def test_one_fit_follows_from_the_other(y, y_hat):
    if np.ptp(y) > 1e-3:
        ratio = 1 - nmse(y, y_hat) / 100
        assert nrmse(y, y_hat) == pytest.approx(100 * (1 - np.sqrt(max(ratio, 0))), rel=1e-6, abs=1e-4)


@given(SIGNALS, SIGNALS, st.floats(0.1, 10), st.floats(-10, 10))
def test_fits_do_not_depend_on_unit_or_origin(y, y_hat, scale, offset):
    if np.ptp(y) > 1:
        assert nrmse(scale * y + offset, scale * y_hat + offset) == pytest.approx(
            nrmse(y, y_hat), rel=1e-6, abs=1e-6
        )


def test_missing_samples_are_left_out_of_error_and_mean_alike():
    y, y_hat = np.array([1.0, 2.0, np.nan, 4.0, 100.0]), np.array([1.5, 2.0, 7.0, 3.0, np.nan])
    assert nmse(y, y_hat) == nmse(y[[0, 1, 3]], y_hat[[0, 1, 3]])
    assert rmse(y, y_hat) == rmse(y[[0, 1, 3]], y_hat[[0, 1, 3]])


@pytest.mark.parametrize("y", [np.full(5, 1.95957), np.array([np.nan, 1.0]), np.array([])])
def test_a_constant_or_absent_signal_has_no_fit(y):
    assert np.isnan(nmse(y, np.zeros_like(y)))
    assert np.isnan(nrmse(y, np.zeros_like(y)))


def test_signals_of_different_length_are_refused():
    with pytest.raises(ForkliftError) as caught:
        nmse(np.zeros(3), np.zeros(4))
    assert caught.value.code == "argument-shape"


@given(arrays(np.float64, st.integers(11, 60), elements=st.floats(-10, 10, width=32)))
def test_the_derivative_is_scipys_savitzky_golay_filter_on_an_even_clock(signal):
    time = np.arange(len(signal)) * 0.02
    expected = savgol_filter(signal, 11, 2, deriv=1, delta=0.02)
    np.testing.assert_allclose(derivative(time, signal), expected, rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("value", [1.95957, 0.1, -1e-300, 3e6])
def test_a_constant_has_a_derivative_of_exactly_zero_and_no_fit(value):
    time = np.cumsum(np.linspace(0.018, 0.022, 40))
    slope = derivative(time, np.full(40, value))
    assert not slope.any()
    assert np.isnan(nrmse(slope, np.sin(time)))


@given(st.lists(st.floats(0.5, 1.5), min_size=11, max_size=60))
def test_a_parabola_is_differentiated_exactly_on_an_uneven_clock(gaps):
    time = np.cumsum(gaps) * 0.02
    np.testing.assert_allclose(derivative(time, 3 - 2 * time + 5 * time**2), -2 + 10 * time, atol=1e-7)


def test_a_gap_makes_those_derivatives_missing_that_need_it():
    time = np.arange(40) * 0.02
    signal = np.sin(time)
    signal[20] = np.nan
    missing = np.flatnonzero(np.isnan(derivative(time, signal)))
    assert missing.tolist() == list(range(15, 26))


def test_fewer_samples_than_the_filter_has_give_no_derivative():
    assert np.isnan(derivative(np.arange(10.0), np.arange(10.0))).all()
