  // what the page around it asks: to stop, and to go on with other numbers of the same robot
  const hide = (name, text) => {
    layers.set(name, false);
    for (const label of at("layers").querySelectorAll("label")) if (label.textContent.trim() === text) label.querySelector("input").checked = false;
  };
  // torques are looked at here, and large ellipsoids stand before them
  if (!asked.has("show")) hide("ellipsoids", "inertia ellipsoids");
  return {
    stop() {
      play(false);
      [show, redraw, frame, drawing] = [() => {}, () => {}, () => {}, null];
    },
    update(data) {
      Object.assign(DATA, data);
      TIMES.set(new Float64Array(bytes(data.times)));
      POSES.set(new Float32Array(bytes(data.poses)));
      data.columns.forEach((text, k) => COLUMNS[k].set(new Float32Array(bytes(text))));
      for (const group of groups.values()) group.most = 0;
      for (const arrow of DATA.arrows) {
        const group = groups.get(arrow.group);
        for (let row = 0; row < TIMES.length; row++) group.most = Math.max(group.most, Math.hypot(...arrow.columns.map((c) => COLUMNS[c][row])));
      }
      for (const label of at("layers").querySelectorAll("label")) {
        for (const [name, { most, unit: measured }] of groups) {
          if (label.textContent.trim().startsWith(`${name}, at most`)) label.lastChild.textContent = `${name}, at most ${written(most, 3)} ${measured}`;
        }
      }
      plots.forEach((plot) => plot.layOut());
      redraw();
    },
  };
