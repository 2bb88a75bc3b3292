"""PySINDy on the cases of greyrig's examination: FROLS and STLSQ on a library of physical terms.

    python3 -m venv venv
    venv/bin/pip install pysindy numpy scipy
    greyrig-exam --cases 100 --only none-ac,one-ac,withheld-ac,two-ac,three-ac --export cases
    OMP_NUM_THREADS=1 venv/bin/python pysindy_exam.py cases --out pysindy.json

What an expert adds to PySINDy, so that it can do as well as it can:

- The equations u = R i + L di/dt + K i w + E and 0 = K i^2 - J dw/dt - mu0 - mu1 w - mu2 w|w| + M are regressed together, in
  three blocks of rows: the electrical one after a Butterworth filter of 250 Hz, the mechanical one as an integral over 100 ms,
  and the mechanical one again in a band about 100 Hz. Products are formed before the filters. Each block is divided by the
  noise that the samples themselves show.
- The terms of the base model are always kept: library and target are projected off them.
- Where physics ties E to M (flux, current sensor, speed sensor) a library column has both.
- The model is the smallest within 0.03 of the best R^2 on the held-out third of the rows.
- Flat tops of a channel are looked for before any regression, as PySINDy cannot know of them, and left out.

PySINDy knows nothing of signs: a coefficient may have either. Reading files is not counted in the time.
"""

import argparse
import json
import time
import warnings
from multiprocessing import Pool
from pathlib import Path

import numpy as np
import pysindy as ps
from scipy.signal import butter, lfilter, sosfilt, sosfiltfilt

warnings.filterwarnings("ignore")

# Nameplate of the type, as printed on every unit of it.
PEAK_A, SPEED = 9.19, 3456.0
CUTOFF_HZ, KEEP = 250.0, 10  # electrical rows; every tenth after the filter
WINDOW_S, EDGE_S, STRIDE_S = 0.1, 0.02, 0.02  # integral form: window, mean over a mains period at its ends, distance
BAND_HZ = (35.0, 220.0)
TURNING = 30.0  # rad/s; below, dry friction may hold the rotor
BLOCK_S = 1.0 / 3.0  # every third block of this length validates
MAIN_SHARE = 0.6  # share of the inductance that belongs to the main flux, from the design
PARSIMONY = 0.03
MOST_TERMS = 8
CLASSES = [
    {"saturation", "armature_reaction"},
    {"iron_loss_drag", "stray_load_torque"},
    {"commutation_demagnetisation", "skin_effect"},
]
STANDS_OUT = 3.0


def same(a, b):
    return a == b or any(a in c and b in c for c in CLASSES)


# ---------------------------------------------------------------------------------------------------------------- signals


def load(path):
    with open(path) as file:
        skip = 0
        for line in file:
            if not line.startswith("#"):
                names = [c.split("[")[0].strip() for c in line.strip().split(",")]
                break
            skip += 1
    data = np.loadtxt(path, delimiter=",", skiprows=skip + 1)
    return {n: data[:, k] for k, n in enumerate(names)}


def clipped(x):
    """Samples at a flat top: at least three in a row at the extreme, more than in one sample of 10,000."""
    bad = np.zeros(len(x), bool)
    for sign in (1.0, -1.0):
        top = (sign * x) >= (sign * x).max() - 1e-9
        run = top & np.roll(top, 1) & np.roll(top, -1)
        run = run | np.roll(run, 1) | np.roll(run, -1)
        if run.sum() > 1e-4 * len(x):
            bad |= run
    return bad


def white_noise(x):
    """Standard deviation of a sample's noise: sixth differences, in pieces of which the median counts."""
    d = np.diff(x, 6) / np.sqrt(924.0)
    n = len(d) // 1000 * 1000
    return float(np.median(np.sqrt(np.mean(d[:n].reshape(-1, 1000) ** 2, axis=1))))


def play(x, r):
    """Play operator of radius r."""
    y = np.empty_like(x)
    last = 0.0
    for n, v in enumerate(x.tolist()):
        if v - r > last:
            last = v - r
        elif v + r < last:
            last = v + r
        y[n] = last
    return y


def lag(x, tau, h, start=None):
    """First-order lag, exact for a straight line between samples up to half a step."""
    a = np.exp(-h / tau)
    first = x[0] if start is None else start
    return lfilter([0.0, 1.0 - a], [1.0, -a], x, zi=[a * first])[0]


class Run:
    """A recording and the linear forms of its equations."""

    def __init__(self, data):
        self.t, self.u, self.i, self.w = (data[k] for k in ("t_s", "u_v", "i_a", "omega_rad_s"))
        self.h = self.t[1] - self.t[0]
        h, n = self.h, len(self.t)
        self.bad = clipped(self.i)
        self.low = butter(4, CUTOFF_HZ, fs=1.0 / h, output="sos")
        self.band = butter(2, BAND_HZ, "band", fs=1.0 / h, output="sos")
        self.smooth = sosfiltfilt(butter(2, 150.0, fs=1.0 / h, output="sos"), self.w)  # for terms with the acceleration
        # Electrical rows, and those of the 100 Hz band.
        settled = int(0.05 / h)
        self.rows = np.arange(settled, n - 1, KEEP)
        spoilt = np.convolve(self.bad, np.ones(int(0.006 / h)))[:n] > 0  # the filter's memory
        self.rows = self.rows[~spoilt[self.rows]]
        turning = self.w > TURNING
        self.fast_rows = self.rows[turning[self.rows]]
        if self.bad.any():
            spoilt = np.convolve(self.bad, np.ones(int(0.03 / h)))[:n] > 0
            self.fast_rows = self.fast_rows[~spoilt[self.fast_rows]]
        # Windows.
        self.window, self.edge = round(WINDOW_S / h), round(EDGE_S / h)
        span = self.window + self.edge
        ends = np.arange(span + settled, n - 1, round(STRIDE_S / h))
        still = np.concatenate([[0], np.cumsum(~turning | self.bad)])
        self.ends = ends[still[ends] == still[ends - span]]

    def electrical(self, level=None, rate=None):
        """Rows of a column of the voltage: a term, and one whose derivative counts."""
        x = np.zeros(len(self.t) - 1)
        if level is not None:
            x += 0.5 * (level[1:] + level[:-1])
        if rate is not None:
            x += np.diff(rate) / self.h
        return sosfilt(self.low, x)[self.rows - 1]

    def fast(self, level=None, rate=None):
        x = np.zeros(len(self.t) - 1)
        if level is not None:
            x += 0.5 * (level[1:] + level[:-1])
        if rate is not None:
            x += np.diff(rate) / self.h
        return sosfilt(self.band, x)[self.fast_rows - 1]

    def slow(self, level=None, rate=None):
        """The integral over a window, per second of it, with both ends averaged over a mains period."""
        out = np.zeros(len(self.ends))
        m, e, n = self.window, self.edge, self.ends
        if level is not None:
            s = np.concatenate([[0.0], np.cumsum(0.5 * (level[1:] + level[:-1]))])
            ss = np.concatenate([[0.0], np.cumsum(0.5 * (s[1:] + s[:-1]))])
            out += ((ss[n] - ss[n - e]) - (ss[n - m] - ss[n - m - e])) / (e * m)
        if rate is not None:
            s = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]))])
            out += ((s[n] - s[n - e]) - (s[n - m] - s[n - m - e])) / (e * m * self.h)
        return out

    def column(self, e=None, de=None, m=None, dm=None):
        """Blocks of a column: e + d(de)/dt in the voltage, m + d(dm)/dt in the torque."""
        return [
            self.electrical(e, de) if e is not None or de is not None else np.zeros(len(self.rows)),
            self.slow(m, dm) if m is not None or dm is not None else np.zeros(len(self.ends)),
            self.fast(m, dm) if m is not None or dm is not None else np.zeros(len(self.fast_rows)),
        ]

    def base(self):
        u, i, w = self.u, self.i, self.w
        one = np.ones_like(i)
        target = self.column(e=u)
        columns = [
            self.column(e=i),
            self.column(de=i),
            self.column(e=i * w, m=-i * i),
            self.column(dm=w),
            self.column(m=one),
            self.column(m=w),
            self.column(m=w * np.abs(w)),
        ]
        return target, columns

    def floors(self, p):
        """What the noise of the samples leaves in each block, by the same forms."""
        R, L, K, J = p[:4]
        rng = np.random.default_rng(0)
        su, si, sw = (white_noise(x) for x in (self.u, self.i, self.w))
        nu, ni, nw = (s * rng.standard_normal(len(self.t)) for s in (su, si, sw))
        clean = self.column(
            e=nu - R * ni - K * (ni * self.smooth + self.i * nw), de=-L * ni, m=2 * K * self.i * ni, dm=-J * nw
        )
        return [float(np.sqrt(np.mean(c**2))) for c in clean]

    def validates(self):
        held = lambda rows: (np.floor(self.t[rows] / BLOCK_S).astype(int) % 3) == 2
        # A window counts where its middle lies.
        return [held(self.rows), held(self.ends - (self.window + self.edge) // 2), held(self.fast_rows)]


def library(run, p):
    """Columns of the effects: (identifier, text, blocks). R, L, K, J from the fit of the base model."""
    R, L, K, J, mu0, mu1, mu2 = p
    t, u, i, w, h = run.t, run.u, run.i, run.w, run.h
    Lm = MAIN_SHARE * L
    z = i / PEAK_A
    a = np.abs(w)
    out = []

    def add(effect, text, **parts):
        out.append((effect, text, run.column(**parts)))

    def flux(effect, text, d, inductive=True):
        """A change d of the flux, in amperes: back-EMF, torque, and the inductance of the main path."""
        add(effect, text, e=K * w * d, de=Lm * d if inductive else None, m=-K * i * d)

    def sensor(effect, text, d):
        """The current is i + d: resistance, inductance, back-EMF and torque see it."""
        add(effect, text, e=(R + K * w) * d, de=L * d, m=-2 * K * i * d)

    for n, knee in ((2.0, 0.5), (2.0, 1.0), (3.0, 0.7), (3.0, 1.2)):
        flux("saturation", f"saturation n={n} knee={knee}", -i * (1 - (1 + np.abs(z / knee) ** n) ** (-1 / n)))
    flux("armature_reaction", "armature reaction", -i * z * z / (1 + z * z), inductive=False)
    for c in (0.35, 0.6, 1.0):
        q = z / c
        add("inductance_saturation", f"L(i) knee={c}", de=-L * PEAK_A * c * (q - np.arctan(q)))
    for r in (0.05, 0.15, 0.4, 0.8):
        flux("hysteresis", f"play {r} A", play(i, r) - i)
    # A lag by a time that is short against the filter; central differences of the smoothed current.
    di = np.gradient(sosfiltfilt(butter(2, 1000.0, fs=1 / h, output="sos"), i), h)
    flux("eddy_current", "flux lag", -di)
    for wt in (600.0, 1500.0):
        flux("transformer_emf", f"flux lag fading at {wt:.0f}", -di / (1 + a / wt))
    flux("remanence", "remanence", np.ones_like(i), inductive=False)
    for c in (0.02, 0.05):
        add("brush_drop", f"brush drop {c}", e=i / np.sqrt(i * i + (c * PEAK_A) ** 2))
    for tau in (10.0, 30.0):
        add("winding_temperature", f"heat {tau:.0f} s", e=i * lag(i * i, tau, h, 0.0))
    add("commutation_demagnetisation", "flux falls with speed", e=-K * i * a * w / SPEED, m=K * i * i * a / SPEED)
    add("skin_effect", "R w^2", e=i * (w / SPEED) ** 2)
    for d in (1.0, 3.0, 6.0):
        add("supply_dead_zone", f"dead zone {d} V", e=np.clip(u, -d, d))
    for ws in (70.0, 140.0, 280.0):
        add("stribeck", f"Stribeck {ws:.0f}", m=1 / (1 + (w / ws) ** 2))
    for x in (2.5, 3.0):
        add("windage_exponent", f"w^{x}", m=np.sign(w) * (a / SPEED) ** x)
    for tau in (0.05, 0.1, 0.2, 0.3):
        add("fan_dynamics", f"flow lag {tau} s", m=(lag(w, tau, h) - w) * a / SPEED**2)
    for x in (1.6, 2.0):
        add("iron_loss_drag", f"|i|^{x}", m=np.abs(z) ** x * (1.0 if x < 2.0 else w / SPEED))
    add("stray_load_torque", "i^2 w^1.3", m=z * z * (a / SPEED) ** 1.3)
    cold = np.exp(-t / 15.0)
    add("bearing_warmup", "warm-up", m=cold * (1 + w * 5e-4))
    add("bearing_warmup", "warm-up of viscous friction", m=cold * w / SPEED)
    sensor("current_offset", "current offset", np.ones_like(i))
    add("voltage_offset", "voltage offset", e=np.ones_like(i))
    sensor("current_compression", "current compression", i * z * z)
    sensor("channel_delay", "current late", di)
    dw = np.gradient(run.smooth, h)
    add("speed_lag", "speed late", e=K * i * dw, m=(mu1 + 2 * mu2 * a) * dw, dm=J * dw)
    return out


# -------------------------------------------------------------------------------------------------------------- selection


def weighted(blocks, scale, keep=None):
    """A column: each block in units of its noise, with the weight of one."""
    parts = []
    for k, b in enumerate(blocks):
        x = b if keep is None else b[keep[k]]
        parts.append(x / (scale[k] * np.sqrt(max(len(x), 1))))
    return np.concatenate(parts)


def prepare(run):
    target, base = run.base()
    validation = run.validates()
    train = [~v for v in validation]
    rough = [max(np.sqrt(np.mean(target[0] ** 2)), 1e-9), 0.1, 0.1]
    for _ in range(2):
        B = np.stack([weighted(c, rough, train) for c in base], axis=1)
        norm = np.linalg.norm(B, axis=0)
        p = np.linalg.lstsq(B / norm, weighted(target, rough, train), rcond=None)[0] / norm
        scale = run.floors(p)
        rough = scale
    return target, base, train, validation, p, scale


def compress(X, y):
    """The triangular factor of [X y]: all inner products, which is all that the optimizers use, in as many rows as columns."""
    r = np.linalg.qr(np.column_stack([X, y]), mode="r")
    return r[:, :-1], r[:, -1]


class Problem:
    def __init__(self, run, exclude):
        self.target, self.base, self.train, self.validation, self.p, self.scale = prepare(run)
        self.terms = [x for x in library(run, self.p) if x[0] not in exclude]
        y = weighted(self.target, self.scale, self.train)
        B = np.stack([weighted(c, self.scale, self.train) for c in self.base], axis=1)
        T = np.stack([weighted(c, self.scale, self.train) for _, _, c in self.terms], axis=1)
        q, _ = np.linalg.qr(B / np.linalg.norm(B, axis=0))
        before = np.linalg.norm(T, axis=0)
        T = T - q @ (q.T @ T)
        T = T - q @ (q.T @ T)
        y = y - q @ (q.T @ y)
        self.norm = np.linalg.norm(T, axis=0)
        alive = self.norm > 1e-4 * before
        self.terms = [x for x, k in zip(self.terms, alive) if k]
        self.norm = self.norm[alive]
        self.X, self.y = compress(T[:, alive] / self.norm, y)
        self.B = B
        self.raw = weighted(self.target, self.scale, self.train)
        self.V = np.stack([weighted(c, self.scale, self.validation) for c in self.base], axis=1)
        self.vy = weighted(self.target, self.scale, self.validation)
        self.T = np.stack([weighted(c, self.scale, self.train) for _, _, c in self.terms], axis=1)
        self.VT = np.stack([weighted(c, self.scale, self.validation) for _, _, c in self.terms], axis=1)
        self.zero = self.error([])

    def fit(self, support):
        A = np.column_stack([self.B, self.T[:, support]]) if support else self.B
        n = np.linalg.norm(A, axis=0)
        return np.linalg.lstsq(A / n, self.raw, rcond=1e-12)[0] / n

    def error(self, support):
        """Mean square on the held-out rows, the blocks in units of their noise."""
        A = np.column_stack([self.V, self.VT[:, support]]) if support else self.V
        return float(np.sum((self.vy - A @ self.fit(support)) ** 2))

    def names(self, support):
        return list(dict.fromkeys(self.terms[k][0] for k in support))

    def choose(self, supports):
        """The smallest model within PARSIMONY of the best R^2; names count, not terms."""
        scored = [(len(set(self.names(s))), len(s), 1 - self.error(s) / self.zero, s) for s in supports]
        best = max(r for _, _, r, _ in scored)
        good = [x for x in scored if x[2] >= best - PARSIMONY]
        return min(good, key=lambda x: (x[0], x[1], -x[2]))


def frols(problem):
    opt = ps.FROLS(max_iter=MOST_TERMS, alpha=1e-10, unbias=False)
    opt.fit(problem.X, problem.y[:, None])
    supports, order = [[]], []
    for coef in opt.history_[1:]:
        order = order + [k for k in np.flatnonzero(coef[0]) if k not in order]
        supports.append(list(order))
    return problem.choose(supports)


def stlsq(problem):
    supports = {(): []}
    size = np.linalg.norm(problem.y)
    for alpha in (1e-6, 1e-4, 1e-2):
        for threshold in np.geomspace(1e-3, 1.0, 40):
            opt = ps.STLSQ(threshold=threshold * size, alpha=alpha, max_iter=50, unbias=True)
            opt.fit(problem.X, problem.y[:, None])
            coef = opt.coef_[0]
            chosen = sorted(np.flatnonzero(coef), key=lambda k: -abs(coef[k]))
            if len(chosen) <= 2 * MOST_TERMS:
                supports.setdefault(tuple(sorted(chosen)), [int(k) for k in chosen])
    names, terms, r2, chosen = problem.choose(list(supports.values()))
    # The first name is that of the term without which the error grows most.
    loss = {k: problem.error([j for j in chosen if j != k]) for k in chosen}
    return names, terms, r2, sorted(chosen, key=lambda k: -loss[k])


def equation_error(problem, held, p, support):
    """Residual over voltage, and over air-gap torque, on the held-out recording."""
    target, base = held.base()
    x = problem.fit(support)
    columns = {text: c for _, text, c in library(held, p)} if support else {}
    chosen = base + [columns[problem.terms[k][1]] for k in support]
    left = [target[b] - sum(c * col[b] for c, col in zip(x, chosen)) for b in range(3)]
    rms = lambda v: float(np.sqrt(np.mean(v**2)))
    return [rms(left[0]) / rms(target[0]), rms(left[1]) / rms(x[2] * base[2][1])]


def case(folder):
    truth = json.loads((folder / "truth.json").read_text())
    data = load(folder / truth["recordings"][0])
    held = Run(load(folder / truth["held_out"]))
    begin = time.perf_counter()
    run = Run(data)
    first = ["adc_clipping"] if run.bad.any() and "adc_clipping" not in truth["withheld"] else []
    problem = Problem(run, truth["withheld"])
    shared = time.perf_counter() - begin
    result = {k: truth[k] for k in ("seed", "truth", "effects", "base_error")}
    result["floors"] = problem.scale
    result["rest"] = problem.zero
    for name, method in (("FROLS", frols), ("STLSQ", stlsq)):
        begin = time.perf_counter()
        _, _, r2, support = method(problem)
        took = shared + time.perf_counter() - begin
        result[name] = {
            "named": first + problem.names(support),
            "terms": [problem.terms[k][1] for k in support],
            "r2": r2,
            "left": problem.error(support),
            "held_out_before": equation_error(problem, held, problem.p, []),
            "held_out_after": equation_error(problem, held, problem.p, support),
            "seconds": took,
        }
    return result


# ---------------------------------------------------------------------------------------------------------------- figures


def wilson(hits, n):
    n = max(n, 1)
    p, z = hits / n, 1.96
    centre = p + z * z / (2 * n)
    half = z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return [(centre - half) / (1 + z * z / n), (centre + half) / (1 + z * z / n)]


def share(flags):
    flags = list(flags)
    hits = int(sum(flags))
    low, high = wilson(hits, len(flags))
    return {"hits": hits, "cases": len(flags), "share": hits / max(len(flags), 1), "low": low, "high": high}


def figures(question, cases, method, healthy):
    out = lambda c: "adc_clipping" in c["truth"] or any(
        c["base_error"][k] >= STANDS_OUT * healthy[k] for k in range(2)
    )
    named = lambda c: c[method]["named"]
    first = lambda c: bool(named(c)) and any(same(named(c)[0], t) for t in c["truth"])
    hits = lambda c: sum(any(same(n, t) for n in named(c)) for t in c["truth"])
    exact = lambda c: len(named(c)) == len(c["truth"]) == hits(c)
    table = {}
    if question == "none":
        table["healthy accused"] = share(bool(named(c)) for c in cases)
    elif question == "one":
        seen = [c for c in cases if out(c)]
        table["right first"] = share(first(c) for c in seen)
        table["exact"] = share(exact(c) for c in seen)
        table["first name wrong"] = share(bool(named(c)) and not first(c) for c in seen)
        table["a false name among those given"] = share(len(named(c)) > hits(c) for c in seen)
        table["nothing named"] = share(not named(c) for c in seen)
    elif question == "withheld":
        seen = [c for c in cases if out(c)]
        table["confident wrong name"] = share(bool(named(c)) for c in seen)
    else:
        table["exact"] = share(exact(c) for c in cases)
        table["right first"] = share(first(c) for c in cases)
        total = sum(len(named(c)) for c in cases)
        table["precision"] = sum(hits(c) for c in cases) / max(total, 1)
        table["recall"] = sum(hits(c) for c in cases) / max(sum(len(c["truth"]) for c in cases), 1)
    median = lambda values: float(np.median(list(values)))
    for when in ("before", "after"):
        table[f"held-out error {when}, voltage"] = median(c[method][f"held_out_{when}"][0] for c in cases)
        table[f"held-out error {when}, torque"] = median(c[method][f"held_out_{when}"][1] for c in cases)
    table["seconds, median"] = median(c[method]["seconds"] for c in cases)
    table["seconds, longest"] = max(c[method]["seconds"] for c in cases)
    return table


def show(x):
    if isinstance(x, dict):
        return f"{100 * x['share']:.1f} % ({x['hits']}/{x['cases']}; {100 * x['low']:.1f} … {100 * x['high']:.1f} %)"
    return f"{x:.4g}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path, help="directory of greyrig-exam --export")
    parser.add_argument("--out", type=Path, help="all cases and figures as JSON")
    parser.add_argument("--most", type=int, default=10**9, help="cases of each question at most")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--wrong", action="store_true", help="print each case that is not exactly right")
    args = parser.parse_args()
    everything, healthy = {}, None
    order = ["none", "one", "withheld", "two", "three", "five"]
    folders = sorted((f for f in args.cases.iterdir() if f.is_dir()), key=lambda f: order.index(f.name.split("-")[0]))
    with Pool(args.jobs) as pool:
        for folder in folders:
            question = folder.name.split("-")[0]
            found = sorted((f for f in folder.iterdir() if (f / "truth.json").exists()), key=lambda f: int(f.name))
            cases = pool.map(case, found[: args.most], chunksize=1)
            if question == "none":
                healthy = [sorted(c["base_error"][k] for c in cases)[len(cases) // 2] for k in range(2)]
            tables = {m: figures(question, cases, m, healthy) for m in ("FROLS", "STLSQ")}
            everything[folder.name] = {"cases": cases, "figures": tables}
            print(f"## {folder.name} ({len(cases)} cases)\n\n| | FROLS | STLSQ |\n| --- | --- | --- |")
            for key in tables["FROLS"]:
                print(f"| {key} | {show(tables['FROLS'][key])} | {show(tables['STLSQ'][key])} |")
            print(flush=True)
            if args.wrong:
                for c in cases:
                    if question == "none" or not all(
                        set(c[m]["named"]) and all(any(same(n, t) for t in c["truth"]) for n in c[m]["named"])
                        and len(c[m]["named"]) == len(c["truth"]) for m in ("FROLS", "STLSQ")
                    ):
                        seen = question in ("none", "two", "three") or "adc_clipping" in c["truth"] or any(
                            c["base_error"][k] >= STANDS_OUT * healthy[k] for k in range(2))
                        print(c["seed"], " ".join(c["effects"]), "" if seen else "(small)", f"rest {c['rest']:.3g}")
                        for m in ("FROLS", "STLSQ"):
                            print(f"    {m} R2 {c[m]['r2']:.3f} left {c[m]['left']:.3g}", "; ".join(c[m]["terms"]))
    if args.out:
        args.out.write_text(json.dumps(everything, indent=1) + "\n")


if __name__ == "__main__":
    main()
