// Live colours and values on the driveline drawing, by the ids the drawing carries.
import { display, format } from "./dom.js";

/** Paint states and values into the drawing: friction devices by state, gears by direction of power, masses by speed. */
export function colour(svg, lookup) {
  for (const group of svg.querySelectorAll("g.device, g.mass")) {
    const isMass = group.id.startsWith("mass-"), name = group.id.replace(/^(device|mass)-/, "");
    const value = group.querySelector("text.value");
    if (isMass) {
      const speed = lookup(`mass.${name}.speed`);
      if (speed && value) { const shown = display(speed.unit); value.textContent = `${format(speed.value * shown.factor, shown.digits)} ${shown.unit}`; }
      continue;
    }
    const paint = (state) => {
      group.classList.remove("open", "slipping", "locked");
      group.classList.add(state);
    };
    const pair = lookup(`clutch.${name}.state`) ?? lookup(`freewheel.${name}.state`);
    if (pair) paint(["locked", "slipping", "open"][Math.round(pair.value)] ?? "open");
    const flank = lookup(`backlash.${name}.state`); // +1 or -1: the flank that presses
    if (flank) paint(Math.round(flank.value) === 0 ? "open" : "locked");
    const torque = lookup(`clutch.${name}.torque`) ?? lookup(`freewheel.${name}.torque`) ?? lookup(`backlash.${name}.torque`) ?? lookup(`shaft.${name}.torque`) ?? lookup(`gear.${name}.torque`) ?? lookup(`row.${name}.sun`);
    const direction = lookup(`gear.${name}.direction`) ?? lookup(`row.${name}.direction`);
    const arrow = direction ? (direction.value > 0 ? " ▶" : direction.value < 0 ? " ◀" : " ■") : "";
    if (torque && value) value.textContent = `${format(torque.value, 0)} ${torque.unit}${arrow}`;
  }
}
