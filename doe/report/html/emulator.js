"use strict";
// An emulator of the simulator, a trend and a process with the runs of a search behind it: mean and standard deviation of a
// response without its scatter, at factors that are -1 to 1 in the region of the design and levels of the categories.
const emulator = (() => {
  const solved = new Map(), known = new Map();

  // A point as the emulators know it: a coordinate a factor, 0 where that means nothing, and one a level.
  const idle = (all, k, kinds) => all.categories.some((each, c) => each.inactive[kinds[c]].includes(k));
  const embedded = (all, coded, kinds) =>
    [...coded.map((x, k) => idle(all, k, kinds) ? 0 : x), ...all.categories.flatMap((each, c) => each.levels.map((_, level) => level === kinds[c] ? 1 : 0))];

  const point = (all, factors, kinds) =>
    embedded(all, factors.map((value, k) => (value - all.centre[k]) / all.half_range[k]), kinds);

  // A point as one emulator knows it: factors that have a share by their logarithms.
  const told = (one, at) => at.map((x, k) => one.shares[k] ? Math.log1p(one.shares[k] * x) / one.shares[k] : x);

  function runs(all, one) {
    if (!known.has(one)) known.set(one, all.points.map((run, i) => told(one, embedded(all, run, all.kinds[i]))));
    return known.get(one);
  }

  // Covariance of two points: Matern of smoothness 5/2 with a length a coordinate.
  function covariance(one, a, b) {
    let apart = 0;
    for (let k = 0; k < a.length; k++) apart += ((a[k] - b[k]) / one.lengths[k]) ** 2;
    const far = Math.sqrt(5 * apart);
    return one.variance * (1 + far + far * far / 3) * Math.exp(-far);
  }

  const product = (a, b) => a.reduce((sum, each, k) => sum + each * b[k], 0);

  function mean(all, one, place) {
    const at = told(one, place), process = runs(all, one).reduce((sum, run, i) => sum + covariance(one, at, run) * one.weights[i], 0);
    return product(model.row(one, at), one.coefficients) + process;
  }

  // Lower triangular root of a matrix, by Cholesky.
  function root(matrix) {
    const found = matrix.map(() => []);
    matrix.forEach((row, i) => {
      for (let j = 0; j <= i; j++) {
        let rest = row[j];
        for (let k = 0; k < j; k++) rest -= found[i][k] * found[j][k];
        found[i].push(i === j ? Math.sqrt(rest) : rest / found[j][j]);
      }
    });
    return found;
  }

  function forward(lower, right) {
    const found = [];
    lower.forEach((row, i) => {
      let rest = right[i];
      for (let k = 0; k < i; k++) rest -= row[k] * found[k];
      found.push(rest / row[i]);
    });
    return found;
  }

  // What of a response stays the same for all points: roots of the covariance of the runs and of the trend's information.
  function prepared(all, one) {
    if (!solved.has(one)) {
      const lower = root(runs(all, one).map((a, i) => runs(all, one).map((b, j) => covariance(one, a, b) + (i === j ? one.noise[i] : 0))));
      const rows = runs(all, one).map(run => model.row(one, run));
      const trend = one.terms.map((_, term) => forward(lower, rows.map(row => row[term])));
      solved.set(one, {lower, trend, information: root(trend.map(a => trend.map(b => product(a, b))))});
    }
    return solved.get(one);
  }

  function deviation(all, one, place) {
    const at = told(one, place), {lower, trend, information} = prepared(all, one);
    const inside = forward(lower, runs(all, one).map(run => covariance(one, at, run)));
    const left = forward(information, model.row(one, at).map((column, term) => column - product(trend[term], inside)));
    const variance = one.variance - product(inside, inside) + product(left, left);
    return Math.max(one.stretch * Math.sqrt(Math.max(variance, 0)), one.least);
  }

  return {point, mean, deviation};
})();
