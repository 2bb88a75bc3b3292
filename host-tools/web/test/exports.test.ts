import assert from "node:assert/strict";
import { test } from "node:test";
import { table } from "../src/exports";

const window = (samples: number, least: number[], largest = least) =>
  ({ from: 1, step: 0.1, samples, least: Float32Array.from(least), largest: Float32Array.from(largest) });

test("every sample is a row, what is not there is empty", () => {
  const text = table("a\nb.csv", [{ name: "u_v", window: window(1, [1, 2.5]) }, { name: "none", window: null }, { name: "i_a", window: window(1, [3]) }]);
  assert.equal(text, "# recording: a b.csv\n# resolution: every sample\nt_s,u_v,i_a\n1,1,3\n1.1,2.5,\n");
});

test("least and largest are told apart", () => {
  const lines = table("r", [{ name: "u_v", window: window(20, [-1], [4]) }]).split("\n");
  assert.deepEqual(lines.slice(1), ["# resolution: least and largest of 20 samples", "t_s,u_v_least,u_v_largest", "1,-1,4", ""]);
});
