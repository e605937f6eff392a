// The solid ellipsoid of uniform density with a given mass and inertia.
import { Matrix4, Vector3 } from "three";

/** Maximum sweeps of the eigenvalue iteration; four are usual. */
const SWEEPS = 12;

/**
 * Returns the principal moments of a symmetric matrix xx xy xz yy yz zz, and its axes as the columns of a rotation. Jacobi's method: Golub and Van
 * Loan, 8.5.
 */
export function principal([xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0]: readonly number[]): { moments: [number, number, number]; axes: number[][] } {
  const m = [
    [xx, xy, xz],
    [xy, yy, yz],
    [xz, yz, zz],
  ];
  const v = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  const at = (rows: number[][], i: number, j: number): number => rows[i]?.[j] ?? 0;
  const rotate = (rows: number[][], i: number, j: number, k: number, l: number, s: number, c: number): void => {
    const [a, b] = [at(rows, i, j), at(rows, k, l)];
    const [first, second] = [rows[i], rows[k]];
    if (first) first[j] = c * a - s * b;
    if (second) second[l] = s * a + c * b;
  };
  for (let sweep = 0; sweep < SWEEPS; sweep += 1) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]] as const) {
      const off = at(m, p, q);
      if (off === 0) continue;
      const theta = (at(m, q, q) - at(m, p, p)) / (2 * off);
      const t = Math.sign(theta || 1) / (Math.abs(theta) + Math.hypot(theta, 1));
      const c = 1 / Math.hypot(t, 1);
      const s = t * c;
      for (let k = 0; k < 3; k += 1) rotate(m, k, p, k, q, s, c);
      for (let k = 0; k < 3; k += 1) rotate(m, p, k, q, k, s, c);
      for (let k = 0; k < 3; k += 1) rotate(v, k, p, k, q, s, c);
    }
  }
  return { moments: [at(m, 0, 0), at(m, 1, 1), at(m, 2, 2)], axes: v };
}

/** Returns link_from_ellipsoid of a ball of one metre: its axes and semi-axes, at the centre of mass. Undefined without a mass. */
export function ellipsoidOf(mass: number, centre: readonly [number, number, number], inertia: readonly number[]): Matrix4 | undefined {
  if (!(mass > 0) || inertia.length !== 6) return undefined;
  const { moments, axes } = principal(inertia);
  const [a, b, c] = moments;
  // I_x = m (b^2 + c^2) / 5, and so on. Inertias of descriptions may be impossible: then an axis is thin.
  const semi = [b + c - a, a + c - b, a + b - c].map((sum) => Math.sqrt(Math.max(0, (5 * sum) / (2 * mass))));
  const longest = Math.max(...semi);
  if (!(longest > 0) || !Number.isFinite(longest)) return undefined;
  const column = (index: number): Vector3 => new Vector3(...axes.map((row) => row[index] ?? 0)).multiplyScalar(Math.max(semi[index] ?? 0, 1e-3 * longest));
  return new Matrix4().makeBasis(column(0), column(1), column(2)).setPosition(...centre);
}
