// What this tab looks at: not a part of the project.
import { computed, effect, signal } from "@preact/signals";
import type { Recording, Version } from "./api";
import { cells, changing, instants, state } from "./server";

export const chosen = signal<number | null>(null);
/** What is shown of the recording's time, s; null: all of it. */
export const range = signal<[number, number] | null>(null);
/** The version that stands beside the present one; "parent": what it was made from. */
export const beside = signal<number | "parent">("parent");
/** The candidate under the pointer. */
export const hovered = signal<string | null>(null);
export const cursors = signal<{ a: number | null; b: number | null }>({ a: null, b: null });
/** What the screen is for; the rooms beside the model's. */
export const ROOMS = ["model", "plan", "challenge", "correction", "judge"] as const;
export type Room = (typeof ROOMS)[number];
export const room = signal<Room>("model");
/** Effects that a plan is to tell apart. */
export const rivals = signal<string[]>([]);
/** What the panes show: signals or their RMS over time, by frequency or by order; residuals by lag; a motor's laws. */
export type Mode = "raw" | "rms" | "spectrum" | "order" | "correlation" | "plane";
export const mode = signal<Mode>("raw");
export const quantity = signal<"current" | "speed">("current");
/** Cells of a map that were chosen, and when the recording was in them. */
export const brush = signal<{ plane: string; cells: number[] } | null>(null);
export const lit = signal<[number, number][]>([]);
/** Cells of each plane in which the recording was while it is looked at. */
export const visited = signal<Record<string, Set<number>>>({});
/** The command that does what was done last. */
export const command = signal("");
export const dark = signal(matchMedia("(prefers-color-scheme: dark)").matches);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (event) => { dark.value = event.matches; });

export const recording = computed<Recording | null>(() => {
  const usable = state.value?.recordings.filter((r) => !r.unusable) ?? [];
  return usable.find((r) => r.id === chosen.value) ?? usable.find((r) => r.judges) ?? usable[0] ?? null;
});
export const present = computed<Version | null>(() => state.value?.versions.find((v) => v.id === state.value?.present) ?? null);
export const ghost = computed<Version | null>(() => {
  const id = beside.value === "parent" ? present.value?.parent : beside.value;
  return state.value?.versions.find((v) => v.id === id && v.id !== present.value?.id) ?? null;
});
/** Whether the present version can be simulated on the recording. */
export const simulated = computed(() => present.value != null && recording.value != null && recording.value.role !== "off");
export const whole = computed<[number, number]>(() => {
  const r = recording.value;
  return r ? [r.start_s, r.start_s + r.seconds] : [0, 1];
});
export const shown = computed<[number, number]>(() => range.value ?? whole.value);

export function zoom(from: number, to: number): void {
  const [low, high] = whole.value;
  const least = 8 * (recording.value?.sample_time_s ?? 1e-6);
  if (to - from < least) { const middle = (from + to) / 2; from = middle - least / 2; to = middle + least / 2; }
  if (to - from >= high - low) { range.value = null; return; }
  if (from < low) { to += low - from; from = low; }
  if (to > high) { from -= to - high; to = high; }
  range.value = [from, to];
}

// The command follows the version, until something else is done.
let last: number | undefined;
effect(() => {
  const v = present.value;
  if (v?.id !== last) command.value = v?.command ?? "";
  last = v?.id;
});

/** The planes that the recordings span. */
export const planes = computed(() => {
  const used = state.value?.recordings.filter((r) => r.role !== "off" && !r.unusable) ?? [];
  const has = (...names: string[]) => used.some((r) => r.channels.some((c) => names.includes(c.column)));
  const all: string[] = [];
  if (has("i_a") && has("omega_rad_s", "angle_rad")) all.push("i_omega");
  if (has("i_a") && used.some((r) => r.mains_s != null)) all.push("phase_u");
  return all;
});

const at = computed(() => (simulated.value && present.value && recording.value ? `${present.value.id} ${recording.value.id}` : null));
const ids = () => at.value?.split(" ").map(Number) as [number, number] | undefined;

// A brush lights up the instants of the recording that is shown.
effect(() => {
  const b = brush.value, [version, shownOne] = ids() ?? [];
  if (!b || version == null || shownOne == null) { lit.value = []; return; }
  if (changing.value) return;
  instants(version, b.plane, shownOne, b.cells).then((all) => { if (brush.peek() === b) lit.value = all; }, () => { lit.value = []; });
});

/** Milliseconds for which the view has to rest before the cells are asked for. */
const REST = 120;
// What is looked at, between the cursors or by zoom, is outlined in the maps.
let later = 0;
effect(() => {
  const { a, b } = cursors.value;
  const between = a != null && b != null && a !== b ? [Math.min(a, b), Math.max(a, b)] as const : range.value;
  const [version, shownOne] = ids() ?? [];
  clearTimeout(later);
  if (!between || version == null || shownOne == null) { visited.value = {}; return; }
  if (changing.value) return;
  later = setTimeout(async () => {
    const found: Record<string, Set<number>> = {};
    for (const plane of planes.peek()) {
      if (changing.peek() || at.peek() !== `${version} ${shownOne}`) return;
      found[plane] = new Set(await cells(version, plane, shownOne, between[0], between[1]).catch(() => []));
    }
    visited.value = found;
  }, REST);
});
