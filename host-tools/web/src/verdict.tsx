// What is missing, in words, with what was tried.
import { useEffect, useState } from "preact/hooks";
import type { Candidate, Diagnosis } from "./api";
import { percent, rounded } from "./format";
import { state, term } from "./server";
import { command, hovered, present } from "./view";
import { SIGNALS, tried } from "./versions";
import { add, adding, addTerm, diagnose, tellApart } from "./work";

function Bar({ c, best, named }: { c: Candidate; best: number; named: boolean }) {
  const busy = Boolean(state.value?.job), error = c.predicted ?? c.esr_after;
  const ready = c.predicted != null;
  const show = () => { if (ready) hovered.value = c.effect; command.value = adding(c.effect); };
  const hide = () => { if (hovered.value === c.effect) hovered.value = null; };
  const title = [c.objection, ready ? "Hover: the model with it, drawn over the others. Click: add it" : "Click: add it. Its curve is being computed"].filter(Boolean).join(". ");
  return (
    <button class={`candidate${named ? " named" : ""}${c.objection ? " objected" : ""}`} disabled={busy} data-effect={c.effect} data-ready={ready} title={title}
      onMouseEnter={show} onMouseLeave={hide} onFocus={show} onBlur={hide} onClick={() => add([c.effect])}>
      <span class="effect">{c.effect}</span>
      <span class="bar"><i style={{ width: `${100 * Math.max(0, c.gain) / best}%` }} /></span>
      <span class="gain">−{(100 * Math.max(0, c.gain)).toFixed(0)} %</span>
      <span class="then">{ready ? "" : "≈ "}{SIGNALS.filter(([of]) => error[of] != null).map(([of, symbol]) => `${symbol} ${percent(error[of])}`).join(" ")}{c.objection ? `; ${c.objection}` : ""}</span>
    </button>
  );
}

function Candidates({ d, all }: { d: Diagnosis; all: Candidate[] }) {
  const best = Math.max(...all.map((c) => c.gain), 0.01);
  const classOf = (effect: string) => d.classes.find((c) => c.includes(effect));
  const groups: Candidate[][] = [];
  for (const c of all) {
    const of = classOf(c.effect), group = of && groups.find((g) => g.some((other) => of.includes(other.effect)));
    if (group) group.push(c);
    else groups.push([c]);
  }
  return (
    <div id="candidates" role="group" aria-label="Candidates, best first">
      {groups.map((group) => {
        const bars = group.map((c) => <Bar key={c.effect} c={c} best={best} named={d.effects.includes(c.effect)} />);
        return group.length > 1 ? <div class="class" title="No recording separates these">{bars}</div> : bars;
      })}
    </div>
  );
}

function Term() {
  const [formula, set] = useState(""), [wrong, say] = useState<string | null>(null);
  useEffect(() => {
    let wanted = true;
    if (!formula.trim()) say(null);
    else term(formula).then((answer) => wanted && say(answer), () => undefined);
    return () => { wanted = false; };
  }, [formula]);
  const submit = async (event: Event) => {
    event.preventDefault();
    if (formula.trim() && !wrong && await addTerm(formula)) set("");
  };
  return (
    <form id="term" onSubmit={submit}>
      <label>A term of your own <input value={formula} placeholder="k*i*abs(i)  or  torque: k*w^3" aria-invalid={wrong != null} onInput={(event) => set(event.currentTarget.value)} /></label>
      <button class="small" disabled={!formula.trim() || wrong != null || Boolean(state.value?.job)}>Add</button>
      {wrong ? <p class="note warning" role="status">{wrong}</p> : null}
    </form>
  );
}

function Parameters() {
  const v = present.value;
  if (!v?.parameters.length) return null;
  return (
    <details id="parameters">
      <summary>Parameters of “{v.label}”</summary>
      <table><thead><tr><th scope="col">Name</th><th scope="col">Value, half of the 95 % interval</th><th scope="col">Unit</th></tr></thead>
        <tbody>{v.parameters.map((p) => <tr class={p.identifiable ? "" : "unknown"} title={p.ci95 ? `${rounded(p.ci95[0], 6)} … ${rounded(p.ci95[1], 6)} (95 %)` : p.identifiable ? "" : "These recordings do not determine it"}><th scope="row">{p.name}</th><td>{rounded(p.value)}{p.ci95 ? ` ± ${rounded((p.ci95[1] - p.ci95[0]) / 2, 2)}` : ""}</td>
         <td>{p.unit}</td></tr>)}</tbody></table>
      {v.notes.map((n) => <p class="note">{n}</p>)}
    </details>
  );
}

export function Verdict() {
  const v = present.value, d = v?.diagnosis, busy = Boolean(state.value?.job);
  if (!v) return <section id="verdict"><h2>What is missing?</h2><p class="muted">Identify a model first; then ask.</p></section>;
  const stale = d && d.basis !== state.value?.basis;
  const [first, ...rest] = d?.text.split("\n") ?? [];
  const all = tried(v);
  const rivals = d?.classes.find((c) => c.length > 1) ?? d?.effects ?? [];
  return (
    <section id="verdict" aria-labelledby="verdict-title" aria-live="polite">
      {d ? <>
        <h2 id="verdict-title" data-kind={d.kind}>{d.headline}</h2>
        {d.odds ? <p id="odds">Odds {d.odds}</p> : null}
        {stale ? <p class="note warning">The recordings have changed since; ask again.</p> : null}
        {d.effects.length > 1 ? <p><button id="add-all" class="primary" disabled={busy} onClick={() => add(d.effects.filter((e) => !v.effects.includes(e)))}>Add all that is named</button></p> : null}
        {d.effects.length === 1 && !v.effects.includes(d.effects[0]!) ? <p><button id="add-named" class="primary" disabled={busy} onClick={() => add(d.effects)}>Add {d.effects[0]}</button></p> : null}
        {all.length ? <>
          <h3>Tried: how far the error falls on data held out</h3>
          <Candidates d={d} all={all} />
          {state.value?.ahead ? <p class="muted" id="ahead">Computing the curves of {state.value.ahead} more…</p> : null}
        </> : null}
        {d.remaining ? <p class="note warning" id="remaining">{d.remaining}</p> : null}
        {d.next_experiment ? <p class="note"><b>The recording that would tell:</b> {d.next_experiment} {rivals.length > 1 ? <button class="small" onClick={() => tellApart(rivals)}>Plan it…</button> : null}</p> : null}
        <details><summary>Why</summary><p>{first}</p>{rest.map((line) => <p>{line.trim()}</p>)}</details>
      </> : <>
        <h2 id="verdict-title">What is missing?</h2>
        <p class="muted">Nobody has asked about “{v.label}” yet.</p>
        <p><button class="primary" disabled={busy} onClick={diagnose}>What is missing?</button></p>
      </>}
      <Term />
      <Parameters />
    </section>
  );
}
