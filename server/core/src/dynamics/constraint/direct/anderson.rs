//! Anderson's acceleration of a fixed point z = g(z): the next z is chosen among all combinations of the last ones whose
//! residuals g(z) - z have the least norm (Walker and Ni, "Anderson acceleration for fixed-point iterations" (2011)). Where g is
//! affine, as many steps as z has numbers are enough.

/// Differences that are kept.
pub(in crate::dynamics) const DEPTH: usize = 6;

/// What is added to the diagonal of the normal equations, as a part of it.
pub(in crate::dynamics) const DAMPING: f64 = 1e-14;

/// The memory of it.
#[derive(Debug, Default)]
pub(in crate::dynamics) struct Anderson {
    /// The last z and its residual.
    last: [Vec<f64>; 2],
    /// Differences of z and of residuals, one after the other; the oldest is written over.
    differences: [Vec<f64>; 2],
    /// How many there have been.
    count: usize,
    is_begun: bool,
}

impl Anderson {
    /// Forgets what was.
    pub(in crate::dynamics) fn begin(&mut self) {
        (self.count, self.is_begun) = (0, false);
    }

    /// Replaces `z` by the next one. `residual` is g(z) - z.
    pub(in crate::dynamics) fn advance(&mut self, z: &mut [f64], residual: &[f64]) {
        let n = z.len();
        let size = |list: &mut Vec<f64>, size: usize| {
            list.clear();
            list.resize(size, 0.0);
        };
        let Self { last, differences, count, is_begun } = self;
        if !*is_begun {
            last.iter_mut().for_each(|list| size(list, n));
            differences.iter_mut().for_each(|list| size(list, DEPTH * n));
        } else {
            let at = *count % DEPTH * n;
            for (i, (z, residual)) in z.iter().zip(residual).enumerate() {
                differences[0][at + i] = z - last[0][i];
                differences[1][at + i] = residual - last[1][i];
            }
            *count += 1;
        }
        *is_begun = true;
        last[0].copy_from_slice(z);
        last[1].copy_from_slice(residual);
        let kept = (*count).min(DEPTH);
        let column = |list: usize, j: usize| &differences[list][j * n..(j + 1) * n];
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        // Normal equations, by Gauss: they are few, symmetric and not indefinite.
        let (mut matrix, mut right) = ([[0.0; DEPTH]; DEPTH], [0.0; DEPTH]);
        for (i, (row, right)) in matrix.iter_mut().zip(&mut right).take(kept).enumerate() {
            for (j, entry) in row.iter_mut().take(kept).enumerate() {
                *entry = dot(column(1, i), column(1, j));
            }
            row[i] *= 1.0 + DAMPING;
            *right = dot(column(1, i), residual);
        }
        for i in 0..kept {
            if matrix[i][i] <= 0.0 {
                matrix[i] = [0.0; DEPTH];
                (matrix[i][i], right[i]) = (1.0, 0.0);
            }
            let pivot = matrix[i];
            for j in i + 1..kept {
                let factor = matrix[j][i] / matrix[i][i];
                for (value, above) in matrix[j].iter_mut().zip(pivot).take(kept).skip(i) {
                    *value -= factor * above;
                }
                right[j] -= factor * right[i];
            }
        }
        for i in (0..kept).rev() {
            let known: f64 = (i + 1..kept).map(|j| matrix[i][j] * right[j]).sum();
            right[i] = (right[i] - known) / matrix[i][i];
        }
        for (z, residual) in z.iter_mut().zip(residual) {
            *z += residual;
        }
        for (j, part) in right[..kept].iter().enumerate() {
            let moved = column(0, j).iter().zip(column(1, j));
            z.iter_mut().zip(moved).for_each(|(z, (dz, dr))| *z -= part * (dz + dr));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// z = A z + b with an A that plain iteration diverges with.
    #[test]
    fn an_affine_map_is_solved_in_as_many_steps_as_it_has_numbers() {
        let a = [[0.5, -2.0, 0.1], [1.5, 0.3, 0.0], [0.0, 0.4, -1.7]];
        let b = [1.0, -2.0, 0.5];
        let residual = |z: &[f64; 3]| {
            [0, 1, 2].map(|i| a[i].iter().zip(z).map(|(a, z)| a * z).sum::<f64>() + b[i] - z[i])
        };
        let (mut anderson, mut z) = (Anderson::default(), [0.0; 3]);
        for _ in 0..2 {
            anderson.begin();
            for _ in 0..6 {
                let left = residual(&z);
                anderson.advance(&mut z, &left);
            }
            assert!(residual(&z).iter().all(|left| left.abs() < 1e-9), "{:?}", residual(&z));
            z = [3.0, -1.0, 2.0];
        }
    }
}
