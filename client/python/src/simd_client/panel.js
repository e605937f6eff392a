// The panel of a robot in a notebook: a slider for each joint, whose handle is the target and whose bar is where the joint is.
function render({ model, el }) {
  const box = document.createElement("div");
  box.style.cssText = "display:grid;grid-template-columns:max-content 1fr max-content;gap:4px 12px;max-width:640px;align-items:center";
  const head = document.createElement("div");
  head.style.cssText = "grid-column:1/-1;font-weight:600";
  box.append(head);
  let moves = 0;
  const rows = model.get("joints").map((joint, index) => {
    const name = document.createElement("span");
    name.textContent = joint.name;
    const middle = document.createElement("div");
    const slider = document.createElement("input");
    slider.type = "range";
    slider.min = joint.lower;
    slider.max = joint.upper;
    slider.step = (joint.upper - joint.lower) / 1000;
    slider.style.width = "100%";
    slider.setAttribute("aria-label", `${joint.name}, target`);
    const bar = document.createElement("progress");
    bar.max = 1;
    bar.style.cssText = "width:100%;height:6px;display:block";
    const number = document.createElement("span");
    number.style.fontVariantNumeric = "tabular-nums";
    let held = false;
    slider.addEventListener("pointerdown", () => (held = true));
    slider.addEventListener("pointerup", () => (held = false));
    slider.addEventListener("input", () => {
      moves += 1;
      model.set("wanted", [index, Number(slider.value), moves]);
      model.save_changes();
    });
    middle.append(slider, bar);
    box.append(name, middle, number);
    return { joint, slider, bar, number, isHeld: () => held };
  });
  const problem = document.createElement("div");
  problem.style.cssText = "grid-column:1/-1;color:#b00020";
  box.append(problem);
  const show = () => {
    const positions = model.get("positions");
    const targets = model.get("targets");
    head.textContent = `${model.get("robot")}, ${model.get("time").toFixed(2)} s`;
    problem.textContent = model.get("problem");
    rows.forEach(({ joint, slider, bar, number, isHeld }, index) => {
      const position = positions[index] ?? 0;
      bar.value = Math.min(1, Math.max(0, (position - joint.lower) / (joint.upper - joint.lower)));
      number.textContent = `${position.toFixed(3)} ${joint.unit}`;
      if (!isHeld()) slider.value = targets[index] ?? position;
    });
  };
  for (const name of ["positions", "targets", "time", "problem"]) model.on(`change:${name}`, show);
  show();
  el.append(box);
  return () => {
    for (const name of ["positions", "targets", "time", "problem"]) model.off(`change:${name}`, show);
  };
}

export default { render };
