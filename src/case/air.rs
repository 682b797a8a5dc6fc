//! Air: enthalpy.

/// Enthalpy of air relative to 298 K, J/kg.
pub fn air_enthalpy_j_kg(temperature_k: f64) -> f64 {
    let points = [
        (300.0, 2e3),
        (600.0, 310e3),
        (900.0, 636e3),
        (1200.0, 980e3),
        (1500.0, 1338e3),
        (1700.0, 1582e3),
        (2000.0, 1954e3),
    ];
    let next = points.partition_point(|&(t, _)| t <= temperature_k).clamp(1, points.len() - 1);
    let ((t0, h0), (t1, h1)) = (points[next - 1], points[next]);
    h0 + (h1 - h0) * (temperature_k - t0) / (t1 - t0)
}
