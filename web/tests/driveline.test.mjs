// What the driveline drawing shows of each kind of device, on a drawing of one group.
//   node --test web/tests/driveline.test.mjs
import assert from "node:assert/strict";
import { test } from "node:test";
import { colour } from "../src/driveline.js";

/** The classes and the text that a device has after painting `signals`: {name: {value, unit}}. */
function painted(name, signals) {
  const classes = new Set(["open"]), value = { textContent: "" };
  const group = {
    id: `device-${name}`,
    classList: { add: (c) => classes.add(c), remove: (...all) => all.forEach((c) => classes.delete(c)) },
    querySelector: () => value,
  };
  colour({ querySelectorAll: () => [group] }, (signal) => signals[signal] ?? null);
  return [...classes, value.textContent];
}

test("clutches, freewheels and backlashes show their state and their torque", () => {
  const shown = (kind, state) =>
    painted("X", { [`${kind}.X.state`]: { value: state, unit: "" }, [`${kind}.X.torque`]: { value: 42.4, unit: "Nm" } });
  assert.deepEqual(shown("clutch", 0), ["locked", "42 Nm"]);
  assert.deepEqual(shown("freewheel", 0), ["locked", "42 Nm"]);
  assert.deepEqual(shown("freewheel", 2), ["open", "42 Nm"]);
  assert.deepEqual(shown("backlash", -1), ["locked", "42 Nm"]);
  assert.deepEqual(shown("backlash", 0), ["open", "42 Nm"]);
});

test("a value stands in its signal's unit", () => {
  assert.deepEqual(painted("X", { "clutch.X.torque": { value: 7, unit: "N" } }), ["open", "7 N"]);
});
