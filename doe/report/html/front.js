"use strict";
// A point of the front, chosen by slider, pointer or click: its clearances and responses, marked in every picture.
(() => {
  const {data, by} = page, REACH = 24;
  const first = data.fronts.map((_, k) => data.fronts.slice(0, k).reduce((sum, front) => sum + front.points.length, 0));
  const all = data.fronts.flatMap(front => front.points);
  const pictures = [...document.querySelectorAll("svg[data-front]")].map(marked_picture);
  const compared = ["baseline", "pick"].filter(name => data.compared[name]);
  let chosen = 0;

  const set_of = number => first.findLastIndex(start => number >= start);
  const tolerance = factor => factor.tolerance ? ` ± ${factor.tolerance}` : "";

  // A picture with the corners [[u, v], ...] of each point and the mark that follows the chosen one: a ring over a pair of
  // responses, a line over parallel axes.
  function marked_picture(svg) {
    const {kind, axes, frame: [left, upper, right, lower]} = JSON.parse(svg.dataset.front), pair = kind === "pair";
    const share = (point, [values, place, low, high]) => (point[values === "factors" ? "x" : "y"][place] - low) / (high - low);
    const across = part => left + (right - left) * part, up = part => lower - (lower - upper) * part;
    const corners = point => pair
      ? [[across(share(point, axes[0])), up(share(point, axes[1]))]]
      : axes.map((axis, k) => [across((k + 0.5) / axes.length), up(share(point, axis))]);
    const mark = document.createElementNS(svg.namespaceURI, pair ? "circle" : "polyline");
    mark.setAttribute("class", "chosen");
    if (pair) mark.setAttribute("r", 7);
    svg.append(mark);
    return {svg, pair, mark, places: all.map(corners)};
  }

  function rows(number) {
    const point = all[number], columns = [point, ...compared.map(name => data.compared[name])];
    const factors = data.factors.map((factor, k) => [
      page.named(factor), ...columns.map((one, c) => one.x[k] === null ? "" : one.x[k].toFixed(factor.decimals + 1) + (c ? "" : tolerance(factor)))]);
    const responses = data.responses.map((response, k) => [
      page.named(response), ...columns.map(one => page.with_error(one.y[k], one.e && one.e[k]))]);
    const robust = point.r ? data.responses.map((response, k) => [
      `${page.named(response)}, with tolerances`, page.shown(point.r[k]), ...compared.map(() => "")]) : [];
    return [...factors, ...responses, ...robust];
  }

  function fill(number) {
    const head = page.element("tr", ""), body = by("front_point").tBodies[0];
    head.append(...["", "chosen", ...compared.map(name => name === "pick" ? "selected" : name)].map(words => page.element("th", words, {scope: "col"})));
    by("front_point").tHead.replaceChildren(head);
    body.replaceChildren(...rows(number).map(([name, ...cells]) => {
      const row = page.element("tr", "");
      row.append(page.element("th", name, {scope: "row"}), ...cells.map(cell => page.element("td", cell)));
      return row;
    }));
  }

  function show(number) {
    fill(number);
    for (const {pair, mark, places} of pictures) {
      const corners = places[number];
      if (!pair) mark.setAttribute("points", corners.map(corner => corner.map(x => x.toFixed(1)).join()).join(" "));
      else ["cx", "cy"].forEach((name, k) => mark.setAttribute(name, corners[0][k].toFixed(1)));
    }
  }

  function choose(number) {
    const k = set_of(number), place = number - first[k], slider = by("front_slider");
    chosen = number;
    by("front_set").value = k;
    slider.max = data.fronts[k].points.length - 1;
    slider.value = place;
    by("front_number").textContent = `${place + 1} of ${data.fronts[k].points.length}`;
    slider.setAttribute("aria-valuetext", rows(number).map(row => `${row[0]} ${row[1]}`).join(", "));
    show(number);
  }

  // The point of a picture that is nearest to the pointer, if it is near.
  function under({svg, pair, places}, event) {
    const pointer = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const away = pair ? ([[u, v]]) => Math.hypot(u - pointer.x, v - pointer.y) : corners => height(corners, pointer);
    let best = null, least = REACH;
    places.forEach((corners, number) => {
      const distance = away(corners);
      if (distance < least) { least = distance; best = number; }
    });
    return best;
  }

  // Height between a line of the parallel coordinates and the pointer.
  function height(corners, pointer) {
    const after = corners.findIndex(([u]) => u >= pointer.x);
    if (after < 1) return Infinity;
    const [[u, v], [next_u, next_v]] = [corners[after - 1], corners[after]];
    return Math.abs(v + (next_v - v) * (pointer.x - u) / (next_u - u) - pointer.y);
  }

  for (const picture of pictures) {
    picture.svg.addEventListener("pointermove", event => {
      const number = under(picture, event);
      show(number === null ? chosen : number);
    });
    picture.svg.addEventListener("pointerleave", () => show(chosen));
    picture.svg.addEventListener("click", event => {
      const number = under(picture, event);
      if (number !== null) choose(number);
    });
  }
  data.fronts.forEach((front, k) => by("front_set").append(page.element("option", front.words, {value: k})));
  by("front_set_label").hidden = data.fronts.length < 2;
  by("front_set").addEventListener("change", () => choose(first[Number(by("front_set").value)]));
  by("front_slider").addEventListener("input", () => choose(first[Number(by("front_set").value)] + Number(by("front_slider").value)));

  // Start at the pick.
  const pick = data.compared.pick;
  const away = point => point.x.reduce((sum, x, k) => sum + ((x - pick.x[k]) / (data.factors[k].step || 1)) ** 2, 0);
  const start = pick ? all.reduce((best, point, k) => away(point) < away(all[best]) ? k : best, 0) : 0;
  choose(start);
})();
