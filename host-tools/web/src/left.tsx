// Recordings and what they are for; the tree of versions.
import { useRef, useState } from "preact/hooks";
import type { Recording, Role, Version } from "./api";
import { frequency, percent, seconds } from "./format";
import { change, state } from "./server";
import { beside, chosen, command, present, range, recording } from "./view";
import { SIGNALS, tree } from "./versions";
import { addFiles, go } from "./work";

const ROLES: [Role, string][] = [["fit", "Models are fitted to it"], ["judge", "What is added is judged on it"], ["off", "It is left out"]];

function quality(r: Recording): [string, string, string] {
  const has = (severity: string) => r.findings.some((f) => f.severity === severity);
  if (r.unusable) return ["stop", "✕", "cannot be used"];
  if (has("stop")) return ["stop", "✕", "answers from it would mean nothing"];
  if (has("warning") || r.warnings.length) return ["warning", "!", "results may be off"];
  return ["fine", "✓", "nothing is wrong with it"];
}

function Mapping({ r }: { r: Recording }) {
  const [rules, set] = useState(r.map.join(" "));
  return (
    <form class="mapping" onSubmit={(event) => { event.preventDefault(); command.value = `greyrig check ${r.name} --map ${rules}`; void change("remap", { recording: r.id, map: rules }); }}>
      <label>Columns, as for <code>--map</code>: <input value={rules} placeholder="u_v=Voltage i_a=Current[mA]" onInput={(event) => set(event.currentTarget.value)} /></label>
      <button class="small">Read again</button>
    </form>
  );
}

function RecordingView({ r }: { r: Recording }) {
  const [mark, sign, words] = quality(r), busy = Boolean(state.value?.job);
  const [open, set] = useState(false);
  const details = r.findings.length + r.warnings.length;
  const select = () => { if (!r.unusable) { chosen.value = r.id; range.value = null; } };
  const show = open || Boolean(r.unusable) || mark === "stop";
  return (
    <li class={recording.value?.id === r.id ? "chosen" : ""} data-recording={r.id} data-quality={mark}>
      <div class="line">
        <span class={`mark ${mark}`} title={words} aria-label={words}>{sign}</span>
        <button class="name" title={r.unusable ?? `Show ${r.name}: ${r.channels.map((c) => c.column).join(", ")}; ${r.samples} samples`} disabled={Boolean(r.unusable)} aria-pressed={recording.value?.id === r.id} onClick={select}>{r.name}</button>
        <button class="small bare" title="Names and units of its columns, and what was found" aria-expanded={show} aria-label={`Details of ${r.name}`} onClick={() => set(!open)}>{details ? `${details} ` : ""}⋯</button>
        <button class="small bare remove" title="Go on without this recording; its file stays" aria-label={`Remove ${r.name}`} disabled={busy}
          onClick={() => change("remove", { recording: r.id })}>✕</button>
      </div>
      {r.unusable ? <p class="note stop">{r.unusable}</p> : (
        <div class="line second">
          <span class="muted">{seconds(r.seconds)}, {frequency(r.sample_time_s)}</span>
          <span class="roles" role="group" aria-label={`What ${r.name} is for`}>
            {ROLES.map(([role, title]) => <button class="small" title={title} aria-pressed={r.role === role} disabled={busy} data-role={role}
              onClick={() => r.role !== role && change("role", { recording: r.id, role })}>{role}</button>)}
          </span>
        </div>
      )}
      {show ? <div class="details">
        {r.findings.map((f) => <p class={`note ${f.severity}`}>{f.text}{f.remedy ? <>; <code>{f.remedy}</code></> : null}</p>)}
        {r.warnings.map((w) => <p class="note warning">{w}</p>)}
        <Mapping key={r.map.join(" ")} r={r} />
      </div> : null}
    </li>
  );
}

export function Recordings() {
  const input = useRef<HTMLInputElement>(null);
  const all = state.value?.recordings ?? [];
  return (
    <section aria-labelledby="recordings-title">
      <h2 id="recordings-title">Recordings
        <button class="small" onClick={() => input.current?.click()}>Add…</button>
        <input id="files" ref={input} type="file" multiple hidden aria-label="Recordings or a model file"
          onChange={async (event) => { const target = event.currentTarget; await addFiles([...(target.files ?? [])]); target.value = ""; }} />
      </h2>
      <ul id="recordings">{all.map((r) => <RecordingView key={r.id} r={r} />)}</ul>
    </section>
  );
}

function VersionView({ v, depth }: { v: Version; depth: number }) {
  const is = v.id === present.value?.id, busy = Boolean(state.value?.job), other = v.basis !== state.value?.basis;
  const shadow = beside.value === v.id || (beside.value === "parent" && v.id === present.value?.parent);
  const judged = v.accepted == null ? "" : v.accepted ? "accepted: the error falls on data held out" : "not accepted: the error does not fall on data held out";
  const [writing, write] = useState(false);
  const note = (text: string) => { write(false); if (text.trim() !== (v.note ?? "")) void change("note", { version: v.id, text }); };
  const leaf = !state.value?.versions.some((w) => w.parent === v.id);
  return (
    <li class={is ? "chosen" : ""} style={{ paddingLeft: `${0.4 + 0.8 * depth}rem` }} data-version={v.id}>
      <div class="line">
        <button class="name" aria-pressed={is} disabled={busy} title={is ? "The present version" : "Make this the present version: what is added next branches off here"} onClick={() => !is && go(v)}>{v.label}</button>
        {v.accepted === false ? <span class="mark warning" title={judged} aria-label={judged}>!</span> : null}
        {is ? null : <button class="small bare" title="Draw it beside the present version" aria-label={`Compare with ${v.label}`} aria-pressed={shadow} onClick={() => { beside.value = beside.value === v.id ? "parent" : v.id; }}>◐</button>}
        <button class="small bare" title="A note to this version" aria-label={`Note to ${v.label}`} aria-expanded={writing} disabled={busy} onClick={() => write(!writing)}>✎</button>
        {leaf ? <button class="small bare remove" title="Remove this version; its model file stays" aria-label={`Remove ${v.label}`} disabled={busy} onClick={() => change("forget", { version: v.id })}>✕</button> : null}
      </div>
      <div class="line second figures" title={`Error in free run on data held out${other ? ", of other recordings than now" : ""}. ${judged}`}>
        {SIGNALS.filter(([of]) => v.held_out[of] != null).map(([of, symbol]) => <span data-signal={of}>{symbol} {percent(v.held_out[of])}</span>)}
        <span class="muted">floor {SIGNALS.filter(([of]) => v.held_out[of] != null).map(([of]) => percent(v.floor[of])).join(", ").replace(/^–(, –)*$/, "–")}</span>
        {v.diagnosis?.odds ? <span class="muted">{v.diagnosis.odds}</span> : null}
        {other ? <span class="mark warning" title="It rests on other recordings, or other roles, than there are now">≠</span> : null}
      </div>
      {v.accepted === false ? <p class="note warning">{judged}</p> : null}
      {writing ? <input class="writing" aria-label={`Note to ${v.label}`} defaultValue={v.note ?? ""} ref={(at) => at?.focus()} onKeyDown={(event) => { if (event.key === "Escape") write(false); if (event.key === "Enter") event.currentTarget.blur(); }} onBlur={(event) => note(event.currentTarget.value)} />
        : v.note ? <p class="note own">{v.note}</p> : null}
    </li>
  );
}

export function Versions() {
  const all = state.value?.versions ?? [];
  if (!all.length) return null;
  return (
    <section aria-labelledby="versions-title">
      <h2 id="versions-title">Versions</h2>
      <ul id="versions">{tree(all).map(([v, depth]) => <VersionView key={v.id} v={v} depth={depth} />)}</ul>
    </section>
  );
}
