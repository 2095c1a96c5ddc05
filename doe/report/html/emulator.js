"use strict";
// An emulator of the simulator, a trend and a process with the runs of a search behind it: mean and standard deviation of a
// response without its scatter, at factors that are -1 to 1 in the region of the design.
const emulator = (() => {
  const factorizations = new Map(), transformed_runs = new Map();

  const point = (all, factors) => factors.map((value, k) => (value - all.centre[k]) / all.half_range[k]);

  // A point as one emulator uses it: factors with a share by their logarithms.
  const transformed = (one, scaled) => scaled.map((x, k) => one.shares[k] ? Math.log1p(one.shares[k] * x) / one.shares[k] : x);

  function runs(all, one) {
    if (!transformed_runs.has(one)) transformed_runs.set(one, all.points.map(run => transformed(one, run)));
    return transformed_runs.get(one);
  }

  // Covariance of two points: Matern of smoothness 5/2 with a length for each coordinate.
  function covariance(one, a, b) {
    let square = 0;
    for (let k = 0; k < a.length; k++) square += ((a[k] - b[k]) / one.lengths[k]) ** 2;
    const distance = Math.sqrt(5 * square);
    return one.variance * (1 + distance + distance * distance / 3) * Math.exp(-distance);
  }

  // Prior covariance of a response at two points: of its trend and of the process.
  function prior(one, a, b) {
    const other = model.row(one, b);
    return model.row(one, a).reduce((sum, column, term) => sum + one.coefficient_variances[term] * column * other[term], covariance(one, a, b));
  }

  const product = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);

  function mean(all, one, place) {
    const scaled = transformed(one, place), process = runs(all, one).reduce((sum, run, i) => sum + covariance(one, scaled, run) * one.weights[i], 0);
    return product(model.row(one, scaled), one.coefficients) + process;
  }

  // Lower triangular root of a matrix, by Cholesky.
  function root(matrix) {
    const lower = matrix.map(() => []);
    matrix.forEach((row, i) => {
      for (let j = 0; j <= i; j++) {
        let rest = row[j];
        for (let k = 0; k < j; k++) rest -= lower[i][k] * lower[j][k];
        lower[i].push(i === j ? Math.sqrt(rest) : rest / lower[j][j]);
      }
    });
    return lower;
  }

  // Solution of a lower triangular system.
  function forward(lower, right) {
    const solution = [];
    lower.forEach((row, i) => {
      let rest = right[i];
      for (let k = 0; k < i; k++) rest -= row[k] * solution[k];
      solution.push(rest / row[i]);
    });
    return solution;
  }

  // Root of the covariance of the runs, the same for all points.
  function factorization(all, one) {
    if (!factorizations.has(one))
      factorizations.set(one, root(runs(all, one).map((a, i) => runs(all, one).map((b, j) => prior(one, a, b) + (i === j ? one.noise[i] : 0)))));
    return factorizations.get(one);
  }

  function deviation(all, one, place) {
    const scaled = transformed(one, place), explained = forward(factorization(all, one), runs(all, one).map(run => prior(one, scaled, run)));
    const variance = prior(one, scaled, scaled) - product(explained, explained);
    return Math.max(one.stretch * Math.sqrt(Math.max(variance, 0)), one.least);
  }

  return {point, mean, deviation};
})();
