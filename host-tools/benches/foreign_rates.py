"""greyrig on recordings at any rate, from motors of a simulation that shares nothing with the project.

    python3 -m venv venv
    venv/bin/pip install numpy scipy numba
    venv/bin/python host-tools/benches/foreign_rates.py target/release/greyrig --seed 1

Each case draws the sampling interval (0.01 to 50 ms), L/R (0.05 to 20 ms), the motor, what the voltage does between the samples
(held, straight, or smooth as of a sine) and how it goes (steps, ramps, pseudo-random levels, a sine within a third of the Nyquist
rate). Classical Runge-Kutta, in steps of a fiftieth of the fastest time constant:

    u = R i + drop(i) + K phi w + L di/dt      J dw/dt = K phi i - mu0 sign(w) - mu1 w - mu2 w |w|,      phi = 1, or i in a series motor

Four questions:

    compare    the model with the true parameters, against a free run of the same samples here: ratio of their errors
    identify   R, K, J: are they within their intervals, and how wide are these?
    healthy    is anything named?
    effect     current offset, dry friction, drop of the brushes, quadratic load: is it named, and nothing else?

"accused", "wrong name" and "with another" are wrong; "nothing" may be all that the recording shows: nobody has looked whether an
effect is large enough to stand out.
"""

import argparse
import json
import subprocess
import tempfile
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numba
import numpy as np
from scipy.interpolate import CubicSpline

INTERVALS = [1e-5, 1e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2]
R, L, K, J, MU0, MU1, MU2, DROP, WIDTH, SERIES = range(10)
NAMES = ["R", "L", "K", "J", "mu0", "mu1", "mu2"]


@numba.njit(cache=True)
def slopes(y, u, p, out):
    i, w = y
    phi = i if p[SERIES] > 0 else 1.0
    drop = p[DROP] * np.tanh(i / p[WIDTH])
    out[0] = (u - p[R] * i - drop - p[K] * phi * w) / p[L]
    driven = p[K] * phi * i - p[MU1] * w - p[MU2] * w * abs(w)
    if abs(w) < 1e-6 and abs(driven) <= p[MU0]:
        out[1] = 0.0
    else:
        out[1] = (driven - p[MU0] * (np.sign(w) if abs(w) > 1e-6 else np.sign(driven))) / p[J]


@numba.njit(cache=True)
def step(y, h, u0, u1, u2, p):
    a, b, c, d = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    slopes(y, u0, p, a)
    slopes(y + h / 2 * a, u1, p, b)
    slopes(y + h / 2 * b, u1, p, c)
    slopes(y + h * c, u2, p, d)
    return y + h / 6 * (a + 2 * b + 2 * c + d)


@numba.njit(cache=True)
def between(how, at, spline, wave, n, s):
    """Voltage a share `s` of an interval after sample `n`."""
    if how == 0:  # held
        return at[n]
    if how == 1:  # straight
        return at[n] + s * (at[n + 1] - at[n])
    if how == 2:  # a sine that swells three times
        x = n + s
        return wave[0] * (0.4 + 0.6 * abs(np.sin(3 * np.pi * x / wave[2]))) * np.sin(wave[1] * x)
    return ((spline[0, n] * s + spline[1, n]) * s + spline[2, n]) * s + spline[3, n]


@numba.njit(cache=True)
def run(how, at, spline, wave, fine, interval, p):
    """Current and speed at each sample. A step in which the rotor turns round ends there, so that friction turns round with it."""
    y, h = np.zeros(2), interval / fine
    current, speed = np.zeros(at.size), np.zeros(at.size)
    for n in range(at.size - 1):
        for q in range(fine):
            u0 = between(how, at, spline, wave, n, q / fine)
            u1 = between(how, at, spline, wave, n, (q + 0.5) / fine)
            u2 = between(how, at, spline, wave, n, (q + 1) / fine)
            new = step(y, h, u0, u1, u2, p)
            if y[1] * new[1] < 0:
                share = y[1] / (y[1] - new[1])
                a, b, c = u0 + share / 2 * (u2 - u0), u0 + share * (u2 - u0), u0 + (1 + share) / 2 * (u2 - u0)
                new = step(y, share * h, u0, a, b, p)
                new[1] = 0.0
                new = step(new, (1 - share) * h, b, c, u2, p)
            y = new
        current[n + 1], speed[n + 1] = y
    return current, speed


def motor(random, rate_of_l, series):
    """A motor of any size."""
    draw = lambda low, high: float(np.exp(random.uniform(np.log(low), np.log(high))))
    p = np.zeros(10)
    p[SERIES] = series
    if series:
        p[R], p[K], amplitude = draw(0.8, 8), draw(0.004, 0.03), 200.0
        p[L] = p[R] * rate_of_l
        stall = amplitude / p[R]
        usual = 0.15 * stall
        torque = p[K] * usual**2
        top = (amplitude - p[R] * usual) / (p[K] * usual)
    else:
        p[R], p[K], amplitude = draw(0.2, 5), draw(0.01, 0.2), float(random.choice([6.0, 12.0, 24.0, 48.0]))
        p[L] = p[R] * rate_of_l
        usual = 0.15 * amplitude / p[R]
        torque = p[K] * usual
        top = amplitude / p[K]
    p[WIDTH] = 0.03 * usual
    p[J] = draw(0.02, 0.3) * torque / top * 3
    p[MU0], p[MU1] = 0.4 * torque, 0.3 * torque / top
    if series:
        p[MU2], p[MU0] = 0.5 * torque / top**2, 0.15 * torque
    return p, amplitude, usual, top, torque


def voltage(random, how, samples, interval, amplitude, series):
    """At the samples, and the sine that it is."""
    levels = random.uniform(0.3, 1, 14) if series else random.uniform(-1, 1, 14)
    n = np.arange(samples)
    hold = max(1, samples // levels.size)
    wave = np.zeros(3)
    if how == "steps":
        at = levels[np.minimum(n // hold, levels.size - 1)]
    elif how == "ramps":
        at = np.interp(n / hold, np.arange(levels.size), levels)
    elif how == "prbs":
        least = max(1, int(round(0.02 / interval)))
        changes = np.cumsum(random.integers(1, 8, samples) * least)
        sizes = random.uniform(0.3, 1, samples) * (1 if series else random.choice([-1, 1], samples))
        at = sizes[np.searchsorted(changes, n, side="right")]
    else:
        hertz = min(50.0 if series else 5.0, 1 / interval / 16)
        wave = np.array([amplitude, 2 * np.pi * hertz * interval, samples])
        at = (0.4 + 0.6 * np.abs(np.sin(3 * np.pi * n / samples))) * np.sin(wave[1] * n)
    return amplitude * at, wave


def record(path, case):
    random = np.random.default_rng(case["seed"])
    interval = case["interval"]
    p, amplitude, usual, top, torque = motor(random, case["l_over_r"], case["series"])
    truth = case["truth"]
    offset = 0.0
    if truth == "current_offset":
        offset = float(random.choice([-1, 1]) * random.uniform(0.05, 0.3) * usual)
    if truth == "brush_drop":
        p[DROP] = amplitude * random.uniform(0.04, 0.12)
    if truth == "quadratic_load":
        p[MU2] += random.uniform(0.6, 1.5) * torque / top**2
    seconds = min(max(14 * 12 * max(p[J] * top / torque / 3, 0.02, 3 * p[L] / p[R]), 60 * interval * 14), 60.0)
    samples = int(min(seconds / interval, 60_000)) + 1
    fastest = p[L] / p[R] / (1 + p[DROP] / p[WIDTH] / p[R])
    fine = max(2, int(np.ceil(interval / fastest * 5)))
    at, wave = voltage(random, case["how"], samples, interval, amplitude, case["series"])
    spline = CubicSpline(np.arange(samples), at).c if case["pushed"] == "smooth" else np.zeros((4, 1))
    pushed = {"held": 0, "straight": 1, "smooth": 2}[case["pushed"]]
    i, w = run(pushed, at, spline, wave, fine, interval, p)
    # The same plant, fed with nothing but the samples.
    again = run(3 if pushed == 2 else pushed, at, spline, wave, fine, interval, p)
    noise = np.array([0.003 * np.max(np.abs(i)), 0.001 * np.max(np.abs(w)) + 1e-3])
    white = random.standard_normal((2, samples))
    i, w = i + offset + noise[0] * white[0], w + noise[1] * white[1]
    kind = "universal" if case["series"] else "pm-dc"
    with open(path, "w") as file:
        file.write(f"# motor: {kind}\nt_s,u_v,i_a,omega_rad_s\n")
        np.savetxt(file, np.column_stack([np.arange(samples) * interval, at, i, w]), fmt="%.8g", delimiter=",")
    far = [np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2)) for a, b in zip(again, (i, w))]
    return p, offset, np.array(far), samples


def model(path, p, series):
    base = "full" if series else "dry-viscous"
    text = [f'schema = 1\nkind = "{"universal" if series else "pm-dc"}"\nbase = "{base}"\nmotion = "rotary"\n\n[filter]\norder = 4\ncutoff_hz = 250.0\n']
    units = {"J": "kg m2", "K": "V s/(rad A)" if series else "V s/rad", "R": "ohm", "L": "H", "mu0": "N m", "mu1": "N m s/rad", "mu2": "N m s2/rad2"}
    for name in ["J", "K", "R", "L", "mu0", "mu1"] + (["mu2"] if series else []):
        text.append(f'[parameters.{name}]\nvalue = {float(p[NAMES.index(name)])!r}\nunit = "{units[name]}"\nstatus = "fixed"\n')
    path.write_text("\n".join(text))


def ask(greyrig, *arguments):
    try:
        done = subprocess.run([greyrig, *arguments, "--json"], capture_output=True, text=True, timeout=300)
        return json.loads(done.stdout), done.stderr
    except json.JSONDecodeError:
        return None, done.stderr
    except subprocess.TimeoutExpired:
        return None, "takes more than 300 s"


def judge(case):
    folder, greyrig = case["folder"], case["greyrig"]
    run_path = folder / f"{case['seed']}.csv"
    p, offset, noise, samples = record(run_path, case)
    out = {"samples": samples}
    kind = ["--kind", "universal" if case["series"] else "pm-dc"]
    if case["truth"] == "healthy":
        model_path = folder / f"{case['seed']}.toml"
        model(model_path, p, case["series"])
        answer, error = ask(greyrig, "compare", str(run_path), "--model", str(model_path))
        out["compare"] = answer["per_recording"][0] if answer and "per_recording" in answer else error.strip().splitlines()[-1:]
        out["noise"] = noise.tolist()
        answer, error = ask(greyrig, "identify", *kind, str(run_path))
        found = {e["name"]: e for e in answer.get("parameters", [])} if answer else {}
        out["identify"] = found or error.strip().splitlines()[-1:]
    base = ["--base", "viscous" if not case["series"] else "full"] if case["truth"] == "coulomb_friction" else []
    answer, error = ask(greyrig, "diagnose", *kind, *base, str(run_path))
    if answer is None or "verdict" not in answer:
        out["verdict"], out["named"], out["why"] = "error", [], error.strip().splitlines()[-1:]
    else:
        out["verdict"], out["named"] = answer["verdict"]["kind"], answer["verdict"]["effects"]
        out["findings"] = [f["code"] for f in answer["data_findings"] if f["severity"] != "info"]
        out["classes"] = answer["classes"]
        floor = answer["noise_floor"] or {}
        out["over"] = max([answer["esr_after"][k] / floor[k] for k in floor if floor[k] and answer["esr_after"].get(k)], default=None)
    out["p"] = dict(zip(NAMES, p[:7].tolist())) | {"drop": float(p[DROP]), "offset": offset}
    if not case["keep"]:
        run_path.unlink()
    return case, out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("greyrig", help="the program")
    parser.add_argument("--seed", type=int, default=1, help="what is drawn")
    parser.add_argument("--cases", type=int, default=200, help="cases")
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    parser.add_argument("--only", type=int, nargs="*", default=[], help="seeds of single cases")
    parser.add_argument("--keep", type=Path, help="folder that keeps the recordings")
    parser.add_argument("--from", dest="first", type=int, default=0, help="number of the first case")
    parser.add_argument("--lines", action="store_true", help="a line for each case")
    args = parser.parse_args()
    random = np.random.default_rng(args.seed)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(args.jobs) as pool:
        cases = []
        if args.keep:
            args.keep.mkdir(parents=True, exist_ok=True)
        for number in range(args.cases):
            series = int(random.random() < 0.35)
            how = str(random.choice(["steps", "ramps", "prbs", "sine"]))
            truths = ["healthy"] * 4 + ["current_offset", "coulomb_friction", "brush_drop"] + ([] if series else ["quadratic_load"])
            truth = str(random.choice(truths))
            if series and truth == "coulomb_friction":
                truth = "healthy"
            cases.append(dict(
                greyrig=args.greyrig, folder=args.keep or Path(folder), keep=bool(args.keep), series=series, how=how, truth=truth,
                interval=float(random.choice(INTERVALS)), l_over_r=float(np.exp(random.uniform(np.log(5e-5), np.log(2e-2)))),
                pushed="smooth" if how == "sine" else "straight" if how == "ramps" else str(random.choice(["held", "straight"])),
                seed=args.seed * 10_000 + number,
            ))
        cases = cases[args.first :]
        if args.only:
            cases = [case for case in cases if case["seed"] in args.only]
        table = defaultdict(lambda: defaultdict(int))
        inside = defaultdict(lambda: [0, 0, 0])
        ratios = []
        for case, out in pool.map(judge, cases):
            what = f"{case['seed']} {'series' if case['series'] else 'magnet'} {case['how']}/{case['pushed']} h={case['interval']:g} L/R={case['l_over_r']:.2g} {case['truth']}"
            truth = case["truth"]
            named = set(out["named"])
            members = [set(next((c for c in out.get("classes", []) if n in c), [n])) for n in named]
            if out["verdict"] == "error":
                figure = "error"
            elif truth == "healthy":
                figure = {"none": "right", "insufficient_data": "insufficient"}.get(out["verdict"], "accused")
            elif out["verdict"] == "missing_effect":
                right = any(truth in m for m in members)
                figure = "right" if right and len(named) == 1 else "with another" if right else "wrong name"
            else:
                figure = {"none": "nothing", "insufficient_data": "insufficient"}.get(out["verdict"], out["verdict"])
            table[truth][figure] += 1
            line = f"{what}: {figure} {' '.join(sorted(named))} over={out.get('over')} {out.get('findings', '')} {out.get('why', '')}"
            if truth == "healthy":
                got = out["compare"]
                if isinstance(got, dict):
                    errors = [got["esr"].get("current"), got["esr"].get("speed")]
                    ratio = [a / b if a is not None and b else None for a, b in zip(errors, out["noise"])]
                    ratios.append(max((r for r in ratio if r), default=np.nan))
                    line += f" | compare {ratio}"
                else:
                    line += f" | compare failed {got}"
                if isinstance(out["identify"], dict):
                    for name in ["R", "K", "J"]:
                        e = out["identify"].get(name)
                        if e is None:
                            continue
                        if e.get("ci95") is None:
                            inside[name][2] += 1
                            line += f" {name} no interval"
                        else:
                            low, high = e["ci95"]
                            ok = low <= out["p"][name] <= high
                            inside[name][0 if ok else 1] += 1
                            if not ok:
                                line += f" {name}={out['p'][name]:.4g} outside {low:.4g}..{high:.4g}"
                else:
                    line += f" | identify failed {out['identify']}"
            if args.lines or figure not in ("right",) or "outside" in line or "failed" in line:
                print(line, flush=True)
    print()
    for truth, figures in table.items():
        print(f"{truth}: " + ", ".join(f"{name} {count}" for name, count in sorted(figures.items())))
    for name, (yes, no, none) in inside.items():
        print(f"{name} within its interval {yes} of {yes + no}, without one {none}")
    if ratios:
        print("compare over noise: median, 90 %, largest", np.nanpercentile(ratios, [50, 90, 100]).round(2))


if __name__ == "__main__":
    main()
