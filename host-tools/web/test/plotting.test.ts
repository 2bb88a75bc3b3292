import assert from "node:assert/strict";
import { test } from "node:test";
import { columns } from "../src/exports";
import { decades, extent, nearest, path, scale, ticks } from "../src/plotting";

test("ticks are round numbers within the range", () => {
  assert.deepEqual(ticks(0, 10, 5), [0, 2, 4, 6, 8, 10]);
  assert.deepEqual(ticks(-0.31, 0.29, 4), [-0.2, 0, 0.2]);
  assert.deepEqual(ticks(3, 3, 5), [3]);
});

test("decades are powers of ten, and few", () => {
  assert.deepEqual(decades(0.5, 2000, 10), [1, 10, 100, 1000]);
  assert.ok(decades(1e-9, 1e9, 5).length <= 5);
});

test("a scale maps its ends to its ends", () => {
  const linear = scale(-1, 3, 10, 50, false), log = scale(0.1, 1000, 0, 40, true);
  assert.deepEqual([linear(-1), linear(1), linear(3)], [10, 30, 50]);
  assert.deepEqual([log(0.1), log(10), log(1000)].map((x) => Math.round(x * 1e9) / 1e9), [0, 20, 40]);
});

test("the extent of nothing is one all the same, and a logarithmic one is of whole decades", () => {
  assert.deepEqual(extent([[null, NaN]], false), [0, 1]);
  const [low, high] = extent([[2, 5], [-1, null]], false);
  assert.ok(low < -1 && high > 5);
  assert.deepEqual(extent([[0, -3, 0.2, 30]], true), [0.1, 100]);
  const [one, more] = extent([[10]], true);
  assert.ok(one < more, "a single value has room");
});

test("a line that is denser than pixels loses no spike", () => {
  const n = 10_000, xs = Array.from({ length: n }, (_, k) => k), ys = xs.map((k) => (k === 5005 ? 9 : 0));
  const drawn = path(xs, ys, scale(0, n, 0, 100, false), scale(0, 10, 100, 0, false));
  assert.match(drawn, /L50 10(?=L)/);
  assert.ok(drawn.length < 5000);
});

test("a gap interrupts the line", () => {
  const unit = scale(0, 10, 0, 100, false);
  assert.equal(path([0, 1, 2, 3], [1, null, 1, 2], unit, unit), "M0 10M20 10L30 20");
});

test("the nearest of ascending values is found", () => {
  assert.deepEqual([-5, 1.4, 1.6, 9].map((x) => nearest([0, 1, 2, 4], x)), [0, 1, 2, 3]);
});

test("values with an axis of their own keep it beside them", () => {
  const xs = [0, 1];
  assert.equal(columns("s", [{ name: "a, b", xs, ys: [1, null] }, { name: "c", xs, ys: [3, 4] }, { name: "d", xs: [5], ys: [6] }]),
    's,"a, b",c,s of d,d\n0,1,3,5,6\n1,,4,,\n');
});
