// The recording that would tell rivals apart, drawn before it is made.
import { useEffect, useState } from "preact/hooks";
import type { Contest, Plan, Proposal, Take } from "./api";
import { Chart } from "./chart";
import { rounded, withPrefix } from "./format";
import { points } from "./points";
import { profileFile, proposed, state, type Window } from "./server";
import { command, present, rivals } from "./view";
import { plan, planning } from "./work";

/** Stretches of a profile that are drawn: as many as a wide screen has columns. */
const STRETCHES = 1500;
const named = (takes: Take[]) => takes.map((t) => t.profile).join(" + ");

function Drawn({ take, version }: { take: Take; version: number }) {
  const [window, set] = useState<Window | null>(null);
  useEffect(() => {
    let wanted = true;
    proposed(version, take.profile, take.seconds, STRETCHES).then((found) => wanted && set(found));
    return () => { wanted = false; };
  }, [version, take.profile, take.seconds]);
  const [xs, ys] = points([window]) as unknown as [number[], number[]];
  return (
    <div class="take">
      <Chart name={`profile-${take.profile}`} label={`${take.profile}, ${take.seconds} s`} x="s" y="V" file={take.profile} rangeX={[0, take.seconds]} lines={[{ name: "voltage", colour: "--measured", xs, ys }]} />
      <p class="muted">up to {withPrefix(take.peak_voltage_v, "V")} and {withPrefix(take.peak_current_a, "A")}
        {" "}<a class="button small" href={profileFile(version, take.profile, take.seconds)} download={`${take.profile}.csv`} title="Volts over seconds, at 10 kHz">Download the profile</a></p>
    </div>
  );
}

function Ranking({ contest, chosen, choose }: { contest: Contest; chosen: Proposal | undefined; choose: (p: Proposal) => void }) {
  return (
    <section>
      <h3>{contest.rivals.join(" or ")}</h3>
      <table class="ranking"><thead><tr><th scope="col">Recording</th><th scope="col" title="What remains of one effect after the other one, in multiples of the noise, at 1 % of the current">Separation</th><th scope="col">Up to</th></tr></thead>
        <tbody>{contest.proposals.map((p) => <tr class={p === chosen ? "chosen" : ""}>
          <th scope="row"><button class="small bare" aria-pressed={p === chosen} onClick={() => choose(p)}>{named(p.takes)}</button></th>
          <td>{rounded(p.separation, 3)}</td><td>{withPrefix(Math.max(...p.takes.map((t) => t.peak_voltage_v)), "V")}, {withPrefix(Math.max(...p.takes.map((t) => t.peak_current_a)), "A")}</td></tr>)}</tbody></table>
      <p class="muted">{(contest.proposals[0]?.separation ?? 0) < 1 ? "No profile shows more than the noise; known is " : ""}{contest.separated_by}</p>
    </section>
  );
}

function Result({ of, version }: { of: Plan; version: number }) {
  const [chosen, choose] = useState<Proposal | undefined>();
  const takes = chosen && of.contests.some((c) => c.proposals.includes(chosen)) ? chosen.takes : of.best;
  const [copied, set] = useState(false);
  return <>
    <div class="proposal" data-takes={named(takes)}>
      <h3>{chosen ? "Chosen" : "Tells most"}: {named(takes)}</h3>
      {takes.map((take) => <Drawn key={`${version} ${take.profile} ${take.seconds} ${of.voltage_v}`} take={take} version={version} />)}
      {of.rehearsal && !chosen ? <p class="rehearsal"><span class="muted">On the virtual rig:</span> <code>{of.rehearsal}</code>
        <button class="small" onClick={() => navigator.clipboard.writeText(of.rehearsal ?? "").then(() => set(true))}>{copied ? "Copied" : "Copy"}</button></p> : null}
    </div>
    <div class="rankings">{of.contests.map((c) => <Ranking key={c.rivals.join()} contest={c} chosen={chosen} choose={choose} />)}</div>
  </>;
}

export function PlanRoom() {
  const v = present.value, now = state.value, busy = Boolean(now?.job);
  const [usualV, usualA] = now?.usual_limits ?? [0, 0];
  const [limits, set] = useState({ seconds: 8, volts: 0, amperes: 0 });
  const kept = { seconds: limits.seconds, volts: limits.volts || v?.plan?.voltage_v || usualV, amperes: limits.amperes || v?.plan?.current_a || usualA };
  useEffect(() => { if (v) command.value = v.plan && !rivals.value.length ? v.plan.command : planning(kept); }, [v?.id, rivals.value, limits]);
  if (!v) return <section class="room" id="plan"><h2>Plan the next recording</h2><p class="muted">Identify a model first: the profiles are tried on it.</p></section>;
  const named = v.diagnosis?.classes.find((c) => c.length > 1) ?? (v.diagnosis && v.diagnosis.effects.length > 1 ? v.diagnosis.effects : null);
  const field = (name: keyof typeof kept, label: string, unit: string) => (
    <label>{label} <input type="number" min={0} step="any" value={kept[name]} onInput={(event) => set({ ...limits, [name]: Number(event.currentTarget.value) })} /> {unit}</label>
  );
  return (
    <section class="room" id="plan" aria-labelledby="plan-title">
      <form class="wishes" onSubmit={(event) => { event.preventDefault(); void plan(kept); }}>
        <h2 id="plan-title">Which recording would tell?</h2>
        <label>Rivals <input list="catalogue" value={rivals.value.join(", ")} placeholder="the pairs that are known to be confused" size={24}
          onChange={(event) => { rivals.value = event.currentTarget.value.split(/[\s,]+/).filter(Boolean); }} /></label>
        <datalist id="catalogue">{now?.catalogue.map((e) => <option value={e} />)}</datalist>
        {named && named.join() !== rivals.value.join() ? <button type="button" class="small" onClick={() => { rivals.value = named; }}>{named.join(" or ")}</button> : null}
        {field("seconds", "Length", "s")}{field("volts", "Up to", "V")}{field("amperes", "and", "A")}
        <button class="primary" id="plan-begin" disabled={busy}>Plan</button>
      </form>
      <div class="content two">{v.plan ? <Result of={v.plan} version={v.id} /> : <p class="muted">Each profile of the rig is run through “{v.label}” within these limits, with each rival in turn: what remains of one after the other tells them apart.</p>}</div>
    </section>
  );
}
