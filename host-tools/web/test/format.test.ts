import assert from "node:assert/strict";
import { test } from "node:test";
import { percent, rounded, seconds, withPrefix } from "../src/format";

test("per cent with as many digits as matter", () => {
  assert.deepEqual([0.194, 0.0226, 0.00078, null].map(percent), ["19.4 %", "2.26 %", "0.078 %", "–"]);
});

test("prefixes leave one to three digits before the point", () => {
  assert.deepEqual([withPrefix(1e4, "Hz"), withPrefix(0.0012, "s"), withPrefix(-2.5e-7, "A"), withPrefix(0, "V")], ["10 kHz", "1.2 ms", "-250 nA", "0 V"]);
});

test("numbers and times", () => {
  assert.equal(rounded(0.00001234), "1.234e-5");
  assert.deepEqual([rounded(null), rounded(NaN), rounded(0)], ["–", "–", "0"]);
  assert.deepEqual([seconds(12), seconds(0.25), seconds(90)], ["12 s", "0.25 s", "1 min 30 s"]);
});
