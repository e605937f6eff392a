//! Symmetric matrices of three rows, as six numbers: nn, nt, nu, tt, tu, uu.

/// Returns eigenvalues and eigenvectors of a symmetric matrix, nn, nt, nu, tt, tu, uu, by Jacobi rotations.
pub fn eigen([nn, nt, nu, tt, tu, uu]: [f64; 6]) -> ([f64; 3], [[f64; 3]; 3]) {
    /// Number of rounds; each reduces the off-diagonal entries quadratically.
    const ROUNDS: usize = 8;
    let mut matrix = [[nn, nt, nu], [nt, tt, tu], [nu, tu, uu]];
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(3 * ROUNDS) {
        if matrix[p][q] == 0.0 {
            continue;
        }
        let theta = 0.5 * (matrix[q][q] - matrix[p][p]) / matrix[p][q];
        let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
        let cosine = 1.0 / tangent.hypot(1.0);
        let sine = tangent * cosine;
        for row in &mut matrix {
            (row[p], row[q]) = (cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]);
        }
        let (a, b) = (matrix[p], matrix[q]);
        for k in 0..3 {
            (matrix[p][k], matrix[q][k]) = (cosine * a[k] - sine * b[k], sine * a[k] + cosine * b[k]);
        }
        let (a, b) = (vectors[p], vectors[q]);
        for k in 0..3 {
            (vectors[p][k], vectors[q][k]) = (cosine * a[k] - sine * b[k], sine * a[k] + cosine * b[k]);
        }
    }
    ([matrix[0][0], matrix[1][1], matrix[2][2]], vectors)
}

/// Returns a symmetric matrix, nn, nt, nu, tt, tu, uu, times a vector.
pub fn weigh([nn, nt, nu, tt, tu, uu]: [f64; 6], [n, t, u]: [f64; 3]) -> [f64; 3] {
    [nn * n + nt * t + nu * u, nt * n + tt * t + tu * u, nu * n + tu * t + uu * u]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_make_a_matrix_again() {
        for matrix in
            [[2.0, 0.3, -0.4, 1.0, 0.2, 3.0], [1.0, 1.0, 1.0, 1.0, 1.0, 1.0], [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]]
        {
            let (values, vectors) = eigen(matrix);
            let mut again = [0.0; 6];
            for (value, [n, t, u]) in values.into_iter().zip(vectors) {
                let square = [n * n, n * t, n * u, t * t, t * u, u * u];
                again.iter_mut().zip(square).for_each(|(sum, square)| *sum += value * square);
            }
            for (again, given) in again.into_iter().zip(matrix) {
                assert!((again - given).abs() < 1e-14, "{again} {given}");
            }
        }
    }
}
