// What a pane over time, over frequency or over lags shows, of which curves.
import type { Recording } from "./api";
import type { CurveOf, Wanted } from "./server";
import { ghost, hovered, mode, present, recording, simulated } from "./view";

export interface Pane { key: string; label: string; unit: string; channel: string; residual: boolean }
export interface Line { name: string; colour: string; dash?: number[]; width?: number; wanted: Wanted }

const NAMES: Record<string, string> = { u_v: "u", i_a: "i", omega_rad_s: "ω", torque_n_m: "T", angle_rad: "φ" };
/** Of linear drives, by their units. */
const LINEAR: Record<string, string> = { m: "x", "m/s": "v", N: "F" };
export const COMPARED = ["i_a", "omega_rad_s", "torque_n_m"];

export function panes(): Pane[] {
  const r = recording.value;
  if (!r) return [];
  // The speed of a recording with positions is their rate of change.
  const angle = r.channels.find((c) => c.column === "angle_rad"), hasSpeed = r.channels.some((c) => c.column === "omega_rad_s");
  const derived = simulated.value && angle && !hasSpeed ? [{ column: "omega_rad_s", unit: `${angle.unit}/s` }] : [];
  return [...r.channels, ...derived].flatMap(({ column, unit }) => {
    const name = LINEAR[unit] ?? NAMES[column] ?? column;
    const pane = { key: column, label: name, unit, channel: column, residual: false };
    const left = { key: `${column}-residual`, label: `Δ${name}`, unit, channel: column, residual: true };
    return simulated.value && COMPARED.includes(column) ? [pane, left] : [pane];
  });
}

export function asked(r: Recording, channel: string, of: CurveOf, version?: number, candidate?: string): Wanted {
  const all: Wanted = { recording: r.id, channel, of };
  if (version != null) all.version = version;
  if (candidate != null) all.candidate = candidate;
  if (mode.value === "rms" && r.mains_s != null) all.rms = r.mains_s;
  return all;
}

export function lines(pane: Pane): Line[] {
  const r = recording.value;
  if (!r) return [];
  const v = present.value;
  const wanted = (of: CurveOf, version?: number, candidate?: string) => asked(r, pane.channel, of, version, candidate);
  const comparable = v && simulated.value && COMPARED.includes(pane.channel);
  if (!comparable) return [{ name: "measured", colour: "--measured", wanted: wanted("raw") }];
  const of = pane.residual ? "residual" : "modelled";
  const all: Line[] = [];
  const before = ghost.value;
  if (before) all.push({ name: `before: ${before.label}`, colour: "--ghost", dash: [3, 3], wanted: wanted(of, before.id) });
  if (!pane.residual) all.push({ name: "measured", colour: "--measured", width: 1.4, wanted: wanted("measured", v.id) });
  all.push({ name: pane.residual ? "model − measured" : "model", colour: pane.residual ? "--residual" : "--modelled", wanted: wanted(of, v.id) });
  const tried = hovered.value;
  if (tried) all.push({ name: `with ${tried}`, colour: "--tried", dash: [8, 3], width: 1.6, wanted: wanted(of, v.id, tried) });
  return all;
}
