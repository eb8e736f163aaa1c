  // what the page around it asks: to stop, and to go on with other numbers of the same robot
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
