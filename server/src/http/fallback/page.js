// Asks for the robots four times a second while the page is visible, and writes them into tables.
const PERIOD = 250;
const LONGEST_PAUSE = 5000;
const COLUMNS = ["joint", "mode", "position", "velocity", "effort", "target"];

const byId = (id) => document.getElementById(id);
/** By robot: its section and the cells of its joints. */
const shown = new Map();

function element(name, text = "", parent = null) {
  const made = document.createElement(name);
  made.textContent = text;
  parent?.append(made);
  return made;
}

/** One row for each of a joint's axes. */
function rows(joint) {
  return joint.mode.map((mode, axis) => {
    const many = joint.mode.length > 1;
    const slides = joint.type === "prismatic" || (joint.type === "planar" && axis < 2) || (joint.type === "floating" && axis < 3);
    const unit = slides ? "m" : "rad";
    const force = slides ? "N" : "N m";
    const number = (value, of) => (value === undefined ? "" : `${value.toFixed(4)} ${of}`);
    const target = { position: unit, hold: unit, velocity: `${unit}/s`, effort: force }[mode];
    // The position of a floating joint is a pose, which has no value for each rate.
    const position = joint.position.length === joint.mode.length ? number(joint.position[axis], unit) : "";
    return [
      many ? `${joint.name} ${axis}` : joint.name,
      mode,
      position,
      number(joint.velocity[axis], `${unit}/s`),
      number(joint.effort[axis], force),
      target ? number(joint.target[axis], target) : "",
    ];
  });
}

function section(name, count) {
  const made = element("section");
  element("h2", name, made);
  const scroll = element("div", "", made);
  scroll.className = "scroll";
  const table = element("table", "", scroll);
  const head = element("tr", "", element("thead", "", table));
  for (const column of COLUMNS) element("th", column, head).scope = "col";
  const body = element("tbody", "", table);
  const cells = Array.from({ length: count }, () => {
    const row = element("tr", "", body);
    return COLUMNS.map(() => element("td", "", row));
  });
  byId("robots").append(made);
  return { made, cells };
}

function show(world) {
  byId("name").textContent = world.name;
  document.title = `simd ${world.name}`;
  byId("world").textContent = `${world.state}, t ${world.sim_time.toFixed(3)} s`;
  byId("world").className = "";
  byId("empty").hidden = world.robots.length > 0;
  const here = new Set(world.robots.map((robot) => robot.name));
  for (const [name, { made }] of shown) {
    if (!here.has(name)) {
      made.remove();
      shown.delete(name);
    }
  }
  for (const robot of world.robots) {
    const wanted = robot.joints.flatMap(rows);
    if (shown.get(robot.name)?.cells.length !== wanted.length) {
      shown.get(robot.name)?.made.remove();
      shown.set(robot.name, section(robot.name, wanted.length));
    }
    const { cells } = shown.get(robot.name);
    wanted.forEach((row, at) => row.forEach((text, column) => {
      const cell = cells[at][column];
      if (cell.textContent !== text) cell.textContent = text;
    }));
  }
}

let pause = PERIOD;
async function ask() {
  if (!document.hidden) {
    try {
      const answer = await fetch("/robots", { signal: AbortSignal.timeout(LONGEST_PAUSE) });
      if (!answer.ok) throw new Error(await answer.text());
      show(await answer.json());
      pause = PERIOD;
    } catch (error) {
      byId("world").textContent = `the daemon does not answer: ${error.message}`;
      byId("world").className = "lost";
      pause = Math.min(2 * pause, LONGEST_PAUSE);
    }
  }
  setTimeout(ask, pause);
}
ask();
