import assert from "node:assert/strict";
import { test } from "node:test";
import { points } from "../src/points";

const window = (from: number, step: number, samples: number, least: number[], largest = least) =>
  ({ from, step, samples, least: Float32Array.from(least), largest: Float32Array.from(largest) });

test("a stretch of samples is drawn from its least to its largest value", () => {
  const [xs, ys] = points([window(1, 0.5, 10, [-1, -2], [3, 4])]);
  assert.deepEqual([...xs!], [1, 1.25, 1.5, 1.75]);
  assert.deepEqual(ys, [-1, 3, -2, 4]);
});

test("curves that begin elsewhere stand at their own time, gaps stay gaps", () => {
  const [xs, first, second, none] = points([window(0, 1, 1, [1, 2, NaN]), window(1, 1, 1, [8, 9, 10]), null]);
  assert.deepEqual([...xs!], [0, 1, 2]);
  assert.deepEqual(first, [1, 2, null]);
  assert.deepEqual(second, [null, 8, 9]);
  assert.deepEqual(none, [null, null, null]);
});
