import assert from "node:assert/strict";
import { test } from "node:test";
import type { Map as Residual } from "../src/api";
import { cells, cellTable, stacked } from "../src/drawings";

const colours = { ground: "#fff", text: "#000", muted: "#555", grid: "#eee" };
const map: Residual = {
  x: { name: "current", unit: "A", edges: [0, 1, 2] }, y: { name: "speed", unit: "rad/s", edges: [0, 10] }, unit: "A", counts: [3, 0], mean: [-0.5, 0], rms: [0.6, 0],
};

test("a drawing of curves stands by itself, and names are text in it", () => {
  const text = stacked("<b> & co", [{ caption: "i, A", xs: [0, 1, 2], curves: [{ ys: [0, 1, null], colour: "rgb(1, 2, 3)", name: "a<b" }] }], [0, 2], 400, 100, colours);
  assert.ok(text.startsWith('<svg xmlns="http://www.w3.org/2000/svg"') && text.endsWith("</svg>"));
  assert.ok(text.includes("&lt;b&gt; &amp; co") && text.includes("a&lt;b") && !text.includes("<b>"));
  assert.equal(text.match(/<path /g)?.length, 1);
});

test("a map draws the cells in which the motor was, and tells them in a table", () => {
  const text = cells("map", map, (cell) => (map.counts[cell] ? { fill: "blue", stroke: "white" } : null), colours);
  assert.equal(text.match(/fill="blue"/g)?.length, 1);
  assert.equal(cellTable(map), 'current from,to,speed from,to,"mean, A","rms, A",samples\n0,1,0,10,-0.5,0.6,3\n');
});
