"""Does the recording tell that a verdict asks for?

    cargo build --release -p greyrig-host --bin greyrig
    python3 host-tools/benches/next_recording.py target/release/greyrig universal --seeds 1,2

Every effect of its usual size on every profile of the virtual rig by itself. Where the verdict is ambiguous, outside the catalogue or
that the data are insufficient, the recording that it asks for is made of the same motor, and both are diagnosed together. Lines: what
was asked, the first verdict, the profiles that its words stand for, the second verdict; and verdicts of the first kind that are wrong.
"""

import argparse
import json
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

EFFECTS = {
    "universal": (
        "saturation inductance_saturation hysteresis eddy_current transformer_emf remanence armature_reaction brush_drop "
        "winding_temperature commutation_demagnetisation skin_effect supply_dead_zone stribeck windage_exponent fan_dynamics "
        "iron_loss_drag stray_load_torque bearing_warmup current_offset voltage_offset current_compression channel_delay speed_lag "
        "adc_clipping"
    ).split(),
    "pm-dc": (
        "brush_drop winding_temperature commutation_demagnetisation commutation_resistance skin_effect supply_dead_zone "
        "asymmetric_friction stribeck torque_offset quadratic_load stray_load_torque bearing_warmup current_offset voltage_offset "
        "current_compression channel_delay speed_lag adc_clipping"
    ).split(),
}
PROFILES = "staircase ramp dc-steps dc-ramp coast-down locked phase-angle steady start".split()
# Words of a verdict's next recording, the profile that has it, and another one where that is what there is already.
WORDS = [
    (("locked",), "locked", None),
    (("DC", "direct current"), "dc-steps", "dc-ramp"),
    (("coast", "supply open"), "coast-down", None),
    (("staircase", "free to turn", "amplitude", "several speeds"), "staircase", "ramp"),
]


def profiles_of(words, present):
    """The profiles that the words stand for, without the one that is present."""
    found = []
    for signs, profile, other in WORDS:
        if any(sign in (words or "") for sign in signs):
            found.append(other if profile == present else profile)
    return [profile for profile in found if profile not in (None, present)]


def is_right(answer, effect):
    """Whether this effect, or one of its class, is named and nothing else."""
    named, classes = answer["verdict"]["effects"], answer["classes"]
    members = [set(next((c for c in classes if name in c), [name])) for name in named]
    return answer["verdict"]["kind"] == "missing_effect" and len(members) == 1 and effect in members[0]


def ask(greyrig, kind, case):
    profile, effect, seed = case
    with tempfile.TemporaryDirectory() as folder:

        def record(profile):
            path = str(Path(folder) / f"{profile}.csv")
            motor = ["--kind", kind, "--effect", effect, "--seed", str(seed), "--spread", "0.025"]
            subprocess.run([greyrig, "simulate", "--profile", profile, *motor, "--out", path], check=True, capture_output=True)
            return path

        def diagnose(paths):
            done = subprocess.run([greyrig, "diagnose", "--json", "--kind", kind, *paths], check=True, capture_output=True, text=True)
            return json.loads(done.stdout)

        paths = [record(profile)]
        first = diagnose(paths)
        verdict = first["verdict"]
        if verdict["kind"] == "none" or is_right(first, effect):
            return None
        if verdict["kind"] == "missing_effect":
            return "wrong", f"{verdict['effects']}"
        more = profiles_of(verdict["next_experiment"], profile)
        second = diagnose(paths + [record(other) for other in more])
        told = f"{verdict['kind']} {verdict['effects']}, then with {' '.join(more)}: {second['verdict']['kind']} {second['verdict']['effects']}"
        return "told" if is_right(second, effect) else "not told", told


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("greyrig", help="the program")
    parser.add_argument("kind", choices=EFFECTS, help="kind of motor")
    parser.add_argument("--seeds", default="1", help="motors")
    parser.add_argument("--profiles", help="some profiles only")
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    args = parser.parse_args()
    profiles = args.profiles.split(",") if args.profiles else [p for p in PROFILES if args.kind == "universal" or p != "phase-angle"]
    cases = [(p, e, int(s)) for p in profiles for e in EFFECTS[args.kind] for s in args.seeds.split(",")]
    counts = {"told": 0, "not told": 0, "wrong": 0}
    with ThreadPoolExecutor(args.jobs) as pool:
        for case, answer in zip(cases, pool.map(lambda case: ask(args.greyrig, args.kind, case), cases)):
            if answer:
                counts[answer[0]] += 1
                print(f"{answer[0]}: {' '.join(map(str, case))}: {answer[1]}", flush=True)
    print(f"\n{len(cases)} cases: " + ", ".join(f"{name} {count}" for name, count in counts.items()))


if __name__ == "__main__":
    main()
