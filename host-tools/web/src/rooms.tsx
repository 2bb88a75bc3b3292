// What the screen is for: the model, and the rooms beside it.
import { ChallengeRoom } from "./challenge";
import { CorrectionRoom } from "./correction";
import { JudgeRoom } from "./judge";
import { PlanRoom } from "./plan";
import { command, present, room, ROOMS, type Room } from "./view";

const WORDS: Record<Room, [string, string]> = {
  model: ["Model", "See where the model fails, ask what is missing, and add it"],
  plan: ["Plan", "The recording that would tell rivals apart"],
  challenge: ["Challenge", "What these recordings would have shown"],
  correction: ["Learn", "What is learnt of what the physics leaves over"],
  judge: ["Judge", "Pass or fail, by the limits of healthy motors"],
};

export function go(to: Room): void {
  room.value = to;
  if (to === "model") command.value = present.value?.command ?? "";
}

export function Rooms() {
  const keys = (event: KeyboardEvent) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!by) return;
    const next = ROOMS[(ROOMS.indexOf(room.value) + by + ROOMS.length) % ROOMS.length]!;
    go(next);
    document.querySelector<HTMLElement>(`#tab-${next}`)?.focus();
    event.preventDefault();
  };
  return (
    <div id="rooms" role="tablist" aria-label="Rooms" onKeyDown={keys}>
      {ROOMS.map((name) => <button role="tab" id={`tab-${name}`} aria-selected={room.value === name} aria-controls={room.value === name ? (name === "model" ? "centre" : "room") : undefined} tabIndex={room.value === name ? 0 : -1} title={WORDS[name][1]} onClick={() => go(name)}>{WORDS[name][0]}</button>)}
    </div>
  );
}

export function RoomView() {
  const of = { plan: <PlanRoom />, challenge: <ChallengeRoom />, correction: <CorrectionRoom />, judge: <JudgeRoom />, model: null }[room.value];
  return of ? <div id="room" role="tabpanel" aria-labelledby={`tab-${room.value}`}>{of}</div> : null;
}
