// What the user wants done; each leaves the command that does the same.
import type { Version } from "./api";
import { change, failure, state } from "./server";
import { beside, brush, command, hovered, present, range, rivals, room } from "./view";

const base = (path: string) => path.split("/").pop() ?? path;
const quoted = (text: string) => (/^[\w./=:,+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

export async function identify(): Promise<void> {
  command.value = state.value?.identify ?? "";
  await change("identify");
}

export async function diagnose(): Promise<void> {
  command.value = diagnosis();
  await change("diagnose");
}

const files = () => (state.value?.identify ?? "").replace(/^greyrig identify /, "").replace(/ --out \S+$/, "");
const model = (v: Version) => /--out (\S+)$/.exec(v.command)?.[1] ?? `${quoted(state.value?.project ?? "")}/versions/${v.id}.toml`;

/** The command that asks what the present version lacks. */
export const diagnosis = (): string => (present.value ? `greyrig diagnose ${files()} --model ${model(present.value)}` : "");
export const adding = (what: string): string => (present.value ? `greyrig add ${what} --model ${model(present.value)} ${files()}` : "");

export async function add(effects: string[]): Promise<void> {
  hovered.value = null;
  beside.value = "parent";
  command.value = adding(effects.join(" "));
  await change("add", { effect: effects.join(",") });
}

export async function addTerm(term: string): Promise<boolean> {
  beside.value = "parent";
  command.value = adding(`--term ${quoted(term)}`);
  return change("add", { term });
}

export async function go(version: Version): Promise<void> {
  command.value = version.command;
  await change("go", { version: version.id });
}

/** What a plan keeps to. */
export interface Limits { seconds: number; volts: number; amperes: number }

export const planning = ({ seconds, volts, amperes }: Limits): string => (present.value
  ? `greyrig plan --model ${model(present.value)}${rivals.value.length ? ` --rivals ${rivals.value.join(",")}` : ""} --seconds ${seconds} --max-voltage ${volts} --max-current ${amperes}` : "");

export async function plan(limits: Limits): Promise<void> {
  command.value = planning(limits);
  await change("plan", { rivals: rivals.value.join(","), ...limits });
}

/** To the recording that would tell rivals apart. */
export function tellApart(effects: string[]): void {
  rivals.value = effects;
  room.value = "plan";
}

export async function challenge(effects: string[]): Promise<void> {
  const named = effects.map((e) => ` --effect ${e}`).join("");
  command.value = present.value ? `greyrig challenge ${files()} --model ${model(present.value)}${named}` : "";
  await change("challenge", { effects: effects.join(",") });
}

export const training = ({ epochs, blanking }: { epochs: number; blanking: number }): string =>
  (present.value ? `greyrig train ${files()} --model ${model(present.value)} --epochs ${epochs} --blanking ${blanking}` : "");

export async function train(wish: { epochs: number; blanking: number }): Promise<void> {
  beside.value = "parent";
  command.value = training(wish);
  await change("train", wish);
}

const station = () => quoted(state.value?.station?.path ?? "station.toml");
const named = (ids: number[]) => ids.map((id) => quoted(state.value?.recordings.find((r) => r.id === id)?.name ?? "")).join(" ");

export async function judge(ids: number[]): Promise<void> {
  command.value = `greyrig monitor ${named(ids)} --model ${station()}`;
  await change("judge", { recordings: ids.join(",") });
}

export async function calibrate(ids: number[]): Promise<void> {
  command.value = present.value ? `greyrig calibrate ${named(ids)} --model ${model(present.value)} --out station.toml` : "";
  await change("calibrate", { recordings: ids.join(",") });
}

export async function openStation(file: File): Promise<void> {
  command.value = `greyrig monitor RUN --model ${quoted(file.name)}`;
  await change("station", { name: file.name }, file);
}

/** The version that was made last from one. */
export const next = (version: Version | null): Version | undefined =>
  state.value?.versions.filter((v) => v.parent === version?.id && version != null).pop();

export async function undo(): Promise<void> {
  const parent = state.value?.versions.find((v) => v.id === present.value?.parent);
  if (parent) await go(parent);
}

export async function redo(): Promise<void> {
  const after = next(present.value);
  if (after) await go(after);
}

export async function addFiles(all: Iterable<File>): Promise<void> {
  const wrong: string[] = [];
  for (const file of all) {
    const isModel = file.name.toLowerCase().endsWith(".toml");
    command.value = isModel ? `greyrig compare ${files()} --model ${quoted(file.name)}` : `greyrig check ${quoted(file.name)}`;
    const done = isModel ? await change("models", { name: file.name }, file) : await change("recordings", { name: file.name }, file, true);
    if (!done && failure.value) wrong.push(failure.value);
  }
  if (wrong.length) failure.value = wrong.join("\n");
}

export async function tour(seed: number): Promise<void> {
  command.value = `greyrig demo --seed ${seed}`;
  range.value = null;
  brush.value = null;
  await change("tour", { seed });
}

export const projectName = (): string => base(state.value?.project ?? "");
