"use strict";
// Which surface is shown: response, two factors, the others at their sliders; rotation, marker, values read out. Where a search
// has left its emulators, their surface is shown in place of the polynomial on demand, in the same colours.
(() => {
  const {data, by} = page, STEPS = 41, TURN = 0.08, searched = data.emulators;
  const ends = data.factors.map((each, k) => searched ? searched.region[k] : [each.low, each.high]);
  let emulated = Boolean(searched);
  const view = {azimuth: 0.9, elevation: 0.5};
  const at = data.factors.map(each => each.centre);
  const marker = data.factors.map(each => each.centre);
  let pick_up_map = null, pick_up_space = null, dragging = null;

  const coded = values => values.map((value, k) => (value - data.factors[k].centre) / data.factors[k].step);
  const surface = () => data.surfaces[Number(by("surface_response").value)];
  const shown_pair = () => [Number(by("surface_x").value), Number(by("surface_y").value)];
  const near = (a, b, k) => Math.abs(a - b) < 1e-6 * data.factors[k].step;
  const shapes = {baseline: "square", pick: "star"};
  const along = (k, share) => ends[k][0] + (ends[k][1] - ends[k][0]) * share;

  // The polynomial is known in the region of the design, the emulator all over.
  function polynomial(one, place) {
    const out = searched
      && data.factors.some((each, k) => place[k] < each.low - 1e-6 * each.step || place[k] > each.high + 1e-6 * each.step);
    return out ? NaN : model.value(one, coded(place));
  }
  const by_emulator = (one, place, what = emulator.mean) =>
    what(searched, searched.responses[one.name], emulator.point(searched, place));

  // Runs behind the surface that is shown: those of the design, or all of the search too.
  function runs(one) {
    if (!emulated) return data.runs.map(run => ({factors: run.factors, value: run.values[one.name]}));
    return searched.points.map((point, i) => ({
      factors: searched.centre.map((centre, k) => centre + searched.half_range[k] * point[k]),
      value: searched.responses[one.name].values[i]}));
  }

  function scene() {
    const [x, y] = shown_pair(), one = surface(), fx = data.factors[x], fy = data.factors[y];
    const grid = height => {
      const point = at.slice();
      return Array.from({length: STEPS}, (_, i) => Array.from({length: STEPS}, (_, j) => {
        point[x] = along(x, i / (STEPS - 1));
        point[y] = along(y, j / (STEPS - 1));
        return height(one, point);
      }));
    };
    const heights_of = searched ? [polynomial, by_emulator].map(grid) : [grid(polynomial)], z = heights_of[Number(emulated)];
    const height = emulated ? by_emulator : polynomial;
    const here = factors => factors.every((value, k) => k === x || k === y || near(value, at[k], k));
    const on = factors => height(one, at.map((value, k) => k === x || k === y ? factors[k] : value));
    const points = runs(one).filter(run => run.value !== null && !run.factors.includes(null)).map(run => (
      {x: run.factors[x], y: run.factors[y], z: run.value, here: here(run.factors), surface: on(run.factors)}));
    const marks = Object.entries(data.marks).map(([name, factors]) => (
      {x: factors[x], y: factors[y], shape: shapes[name], here: here(factors), surface: on(factors)}));
    const run_values = searched ? searched.responses[one.name].values : points.map(each => each.z);
    const heights = [...heights_of.flat(2), ...run_values].filter(Number.isFinite);
    const low = Math.min(...heights), high = Math.max(...heights);
    return {
      bounds: one.bounds || [], x: ends[x], y: ends[y], z, points, marks, low, high: high > low ? high : low + 1,
      labels: [page.named(fx), page.named(fy), page.named(one)],
      marker: [marker[x], marker[y]], height: on(marker),
    };
  }

  function draw() {
    const s = scene();
    pick_up_space = surface_3d.draw(by("surface_3d"), s, view);
    pick_up_map = contours.draw(by("surface_map"), s);
    read();
  }

  function read() {
    const pair = shown_pair(), one = surface(), unit = one.unit && ` ${one.unit}`;
    const place = at.map((value, k) => pair.includes(k) ? marker[k] : value), c = coded(place);
    const where = place.map((value, k) => {
      const each = data.factors[k];
      return `${each.words} ${value.toFixed(each.decimals + 1)}${each.unit && ` ${each.unit}`}`;
    });
    let height = `${page.with_error(polynomial(one, place), model.half_width(one, c))}${unit}`;
    if (searched) {
      const known = Number.isFinite(polynomial(one, place)) ? `${height} by the polynomial` : "not known to the polynomial";
      const [value, deviation] = page.rounded(by_emulator(one, place), by_emulator(one, place, emulator.deviation));
      height = `${value}${unit} by the emulator, standard deviation ${deviation}${unit}; ${known};`;
    }
    by("surface_read").textContent = `${one.words} ${height} at ${where.join(", ")}`;
  }

  function move_marker(shares) {
    shown_pair().forEach((k, which) => {
      marker[k] = along(k, Math.min(Math.max(shares[which], 0), 1));
    });
    draw();
  }

  // A slider for every factor that is not an axis.
  function sliders() {
    const pair = shown_pair();
    by("surface_others").replaceChildren(...data.factors.flatMap((each, k) => {
      if (pair.includes(k)) return [];
      const label = page.element("label", `${page.named(each)} `);
      const step = 10 ** -(each.decimals + 1);
      const input = page.element("input", "", {type: "range", min: ends[k][0], max: ends[k][1], step});
      const shown = page.element("output", at[k].toFixed(each.decimals + 1));
      input.value = at[k];
      input.addEventListener("input", () => {
        at[k] = Number(input.value);
        shown.textContent = at[k].toFixed(each.decimals + 1);
        draw();
      });
      label.append(input, shown);
      return [label];
    }));
  }

  function axes_changed(changed, other) {
    // The same factor cannot be both axes: the other one gives way.
    if (by(changed).value === by(other).value)
      by(other).value = data.factors.findIndex((_, k) => String(k) !== by(changed).value);
    sliders();
    draw();
  }

  function go_to(name) {
    data.marks[name].forEach((value, k) => { at[k] = value; marker[k] = value; });
    sliders();
    draw();
  }

  function rotate(across, up) {
    view.azimuth += across;
    view.elevation = Math.min(Math.max(view.elevation + up, 0.05), 1.5);
    draw();
  }

  const keys = (canvas, act) => canvas.addEventListener("keydown", event => {
    const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
    if (!way || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act(...way);
  });

  const space = by("surface_3d"), map = by("surface_map");
  keys(space, (across, up) => rotate(across * TURN, up * TURN));
  keys(map, (across, up) => {
    const step = 1 / (STEPS - 1);
    move_marker(shown_pair().map((k, which) =>
      (marker[k] - ends[k][0]) / (ends[k][1] - ends[k][0]) + step * [across, up][which]));
  });
  space.addEventListener("pointerdown", event => {
    dragging = [event.clientX, event.clientY];
    space.setPointerCapture(event.pointerId);
  });
  space.addEventListener("pointermove", event => {
    if (dragging) {
      rotate(-(event.clientX - dragging[0]) * 0.01, (event.clientY - dragging[1]) * 0.01);
      dragging = [event.clientX, event.clientY];
    } else if (pick_up_space) {
      const shares = pick_up_space(event.offsetX, event.offsetY);
      if (shares) move_marker(shares);
    }
  });
  for (const end of ["pointerup", "pointercancel"]) space.addEventListener(end, () => { dragging = null; });
  map.addEventListener("pointermove", event => {
    const shares = pick_up_map && pick_up_map(event.offsetX, event.offsetY);
    if (shares && shares.every(share => share >= 0 && share <= 1)) move_marker(shares);
  });

  function choice(words, names, chosen, act) {
    const label = page.element("label", `${words} `), select = page.element("select", "");
    select.append(...names.map((name, k) => page.element("option", name, {value: k})));
    select.value = chosen;
    select.addEventListener("change", () => { act(Number(select.value)); draw(); });
    label.append(select);
    by("surface_others").before(label);
    return select;
  }

  data.surfaces.forEach((each, k) => by("surface_response").append(page.element("option", page.named(each), {value: k})));
  for (const name of ["surface_x", "surface_y"])
    data.factors.forEach((each, k) => by(name).append(page.element("option", page.named(each), {value: k})));
  by("surface_y").value = Math.min(1, data.factors.length - 1);
  by("surface_response").addEventListener("change", draw);
  by("surface_x").addEventListener("change", () => axes_changed("surface_x", "surface_y"));
  by("surface_y").addEventListener("change", () => axes_changed("surface_y", "surface_x"));
  for (const name of ["baseline", "pick"]) {
    by(`surface_${name}`).hidden = !data.marks[name];
    by(`surface_${name}`).addEventListener("click", () => go_to(name));
  }
  if (searched) {
    choice("Surface by", ["polynomial", "emulator"], 1, chosen => { emulated = chosen === 1; }).id = "surface_by";
    by("surface_help").textContent += " The polynomial knows the runs of the design, the emulator those of the search too; one scale colours both.";
  }
  sliders();
  page.draws(draw);
})();
