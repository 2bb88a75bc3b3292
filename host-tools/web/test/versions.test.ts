import assert from "node:assert/strict";
import { test } from "node:test";
import type { Candidate, Version } from "../src/api";
import { ladder, tree, tried } from "../src/versions";

const figures = { current: null, speed: null, torque: null };
const version = (id: number, parent: number | null, basis = "a"): Version => ({
  id, parent, label: String(id), command: "", effects: [], terms: [], parameters: [], notes: [], note: null, training: figures, held_out: figures,
  floor: figures, accepted: null, basis, diagnosis: null, corrected: null, plan: null, challenge: null,
});
const candidate = (effect: string, gain: number, step = 1): Candidate =>
  ({ effect, step, gain, probability: null, esr_after: figures, objection: null, predicted: null });

test("a chain stays flat, a branch is indented", () => {
  const all = [version(1, null), version(2, 1), version(3, 2), version(4, 1)];
  assert.deepEqual(tree(all).map(([v, depth]) => [v.id, depth]), [[1, 0], [2, 1], [3, 1], [4, 1]]);
  assert.deepEqual(tree([version(1, null), version(2, 1), version(3, 2)]).map(([, depth]) => depth), [0, 0, 0]);
});

test("every version is in the tree once, also one whose origin was removed", () => {
  const ids = tree([version(5, 4), version(6, 5), version(7, null)]).map(([v]) => v.id);
  assert.deepEqual([...ids].sort(), [5, 6, 7]);
});

test("the ladder goes from the first version to the present one, on the same recordings", () => {
  const all = [version(1, null, "other"), version(2, 1), version(3, 2), version(4, 2)];
  assert.deepEqual(ladder(all, all[2]!).map((v) => v.id), [2, 3]);
  assert.deepEqual(ladder(all, null), []);
});

test("candidates are those of the first step, best first, each once", () => {
  const diagnosis = { candidates: [candidate("a", 0.2), candidate("b", 0.9), candidate("a", 0.1), candidate("c", 1, 2)] };
  const v = { ...version(1, null), diagnosis } as unknown as Version;
  assert.deepEqual(tried(v).map((c) => [c.effect, c.gain]), [["b", 0.9], ["a", 0.2]]);
});
