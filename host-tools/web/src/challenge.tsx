// Is there really nothing else? From what size on these recordings would have shown each effect.
import { useEffect, useState } from "preact/hooks";
import type { Challenged } from "./api";
import { percent, withPrefix } from "./format";
import { state } from "./server";
import { command, present } from "./view";
import { add, challenge, tellApart } from "./work";

/** Error of the free run below which an effect does nothing. */
const NOTHING = 1e-9;

function revealed(e: Challenged): string {
  if (e.revealed_from != null) return `from ${withPrefix(e.revealed_from, e.unit, 2)} on`;
  if (e.hidden_up_to == null) return "the model cannot be run with it";
  return [e.esr.current, e.esr.speed].every((x) => x == null || x < NOTHING) ? "it does nothing in this model" : `not even at ${withPrefix(e.hidden_up_to, e.unit, 2)}`;
}

export function ChallengeRoom() {
  const v = present.value, now = state.value, c = v?.challenge, busy = Boolean(now?.job), ready = Boolean(now?.identify);
  const [wanted, set] = useState("");
  const effects = wanted.split(/[\s,]+/).filter(Boolean);
  useEffect(() => { if (c) command.value = c.command; }, [c?.command]);
  if (!v) return <section class="room" id="challenge"><h2>What would these recordings have shown?</h2><p class="muted">Identify a model first.</p></section>;
  return (
    <section class="room" id="challenge" aria-labelledby="challenge-title">
      <form class="wishes" onSubmit={(event) => { event.preventDefault(); void challenge(effects); }}>
        <h2 id="challenge-title">What would these recordings have shown?</h2>
        <label>Effects <input list="catalogue" value={wanted} placeholder="all that the model lacks" size={34} onInput={(event) => set(event.currentTarget.value)} /></label>
        <datalist id="catalogue">{now?.catalogue.map((e) => <option value={e} />)}</datalist>
        <button class="primary" id="challenge-begin" disabled={busy || !ready}>Challenge</button>
      </form>
      <div class="content">{c ? <>
        {c.basis !== now?.basis ? <p class="note warning">The recordings have changed since; ask again.</p> : null}
        {c.found.length ? <p class="note warning">Diagnosis finds {c.found.join(" and ")} without any challenge; the challenged model has it. <button class="small" disabled={busy} onClick={() => add(c.found)}>Add it</button></p> : null}
        {c.unexplained ? <p class="note warning">Structure is left that no effect explains, which hides small effects.</p> : null}
        {c.effects.length ? <table id="challenged"><thead><tr><th scope="col">Effect</th><th scope="col">Revealed</th><th scope="col">Error that it adds there: current</th><th scope="col">speed</th><th scope="col">Smaller ones</th><td /></tr></thead>
          <tbody>{c.effects.map((e) => <tr data-effect={e.effect} class={e.revealed_from == null ? "unknown" : ""}><th scope="row" title={e.effect}>{e.name}</th><td><b>{revealed(e)}</b></td><td>{percent(e.esr.current)}</td><td>{percent(e.esr.speed)}</td>
            <td>{e.mistaken_for ? `taken for ${e.mistaken_for}` : e.objection ?? ""}</td>
            <td>{e.mistaken_for || e.revealed_from == null ? <button class="small bare" title="The recording that would tell" onClick={() => tellApart(e.mistaken_for ? [e.effect, e.mistaken_for] : [e.effect])}>Plan…</button> : null}</td></tr>)}</tbody></table> : null}
        {c.out_of_reach.length ? <><h3>Not to be told from these recordings</h3><ul>{c.out_of_reach.map((o) => <li><b>{o.name}</b>: {o.text}</li>)}</ul></> : null}
      </> : <p class="muted">Each effect that “{v.label}” lacks is put into the recordings at known sizes, and diagnosis has to find it. That takes a minute or more; it can be stopped.</p>}</div>
    </section>
  );
}
