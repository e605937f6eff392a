//! Elliptic integrals and functions, by the arithmetic-geometric mean.

/// Complete elliptic integral of the first kind of modulus k: pi / (2 agm(1, k')).
/// Abramowitz and Stegun, Handbook of Mathematical Functions, 17.6.3.
pub(crate) fn complete(k: f64) -> f64 {
    let (mut a, mut b) = (1.0f64, (1.0 - k * k).sqrt());
    while (a - b).abs() > 1e-15 {
        (a, b) = ((a + b) / 2.0, (a * b).sqrt());
    }
    std::f64::consts::PI / (2.0 * a)
}

/// Jacobi's sn, cn and dn of argument u and modulus k. Abramowitz and Stegun 16.4.
pub(crate) fn jacobi(u: f64, k: f64) -> (f64, f64, f64) {
    let (mut a, mut b, mut c) = (1.0f64, (1.0 - k * k).sqrt(), k);
    let mut ratios = Vec::new();
    while c.abs() > 1e-15 {
        (a, b, c) = ((a + b) / 2.0, (a * b).sqrt(), (a - b) / 2.0);
        ratios.push(c / a);
    }
    let mut phase = a * u * f64::powi(2.0, ratios.len() as i32);
    for ratio in ratios.into_iter().rev() {
        phase = (phase + (ratio * phase.sin()).asin()) / 2.0;
    }
    let sn = phase.sin();
    (sn, phase.cos(), (1.0 - k * k * sn * sn).sqrt())
}

/// Values of Abramowitz and Stegun's tables 17.1 and 16, and sn(K) = 1.
#[test]
fn elliptic_functions_are_those_of_the_tables() {
    assert!((complete(0.5f64.sqrt()) - 1.854_074_677_301_372).abs() < 1e-14);
    let (sn, cn, dn) = jacobi(complete(0.9), 0.9);
    assert!((sn - 1.0).abs() < 1e-14 && cn.abs() < 1e-7 && (dn - 0.19f64.sqrt()).abs() < 1e-7);
    let (sn, cn, dn) = jacobi(0.2, 0.81f64.sqrt());
    // Series in u, to u^5: A&S 16.22.
    let m = 0.81;
    let series = 0.2 - (1.0 + m) * 0.008 / 6.0 + (1.0 + 14.0 * m + m * m) * 0.00032 / 120.0;
    assert!((sn - series).abs() < 1e-6, "{sn} {series}");
    assert!((sn * sn + cn * cn - 1.0).abs() < 1e-14 && (dn * dn + m * sn * sn - 1.0).abs() < 1e-14);
}
