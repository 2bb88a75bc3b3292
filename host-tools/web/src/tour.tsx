// A first visit: a motor that hides something, and five steps to an error on the floor.
import { computed, effect, signal } from "@preact/signals";
import { percent } from "./format";
import { state } from "./server";
import { brush, present } from "./view";
import { diagnose, identify, tour } from "./work";

const brushed = signal(false);
effect(() => { if (brush.value) brushed.value = true; });
const dismissed = signal(false);
/** An error within this factor of the noise floor is on it, on a logarithmic scale of decades: a judgement by sight. */
const ON_THE_FLOOR = 3;

/** Whether the present version is as good as the data. */
const onFloor = computed(() => {
  const v = present.value;
  if (!v) return false;
  const signals = ["current", "speed"] as const;
  const near = signals.every((of) => v.held_out[of] == null || v.floor[of] == null || v.held_out[of]! <= ON_THE_FLOOR * v.floor[of]!);
  return near || v.diagnosis?.kind === "none";
});

const step = computed(() => {
  const now = state.value;
  if (!now?.versions.length) return 1;
  if (onFloor.value) return 5;
  if (!brushed.value && !now.versions.some((v) => v.diagnosis)) return 2;
  if (!present.value?.diagnosis) return 3;
  return 4;
});

export function Tour() {
  const told = state.value?.tour;
  if (!told || dismissed.value) return null;
  const busy = Boolean(state.value?.job), v = present.value;
  const rig = `greyrig simulate --profile staircase --seed ${told.seed} ${told.hidden.map((h) => `--effect ${h}`).join(" ")} --out staircase.csv`;
  const text = {
    1: <>Two recordings of a motor that hides something: a staircase to fit to, a ramp to judge on. <button class="small" disabled={busy} onClick={identify}>Identify the base model</button></>,
    2: <>The model does not follow: Δi is what it misses. Click a strongly coloured cell of a map below, and its instants light up in the signals.</>,
    3: <>So it fails at certain currents and speeds. Which physics would do that? <button class="small" disabled={busy} onClick={diagnose}>What is missing?</button></>,
    4: <>Rest the pointer on a candidate at the right: the model with it is drawn over the others. Then add what is named.</>,
    5: <>The error is at the noise floor: {percent(v?.held_out.current)} of the current, floor {percent(v?.floor.current)}. The motor hid <b>{told.hidden.join(", ")}</b>: <code>{rig}</code></>,
  }[step.value];
  return (
    <aside id="tour" data-step={step.value} aria-label="Tour">
      <b>Step {step.value} of 5</b> <span>{text}</span>
      <button class="small bare" aria-label="End the tour" onClick={() => { dismissed.value = true; }}>✕</button>
    </aside>
  );
}

const seed = signal(1);
export function Welcome({ choose }: { choose: () => void }) {
  const busy = Boolean(state.value?.job);
  return (
    <section id="welcome">
      <h2>Compare a motor's model with its measurements, see where it fails, add the effect that is missing, and watch the error fall.</h2>
      <p><button class="primary" onClick={choose}>Add recordings…</button> or drop files anywhere: CSV, Parquet, MF4, MAT, HDF5, TDMS, NumPy or WAV, all of one motor type. Model files (TOML), too.</p>
      <p><button id="tour-begin" disabled={busy} onClick={() => tour(seed.value)}>Try it on a built-in motor</button> that hides something; its number
        <input type="number" min={1} max={8} value={seed.value} aria-label="Number of the built-in motor" onInput={(event) => { seed.value = Math.max(1, Number(event.currentTarget.value) || 1); }} /> decides what.</p>
    </section>
  );
}
