#!/usr/bin/env python3
"""Reference values for the Butterworth filter, from scipy.

    python3 -m venv venv && venv/bin/pip install scipy==1.17.1
    venv/bin/python tests/core/butterworth_scipy.py

writes two tables beside itself:

butterworth_scipy.csv           second-order sections of scipy.signal.butter(..., output='sos')
butterworth_scipy_response.csv  impulse and step response of those sections, and the first sample from which the
                                step response stays within 0.1 % of one
"""

import csv
import pathlib

import numpy
from scipy.signal import butter, sosfilt

HERE = pathlib.Path(__file__).parent
SETTLED = 1e-3
CASES = [
    (1, 250.0, 10e3),
    (2, 250.0, 10e3),
    (3, 250.0, 10e3),
    (4, 250.0, 10e3),
    (5, 250.0, 10e3),
    (6, 250.0, 10e3),
    (7, 250.0, 10e3),
    (8, 250.0, 10e3),
    (4, 10.0, 10e3),
    (2, 50.0, 1e3),
    (3, 20.0, 48e3),
    (4, 1.0, 10e3),
    (4, 2400.0, 10e3),
    (5, 12e3, 50e3),
    (8, 4800.0, 10e3),
    (8, 10.0, 10e3),
]
SAMPLES = [0, 1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233, 377, 610, 987]


def main():
    with open(HERE / "butterworth_scipy.csv", "w", newline="") as sections, open(
        HERE / "butterworth_scipy_response.csv", "w", newline=""
    ) as responses:
        sections = csv.writer(sections, lineterminator="\n")
        responses = csv.writer(responses, lineterminator="\n")
        sections.writerow("order cutoff_hz sample_rate_hz section b0 b1 b2 a0 a1 a2".split())
        responses.writerow("order cutoff_hz sample_rate_hz sample impulse step settling_samples".split())
        for order, cutoff, rate in CASES:
            sos = butter(order, cutoff, fs=rate, output="sos")
            for i, row in enumerate(sos):
                sections.writerow([order, cutoff, rate, i, *(repr(float(v)) for v in row)])
            impulse = numpy.zeros(int(20 * rate / cutoff) + 2000)
            impulse[0] = 1.0
            step = sosfilt(sos, numpy.ones_like(impulse))
            impulse = sosfilt(sos, impulse)
            outside = numpy.flatnonzero(abs(step - 1.0) > SETTLED)
            settling = int(outside[-1]) + 1 if outside.size else 0
            for n in SAMPLES:
                responses.writerow([order, cutoff, rate, n, repr(float(impulse[n])), repr(float(step[n])), settling])


if __name__ == "__main__":
    main()
