// What is asked of the server.
import { batch, signal } from "@preact/signals";
import type { Changed, Correction, Correlations, Judged, LawPlane, Map, Spectrum, State, Tick } from "./api";

export const state = signal<State | null>(null);
/** What went wrong last with a wish of this page. */
export const failure = signal<string | null>(null);
export const gone = signal(false);
/** Whether a change is under way: what is shown may be gone in a moment. */
export const changing = signal(false);
/** What has been asked for and is not answered yet. */
export const pending = signal<string | null>(null);
const WORDS: Record<string, string> = {
  recordings: "reading the file", models: "reading the model", tour: "recording the built-in motor", remap: "reading the file again", role: "questioning the recordings",
  remove: "questioning the recordings", station: "reading the station",
};

async function said(answer: Response): Promise<string> {
  return (await answer.text()).trim() || `${answer.status} ${answer.statusText}`;
}

async function got<T>(path: string): Promise<T> {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(await said(answer));
  return answer.json() as Promise<T>;
}

let asking: Promise<void> | null = null;
/** Brings the state; those who ask meanwhile get the next one. */
export async function refresh(): Promise<void> {
  if (asking) await asking;
  asking = got<State>("state").then((now) => { state.value = now; }).finally(() => { asking = null; });
  await asking;
}

type Words = Record<string, string | number>;
const query = (words: Words) => new URLSearchParams(Object.entries(words).map(([k, v]) => [k, String(v)])).toString();

/** Asks for a change of the project as it is shown; says whether it was made. */
export async function change(path: string, words: Words = {}, body?: Blob, any = false): Promise<boolean> {
  failure.value = null;
  const revision = any ? "*" : `"${state.value?.revision ?? 0}"`;
  const options: RequestInit = { method: "POST", headers: { "If-Match": revision } };
  if (body) options.body = body;
  changing.value = true;
  pending.value = WORDS[path] ?? null;
  try {
    const answer = await fetch(`${path}?${query(words)}`, options);
    if (answer.ok) {
      const { revision } = (await answer.json()) as Changed;
      if (state.value && revision !== state.value.revision) await refresh();
    } else {
      failure.value = await said(answer);
      await refresh();
    }
    return answer.ok;
  } catch {
    gone.value = true;
    return false;
  } finally {
    pending.value = null;
    changing.value = false;
  }
}

/** Milliseconds until the next attempt. */
const AGAIN = 2000;

/** Follows what happens to the project, whoever does it. */
export function follow(): void {
  const events = new EventSource("events");
  events.onmessage = (event) => {
    const tick = JSON.parse(event.data as string) as Tick;
    const now = state.value, again = gone.value;
    gone.value = false;
    if (again || !now || tick.shown !== now.shown) void refresh();
    else if (now.job || tick.job) batch(() => { state.value = { ...now, job: tick.job }; });
  };
  events.onerror = () => {
    gone.value = true;
    // Browsers try again by themselves, but not after every kind of end.
    if (events.readyState === EventSource.CLOSED) setTimeout(follow, AGAIN);
  };
}

export interface Window {
  from: number; step: number; samples: number; least: Float32Array; largest: Float32Array;
}

export type CurveOf = "raw" | "measured" | "modelled" | "residual";
export interface Wanted { recording: number; channel: string; of: CurveOf; version?: number; candidate?: string; rms?: number }

const kept = new globalThis.Map<string, Promise<Window | null>>();
/** Windows that are kept: some screens' worth. */
const MOST = 300;

async function brought(path: string): Promise<Window | null> {
  const answer = await fetch(path);
  if (!answer.ok) return null;
  const buffer = await answer.arrayBuffer();
  const view = new DataView(buffer);
  const count = view.getUint32(4, true);
  return {
    from: view.getFloat64(8, true), step: view.getFloat64(16, true), samples: view.getUint32(24, true),
    least: new Float32Array(buffer, 32, count), largest: new Float32Array(buffer, 32 + 4 * count, count),
  };
}

/** A stretch of a curve; null where there is none. */
export function curve(wanted: Wanted, [from, to]: [number, number], px: number): Promise<Window | null> {
  const { recording, channel, of, version, candidate, rms } = wanted;
  const words: Words = { of, from, to, px };
  if (version != null) words["version"] = version;
  if (candidate != null) words["candidate"] = candidate;
  if (rms != null) words["rms"] = rms;
  const path = `signal/${recording}/${channel}?${query(words)}`;
  const known = kept.get(path);
  if (known) return known;
  const asked = brought(path).catch(() => null);
  kept.set(path, asked);
  void asked.then((window) => { if (!window) kept.delete(path); });
  if (kept.size > MOST) kept.delete(kept.keys().next().value as string);
  return asked;
}

/** A stretch of the voltage that a plan proposes. */
export const proposed = (version: number, profile: string, seconds: number, px: number) =>
  brought(`proposed/${version}/${profile}?${query({ seconds, from: 0, to: seconds, px })}`).catch(() => null);
export const profileFile = (version: number, profile: string, seconds: number) => `profile/${version}/${profile}?${query({ seconds })}`;
export const correction = (version: number) => got<Correction>(`correction/${version}`);
export const judged = () => got<Judged>("judged");
export const spectrum = (wanted: Wanted, over: "frequency" | "order", [from, to]: [number, number]) => {
  const { recording, channel, of, version, candidate } = wanted;
  return got<Spectrum>(`spectrum/${recording}/${channel}?${query({ of, over, from, to, ...(version == null ? {} : { version }), ...(candidate == null ? {} : { candidate }) })}`);
};
export const lawPlanes = (recording: number, version: number, [from, to]: [number, number]) =>
  got<LawPlane[]>(`planes/${recording}?${query({ version, from, to })}`);
export const correlations = (recording: number, channel: string, version: number, [from, to]: [number, number]) =>
  got<Correlations>(`correlations/${recording}/${channel}?${query({ version, from, to })}`);

export const map = (version: number, plane: string, of: string) => got<Map>(`map/${version}/${plane}/${of}`);
export const instants = (version: number, plane: string, recording: number, cells: number[]) =>
  got<[number, number][]>(`instants/${version}/${plane}/${recording}?${query({ cells: cells.join(",") })}`);
export const cells = (version: number, plane: string, recording: number, from: number, to: number) =>
  got<number[]>(`cells/${version}/${plane}/${recording}?${query({ from, to })}`);
export const term = (formula: string) => got<string | null>(`term?${query({ formula })}`);
