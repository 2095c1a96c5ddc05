"use strict";
// A point of the front, chosen by slider, pointer or click: its clearances and responses, marked in every picture.
(() => {
  const {data, by} = page, REACH = 24;
  const pictures = [...document.querySelectorAll("svg[data-front]")];
  const first = data.fronts.map((_, k) => data.fronts.slice(0, k).reduce((sum, each) => sum + each.points.length, 0));
  const all = data.fronts.flatMap(each => each.points);
  const marks = pictures.map(svg => [...svg.querySelectorAll("[data-point]")]);
  const beside = ["baseline", "pick"].filter(name => data.beside[name]);
  let chosen = 0;

  const set_of = number => first.findLastIndex(each => number >= each);
  const tolerance = each => each.tolerance ? ` ± ${each.tolerance}` : "";

  function rows(number) {
    const point = all[number], columns = [point, ...beside.map(name => data.beside[name])];
    const factors = data.factors.map((each, k) => [
      page.named(each), ...columns.map((one, c) => one.x[k] === null ? "" : one.x[k].toFixed(each.decimals + 1) + (c ? "" : tolerance(each)))]);
    const responses = data.responses.map((each, k) => [
      page.named(each), ...columns.map(one => page.with_error(one.y[k], one.e && one.e[k]))]);
    const robust = point.r ? data.responses.map((each, k) => [`${page.named(each)}, with tolerances`, page.shown(point.r[k]), ...beside.map(() => "")]) : [];
    return [...factors, ...responses, ...robust];
  }

  function fill(number) {
    const head = page.element("tr", ""), body = by("front_point").tBodies[0];
    head.append(...["", "chosen", ...beside].map(words => page.element("th", words, {scope: "col"})));
    by("front_point").tHead.replaceChildren(head);
    body.replaceChildren(...rows(number).map(([name, ...cells]) => {
      const row = page.element("tr", "");
      row.append(page.element("th", name, {scope: "row"}), ...cells.map(cell => page.element("td", cell)));
      return row;
    }));
  }

  function mark(number) {
    pictures.forEach((svg, k) => {
      const at = marks[k].find(each => Number(each.dataset.point) === number), on = svg.querySelector(".chosen");
      if (!at || !on) return;
      for (const name of ["cx", "cy", "points"])
        if (at.hasAttribute(name)) on.setAttribute(name, at.getAttribute(name));
    });
  }

  function show(number) {
    fill(number);
    mark(number);
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
  function under(svg, event) {
    const k = pictures.indexOf(svg), way = svg.getScreenCTM().inverse();
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(way);
    let best = null, least = REACH;
    for (const each of marks[k]) {
      const away = each.hasAttribute("cx")
        ? Math.hypot(each.getAttribute("cx") - at.x, each.getAttribute("cy") - at.y)
        : thread(each, at);
      if (away < least) { least = away; best = Number(each.dataset.point); }
    }
    return best;
  }

  // Height between a line of the parallel coordinates and the pointer.
  function thread(line, at) {
    const corners = [...line.points], after = corners.findIndex(corner => corner.x >= at.x);
    if (after < 1) return Infinity;
    const [a, b] = [corners[after - 1], corners[after]];
    return Math.abs(a.y + (b.y - a.y) * (at.x - a.x) / (b.x - a.x) - at.y);
  }

  pictures.forEach(svg => {
    svg.addEventListener("pointermove", event => {
      const number = under(svg, event);
      show(number === null ? chosen : number);
    });
    svg.addEventListener("pointerleave", () => show(chosen));
    svg.addEventListener("click", event => {
      const number = under(svg, event);
      if (number !== null) choose(number);
    });
  });
  data.fronts.forEach((each, k) => by("front_set").append(page.element("option", each.words, {value: k})));
  by("front_set_label").hidden = data.fronts.length < 2;
  by("front_set").addEventListener("change", () => choose(first[Number(by("front_set").value)]));
  by("front_slider").addEventListener("input", () => choose(first[Number(by("front_set").value)] + Number(by("front_slider").value)));

  // Start at the pick.
  const pick = data.beside.pick;
  const away = point => point.x.reduce((sum, x, k) => sum + ((x - pick.x[k]) / (data.factors[k].step || 1)) ** 2, 0);
  const start = pick ? all.reduce((best, point, k) => away(point) < away(all[best]) ? k : best, 0) : 0;
  choose(start);
})();
