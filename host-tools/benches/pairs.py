"""One effect, and every other one beside it.

    cargo build --release -p greyrig-host --bin greyrig
    python3 host-tools/benches/pairs.py target/release/greyrig saturation:froelich=0.5 --seeds 1,2,3,4

A universal motor of the lot with an effect of the size that is asked for, and another one of its usual size, is recorded for 8 s and
diagnosed. Lines: the verdicts that do not name exactly these two (or members of their classes).
"""

import argparse
import json
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

EFFECTS = (
    "inductance_saturation hysteresis eddy_current transformer_emf remanence brush_drop winding_temperature commutation_demagnetisation "
    "supply_dead_zone stribeck windage_exponent fan_dynamics iron_loss_drag stray_load_torque bearing_warmup current_offset "
    "voltage_offset current_compression channel_delay speed_lag"
).split()


def effect_of(argument):
    return argument.split("=")[0].split(":")[0]


def ask(greyrig, profile, first, second, seed):
    """Whether exactly these two are named, and the verdict."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "run.csv")
        motor = ["--profile", profile, "--seconds", "8", "--seed", seed, "--spread", "0.025"]
        simulate = [greyrig, "simulate", *motor, "--effect", first, "--effect", second, "--out", path]
        subprocess.run(simulate, check=True, capture_output=True)
        done = subprocess.run([greyrig, "diagnose", "--json", path], check=True, capture_output=True, text=True)
    answer = json.loads(done.stdout)
    verdict = answer["verdict"]
    members = [set(next((c for c in answer["classes"] if name in c), [name])) for name in verdict["effects"]]
    covered = all(any(effect_of(truth) in m for m in members) for truth in (first, second))
    return covered and len(members) == 2 and verdict["kind"] == "missing_effect", verdict


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("greyrig", help="the program")
    parser.add_argument("effect", help="the effect, as greyrig simulate takes it")
    parser.add_argument("--seeds", default="1", help="motors")
    parser.add_argument("--profile", default="staircase", help="excitation")
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    args = parser.parse_args()
    others = [effect for effect in EFFECTS if effect != effect_of(args.effect)]
    cases = [(effect, seed) for seed in args.seeds.split(",") for effect in others]
    right = 0
    with ThreadPoolExecutor(args.jobs) as pool:
        answers = pool.map(lambda case: ask(args.greyrig, args.profile, args.effect, *case), cases)
        for (effect, seed), (is_right, verdict) in zip(cases, answers):
            right += is_right
            if not is_right:
                print(f"{effect}, motor {seed}: {verdict['kind']} {verdict['effects']}", flush=True)
    print(f"exactly these two: {right} of {len(cases)}")


if __name__ == "__main__":
    main()
