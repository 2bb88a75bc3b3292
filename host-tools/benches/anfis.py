"""CPU time and error of `greyrig anfis fit` beside other ANFIS trainers, on the same data.

    python3 -m venv venv && venv/bin/pip install numpy scipy fuzzytool anfis-toolbox
    cargo build --release -p greyrig-host
    venv/bin/python host-tools/benches/anfis.py --greyrig target/release/greyrig [--set scattered] [--peer numpy]

Everything runs on one thread. Times are CPU time (user and system) and leave reading the file out: for greyrig a run of
one epoch is subtracted. Peers: `numpy`, the hybrid method written out with numpy and Cholesky; `fuzzytool` and
`toolbox`, fuzzytool and anfis-toolbox of PyPI. All but fuzzytool start from the same bells. The sets are Jang's
three-input function, the Mackey-Glass series, and 100,000 scattered points.
"""

import argparse
import itertools
import json
import os
import resource
import subprocess
import sys
import tempfile

for pool in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[pool] = "1"
import numpy as np


def three_input():
    def table(grid):
        x = np.array(list(itertools.product(grid, repeat=3)))
        return x, (1 + np.sqrt(x[:, 0]) + 1 / x[:, 1] + x[:, 2] ** -1.5) ** 2

    return table(np.arange(1.0, 7.0)), table(np.arange(1.5, 6.0)), 2, (1.0, 6.0)


def mackey_glass():
    """Runge-Kutta, steps of 0.1, delay 17, history zero; the delayed value between steps is the mean of its neighbours."""
    x = np.zeros(11241)
    x[0] = 1.2
    slope = lambda v, d: 0.2 * d / (1 + d**10) - 0.1 * v
    for k in range(len(x) - 1):
        d0 = x[k - 170] if k >= 170 else 0.0
        d2 = x[k - 169] if k >= 169 else 0.0
        d1 = (d0 + d2) / 2
        a = slope(x[k], d0)
        b = slope(x[k] + 0.05 * a, d1)
        c = slope(x[k] + 0.05 * b, d1)
        d = slope(x[k] + 0.1 * c, d2)
        x[k + 1] = x[k] + (a + 2 * b + 2 * c + d) / 60
    x = x[::10]
    t = np.arange(118, 1118)
    rows, y = np.stack([x[t - 18], x[t - 12], x[t - 6], x[t]], 1), x[t + 6]
    return (rows[:500], y[:500]), (rows[500:], y[500:]), 2, (rows[:500].min(), rows[:500].max())


def scattered():
    def target(x):
        a, b, c = x.T
        wave = 0.6 * np.sin(np.pi * a) * np.cos(0.5 * np.pi * b)
        return wave + 0.3 * np.tanh(3 * c) * a**2 + 0.2 * b * c + 0.1 * np.sin(2 * np.pi * c)

    random = np.random.default_rng(1993)
    x = random.uniform(-1, 1, (100_000, 3))
    train = x, target(x) + random.normal(0, 0.01, len(x))
    x = random.uniform(-1, 1, (20_000, 3))
    return train, (x, target(x)), 3, (-1.0, 1.0)


SETS = {"three_input": (three_input, 200), "mackey_glass": (mackey_glass, 500), "scattered": (scattered, 20)}


PEERS = ["hybrid", "varpro", "numpy", "fuzzytool", "toolbox"]


def first_bells(inputs, functions, ends):
    bells = np.empty((inputs, functions, 3))
    bells[..., 0] = (ends[1] - ends[0]) / (functions - 1) / 2
    bells[..., 1] = 2
    bells[..., 2] = np.linspace(*ends, functions)
    return bells


class Numpy:
    """Jang's hybrid method: least squares with a ridge of 1e-6, then a step of length k down the gradient."""

    def __init__(self, bells):
        self.bells = bells.copy()
        inputs, functions = bells.shape[:2]
        self.grid = np.array(list(itertools.product(range(functions), repeat=inputs)))

    def layers(self, x):
        z = np.abs((x[:, :, None] - self.bells[..., 2]) / self.bells[..., 0])
        log = np.log(np.maximum(z, 1e-150))
        mu = 1 / (1 + np.exp(np.minimum(2 * self.bells[..., 1] * log, 500)))
        w = np.prod([mu[:, i, self.grid[:, i]] for i in range(x.shape[1])], 0)
        return mu, log, w / w.sum(1, keepdims=True)

    def output(self, x):
        share = self.layers(x)[2]
        return np.einsum("nr,nr->n", share, np.column_stack([x, np.ones(len(x))]) @ self.rules.T)

    def train(self, x, y, epochs, k=0.1):
        import scipy.linalg

        extended = np.column_stack([x, np.ones(len(x))])
        errors, raised, lowered, best = [], 0, 0, (np.inf, None, None)
        for epoch in range(epochs):
            mu, log, share = self.layers(x)
            a = (share[:, :, None] * extended[:, None]).reshape(len(x), -1)
            gram = a.T @ a
            gram[np.diag_indices_from(gram)] += 1e-6
            solution = scipy.linalg.cho_solve(scipy.linalg.cho_factor(gram), a.T @ y)
            self.rules = solution.reshape(len(self.grid), -1)
            f = extended @ self.rules.T
            o = (share * f).sum(1)
            errors.append(np.sqrt(np.mean((y - o) ** 2)))
            if errors[-1] < best[0]:
                best = errors[-1], self.bells.copy(), self.rules
            by_strength = (y - o)[:, None] * share * (f - o[:, None])
            down = np.zeros_like(self.bells)
            for i, j in itertools.product(*map(range, self.bells.shape[:2])):
                s = by_strength[:, self.grid[:, i] == j].sum(1) * (1 - mu[:, i, j])
                width, b, centre = self.bells[i, j]
                distance = x[:, i] - centre
                inverse = np.divide(1, distance, out=np.zeros_like(distance), where=distance != 0)
                down[i, j] = 2 * b / width * s.sum(), -2 * (s @ log[:, i, j]), 2 * b * (s @ inverse)
            self.bells += k * down / np.linalg.norm(down)
            fell = list(np.diff(errors[-5:]) < 0)
            if fell == [False, True, False, True] and epoch - lowered >= 4:
                k, lowered = 0.9 * k, epoch
            elif fell == [True] * 4 and epoch - raised >= 4:
                k, raised = 1.1 * k, epoch
        _, self.bells, self.rules = best


def cpu():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def rms(e):
    return float(np.sqrt(np.mean(e**2)))


def run_numpy(train, check, functions, ends, epochs):
    net = Numpy(first_bells(train[0].shape[1], functions, ends))
    start = cpu()
    net.train(*train, epochs)
    used = cpu() - start
    return used, rms(train[1] - net.output(train[0])), rms(check[1] - net.output(check[0]))


def run_toolbox(train, check, functions, ends, epochs):
    from anfis_toolbox import ANFISRegressor
    from anfis_toolbox.membership import BellMF

    bells = first_bells(train[0].shape[1], functions, ends)
    own = {i: [BellMF(a=a, b=b, c=c) for a, b, c in row] for i, row in enumerate(bells.tolist())}
    net = ANFISRegressor(inputs_config=own, optimizer="hybrid", learning_rate=0.1, epochs=epochs)
    start = cpu()
    net.fit(*train)
    used = cpu() - start
    return used, rms(train[1] - net.predict(train[0])), rms(check[1] - net.predict(check[0]))


def run_fuzzytool(train, check, functions, ends, epochs):
    from fuzzytool import ANFIS

    # Gaussians only, spread by itself; its step is not normalised, so it needs another size for each set.
    rate = 0.5 if len(train[1]) < 10_000 else 5
    net = ANFIS(train[0].shape[1], n_mf=functions, learning_rate=rate)
    start = cpu()
    net.fit(*train, epochs=epochs)
    used = cpu() - start
    return used, rms(train[1] - net.predict(train[0])), rms(check[1] - net.predict(check[0]))


def run_greyrig(program, method, files, functions, ends, epochs):
    def one(epochs):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = [program, "anfis", "fit", files[0], "--mfs", str(functions), "--epochs", str(epochs), "--json"]
        command += [f"--range={ends[0]!r}:{ends[1]!r}", "--method", method, "--keep", "training"]
        found = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, found

    base, _ = one(1)
    used, found = one(epochs + 1)
    done = len(found["epochs"]) - 1
    # With checking data: what is kept, and its error there. That run is not timed.
    command = [program, "anfis", "fit", files[0], "--check", files[1], "--mfs", str(functions), "--epochs", str(epochs)]
    command += [f"--range={ends[0]!r}:{ends[1]!r}", "--method", method, "--json"]
    kept = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
    return (used - base) / done * epochs, kept["rmse_trn"], kept["rmse_chk"]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--greyrig", required=True)
    parser.add_argument("--set", action="append", choices=SETS)
    parser.add_argument("--peer", action="append", choices=PEERS)
    parser.add_argument("--save", help="folder to leave the tables in")
    chosen = parser.parse_args()
    print("| data | trainer | CPU, ms an epoch | RMS error, training | checking |\n| --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.save or temporary
        for name in chosen.set or SETS:
            make, epochs = SETS[name]
            train, check, functions, ends = make()
            ends = float(ends[0]), float(ends[1])
            files = [os.path.join(folder, f"{name}_{part}.csv") for part in ("train", "check")]
            header = ",".join([f"x{i + 1}" for i in range(train[0].shape[1])] + ["y"])
            for file, (x, y) in zip(files, (train, check)):
                np.savetxt(file, np.column_stack([x, y]), delimiter=",", header=header, comments="", fmt="%.17g")
            for peer in chosen.peer or PEERS:
                if peer in ("toolbox", "fuzzytool"):
                    # Seconds an epoch on the large set.
                    count = min(epochs, 50) if len(train[1]) < 10_000 else 2
                    run = run_toolbox if peer == "toolbox" else run_fuzzytool
                    used, trn, chk = run(train, check, functions, ends, count)
                elif peer == "numpy":
                    count = epochs
                    used, trn, chk = run_numpy(train, check, functions, ends, count)
                else:
                    count = epochs
                    used, trn, chk = run_greyrig(chosen.greyrig, peer, files, functions, ends, count)
                label = f"greyrig, {peer}" if peer in ("hybrid", "varpro") else peer
                print(f"| {name} | {label}, {count} epochs | {1000 * used / count:.3g} | {trn:.5f} | {chk:.5f} |")
                sys.stdout.flush()


if __name__ == "__main__":
    main()
