// The workbench of `greyrig serve`.
import { render } from "preact";
import { useState } from "preact/hooks";
import "uplot/dist/uPlot.min.css";
import "./style.css";
import { percent, seconds } from "./format";
import { Ladder } from "./ladder";
import { Recordings, Versions } from "./left";
import { Maps } from "./maps";
import { Panes } from "./panes";
import { change, failure, follow, gone, pending, refresh, state } from "./server";
import { Tour, Welcome } from "./tour";
import { Verdict } from "./verdict";
import { Rooms, RoomView } from "./rooms";
import { command, present, recording, room } from "./view";
import { addFiles, diagnose, identify, next, projectName, redo, undo } from "./work";

const at = document.querySelector<HTMLElement>("#page")!;

function Progress() {
  const job = state.value?.job;
  if (!job && pending.value) return <><span id="job" role="status">{pending.value}…</span><progress aria-label="Progress" /></>;
  if (!job) return <span id="job" role="status" />;
  const part = job.fraction == null ? `step ${job.step}` : percent(Math.min(1, job.fraction));
  const left = job.left_s != null && job.left_s > 1 ? `, ${seconds(Math.ceil(job.left_s))} left of this part` : "";
  return <>
    <span id="job" role="status">{job.what}: {job.doing} ({part}{left})</span>
    <progress aria-label="Progress" {...(job.fraction == null ? {} : { value: job.fraction })} />
    <button id="stop" disabled={job.stopping} onClick={() => change("stop", {}, undefined, true)}>{job.stopping ? "Stopping…" : "Stop"}</button>
  </>;
}

function Top() {
  const now = state.value, v = present.value, busy = Boolean(now?.job), ready = Boolean(now?.identify);
  return (
    <header>
      <h1 title={`greyrig ${at.dataset["version"]}, on this machine alone. Project: ${now?.project ?? ""}`}>greyrig <span class="muted">{projectName()}</span></h1>
      <button id="identify" class={v ? "" : "primary"} disabled={busy || !ready} onClick={identify}>Identify the base model</button>
      <button id="diagnose" class={v && !v.diagnosis ? "primary" : ""} disabled={busy || !ready || !v} onClick={diagnose}>What is missing?</button>
      <button id="undo" title="Back to what this version was made from" disabled={busy || v?.parent == null} onClick={undo}>Undo</button>
      <button id="redo" title="On to what was made from it last" disabled={busy || !next(v)} onClick={redo}>Redo</button>
      <a class="button" id="model" aria-disabled={!v} href={v ? `model/${v.id}` : undefined} download="model.toml">Save the model</a>
      <a class="button" id="report" aria-disabled={!v || !ready} href={v && ready ? `report/${v.id}` : undefined} target="_blank" rel="noreferrer">Report</a>
      <span class="grow" /><Progress />
    </header>
  );
}

function Command() {
  const [copied, set] = useState("");
  const line = command.value || present.value?.command || state.value?.identify || "";
  return (
    <footer>
      {line ? <><code id="command" tabIndex={0} title="The command that does the same">{line}</code>
        <button class="small" id="copy" onClick={() => navigator.clipboard.writeText(line).then(() => set(line))}>{copied === line ? "Copied" : "Copy"}</button></> : null}
    </footer>
  );
}

function Messages() {
  const text = gone.value ? "greyrig serve does not answer; when it is started again this page goes on" : failure.value ?? state.value?.message;
  return <p id="error" class="note stop" role="alert" hidden={!text}>{text}{failure.value && !gone.value ? <button class="small bare" aria-label="Close" onClick={() => { failure.value = null; }}>✕</button> : null}</p>;
}

function Page() {
  const now = state.value;
  if (!now) return <p class="muted">Asking for the project…</p>;
  const empty = now.recordings.length === 0;
  const choose = () => document.querySelector<HTMLInputElement>("#files")?.click();
  return <>
    <Top />
    <Messages />
    <Tour />
    <main class={room.value === "model" ? "" : "in-room"}>
      <nav aria-label="Project"><Rooms /><Recordings /><Versions /></nav>
      {room.value === "model" ? null : <RoomView />}
      {room.value !== "model" ? null : <><div id="centre" role="tabpanel" aria-labelledby="tab-model">{empty ? <Welcome choose={choose} /> : recording.value ? <Panes /> : <p class="muted">No recording can be shown.</p>}</div>
      <aside id="right"><Verdict /></aside>
      {present.value ? <div id="below"><Maps /><Ladder /></div> : null}</>}
    </main>
    <Command />
  </>;
}

document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  void addFiles([...(event.dataTransfer?.files ?? [])]);
});
at.replaceChildren();
render(<Page />, at);
refresh().catch(() => { gone.value = true; });
follow();
