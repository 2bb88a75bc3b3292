"""The fit of `greyrig identify` with scipy: same recordings, equations, residuals, weights and start values.

    greyrig simulate --profile staircase --seconds 30 --seed 1 --out staircase.csv
    greyrig simulate --profile ramp --seconds 30 --seed 1 --out ramp.csv
    greyrig identify staircase.csv ramp.csv --method least-squares --json > start.json
    python scipy_identify.py --start start.json [--numba] staircase.csv ramp.csv

Reading the files and numba's compilation are not counted. For a universal motor that runs forward.
"""

import argparse
import json
import time

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import butter, sosfilt, sosfilt_zi

NAMES = ["R", "L", "K", "J", "mu0", "mu1", "mu2"]
CUTOFF_HZ = 250.0
SETTLING = 200  # samples not counted at the start


def simulate(u, h, i, current, speed, R, L, K, J, mu0, mu1, mu2):
    """Free run: RK4 with the voltage linear between samples; dry friction holds the rotor at rest."""
    w = 0.0
    current[0] = i
    speed[0] = w
    for n in range(1, len(u)):
        u0 = u[n - 1]
        u1 = u[n]
        um = 0.5 * (u0 + u1)
        moving = 1.0 if w > 0.0 or K * i * i > mu0 else 0.0
        a1 = (u0 - (R + K * w) * i) / L
        b1 = moving * (K * i * i - mu0 - (mu1 + mu2 * w) * w) / J
        x = i + 0.5 * h * a1
        y = w + 0.5 * h * b1
        a2 = (um - (R + K * y) * x) / L
        b2 = moving * (K * x * x - mu0 - (mu1 + mu2 * y) * y) / J
        x = i + 0.5 * h * a2
        y = w + 0.5 * h * b2
        a3 = (um - (R + K * y) * x) / L
        b3 = moving * (K * x * x - mu0 - (mu1 + mu2 * y) * y) / J
        x = i + h * a3
        y = w + h * b3
        a4 = (u1 - (R + K * y) * x) / L
        b4 = moving * (K * x * x - mu0 - (mu1 + mu2 * y) * y) / J
        i = i + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        w = w + h / 6.0 * (b1 + 2.0 * (b2 + b3) + b4)
        if w < 0.0:
            w = 0.0
        current[n] = i
        speed[n] = w


def read(path):
    """Voltage, current and speed at common instants, and the sampling interval."""
    meta, rows = {}, 0
    with open(path) as lines:
        for line in lines:
            rows += 1
            if not line.startswith("#"):
                header = line.strip().split(",")
                break
            key, _, value = line[1:].partition(":")
            meta[key.strip()] = value.strip()
    table = dict(zip(header, np.loadtxt(path, delimiter=",", skiprows=rows).T))
    h = float(meta["sample_time_s"])

    def earlier(x, key):
        return x - float(meta.get(key, 0.0)) / h * np.diff(x, prepend=x[0])

    return (table["u_v"], earlier(table["i_a"], "skew_i_a_s"),
            earlier(table["omega_rad_s"], "skew_omega_rad_s_s"), h)


def rows_of(signal, sos, every):
    """Filtered from its steady state, and decimated."""
    filtered, _ = sosfilt(sos, signal, zi=sosfilt_zi(sos) * signal[0])
    return filtered[::every][-(-SETTLING // every):]


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--start", required=True)
    arguments.add_argument("--numba", action="store_true")
    arguments.add_argument("recordings", nargs="+")
    arguments = arguments.parse_args()
    with open(arguments.start) as file:
        start = {p["name"]: p["value"] for p in json.load(file)["parameters"]}
    start = np.array([start[name] for name in NAMES])
    run = simulate
    if arguments.numba:
        import numba
        run = numba.njit(simulate)
        run(np.zeros(2), 1e-4, 0.0, np.zeros(2), np.zeros(2), *start)
    data = [read(path) for path in arguments.recordings]

    began = time.perf_counter()
    runs = []
    for u, i, w, h in data:
        sos = butter(4, CUTOFF_HZ, fs=1.0 / h, output="sos")
        every = int(1.0 / h / (4.0 * CUTOFF_HZ) + 1e-6)
        # Python steps through a list faster than through an array.
        u = u if arguments.numba else u.tolist()
        runs.append((u, h, float(i[0]), sos, every, [rows_of(i, sos, every), rows_of(w, sos, every)]))
    simulations = 0

    def differences(values):
        nonlocal simulations
        simulations += 1
        parts = [[], []]
        for u, h, i, sos, every, measured in runs:
            make = (lambda n: np.empty(n)) if arguments.numba else (lambda n: [0.0] * n)
            states = [make(len(u)), make(len(u))]
            run(u, h, i, *states, *(float(v) for v in values))
            for part, state, m in zip(parts, states, measured):
                part.append(rows_of(np.asarray(state), sos, every) - m)
        return [np.concatenate(p) for p in parts]

    weights = [np.sqrt(np.mean(np.concatenate([r[5][k] for r in runs]) ** 2)) for k in range(2)]
    theta = np.ones(len(NAMES))
    for _ in range(2):
        result = least_squares(
            lambda t: np.concatenate([d / s for d, s in zip(differences(t * start), weights)]),
            theta, jac="2-point", diff_step=1e-6, method="lm", ftol=1e-9, xtol=1e-9)
        theta = result.x
        weights = [np.sqrt(np.mean(d ** 2)) for d in differences(theta * start)]
    seconds = time.perf_counter() - began
    print(json.dumps({"seconds": round(seconds, 3), "simulations": simulations,
                      "parameters": dict(zip(NAMES, (theta * start).tolist()))}))


if __name__ == "__main__":
    main()
